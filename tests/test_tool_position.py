"""How uncertain a tool's place is, in the squares at the rake face and along the shear band."""

from dataclasses import replace
from math import degrees, hypot, radians

import numpy as np
import pytest
import xarray as xr
from command import typed
from hypothesis import given, settings, strategies as st
from measured_band import RASTER, TOOL, measured
from seen_chip import look, noisy

from chipglow.io import read_measurement, write_measurement
from chipglow.laboratory.chip import ToolUncertainty, band_profile, find_tool, rake_grid
from chipglow.laboratory.comparison import StatedUncertainties, compare, normalised_error
from chipglow.scene import ToolGeometry
from chipglow.surface import CHIP_2
from chipglow.uncertainty import Estimate, from_xarray

X, Y = np.meshgrid(RASTER.x, RASTER.y)
SLOPE = np.array([2e5, 1e5])
CURVE = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-230e-6, 230e-6]])
UP, INTO = np.array(TOOL.rake_direction), np.array(TOOL.rake_normal)
FOUND = ToolUncertainty(along=16e-6, across=2e-6, angle=radians(1.5), pivot=70e-6)


def linear(count=3):
    """Frames whose radiance temperature is linear in x and y, with the slope `SLOPE`."""
    return measured([700.0 + SLOPE[0] * X + SLOPE[1] * Y] * count)


def moved(tool, uncertainty, along, across, angle):
    """A tool that is off by so many standard uncertainties."""
    turned = replace(tool, rake_angle=tool.rake_angle + angle * uncertainty.angle)
    way = along * uncertainty.along * np.array(tool.rake_direction)
    way = way + across * uncertainty.across * np.array(tool.rake_normal)
    tip = tool.rake_point(uncertainty.pivot) + way - turned.rake_point(uncertainty.pivot)
    return turned.at((float(tip[0]), float(tip[1])))


@settings(max_examples=40)
@given(
    kind=st.sampled_from([0, 1, 2]),
    angle=st.floats(-25.0, 25.0),
    pivot=st.floats(-50e-6, 200e-6),
    up=st.floats(-100e-6, 300e-6),
    into=st.floats(0.0, 100e-6),
)
def test_displacements_are_those_of_a_tool_that_is_moved_and_turned(kind, angle, pivot, up, into):
    tool = ToolGeometry(rake_angle=radians(angle))
    # So small that the sine is the angle to a millionth.
    small = ToolUncertainty(1e-8, 1e-8, 1e-6, pivot)
    other = moved(tool, small, *np.eye(3)[kind])
    here, there = (t.rake_point(up) + into * np.array(t.rake_normal) for t in (tool, other))
    found = small.displacements(tool, here)[kind]
    # A millionth of displacements of 1e-8 m.
    np.testing.assert_allclose(found, there - here, atol=1e-14)


def test_the_tool_of_the_measurement_is_taken_if_none_is_given():
    other = TOOL.at((20e-6, 0.0))
    told = linear(1).with_tool(other)
    assert rake_grid(told).tool == other
    assert rake_grid(told, TOOL).tool == TOOL
    expected = band_profile(told, other, curve=CURVE).distance
    np.testing.assert_array_equal(band_profile(told, curve=CURVE).distance, expected)
    attributes = {k: v for k, v in told.data.attrs.items() if not k.startswith("tool_")}
    told.data.attrs = attributes
    for analysis in (rake_grid, band_profile):
        with pytest.raises(ValueError, match="tool: the measurement contains no tool"):
            analysis(told)


def test_a_comparison_has_the_uncertainty_of_the_tool_s_place():
    stated = StatedUncertainties(temperature=3.0, tool=FOUND)
    result = compare(linear(), {"same": linear()}, TOOL, CURVE, stated)
    grid = rake_grid(linear(), TOOL, uncertainty=FOUND)
    assert result.grid is not None and result.band is not None
    known = np.isfinite(result.grid.measured.values)
    expected = np.hypot(3.0, grid.frame_estimate.standard_uncertainty)
    # Frames that are alike: nothing else, not the pixel's position either.
    np.testing.assert_allclose(
        result.grid.measured.standard_uncertainty[known], expected[known], rtol=1e-12
    )
    # The curve is laid on the simulation by the edge, so that it is off with it in any direction.
    moves = FOUND.displacements(TOOL, TOOL.edge_point) @ SLOPE
    pixel = RASTER.spacing / np.sqrt(12.0) * np.hypot(*SLOPE)
    known = np.isfinite(result.band.measured.values)
    # A field that is linear, but for rounding: 2e-10.
    np.testing.assert_allclose(
        result.band.measured.standard_uncertainty[known], hypot(3.0, pixel, *moves), rtol=1e-8
    )
    assert not result.grid.simulated[0].only("tool").components


def test_a_tool_that_is_off_moves_all_squares_together():
    """The mean of many squares is as uncertain as each where the slope is the same everywhere."""
    tool = ToolUncertainty(along=16e-6, across=0.0)
    stated = StatedUncertainties(temperature=1e-3, tool=tool)
    result = compare(linear(), {"same": linear()}, TOOL, CURVE, stated)
    own = StatedUncertainties(temperature=1e-3, position=16e-6)
    each = compare(linear(), {"same": linear()}, TOOL, CURVE, own)
    expected = 16e-6 * abs(SLOPE @ UP)
    together, apart = result.fits[:2], each.fits[:2]
    # Beside 16 um the other parts of the uncertainty are 1e-3 K.
    np.testing.assert_allclose(together["bias_standard_uncertainty_K"], expected, rtol=2e-6)
    single = 16e-6 * np.hypot(*SLOPE) / np.sqrt(apart["values"])
    np.testing.assert_allclose(apart["bias_standard_uncertainty_K"], single, rtol=2e-5)  # likewise


