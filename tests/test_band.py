"""A hot band as a camera shows it, against a closed form that shares no code with the camera."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command import chipglow, refused
from scipy.special import ndtr

from chipglow import Camera, GaussianPSF, Study, UniformSurface, band_reading, open_scene, scenes
from chipglow.scene import SceneError

WIDTH, RISE, SPEED, BASE = 20e-6, 300.0, 4.0, 773.15
PITCH, BLUR, EXPOSURE = 6e-6, 12e-6, 10e-6
SIGMA = 1 / np.sqrt(8 * np.log(2))
CAMERA = Camera(pitch=PITCH, psf=GaussianPSF(BLUR), integration_time=EXPOSURE)
SETTINGS = {
    "pitch": PITCH,
    "psf": {"kind": "gaussian", "fwhm": BLUR},
    "psf_order": "optics",
    "integration_time": EXPOSURE,
    "lower_limit": "none",
}


def study(emissivity=0.6, **sections):
    surface = {"kind": "uniform", "emissivity": emissivity}
    return Study(**{"surface": surface, "camera": SETTINGS, **sections})


def twice_integrated(x, sigma):
    """The second integral of a normal density."""
    return x * ndtr(x / sigma) + sigma * np.exp(-0.5 * (x / sigma) ** 2) / np.sqrt(2 * np.pi)


def kernel(x, sigma=SIGMA * BLUR, pixel=PITCH, path=SPEED * EXPOSURE):
    """A Gaussian convolved with the boxes of pixel and motion, in closed form."""
    wide, narrow = (pixel + path) / 2, (pixel - path) / 2
    ends = [(wide, 1), (narrow, -1), (-narrow, -1), (-wide, 1)]
    return sum(sign * twice_integrated(x + end, sigma) for end, sign in ends) / (pixel * path)


def shown(at, emissivity=1.0, **changes):
    """The radiance temperature that a pixel with its centre `at` shows of the band, in K."""
    x = np.linspace(-150e-6, 150e-6, 6001)  # a 170th of the blur: its sum is exact to 1e-9
    kelvins = BASE + RISE * np.exp(-0.5 * (x / (SIGMA * WIDTH)) ** 2)
    light = emissivity * CAMERA.band.radiance(kelvins)
    weights = kernel(np.asarray(at)[..., None] - x, **changes)
    return CAMERA.band.temperature((weights * light).sum(axis=-1) / weights.sum(axis=-1))


def test_the_kernel_is_a_gaussian_without_boxes_and_has_the_sum_of_their_variances():
    x = np.linspace(-200e-6, 200e-6, 40001)
    weights = kernel(x) / kernel(x).sum()
    variance = (SIGMA * BLUR) ** 2 + (PITCH**2 + (SPEED * EXPOSURE) ** 2) / 12
    # The sum over the samples is exact but for the kernel's rounding.
    assert (weights * x**2).sum() == pytest.approx(variance, rel=1e-6)


@pytest.mark.parametrize("phase", [0.0, 0.5, 0.9])
def test_a_row_of_pixels_is_the_closed_form(phase):
    size = 30 * WIDTH, 3.5 * PITCH
    scene = scenes.band(WIDTH, RISE, SPEED, EXPOSURE, BASE, size=size)
    camera = replace(CAMERA, offset=(phase * PITCH, 0.0))
    image = camera.measure(scene, UniformSurface(0.6), 0.0)
    row, x = image.celsius()[1] + 273.15, image.raster.x
    inside = np.abs(x) < 60e-6
    assert inside.sum() >= 19
    # Samples of a 24th of the width, and frames one sample apart, are worth 0.1 % of the rise.
    assert row[inside] == pytest.approx(shown(x[inside], 0.6), abs=0.001 * RISE)
    # The band makes the row rise by 100 K: the tolerance is not what lets it pass.
    assert np.ptp(row[inside]) > 100


def test_the_reading_is_the_closed_form_and_its_effects_sum_to_the_error():
    reading = band_reading(study(), WIDTH, RISE, SPEED, base=BASE, draws=40)
    frame = reading.quantities_frame().set_index("quantity")
    positions = PITCH * (np.arange(9) / 9 - 0.5)
    # The hottest pixel is the one nearest to the middle: its centre is within half a pitch.
    expected = shown(positions, 0.6).mean() - 273.15
    # Samples of an eighth of a pixel: 0.003 K measured.
    assert frame.shown["peak temperature"] == pytest.approx(expected, abs=0.01)
    black = shown(positions).mean() - 273.15
    # The same, over an emissivity of 0.6.
    assert frame.shown["peak, emissivity set"] == pytest.approx(black, abs=0.01)
    total = sum(reading.contributions.values())
    # The scene's temperatures are single floats: 1073 K is known to 6e-5 K.
    assert frame.error["peak temperature"] == pytest.approx(total, abs=1e-4)
    assert list(reading.contributions) == ["emissivity", "motion", "psf", "footprint"]
    x = np.linspace(0.0, 60e-6, 201)
    profile = shown(x, 0.6)  # falls from the middle on; the other side is the same
    level = (profile[0] + shown(150e-6, 0.6)) / 2
    width = 2 * np.interp(-level, -profile, x)
    # Straight lines between pixels of 6 um on a curve 45 um wide.
    assert 1e-6 * frame.shown["width at half of the rise"] == pytest.approx(width, rel=0.01)
    low, high = frame.low["peak temperature"], frame.high["peak temperature"]
    # Only the position of the pixels differs: the ends are those of the closed form.
    ends = shown(np.array([PITCH / 2, 0.0]), 0.6) - 273.15
    # 40 positions end 1/80 of a pitch before the closed form: 0.09 K.
    assert (low, high) == pytest.approx(tuple(ends), abs=0.2)


def test_a_slow_wide_band_is_shown_as_it_is():
    reading = band_reading(study(1.0), 400e-6, RISE, 0.0, draws=40)
    frame = reading.quantities_frame()
    # A blur of 12 um and pixels of 6 um take 0.1 % of a band of 400 um: 0.3 K of 300 K.
    assert np.abs(frame.error[:2]).max() < 0.5
    assert "peak, emissivity set" not in set(frame.quantity)
    assert len(reading.scene) == 1


def test_the_interval_is_that_of_the_uncertain_emissivity():
    # An integration time that is longer than the nominal one needs a longer scene.
    exposure = {"camera.integration_time": {"standard": "0.1 %"}}
    inputs = {"surface.emissivity": {"standard": 0.03}, **exposure}
    uncertain = study(uncertainty={"inputs": inputs})
    reading = band_reading(uncertain, WIDTH, RISE, SPEED, base=BASE, draws=200)
    peak = reading.values[1, 0]
    slope = CAMERA.band.radiance(peak) / CAMERA.band.slope(peak) / 0.6
    # 200 draws determine a standard deviation within 5 %, of which this is three.
    assert reading.draws[:, 0].std() == pytest.approx(0.03 * slope, rel=0.15)
    assert reading.causes == ("position of the pixels", *inputs)


def test_noise_spreads_the_frames_by_its_netd():
    terms = [{"kind": "netd", "netd": "2 K", "temperature": "500 degC"}]
    response = {"kind": "range", "hottest": "900 degC"}
    camera = {**SETTINGS, "detector": {"response": response, "bits": 14, "terms": terms}}
    reading = band_reading(study(1.0, camera=camera), WIDTH, RISE, SPEED, base=BASE, draws=200)
    # Beside the band a pixel shows 500 degC, where the noise is 2 K; within three errors of 5 %.
    assert reading.shown[:, 3].std() == pytest.approx(2.0, rel=0.15)
    assert "noise" in reading.causes
    assert "detector" in reading.contributions


def test_a_band_below_the_range_is_warned_of():
    reading = band_reading(Study(), 5e-6, 20.0, base=400.0, draws=40)
    assert any("100 % of the frames" in text for text in reading.notes.warnings)
    assert any("blackbody" in text for text in reading.notes.assumed)


def test_a_microbolometer_that_lags_is_warned_of():
    slow = {**SETTINGS, "time_constant": "10 ms"}
    moving = band_reading(study(camera=slow), WIDTH, RISE, SPEED, draws=40)
    assert any("lags" in text for text in moving.notes.warnings)
    still = band_reading(study(camera=slow), WIDTH, RISE, draws=40)
    assert not still.notes.warnings


def test_the_scenes_are_their_formulas():
    step = scenes.step(20e-6, 100.0, base=500.0)
    x, row = step.raster.x, step.frame(0).temperature[0]
    # Temperatures are single floats, and straight lines between samples of 0.8 um.
    assert np.interp([-10e-6, 0, 10e-6], x, row) == pytest.approx([590, 550, 510], abs=0.05)
    spot = scenes.spot(20e-6, 100.0, 2.0, 10e-6, base=500.0)
    half = spot.raster.index([[0.0, 0.0], [10e-6, 0.0], [0.0, 10e-6]]).round().astype(int)
    middle = spot.frame(len(spot) // 2).temperature
    assert middle[tuple(half)] == pytest.approx([600, 550, 550], abs=2.0)  # within half a sample
    first, last = (spot.frame(i).temperature.max(axis=0).argmax() for i in (0, -1))
    path = (last - first) * spot.raster.spacing
    assert path == pytest.approx(20e-6 * (1 - 1 / len(spot)), abs=spot.raster.spacing)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"width": 0.0}, "width: 0.0 m, expected more than 0"),
        ({"rise": float("nan")}, "rise: nan, expected a finite number"),
        ({"duration": -1.0}, "duration: -1.0 s, expected 0 or more"),
        ({"speed": 4.0, "duration": 1.0}, "in which 2e.05 widths pass, takes"),
        ({"size": (0.0, 1e-6)}, "size: 0.0 m"),
    ],
)
def test_scenes_refuse(changes, message):
    with pytest.raises(ValueError, match=message):
        scenes.band(**{"width": 20e-6, "rise": 300.0, **changes})


def test_a_temperature_that_cannot_be_is_refused():
    with pytest.raises(SceneError, match="expected kelvin"):
        scenes.band(20e-6, 1e5)


def test_the_command_prints_and_writes_all(tmp_path):
    names = ("band.csv", "band.png", "band.nc")
    out, plot, scene = (tmp_path / name for name in names)
    shown = chipglow(
        "band", "--width", "20um", "--rise", "300K", "--speed", "4m/s", "--emissivity", "0.6",
        "--draws", "40", "--out", out, "--plot", plot, "--scene", scene,
    )  # fmt: skip
    assert "peak, emissivity set" in shown.stdout
    assert "motion" in shown.stdout
    assert out.read_text().splitlines()[0] == "quantity,unit,true,shown,error,low,high"
    assert "error by motion,K" in out.read_text()
    assert plot.stat().st_size > 5000
    assert open_scene(scene).raster.spacing == pytest.approx(0.75e-6)


def test_the_command_takes_the_camera_of_a_study(tmp_path):
    file = tmp_path / "study.yaml"
    file.write_text("surface: {kind: uniform, emissivity: 0.5}\ncamera: {pitch: 12 um}\n")
    shown = chipglow("--json", "band", "--width", "50um", "--rise", "100K", "--draws", "40",
                "--camera", file)  # fmt: skip
    rows = json.loads(shown.stdout)["tables"]["reading"]
    assert [row["quantity"] for row in rows][:2] == ["peak temperature", "peak, emissivity set"]
    assert rows[0]["true"] == pytest.approx(600.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--width", "20um", "--rise", "-3K"], "rise"),
        (["--width", "20", "--rise", "300K"], "--width"),
        (["--width", "20um", "--rise", "300K", "--draws", "3"], "draws: 3, expected 40 or more"),
        (["--width", "20um", "--rise", "300K", "--emissivity", "2"], "emissivity"),
    ],
)
def test_the_command_refuses(arguments, message):
    refused(["band", *arguments], message)
