"""The analysis grid on the rake face, and tools that stand where an image has them."""

from math import radians

import numpy as np
import pytest
from drawn import in_a_notebook, legend_of, on_given_axes, on_new_axes, points_of
from hypothesis import given, settings, strategies as st

from chipglow.camera import Flag, Measurement
from chipglow.io import load_tool, read_measurement, write_measurement
from chipglow.laboratory.chip import rake_grid
from chipglow.radiometry import Band
from chipglow.scene import Raster, ToolGeometry, ToolOutline
from chipglow.text import DescriptionError

FAR_BELOW = 1e-12
"""In m: far below a pixel."""

BAND = Band(3.8e-6, 5.1e-6)
RASTER = Raster(left=-400e-6, top=400e-6, spacing=6e-6, rows=70, columns=80)
PIXEL = RASTER.spacing
# A radiance temperature comes back from its radiance to well under this.
EXACT = 1e-3


def plane(x, y):
    """A temperature in K that is linear in x and y."""
    return 900.0 + 4e5 * x - 7e5 * y


def measured(*temperatures, flags=None, raster=RASTER):
    """A measurement of radiance temperatures in K."""
    radiance = BAND.radiance(np.stack(temperatures))
    times = np.arange(len(temperatures)) / 600
    return Measurement.from_radiance(radiance, BAND, times, raster, flags=flags)


def linear_image(raster=RASTER):
    return plane(*np.meshgrid(raster.x, raster.y))


def middles(grid):
    """Middles of the squares, x and y each of shape (m, n)."""
    normal = np.array(grid.tool.rake_normal)
    return np.moveaxis(grid.tool.rake_point(grid.along) + grid.depth[:, None, None] * normal, 2, 0)


@settings(max_examples=25)
@given(
    angle=st.floats(-25.0, 25.0),
    x=st.floats(-30e-6, 30e-6),
    y=st.floats(-30e-6, 30e-6),
    pixels=st.sampled_from([2, 3, 3.5, 5]),
)
def test_a_linear_field_is_exact_at_the_middles_of_the_squares(angle, x, y, pixels):
    tool = ToolGeometry(rake_angle=radians(angle)).at((x, y))
    grid = rake_grid(measured(linear_image()), tool, pixels)
    expected = plane(*middles(grid))
    enough = grid.usable[0] & (grid.count[0] >= 3)
    assert enough.sum() > 9
    assert np.abs(grid.mean[0] - expected)[enough].max() < EXACT
    assert grid.size == pixels * PIXEL


def test_squares_on_the_pixels_are_plain_means_of_nine():
    tool = ToolGeometry(rake_angle=0.0, edge_radius=6e-6).at((8e-6, 4e-6))
    foot = tool.rake_foot
    image = np.random.default_rng(3).uniform(800.0, 1200.0, RASTER.shape)
    grid = rake_grid(measured(image), tool)
    column = round((foot[0] - RASTER.left) / PIXEL)
    row = round((RASTER.top - foot[1]) / PIXEL)
    for m, n in ((0, 0), (2, 5)):
        square = image[row - 3 * n - 3 : row - 3 * n, column - 3 * m - 3 : column - 3 * m]
        assert grid.count[0, m, n] == 9
        assert abs(grid.mean[0, m, n] - square.mean()) < EXACT
        assert abs(grid.standard_deviation[0, m, n] - square.std(ddof=1)) < EXACT
    np.testing.assert_allclose(grid.along[:2], [9e-6, 27e-6])
    np.testing.assert_allclose(grid.depth, 18e-6 * (np.arange(5) + 0.5))
    np.testing.assert_allclose(grid.corners()[2, 5] - foot, [-36e-6, 90e-6], atol=FAR_BELOW)


@pytest.mark.parametrize("flag", [Flag.UNDER_RANGE, Flag.SATURATED, Flag.DEAD])
def test_one_unusable_pixel_removes_its_square_alone(flag):
    tool = ToolGeometry()
    whole = rake_grid(measured(linear_image()), tool)
    m, n = 2, 6
    x, y = (part[m, n] for part in middles(whole))
    flags = np.zeros((1, *RASTER.shape), np.uint8)
    row, column = int((RASTER.top - y) / PIXEL), int((x - RASTER.left) / PIXEL)
    flags[0, row, column] = flag
    holed = rake_grid(measured(linear_image(), flags=flags), tool)
    missing = whole.usable & ~holed.usable
    assert missing.sum() == 1 and missing[0, m, n]
    assert holed.count[0, m, n] == whole.count[0, m, n] - 1
    same = holed.usable
    np.testing.assert_array_equal(holed.mean[same], whole.mean[same])


def test_a_replaced_pixel_is_used():
    flags = np.full((1, *RASTER.shape), Flag.REPLACED, np.uint8)
    tool = ToolGeometry()
    kept = rake_grid(measured(linear_image(), flags=flags), tool)
    np.testing.assert_array_equal(kept.mean, rake_grid(measured(linear_image()), tool).mean)


def test_frames_have_a_mean_and_a_deviation_between_them():
    shifts = np.array([-20.0, 0.0, 50.0, 10.0])
    frames = measured(*(linear_image() + shift for shift in shifts))
    grid = rake_grid(frames, ToolGeometry())
    np.testing.assert_allclose(
        (grid.frame_mean - grid.mean[1])[grid.usable[1]], shifts.mean(), atol=EXACT
    )
    found = grid.frame_standard_deviation[grid.usable[1]]
    np.testing.assert_allclose(found, shifts.std(ddof=1), atol=EXACT)
    chosen = rake_grid(frames, ToolGeometry(), frames=[2])
    np.testing.assert_array_equal(chosen.mean[0], grid.mean[2])
    assert chosen.times[0] == frames.times[2]
    assert np.isnan(chosen.frame_standard_deviation).all()


