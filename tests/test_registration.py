"""Infrared on visible: maps from points, and the clocks of both cameras."""

from math import cos, radians, sin

import numpy as np
import pytest
from camera_files import cine
from command import refusal, typed, words
from hypothesis import given, settings, strategies as st
from PIL import Image
from scipy.stats import f, t

from chipglow.camera import Measurement
from chipglow.io import read_measurement, write_measurement
from chipglow.laboratory.registration import (
    align_times,
    fit_points,
    load_registration,
    read_pictures,
    simultaneous_frames,
    write_registration,
)
from chipglow.radiometry import Band
from chipglow.scene import Raster

RASTER = Raster(left=-620e-6, top=520e-6, spacing=6e-6, rows=120, columns=160)
SHAPE = (480, 640)
CORNERS = np.array([[-600e-6, -180e-6], [320e-6, 500e-6], [-600e-6, 500e-6], [0.0, 0.0]])


def a_matrix(model, seed=1, mirrored=False):
    generator = np.random.default_rng(seed)
    turn, scale = radians(generator.uniform(-20, 20)), 1 / 1.5e-6
    linear = np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]]) @ np.diag([1, -1])
    if mirrored:
        linear = linear @ np.diag([-1, 1])
    if model != "similarity":
        linear = linear @ (np.eye(2) + generator.uniform(-0.1, 0.1, (2, 2)))
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = scale * linear, generator.uniform(100, 400, 2)
    if model == "homography":
        matrix[2, :2] = generator.uniform(-200, 200, 2)
    return matrix


def mapped(matrix, places):
    whole = np.concatenate([places, np.ones((len(places), 1))], axis=1) @ matrix.T
    return whole[:, :2] / whole[:, 2:]


def picked(count, seed):
    generator = np.random.default_rng(seed)
    return np.stack(
        [generator.uniform(-600e-6, 320e-6, count), generator.uniform(-180e-6, 500e-6, count)], 1
    )


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("model", ["similarity", "affine", "homography"])
@given(seed=st.integers(0, 2**32))
@settings(max_examples=15)
def test_exact_points_give_the_exact_map(model, mirrored, seed):
    matrix, places = a_matrix(model, seed, mirrored), picked(9, seed)
    fit = fit_points(places, mapped(matrix, places), model, picked=False)
    # Rounding of an elimination, in pixels: 5e-13 measured.
    assert fit.registration.pixels(CORNERS) == pytest.approx(mapped(matrix, CORNERS), abs=1e-10)
    # Rounding, in m.
    assert fit.registration.positions(mapped(matrix, CORNERS)) == pytest.approx(CORNERS, abs=1e-15)
    assert fit.registration.notes.warnings == []


@pytest.mark.parametrize("model", ["similarity", "affine", "homography"])
def test_the_covariance_of_a_mapped_position_is_that_of_many_repeats(model):
    """Hotelling: the mean of T^2 / 2 over F's 95 % point is passed in 5 % of repeats."""
    matrix, places = a_matrix(model), picked(10, 4)
    exact, corner = mapped(matrix, places), CORNERS[:1]
    generator = np.random.default_rng(8)
    inside, errors, stated = 0, [], []
    for _ in range(300):
        fit = fit_points(places, exact + generator.normal(0.0, 1.3, exact.shape), model)
        error = (fit.registration.pixels(corner) - mapped(matrix, corner))[0]
        covariance = fit.registration.pixel_covariance(corner)[0]
        limit = 2 * f.ppf(0.95, 2, fit.registration.degrees_of_freedom)
        inside += error @ np.linalg.solve(covariance, error) < limit
        errors.append(error)
        stated.append(covariance)
    # 300 trials at 0.95: four standard deviations are 15.
    assert 270 <= inside <= 299
    # Variances of 300 errors scatter by 8 %, covariances near 0 by up to 0.1.
    assert np.mean(stated, axis=0) == pytest.approx(np.cov(np.transpose(errors)), rel=0.35, abs=0.1)


