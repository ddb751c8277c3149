"""A scene as Pyxel's source of photons: against Planck's law, and in Pyxel itself."""

from math import expm1, pi
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

from chipglow import Raster, Scene, write_scene
from chipglow.pyxel import photons

TEMPERATURE = 900.0
STUDY = """
scene: scene.nc
surface: {kind: uniform, emissivity: 1.0}
camera: {pitch: 9 um, psf: none}
"""
PIPELINE = """
exposure:
  readout: {times: [10.e-6, 20.e-6]}
pipeline:
  photon_collection:
    - name: plate
      func: chipglow.pyxel.photons
      enabled: true
      arguments: {study: study.yaml, f_number: 2.5}
cmos_detector:
  geometry: {row: 4, col: 5, pixel_vert_size: 15.0, pixel_horz_size: 12.0}
  environment: {temperature: 77}
  characteristics: {quantum_efficiency: 0.8}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A plate in 36 x 45 samples of 1 um that warms by 1 K in each us from its temperature."""
    times = 1e-6 * np.arange(25)
    warming = TEMPERATURE + 1e6 * times[:, None, None]
    fields = {"temperature": np.broadcast_to(warming, (25, 36, 45))}
    scene = Scene.from_fields(Raster(0, 0, 1e-6, 36, 45), times, fields)
    write_scene(scene, tmp_path / "scene.nc")
    (tmp_path / "study.yaml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def detector(**changed):
    geometry = {"row": 4, "col": 5, "pixel_vert_size": 15.0, "pixel_horz_size": 12.0}
    return SimpleNamespace(
        geometry=SimpleNamespace(**{**geometry, **changed}),
        photon=SimpleNamespace(array=None),
        time=10e-6,
        time_step=10e-6,
    )


def expected(frames):
    """Photons of an element over frames of 1 us: Planck's law for photons, 2 c / λ⁴, by SciPy."""
    return sum(in_one_frame(TEMPERATURE + frame) for frame in frames)


def in_one_frame(temperature):
    planck, light, boltzmann = 6.62607015e-34, 299792458.0, 1.380649e-23

    def radiance(wavelength):
        exponent = planck * light / (wavelength * boltzmann * temperature)
        return 2 * light / wavelength**4 / expm1(exponent)

    return quad(radiance, 3.8e-6, 5.1e-6)[0] * pi / (4 * 2.5**2) * 15e-6 * 12e-6 * 1e-6


def test_photons_are_planck_s(folder):
    seen = detector()
    photons(seen, "study.yaml", 2.5)
    # The table of radiances is within 1e-6.
    np.testing.assert_allclose(seen.photon.array, expected(range(10)), rtol=2e-6)
    assert seen.photon.array.shape == (4, 5)


def test_the_exposure_is_pyxels_time_step(folder):
    later = detector()
    later.time, later.time_step = 21e-6, 5e-6
    photons(later, "study.yaml", 2.5, transmittance=0.5, start="1 us")
    # Tables of photons: 7e-10 measured.
    np.testing.assert_allclose(later.photon.array, 0.5 * expected(range(17, 22)), rtol=1e-8)


@pytest.mark.parametrize(
    ("given", "geometry", "message"),
    [
        ({}, {"row": 5}, "study.yaml: the camera's image has 4 rows and 5 columns"),
        ({"chip": "chip 3"}, {}, "chip: 'chip 3', expected one of"),
        ({"f_number": 0.1}, {}, "f_number: 0.1, expected 0.5 or more"),
        ({"transmittance": 0.0}, {}, "transmittance: 0.0, expected more than 0, at most 1"),
        ({"start": "20 us"}, {}, "beyond|scene"),
    ],
)
def test_what_does_not_fit_is_refused(folder, given, geometry, message):
    with pytest.raises(ValueError, match=message):
        photons(detector(**geometry), "study.yaml", **{"f_number": 2.5, **given})


@pytest.mark.filterwarnings("ignore")
def test_it_runs_in_pyxel(folder):
    pyxel = pytest.importorskip("pyxel")
    found = pyxel.run_mode(pyxel.loads(PIPELINE))
    counted = found["bucket"]["photon"].values
    for number, image in enumerate(counted):
        # Some roundings of float32.
        np.testing.assert_allclose(image, expected(range(10 * number, 10 * number + 10)), rtol=2e-6)
