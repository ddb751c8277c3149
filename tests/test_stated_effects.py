"""Every effect that made a measurement is stated in its file, and `chipglow show` prints it."""

from dataclasses import replace

import numpy as np
import pytest
from analytic_chip import AnalyticChip

from chipglow.camera import (
    AnnularAperturePSF,
    BlurredPSF,
    Camera,
    Detector,
    Distortion,
    EnergyResponse,
    GaussianPSF,
    Jitter,
    OpticalElement,
    ReadNoise,
    Veil,
)
from chipglow.cli.screen import begin
from chipglow.cli.showing import say_measurement
from chipglow.io import read_measurement, write_measurement
from chipglow.radiometry import Band, TabulatedResponse
from chipglow.scene import Raster
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    Dispersion,
    EmissivityTrend,
    FeatureTrends,
    Fresnel,
    HagenRubens,
    MapSurface,
    ParabolicOxide,
    TrendSurface,
    UniformSurface,
    Wedge,
)

BASE = Camera(
    band=Band(3.8e-6, 5.1e-6), pitch=12e-6, psf=None, integration_time=1e-6, lower_limit=None
)
DETECTOR = Detector(response=EnergyResponse(2e4), full_well=1e7, bits=14)
RESPONSE = TabulatedResponse((3.8e-6, 4.5e-6, 5.1e-6), (0.2, 1.0, 0.5))
TREND = EmissivityTrend(600.0, 0.5, 1e-4)
MAP = MapSurface(np.full((4, 5), 0.5), Raster(-336e-6, 300e-6, 80e-6, 4, 5), elsewhere=0.3)


def reading(**fields):
    return {"detector": replace(DETECTOR, **fields)}


CAMERAS = {
    "3.8 µm to 4.6 µm": {"band": Band(3.8e-6, 4.6e-6)},
    "response with its mean at 4.459 µm and its peak at 4.5 µm": {
        "band": Band(3.8e-6, 5.1e-6, RESPONSE)
    },
    "of 15 µm": {"pitch": 15e-6},
    "2e-06": {"offset": (2e-6, 0.0)},
    "0.8": {"fill_factor": 0.8},
    "GaussianPSF(fwhm=1.2e-05)": {"psf": GaussianPSF(12e-6)},
    "obscuration=0.4": {"psf": AnnularAperturePSF(obscuration=0.4)},
    "Jitter(": {"psf": BlurredPSF(GaussianPSF(12e-6), (Jitter(standard_deviation=2e-6),))},
    "detector": {"psf": GaussianPSF(12e-6), "psf_order": "detector"},
    "Veil(": {"optics": (Veil(fraction=0.02, radius=3e-4),)},
    "OpticalElement(": {"optics": (OpticalElement(transmittance=0.9),)},
    "Distortion(": {"optics": (Distortion(fraction=0.02, radius=3e-4),)},
    "integration time": {"integration_time": 2e-6},
    "500.0": {"frame_rate": 500.0},
    "shutter rolling, 2e-08 s per row": {"line_time": 2e-8},
    "lower range limit 300 °C": {"lower_limit": 573.15},
    "333.15": {"reflected": 333.15},
    "detector_response EnergyResponse(": reading(),
    "ReadNoise(standard_deviation=300.0)": reading(terms=(ReadNoise(300.0),)),
    "12 bits": reading(bits=12),
    "correction one-point": reading(correction="one-point"),
    "7 frames of each": reading(frames=7),
}
SURFACES = {
    "UniformSurface(emissivity=0.5)": UniformSurface(0.5),
    "chip 0.77 (standard deviation 0.03)": CHIP_2,
    "grain 3e-05 m": replace(CHIP_1, grain=30e-6),
    "follow none": replace(CHIP_1, follow="none"),
    "seed 7": replace(CHIP_1, seed=7),
    "standard deviation not restored": replace(CHIP_1, restore_standard_deviation=False),
    "HagenRubens(resistivity=1.7e-07": HagenRubens(1.7e-7),
    "image of 5 x 4 pixels of 8e-05 m, mean 0.5, elsewhere 0.3": MAP,
    "0.5 at 600 K, changing by 0.0001 1/K": TrendSurface(TREND),
    "chip 0.5 at 600 K": CHIP_1.modified(FeatureTrends({"chip": TREND})),
    "ParabolicOxide(initial=1e-07": CHIP_1.modified(ParabolicOxide(initial=1e-7)),
    "Fresnel(tilt=0.1": CHIP_1.modified(Fresnel(tilt=0.1, n=4.6, k=15.0)),
    "3.8 um to 5.1 um, elsewhere by HagenRubens(": CHIP_1.modified(Dispersion(HagenRubens(1.7e-7))),
    "mirror=0.5": CHIP_1.modified(Wedge(mirror=0.5)),
}


@pytest.fixture(scope="module")
def scene():
    return AnalyticChip(frames=4, raster=Raster(-336e-6, 300e-6, 6e-6, 56, 70)).scene()


@pytest.fixture
def shown(scene, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "200")

    def show(camera, surface):
        write_measurement(camera.measure(scene, surface, 0.0), tmp_path / "m.nc")
        begin()
        say_measurement(read_measurement(tmp_path / "m.nc"))
        return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]

    return show


def test_every_switch_of_the_camera_is_printed(shown):
    plain = shown(BASE, CHIP_1)
    for text, switched in CAMERAS.items():
        found = shown(replace(BASE, **switched), CHIP_1)
        stated = [line for line in found if line not in plain]
        assert any(text in line for line in stated), (text, stated)


def test_every_switch_of_the_surface_is_printed(shown):
    plain = "\n".join(shown(BASE, CHIP_1))
    assert "workpiece 0.4 (standard deviation 0.03), chip 0.42 (standard deviation 0.07)" in plain
    for text, surface in SURFACES.items():
        assert text in "\n".join(shown(BASE, surface)) and text not in plain, text
    # What is wrapped is stated besides what is added.
    both = "\n".join(shown(BASE, CHIP_2.modified(ParabolicOxide(), Wedge())))
    assert all(part in both for part in ("chip 0.77", "ParabolicOxide(", "Wedge("))


def test_exposures_of_several_surfaces_state_what_they_have_in_common(scene):
    one, other = (BASE.expose(scene, chip, 0.0) for chip in (CHIP_1, CHIP_2))
    attributes = BASE.form_measurement([one, other]).data.attrs
    assert attributes["texture"] == CHIP_1.effects["texture"] and "emissivity" not in attributes
    assert BASE.form_measurement(one).data.attrs["emissivity"] == CHIP_1.effects["emissivity"]