@pytest.mark.parametrize(("turned", "doubted"), [(2.9, False), (3.1, True)])
def test_a_rake_angle_is_doubted_beyond_its_expanded_uncertainty(turned, doubted):
    other = linear().with_tool(replace(TOOL, rake_angle=TOOL.rake_angle + radians(turned)))
    result = compare(linear(), {"other": other}, TOOL, CURVE, StatedUncertainties(1.0, tool=FOUND))
    assert ("rake angle of other differs" in " ".join(result.notes.warnings)) is doubted


def test_the_uncertainty_holds_for_tools_that_are_off_at_random():
    """A chip that is hot at the face, where contact ends: neither slope nor bend is even."""
    along = (X - TOOL.rake_foot[0]) * UP[0] + (Y - TOOL.rake_foot[1]) * UP[1]
    depth = np.abs(TOOL.signed_distance(X, Y))
    contact = 1 / (1 + np.exp((along - 150e-6) / 30e-6))
    chip = measured([600.0 + 300.0 * contact * np.exp(-depth / 50e-6)])
    true = rake_grid(chip, TOOL)
    rng = np.random.default_rng(5)
    within, count = 0, 0
    for off in rng.standard_normal((120, 3)):
        grid = rake_grid(chip, moved(TOOL, FOUND, *off), uncertainty=FOUND)
        columns = min(grid.along.size, true.along.size)
        own = grid.frame_estimate[:, :columns].only("tool")
        e_n = normalised_error(own, Estimate(true.frame_mean[:, :columns]))
        within += int((e_n <= 1).sum())
        count += int(np.isfinite(e_n).sum())
    # 120 tools whose squares go together: a standard deviation of 2 %.
    assert within / count == pytest.approx(0.954, abs=0.05)


# The commands


@pytest.fixture
def folder(tmp_path, monkeypatch, seen):
    monkeypatch.chdir(tmp_path)
    write_measurement(seen, tmp_path / "told.nc")
    write_measurement(noisy(seen, 0), tmp_path / "real.nc")
    return tmp_path


@pytest.fixture(scope="module")
def seen():
    return look(-7.0, CHIP_2)


def test_the_place_of_a_found_tool_is_uncertain_and_position_wins(folder):
    (folder / "tool.yaml").write_text("rake_angle: -7 deg\ntip: [0 um, 0 um]\n")
    measurement = read_measurement(folder / "real.nc")
    found = find_tool(measurement)
    stated = ToolUncertainty(along=5e-6, across=5e-6)
    for options, tool, uncertainty, said in (
        ("--tool found", found.tool, found.uncertainty, "found, ± 16 um along the face"),
        (
            "--tool found --position '5 um'",
            found.tool,
            stated,
            "--position 5 um instead of the detected one, ± 16 um along",
        ),
        ("--tool tool.yaml --position '5 um'", None, stated, None),
        ("--tool tool.yaml", None, None, None),
    ):
        result = typed(f"rake real.nc {options} --out grid.nc")
        text, assumed = result.stdout, result.stderr
        if tool is found.tool:
            angle = degrees(tool.rake_angle)
            assert f"Found: rake angle {angle:.1f} deg, tip at x " in text
            assert "Assumed: The clearance angle is 7 deg, the edge radius 20 um." in assumed
        with xr.open_dataset(folder / "grid.nc", engine="h5netcdf", decode_times=False) as data:
            written = from_xarray(data.load(), "mean")
        tool = tool or ToolGeometry(radians(-7.0)).at((0.0, 0.0))
        grid = rake_grid(measurement, tool, uncertainty=uncertainty)
        np.testing.assert_array_equal(written.values, grid.mean)
        np.testing.assert_array_equal(
            (written - grid.estimate).standard_uncertainty[grid.usable], 0
        )
        assert bool(written.only("tool").components) is (uncertainty is not None)
        assert ("Position of the tool: " in text) is (said is not None)
        assert said is None or f"Position of the tool: {said}" in text
        assert ("Errors of tool move all squares together" in text) is (uncertainty is not None)
        if uncertainty:
            most = np.nanmax(grid.frame_estimate.contribution("tool across"))
            (line,) = (line.split() for line in text.splitlines() if "tool across" in line)
            # Two printed digits.
            assert float(line[-1]) == pytest.approx(most, rel=0.05)


def test_the_place_of_a_found_tool_goes_into_the_band(folder):
    (folder / "curve.csv").write_text("x_um,y_um\n-30,40\n-150,140\n")
    uncertainty = {}
    for name, options in (("found", ""), ("stated", "--position '2 um'")):
        usual = f"real.nc --curve curve.csv --tool found --out {name}.nc"
        assert "Position of the tool: " in typed(f"shearband {usual} {options}").stdout
        path = folder / f"{name}.nc"
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as data:
            read = from_xarray(data.load(), "temperature")
            uncertainty[name] = read.only("tool").standard_uncertainty
            whole = np.hypot(read.contribution("position"), uncertainty[name])
            np.testing.assert_allclose(data["standard_uncertainty"], whole)
    assert np.nanmin(uncertainty["found"]) >= 0.0
    assert np.nanmax(uncertainty["found"]) > 1.0
    assert (uncertainty["stated"] == 0.0).all()
