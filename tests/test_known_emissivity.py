"""Corrections with emissivities of the laboratory: at their temperature, and pixel by pixel."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from command import chipglow, refusal
from scipy.ndimage import gaussian_filter

from chipglow import AnnularAperturePSF, Band, Camera, Estimate, Measurement, Raster
from chipglow.camera import check_camera, image_formation
from chipglow.correction import (
    CorrectionFlag,
    SampledObject,
    Zone,
    correct,
    correct_known,
    correct_mapped,
    known_parts,
    read_correction,
)
from chipglow.io import write_measurement
from chipglow.laboratory.emissivity import (
    EmissivityLine,
    Heating,
    determine_emissivities,
    emissivity_line,
    read_emissivity_map,
    write_emissivity,
)
from chipglow.scene import Polygon, Region
from chipglow.surface import MapSurface

PITCH, SAMPLES, COUNT = 6e-6, 8, 24
BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), lower_limit=None)
ROOM = 293.0
PIXELS = Raster(0.0, COUNT * PITCH, PITCH, COUNT, COUNT)
FINE = Raster(0.0, COUNT * PITCH, PITCH / SAMPLES, COUNT * SAMPLES, COUNT * SAMPLES)
MARGIN = 16
"""Pixels by which a field that varies continues beyond its image on each side."""

BESIDE = MARGIN * PITCH
AROUND = Raster(
    -BESIDE, COUNT * PITCH + BESIDE, FINE.spacing, *[(COUNT + 2 * MARGIN) * SAMPLES] * 2
)
NOISE = 0.2
"""Noise in K at 600 K."""


def seen(emissivity, kelvins, seed=1, samples=FINE):
    """Return the measurement of an object with emissivities and temperatures on samples."""
    light = emissivity * BAND.radiance(kelvins) + (1 - emissivity) * BAND.radiance(ROOM)
    image = image_formation(CAMERA, samples).forward(np.broadcast_to(light, samples.shape))
    if samples is AROUND:
        image = image[MARGIN:-MARGIN, MARGIN:-MARGIN]
    noise = np.random.default_rng(seed).normal(0.0, NOISE * float(BAND.slope(600.0)), image.shape)
    return Measurement.from_radiance((image + noise)[None], BAND, np.zeros(1), PIXELS)


def texture(seed=3):
    """Return emissivities with the paper's standard deviation and grain on samples."""
    field = np.random.default_rng(seed).standard_normal(FINE.shape)
    field = gaussian_filter(field, 20e-6 / FINE.spacing / 2.355, mode="wrap")
    return 0.42 + 0.07 * field / field.std()


def sloping(slope=2e-4):
    """Return an emissivity that is 0.4 at 700 K and was measured at 650 K to 750 K."""
    return emissivity_line(
        [
            EmissivityLine.measured(
                "chip",
                "chip",
                Heating(kelvins, ROOM),
                Estimate(np.array(0.4 + slope * (kelvins - 700.0))).with_component("noise", 0.004),
                0.0,
            )
            for kelvins in (650.0, 700.0, 750.0)
        ]
    )


def test_the_emissivity_is_taken_at_the_temperature_of_the_pixels():
    line, kelvins = sloping(), 900.0
    image = seen(0.4 + 2e-4 * (kelvins - 700.0), kelvins)
    result = correct_known(
        image, CAMERA, known_parts({"chip": line}, elsewhere="chip"), noise=NOISE
    )
    inside = result.data["temperature"][0].values[4:-4, 4:-4]
    # The emissivity at 700 K would give 909 K. Each round leaves a fifth of this; noise averages.
    assert abs(inside.mean() - kelvins) < 0.1
    stated = float(line.at(kelvins).standard_uncertainty) / 0.44
    expected = stated * float(BAND.radiance(kelvins)) / float(BAND.slope(kelvins))
    found = result.contribution("emissivity")[4:-4, 4:-4].mean()
    # As in an emissivity error of equation 2: changes are solved to 0.1 %, enlarged by weights.
    assert found == pytest.approx(expected, rel=0.03)
    assert any("150 K away, at 377 °C to 477 °C" in text for text in result.notes.warnings)