def test_a_square_is_averaged_over_the_frames_that_show_it():
    flags = np.zeros((2, *RASTER.shape), np.uint8)
    flags[1, :, :] = Flag.UNDER_RANGE
    grid = rake_grid(measured(linear_image(), linear_image() + 9, flags=flags), ToolGeometry())
    seen = grid.usable[0]
    assert (grid.frame_count[seen] == 1).all()
    np.testing.assert_array_equal(grid.frame_mean[seen], grid.mean[0][seen])


def test_noise_averages_as_the_number_of_pixels_says():
    """The weights that centre the pixels raise the noise by 6 % on average at -7 degrees."""
    noise = np.random.default_rng(5).normal(0.0, 5.0, (60, *RASTER.shape))
    grid = rake_grid(measured(*(linear_image() + noise)), ToolGeometry())
    seen = grid.usable.all(axis=0)
    scaled = (grid.frame_standard_deviation * np.sqrt(grid.count[0]) / 5.0)[seen]
    # 60 frames give each standard deviation to 9 %, about 60 squares their mean to 1.2 %.
    assert 0.97 < scaled.mean() < 1.10


OUTLINE = ToolOutline.placed([(-20e-6, 300e-6), (0.0, 30e-6), (10e-6, 0.0), (300e-6, 30e-6)])


@pytest.mark.parametrize("tool", [ToolGeometry(), OUTLINE])
def test_a_placed_tool_is_the_tool_moved(tool, tmp_path):
    placed = tool.at((120e-6, -40e-6))
    moved = np.array(placed.tip)
    np.testing.assert_allclose(placed.rake_foot, tool.rake_foot + moved, atol=FAR_BELOW)
    np.testing.assert_allclose(placed.edge_point, tool.edge_point + moved, atol=FAR_BELOW)
    np.testing.assert_allclose(placed.outline(1e-4), tool.outline(1e-4) + moved, atol=FAR_BELOW)
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    np.testing.assert_allclose(
        placed.signed_distance(x + moved[0], y + moved[1]),
        tool.signed_distance(x, y),
        atol=FAR_BELOW,
    )
    write_measurement(measured(linear_image()).with_tool(placed), tmp_path / "m.nc")
    stored = read_measurement(tmp_path / "m.nc").tool
    assert stored == placed
    np.testing.assert_array_equal(stored.corners, placed.corners)
    replaced = measured(linear_image()).with_tool(placed).with_tool(tool)
    assert replaced.tool.tip == (0.0, 0.0)


def test_a_tool_is_read_from_its_file(tmp_path):
    path = tmp_path / "tool.yaml"
    path.write_text("rake_angle: 6 deg\nedge_radius: 8 um\ntip: [-12 um, 3.5 um]\n")
    expected = ToolGeometry(rake_angle=radians(6.0), edge_radius=8e-6).at((-12e-6, 3.5e-6))
    assert load_tool(path) == expected
    path.write_text("")
    assert load_tool(path) == ToolGeometry()
    (tmp_path / "edge.csv").write_text("x_um,y_um\n-20,300\n0,30\n10,0\n300,30\n")
    path.write_text("outline: edge.csv\ntip: [10 um, 0 um]\n")
    found = load_tool(path)
    assert isinstance(found, ToolOutline) and found.tip != (0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "rake_angel: 3 deg\n",
            r"tool.yaml: unknown key 'rake_angel', did you mean 'rake_angle'\?",
        ),
        ("tip: [1 um]\n", "tool.yaml: tip"),
        ("tip: [1, 2]\n", "tool.yaml: tip.0: 1 has no unit"),
        (
            "rake_angle: 80 deg\n",
            "tool.yaml: rake_angle: 80 deg, expected more than -60 deg, less than 60",
        ),
    ],
)
def test_a_file_that_is_no_tool_is_one_error(tmp_path, text, message):
    (tmp_path / "tool.yaml").write_text(text)
    with pytest.raises(DescriptionError, match=message):
        load_tool(tmp_path / "tool.yaml")


def test_a_grid_is_drawn_by_depth_and_shown_with_its_warnings():
    flags = np.zeros((2, *RASTER.shape), np.uint8)
    flags[1, :40] = Flag.UNDER_RANGE
    frames = measured(linear_image(), linear_image() + 8.0, flags=flags)
    grid = rake_grid(frames, ToolGeometry(), depth=3 * 18e-6)
    axes = on_given_axes(grid)
    assert legend_of(axes) == legend_of(on_new_axes(grid)) == ["9 µm", "27 µm", "45 µm"]
    middle = points_of(axes, "27 µm")  # the curves of the other depths are moved aside
    np.testing.assert_allclose(middle[0], 1e6 * grid.along)
    np.testing.assert_allclose(middle[1], grid.frame_mean[1] - 273.15)
    columns, rows, sentences = in_a_notebook(grid)
    assert columns[:4] == ["time_us", "depth_um", "along_um", "mean_degC"]
    assert rows[0][3] == f"{grid.mean[0, 0, 0] - 273.15:.6g}"
    assert grid.notes.warnings[0] in sentences
