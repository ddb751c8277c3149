"""The rake face found in an image, within the uncertainty that is stated; the command `rake`."""

from math import degrees, radians

import numpy as np
import pytest
import xarray as xr
from command import typed
from seen_chip import BAND, FLOOR, look, noisy

from chipglow.camera import Measurement
from chipglow.io import write_measurement
from chipglow.laboratory.chip import find_tool, rake_grid
from chipglow.quantities import uncertain_text
from chipglow.scene import Raster, ToolGeometry
from chipglow.surface import CHIP_1, CHIP_2


@pytest.fixture(scope="module")
def seen():
    return {
        (angle, name): look(angle, surface)
        for angle in (-12.0, -7.0, 0.0)
        for name, surface in (("chip 1", CHIP_1), ("chip 2", CHIP_2))
    }


@pytest.fixture(scope="module")
def found_in(seen):
    """24 noisy images: the clean measurement, and the tool that was found without knowing it."""
    return [
        (measurement, find_tool(noisy(measurement, seed)))
        for measurement in seen.values()
        for seed in range(4)
    ]


@pytest.mark.slow
def test_the_face_is_within_its_stated_uncertainty(found_in):
    """24 images: an expanded uncertainty of k = 2 shall hold in 95 %, so in 21 or more of them.

    Binomial: at 95 %, fewer than 21 of 24 have a probability of 3 %.
    """
    within_angle, within_place, within_tip = 0, 0, 0
    for measurement, found in found_in:
        true, stated = measurement.tool, found.uncertainty
        off = found.tool.rake_point(stated.pivot) - true.rake_foot
        tip = (found.tool.rake_foot - true.rake_foot) @ true.rake_direction
        away = found.tool.rake_angle - true.rake_angle
        within_angle += abs(away) < 2 * stated.angle
        within_place += abs(off @ true.rake_normal) < 2 * stated.across
        within_tip += abs(tip) < 2 * stated.along
        # An uncertainty that covers everything would say nothing.
        assert stated.angle < radians(4.0)
        assert stated.across < 6e-6
    assert len(found_in) == 24
    assert min(within_angle, within_place, within_tip) >= 21


def test_the_shape_says_where_to_look_and_what_the_edge_is(seen):
    """A rake face over 20 degrees from the shape's is not found without a warning."""
    measurement = noisy(seen[-7.0, "chip 2"], 1)
    found = find_tool(measurement, ToolGeometry(radians(0.0), radians(10.0), 8e-6)).tool
    assert degrees(found.rake_angle) == pytest.approx(-7.0, abs=4.0)  # as stated above
    assert (found.clearance_angle, found.edge_radius) == (radians(10.0), 8e-6)
    elsewhere = find_tool(measurement, ToolGeometry(radians(30.0)))
    assert "at the limit of the search range" in " ".join(elsewhere.notes.warnings)


def test_a_found_tool_moves_with_the_image(seen):
    measurement = noisy(seen[-7.0, "chip 2"], 1)
    raster = measurement.raster
    elsewhere = Raster(
        raster.left + 1.3e-3, raster.top - 0.4e-3, raster.spacing, raster.rows, raster.columns
    )
    moved = Measurement.from_radiance(
        measurement.radiance, BAND, measurement.times, elsewhere, FLOOR
    )
    here, there = find_tool(measurement), find_tool(moved)
    # Rounding, in m.
    np.testing.assert_allclose(
        np.subtract(there.tool.tip, here.tool.tip), [1.3e-3, -0.4e-3], atol=1e-12
    )
    assert abs(there.tool.rake_angle - here.tool.rake_angle) < 1e-9  # rounding, in rad


def test_a_weak_edge_is_doubtful():
    """A chip that is hardly brighter than the tool."""
    raster = Raster(-300e-6, 300e-6, 6e-6, 60, 80)
    x, y = np.meshgrid(raster.x, raster.y)
    image = np.where(x + 0.12 * y < 0.0, 106.5, 100.0)
    image = image + np.random.default_rng(0).normal(0.0, 2.0, image.shape)
    measurement = Measurement.from_radiance(image[None], BAND, np.zeros(1), raster)
    warnings = find_tool(measurement).notes.warnings
    assert any("hardly stands out" in warning for warning in warnings)
    assert any("The tip is not in the image" in warning for warning in warnings)