def test_the_emissivity_follows_the_temperature_within_a_zone():
    line, slope = sloping(), 2e-4
    kelvins = 700.0 + 300.0 * AROUND.x / (COUNT * PITCH)
    emissivity = np.broadcast_to(0.4 + slope * (kelvins - 700.0), AROUND.shape)
    image = seen(emissivity, kelvins, samples=AROUND)
    result = correct_known(
        image, CAMERA, known_parts({"chip": line}, elsewhere="chip"), noise=NOISE
    )
    labels = np.zeros(AROUND.shape, np.int16)
    exact = SampledObject((Zone("chip", 0.4),), AROUND, labels, emissivity)
    expected = correct(image, CAMERA, exact, noise=NOISE)
    # The mean emissivity of the zone would be off by up to 6 % and cause 9 K at either end.
    # Each round leaves a fifth of an error of the emissivity: that of the second is below 0.4 K.
    error = (result.data["temperature"] - expected.data["temperature"])[0].values
    assert np.abs(error[4:-4, 4:-4].mean(axis=0)).max() < 0.4
    # The field rises beyond the image too, where the correction assumes less light: 1.6 K too hot.
    inner = np.zeros(PIXELS.shape, bool)
    inner[4:-4, 4:-4] = True
    truth = np.broadcast_to(700.0 + 300.0 * PIXELS.x / (COUNT * PITCH), PIXELS.shape)[inner].mean()
    mean = expected.at(inner)
    assert abs(float(mean.values) - truth) < float(mean.expanded_uncertainty())


@pytest.fixture(scope="module")
def emissivity_file(tmp_path_factory):
    """Return the file of a heated object's emissivity at 664 K, with a texture."""
    path = tmp_path_factory.mktemp("map") / "emissivity.nc"
    whole = Region("chip", Polygon.rectangle((0.0, 0.0), (float(COUNT), float(COUNT))))
    found = determine_emissivities([seen(texture(), 664.0)], [Heating(664.0, ROOM)], [whole], ["h"])
    write_emissivity(found, path)
    return path


@pytest.mark.slow
def test_a_map_gives_the_temperature_of_textured_pixels(emissivity_file):
    image, kelvins = seen(texture(), 800.0, seed=2), 800.0
    image_map = read_emissivity_map(emissivity_file)
    by_map = correct_mapped(image, CAMERA, image_map, noise=NOISE)
    by_mean = correct_known(image, CAMERA, known_parts(EmissivityLine.constant(0.42)), noise=NOISE)
    errors = [one.data["temperature"][0].values[4:-4, 4:-4] - kelvins for one in (by_map, by_mean)]
    spread, without = (error.std() for error in errors)
    # A texture of 17 % is one of 25 K. The blurred map itself, blurred again, leaves 8 K.
    assert without > 15.0
    assert spread < 2.0
    data = by_map.data.isel(time=0)
    held = (data["lower"] <= kelvins) & (kelvins <= data["upper"])
    # 256 pixels that share the map's noise: 95 % within at least four of their deviations.
    assert held.values[4:-4, 4:-4].mean() > 0.9