def test_the_covariance_of_the_position_is_that_of_the_pixel_through_the_map():
    places = picked(8, 2)
    pixels = mapped(a_matrix("homography"), places)
    noise = np.random.default_rng(1).normal(0, 0.5, pixels.shape)
    found = fit_points(places, pixels + noise, "homography").registration
    at, step = CORNERS[1], 1e-8
    slope = np.stack(
        [(found.pixels(at + step * e) - found.pixels(at - step * e)) for e in np.eye(2)]
    )
    slope = slope.T / (2 * step)
    # Difference quotients: 6e-11 measured.
    assert found.jacobian(at) == pytest.approx(slope, rel=1e-8)
    there = slope @ found.position_covariance(at) @ slope.T
    assert there == pytest.approx(found.pixel_covariance(at), rel=1e-8)  # likewise


def test_a_point_picked_wrong_is_named():
    places = picked(9, 3)
    pixels = mapped(a_matrix("affine"), places)
    pixels += np.random.default_rng(5).normal(0.0, 0.5, pixels.shape)
    fit = fit_points(places, pixels)
    assert not fit.misplaced.any() and fit.registration.notes.warnings == []
    pixels[4] += [12.0, -5.0]
    fit = fit_points(places, pixels)
    assert np.flatnonzero(fit.misplaced).tolist() == [4]
    assert "Point 5 is" in fit.registration.notes.warnings[0]


def test_the_warped_image_has_each_sensor_where_the_map_says():
    found = fit_points(picked(9, 1), mapped(a_matrix("affine"), picked(9, 1))).registration
    image = np.arange(RASTER.rows * RASTER.columns, dtype=float).reshape(RASTER.shape)
    warped = found.warp(image, RASTER, SHAPE)
    rows, columns = (axis.ravel() for axis in np.indices(RASTER.shape))
    places = np.stack([RASTER.x[columns], RASTER.y[rows]], axis=1)
    column, row = np.rint(found.pixels(places)).astype(int).T
    here = (column >= 0) & (row >= 0) & (column < SHAPE[1]) & (row < SHAPE[0])
    assert here.mean() > 0.2
    assert (warped[row[here], column[here]] == image.ravel()[here]).all()


# Clocks


def event(time):
    """An entry into the cut and segments that are not even: seen by both cameras."""
    entry = 1 / (1 + np.exp(-(time - 21.3e-3) / 0.4e-3))
    return entry * (1 + 0.3 * np.sin(2 * np.pi * 133 * time + 40 * time**2))


def clocks(generator, offset, noise=0.02):
    infrared = np.arange(30) / 600.0
    visible = np.arange(2400) / 30000.0
    seen = event(visible - offset)
    hot = event(infrared) + generator.normal(0.0, noise, infrared.size)
    return infrared, hot, visible, 7.0 - 3.0 * seen + generator.normal(0.0, noise, visible.size)


def test_the_offset_of_the_clocks_is_within_its_interval():
    """Visible brightness falls where the infrared rises; both have noise."""
    generator = np.random.default_rng(11)
    inside = 0
    for _ in range(15):
        offset = generator.uniform(5e-3, 25e-3)
        found = align_times(*clocks(generator, offset))
        limit = t.ppf(0.975, found.degrees_of_freedom) * found.uncertainty
        inside += abs(found.offset - offset) < limit
        assert found.warnings == ()
        assert found.correlation < -0.99
        assert abs(found.offset - offset) < 100e-6  # three times the largest of 15, 45 us
    # 15 trials at 0.95: less than 12 has a chance of 0.5 %.
    assert inside >= 12