@pytest.mark.parametrize("noise", [0.0, 3.0])
def test_an_image_without_an_edge_is_one_error(noise):
    raster = Raster(-300e-6, 300e-6, 6e-6, 60, 80)
    image = 100.0 + np.random.default_rng(2).normal(0.0, noise, (1, *raster.shape))
    measurement = Measurement.from_radiance(image, BAND, np.zeros(1), raster)
    with pytest.raises(ValueError, match="find tool: no rake face is found, nothing stands out"):
        find_tool(measurement)


@pytest.fixture
def folder(tmp_path, monkeypatch, seen):
    monkeypatch.chdir(tmp_path)
    write_measurement(seen[-7.0, "chip 2"], tmp_path / "told.nc")
    write_measurement(noisy(seen[-7.0, "chip 2"], 0), tmp_path / "real.nc")
    return tmp_path


def test_the_command_writes_what_the_function_gives(folder, seen):
    text = typed("rake told.nc --out grid.nc --plot grid.png").stdout
    measurement = seen[-7.0, "chip 2"]
    grid = rake_grid(measurement, measurement.tool)
    with xr.open_dataset(folder / "grid.nc", engine="h5netcdf", decode_times=False) as data:
        np.testing.assert_array_equal(data["mean"], grid.mean)
        np.testing.assert_array_equal(data["count"], grid.count)
        assert data["mean"].dims == ("time", "depth", "along")
        assert data["mean"].attrs["units"] == "K" and data.attrs["size"] == grid.size
        assert data.attrs["tool_rake_angle"] == radians(-7.0)
    assert (folder / "grid.png").read_bytes().startswith(b"\x89PNG")
    value, spread = grid.frame_mean[0, 4] - 273.15, grid.frame_standard_deviation[0, 4]
    assert uncertain_text(value, spread) in text
    assert "squares are left out" in text


def test_the_table_has_units_and_gaps(folder, seen):
    typed("rake told.nc --frame 1 --out grid.csv")
    lines = (folder / "grid.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == (
        "time_us,depth_um,along_um,mean_degC,standard_deviation_K,usable_pixels,standard_uncertainty_K,"
        "calibration_uncertainty_K,tool_along_uncertainty_K,tool_across_uncertainty_K,"
        "tool_angle_uncertainty_K"
    )
    measurement = seen[-7.0, "chip 2"]
    grid = rake_grid(measurement, measurement.tool, frames=[1])
    assert len(lines) == 1 + grid.mean.size
    cells = lines[1].split(",")
    first = [float(cell) for cell in cells[:6]]
    assert cells[6:] == [""] * 5
    expected = [10.0, 9.0, 9.0, grid.mean[0, 0, 0] - 273.15, grid.standard_deviation[0, 0, 0]]
    # Four digits after the point are written.
    np.testing.assert_allclose(first[:-1], expected, atol=6e-5)
    without = [line.split(",")[3] == "" for line in lines]
    assert sum(without) == np.isnan(grid.mean).sum() > 0


def test_a_tool_that_the_image_shows_elsewhere_is_doubted(folder):
    # The face's place is known to some 3 um, the angle to 1 or 2 deg.
    for text, doubted in (
        ("rake_angle: -7 deg\ntip: [0 um, 0 um]\n", False),
        ("rake_angle: -7 deg\ntip: [-20 um, 0 um]\n", True),
        ("rake_angle: 7 deg\ntip: [0 um, 0 um]\n", True),
    ):
        (folder / "tool.yaml").write_text(text)
        said = typed("rake real.nc --tool tool.yaml").stderr
        assert ("Warning: The rake face that shows in the image is" in said) is doubted