def test_beyond_the_map_nothing_is_determined(emissivity_file):
    whole = read_emissivity_map(emissivity_file)
    left = Raster(0.0, COUNT * PITCH, PITCH, COUNT, COUNT // 2)
    part = MapSurface(whole.values[:, : COUNT // 2], left, middle=whole.middle)
    result = correct_mapped(seen(texture(), 800.0), CAMERA, part, noise=NOISE)
    unknown = result.data["flags"][0].values & CorrectionFlag.NOT_DETERMINED > 0
    # The edge of a map is continued by two cells, one pixel.
    assert not unknown[:, : COUNT // 2].any()
    assert unknown[:, COUNT // 2 + 2 :].all()


def test_a_map_of_another_place_is_refused(emissivity_file):
    found = read_emissivity_map(emissivity_file)
    away = MapSurface(found.values, Raster(1e-3, 0.0, PITCH, COUNT, COUNT), middle=found.middle)
    with pytest.raises(ValueError, match="the map lies at x 1000 to 1144 um, y -144 to 0 um, exp"):
        correct_mapped(seen(0.4, 800.0), CAMERA, away)


def test_an_emissivity_that_its_line_makes_negative_is_refused():
    image = seen(0.1, 1500.0)
    with pytest.raises(ValueError, match=r"emissivity: that of 'chip' is -\S+ at"):
        correct_known(image, CAMERA, known_parts({"chip": sloping(-2e-3)}, elsewhere="chip"))


@pytest.mark.parametrize(
    ("settings", "attributes", "message"),
    [
        ({}, {}, ""),
        # Three digits of a text: accepted.
        ({"pitch": 6.04e-6}, {}, ""),
        ({"pitch": 6.1e-6}, {}, "pitch: 6 um in the measurement, 6.1 um in the camera"),
        ({"band": Band(3.9e-6, 5.1e-6)}, {}, "lower limit of the band: 3.8 um in the"),
        ({"fill_factor": 0.8}, {"fill_factor": 1.0}, "fill_factor: 1 in the measurement, 0.8 in"),
    ],
)
def test_a_camera_agrees_with_its_measurement_or_is_refused(settings, attributes, message):
    camera = Camera(**{"pitch": PITCH, "band": BAND, "lower_limit": None} | settings)
    image = Measurement.from_radiance(
        np.ones((1, 4, 4)), BAND, np.zeros(1), Raster(0.0, 0.0, PITCH, 4, 4), attributes=attributes
    )
    if message:
        with pytest.raises(ValueError, match=message):
            check_camera(image, camera)
    else:
        check_camera(image, camera)


@pytest.fixture
def folder(tmp_path, monkeypatch, emissivity_file):
    """A folder with a measurement of two frames, its point spread function and emissivities."""
    frames = [seen(texture(), kelvins).data for kelvins in (800.0, 820.0)]
    both = xr.concat(
        [one.assign_coords(time=[time]) for one, time in zip(frames, (0.0, 0.1), strict=True)],
        "time",
        data_vars="minimal",
    )
    write_measurement(Measurement(both), tmp_path / "chip.nc")
    spacing = PITCH / 4
    weights = CAMERA.psf.kernel(spacing)
    kernel = xr.Dataset({"kernel": (("y", "x"), weights, {"spacing": spacing})})
    kernel.to_netcdf(tmp_path / "psf.nc", engine="h5netcdf")
    (tmp_path / "emissivity.nc").write_bytes(emissivity_file.read_bytes())
    (tmp_path / "regions.yaml").write_text(
        "regions:\n  spot: {rectangle: [[6, 6], [18, 18]], feature: chip}\n", encoding="utf-8"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_command_takes_what_the_laboratory_writes(folder):
    psf = "correct chip.nc --psf psf.nc --noise 0.2K --regions regions.yaml"
    chipglow(*f"{psf} --frame 0 --map emissivity.nc --out map.nc".split())
    (frame,) = read_correction("map.nc").data["temperature"].values
    assert abs(frame[6:18, 6:18].mean() - 800.0) < 1.0  # by noise and edges: 0.5 K measured
    table = f"{psf} --emissivity emissivity.nc --elsewhere chip --table places.csv"
    output = chipglow(*table.split()).output
    assert "time / s" in output and "0.1" in output
    assert "determined" in output  # the emissivity is one of 391 °C
    rows = pd.read_csv(folder / "places.csv")
    spots = rows[rows["place"] == "spot"]
    # The mean emissivity of the region: its texture averages over 144 pixels to about 3 K.
    assert np.abs(spots["true_temperature_K"] - [800.0, 820.0]).max() < 10.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--study s.yaml --emissivity 0.4", "--study: cannot be combined with --emissivity"),
        ("--study s.yaml --tool found", "--study: cannot be combined with --tool"),
        ("--psf psf.nc", "or a number; or --map"),
        ("--psf psf.nc --map emissivity.nc --elsewhere chip", "--map: cannot be combined with"),
        ("--psf psf.nc --map regions.yaml", "regions.yaml"),
        ("--psf psf.nc --emissivity 0.4 --frame 7", "--frame: '7', expected 0 to 1, or all"),
        (
            "--psf psf.nc --emissivity emissivity.nc --emissivity-uncertainty 0.1",
            "--emissivity-uncertainty: the file states it",
        ),
    ],
)
def test_options_that_exclude_each_other_are_refused(folder, options, message):
    assert message in refusal(f"correct chip.nc {options} --out corrected.nc")