def test_periodic_and_unrelated_signals_are_doubtful():
    generator = np.random.default_rng(13)
    infrared, visible = np.arange(60) / 600.0, np.arange(4500) / 30000.0
    noise, (wave, seen) = (
        generator.normal(0, 0.02, 60),
        (np.sin(2 * np.pi * 77 * times) for times in (infrared, visible)),
    )
    found = align_times(infrared, wave + noise, visible, seen)
    assert any("fits nearly as well" in warning for warning in found.warnings)
    found = align_times(infrared, generator.normal(size=60), visible, generator.normal(size=4500))
    assert any("unrelated" in warning for warning in found.warnings)


def test_visible_frames_within_an_integration():
    infrared, visible = np.array([0.0, 1.0 / 600]), np.arange(200) / 30000.0
    signal = np.linspace(0.0, 1.0, 200) ** 2
    times = np.linspace(0.0, 4e-3, 30)
    found = align_times(times, np.interp(times + 1e-3, visible, signal), visible, signal)
    assert found.offset == pytest.approx(1e-3, abs=2e-7)  # a spline of a parabola: 0.05 us measured
    # 1 ms is frame 30; integrations of 70 us reach into frames 30 to 32.
    first, second = simultaneous_frames(found, infrared, 70e-6, visible + 1e-6, 33e-6)
    assert first.tolist() == [30, 31, 32] or first.tolist() == [29, 30, 31, 32]
    assert second.tolist() in ([80, 81, 82], [79, 80, 81, 82])
    (none,) = simultaneous_frames(found, np.array([1.0]), 10e-6, visible, 33e-6)
    assert none.size == 0


# Files and the command


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = Raster(0.0, 120e-6, 6e-6, 20, 30)
    x, y = np.meshgrid(small.x, small.y)
    spot = 5 * np.exp(-(((x - 90e-6) ** 2 + (y - 60e-6) ** 2) / (30e-6) ** 2))
    rise = 1 + event(np.arange(40) / 600.0)[:, None, None] * spot
    attributes = {"integration_time": 10e-6}
    band = Band(3.8e-6, 5.1e-6)
    times = np.arange(40) / 600.0
    measured = Measurement.from_radiance(50 * rise, band, times, small, attributes=attributes)
    write_measurement(measured, "infrared.nc")
    rows = ["infrared_column,infrared_row,visible_column,visible_row"]
    rows += [
        f"{c},{r},{4 * c + 1.5},{4 * r + 1.5}" for c, r in ((2, 3), (25, 2), (3, 17), (26, 18))
    ]
    (tmp_path / "points.csv").write_text("\n".join(rows) + "\n")
    bright = np.arange(30, 50).repeat(4)[:, None] + np.arange(120)
    Image.fromarray(bright.astype(np.uint8)).save("visible.png")
    return tmp_path


def test_the_command_writes_map_pictures_and_numbers(folder):
    (folder / "tool.yaml").write_text("tip: [100 um, 30 um]\n")
    files = "--out map.yaml --overlay over.png --blink blink.gif"
    given = "--points points.csv --tool tool.yaml"
    output = words(typed(f"register infrared.nc visible.png {given} {files}").output)
    assert "A visible pixel is 1.5 um" in output
    assert "2 degrees of freedom" in output
    # The folder's points are computed, not picked.
    assert "Warning: The points agree to" in output
    again = typed("register infrared.nc visible.png --map map.yaml --overlay over2.png").output
    assert "A visible pixel is 1.5 um" in words(again)
    assert (folder / "over2.png").exists()
    found = load_registration("map.yaml")
    assert found.pixels([3e-6, 117e-6]) == pytest.approx([1.5, 1.5], abs=1e-12)  # rounding
    assert found.model == "affine"
    with Image.open("blink.gif") as blink:
        assert blink.n_frames == 2
        assert blink.size[0] == 640
    with Image.open("over.png") as picture:
        assert picture.size[0] > 900


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_visible_picture_is_upright(tmp_path, suffix, orientation):
    stored = np.zeros((8, 16), np.uint8)
    stored[0, 0] = 255
    exif = Image.Exif()
    exif[274] = orientation
    path = tmp_path / f"visible.{suffix}"
    Image.fromarray(stored).save(path, exif=exif, **({"quality": 100} if suffix == "jpg" else {}))
    if suffix == "tif" and orientation > 4:  # Pillow scrambles them
        with pytest.raises(ValueError, match=r"visible\.tif: a TIFF picture on its side"):
            read_pictures(path)
        return
    (frame,) = read_pictures(path).signal
    # By the TIFF standard: where row 0 and column 0 of the stored picture are.
    row, column = ((0, 0), (0, -1), (-1, -1), (-1, 0))[(orientation - 1) % 4]
    assert frame.shape == ((8, 16) if orientation < 5 else (16, 8))
    assert frame[row, column] > 250
    assert frame.sum() < 300


ALIGN = "--align '60um:120um,30um:90um' --pairs pairs.csv"


def offset_of(result):
    """Offset of the clocks in us that the command prints."""
    return float(words(result.stdout).split("infrared clock + ")[1].split(" us")[0])


def test_the_command_aligns_the_clocks(folder):
    times = np.arange(0.0, 90e-3, 1 / 5000)
    values = 100 + 60 * event(times - 7e-3)[:, None, None] * np.ones((1, 20, 30))
    pages = [Image.fromarray(page.astype(np.uint8)).resize((120, 80)) for page in values]
    pages[0].save("visible.tif", save_all=True, append_images=pages[1:])
    command = f"register infrared.nc visible.tif --points points.csv {ALIGN}"
    assert "--visible-interval" in refusal(command)
    result = typed(f"{command} --visible-interval '200 us'")
    assert "Assumed: A visible exposure lasts as long as its frame, 200 us." in result.stderr
    assert "Assumed" not in result.stdout
    # The visible frames are exposed for 200 us, whose middle is 100 us after their times.
    assert offset_of(result) == pytest.approx(7000 + 100 - 5, abs=20)
    lines = (folder / "pairs.csv").read_text().splitlines()
    assert lines[0] == "infrared_frame,infrared_time_us,visible_frames"
    assert len(lines) == 1 + read_measurement("infrared.nc").times.size
    assert lines[1].split(",")[2] == "35"


def test_a_cine_file_is_the_visible_camera(folder):
    """Its pictures, and the times and the exposure it tells: no --visible-interval is needed."""
    times = np.arange(0.0, 90e-3, 1 / 2000)
    values = 100 + 60 * event(times - 7e-3)[:, None, None] * np.ones((1, 80, 120))
    written = cine(values.astype(np.uint8), "8", 2000, np.full(times.size, 400e-6).tolist())
    (folder / "visible.cine").write_bytes(written)
    command = "register infrared.nc visible.cine --points points.csv --visible-frame 60"
    result = typed(f"{command} {ALIGN}")
    assert "Assumed: A visible exposure" not in words(result.output)
    # Middles of exposures: 200 us after the visible stamps, 5 us after the infrared ones.
    assert offset_of(result) == pytest.approx(7000 + 200 - 5, abs=20)
    first, second = ((folder / "pairs.csv").read_text().splitlines()[row] for row in (1, 2))
    # Frames are 500 us apart and last 400: 7.195 ms is in frame 14, 8.86 ms in 17.
    assert (first.split(",")[2], second.split(",")[2]) == ("14", "17")


def test_what_is_written_is_read_again(tmp_path):
    places = picked(8, 2)
    noise = np.random.default_rng(1).normal(0, 0.5, places.shape)
    found = fit_points(places, mapped(a_matrix("affine"), places) + noise).registration
    write_registration(found, tmp_path / "map.yaml")
    again = load_registration(tmp_path / "map.yaml")
    for name in ("matrix", "covariance", "degrees_of_freedom"):
        np.testing.assert_array_equal(getattr(again, name), getattr(found, name))
