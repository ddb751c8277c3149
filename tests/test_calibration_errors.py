"""The calibration's and the tool's errors in what is read of a chip, by drawing them anew."""

import csv
from dataclasses import replace
from math import cos, hypot, radians, sin

import numpy as np
import pytest
from command import typed
from measured_band import BAND, RASTER, TOOL, BandImage, measured
from tolerances import DOUBLE

from chipglow.camera import LinearCalibration, Measurement, SakumaHattori
from chipglow.io import read_measurement, write_measurement
from chipglow.laboratory.chip import ToolUncertainty, band_profile, rake_grid
from chipglow.laboratory.recordings import fit_calibration
from chipglow.radiometry.band import SECOND_RADIATION_CONSTANT
from chipglow.uncertainty import Estimate

X, Y = np.meshgrid(RASTER.x, RASTER.y)
SLOPE = np.array([2e5, 1e5])
CURVE = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-230e-6, 230e-6]])
FOUND = ToolUncertainty(along=3e-6, across=1e-6, angle=radians(0.3), pivot=70e-6)
BODIES = np.arange(300.0, 701.0, 50.0) + 273.15
DRAWS = 20_000

KELVINS = np.arange(450.0, 1100.0, 0.1)


RADIANCE = BAND.radiance(KELVINS)


def by_line(counts, offset, gain):
    """Temperatures in K of counts on a straight line over the radiance."""
    return np.interp((counts - offset) / gain, RADIANCE, KELVINS)


def by_sakuma_hattori(counts, offset, a, b, scale):
    return (SECOND_RADIATION_CONSTANT / np.log(scale / (counts - offset) + 1) - b) / a


# Of counts, of each blackbody and of all of them in K. The form's parameters are so uncertain by
# themselves that, with errors as of the line, counts are no longer linear in them.
CAMERAS = {
    "line": (LinearCalibration, by_line, (2.0, 0.3, 1.0)),
    "form": (SakumaHattori, by_sakuma_hattori, (0.05, 0.008, 0.2)),
}


def temperature_at(points):
    """A chip whose temperature is linear in x and y: a square's mean is that of its middle."""
    return 700.0 + points @ SLOPE


def counts_of(kelvins):
    return 400.0 + 1.8 * np.interp(kelvins, KELVINS, RADIANCE)


def looked_at(fit, frames=2):
    """The chip as a camera shows it that was calibrated by `fit`."""
    counts = counts_of(temperature_at(np.stack([X, Y], axis=-1)))
    return Measurement.from_radiance(
        np.repeat(fit.radiance(counts)[None], frames, axis=0),
        fit.band,
        1e-5 * np.arange(frames),
        RASTER,
        573.15,
        calibration_errors=fit.errors,
    ).with_tool(TOOL)


def drawn_parameters(fit, generator):
    """Parameters as other blackbodies would have given them, each of shape (DRAWS, 1)."""
    scale = np.sqrt(np.diag(fit.covariance))
    alike = fit.covariance / scale / scale[:, None]
    root = np.linalg.cholesky(alike + 1e-13 * np.eye(scale.size))
    away = generator.standard_normal((DRAWS, scale.size)) @ root.T
    return (fit.parameters + scale * away).T[..., None]


def displaced(points, drawn):
    """Points fixed to a tool that is up its face, into the chip, and turned by so many u."""
    up = np.array([sin(TOOL.rake_angle), cos(TOOL.rake_angle)])
    into = np.array([-cos(TOOL.rake_angle), sin(TOOL.rake_angle)])
    pivot = TOOL.rake_foot + FOUND.pivot * up
    turn = FOUND.angle * drawn[:, 2, None]
    away = points - pivot
    across, along = away @ into, away @ up
    moved = points + np.multiply.outer(FOUND.along * drawn[:, 0], up)[:, None]
    moved = moved + np.multiply.outer(FOUND.across * drawn[:, 1], into)[:, None]
    moved = moved + (np.cos(turn) - 1)[..., None] * away
    return moved + np.sin(turn)[..., None] * (across[:, None] * up - along[:, None] * into)


@pytest.mark.parametrize(("kind", "temperature_of", "stated"), CAMERAS.values(), ids=CAMERAS)
def test_squares_and_band_have_errors_in_common(kind, temperature_of, stated):
    """Against draws of the calibration's parameters and of the tool's place."""
    generator = np.random.default_rng(7)
    fit = fit_calibration(kind, BODIES, counts_of(BODIES), BAND, *stated).calibration
    measurement = looked_at(fit)
    grid = rake_grid(measurement, TOOL, uncertainty=FOUND)
    profile = band_profile(measurement, TOOL, curve=CURVE, position=0.0, uncertainty=FOUND)
    rows, columns = np.array([0, 0, 4, 4]), np.array([1, 8, 1, 8])
    squares = grid.frame_estimate[rows, columns]
    places = np.array([10, 60])
    band = profile.estimate[0, places]

    parameters = drawn_parameters(fit, generator)
    tools = generator.standard_normal((DRAWS, 3))
    up = np.array([sin(TOOL.rake_angle), cos(TOOL.rake_angle)])
    into = np.array([-cos(TOOL.rake_angle), sin(TOOL.rake_angle)])
    middles = TOOL.rake_foot + grid.along[columns, None] * up + grid.depth[rows, None] * into
    way = (CURVE[1] - CURVE[0]) / hypot(*(CURVE[1] - CURVE[0]))
    edge = TOOL.edge_point
    farther = (displaced(edge[None], tools)[:, 0] - edge) @ way
    along = profile.points[0, places] + np.multiply.outer(farther, way)[:, None]
    seen = temperature_at(np.concatenate([displaced(middles, tools), along], axis=1))
    read = temperature_of(counts_of(seen), *parameters)

    together = Estimate(
        np.concatenate([squares.values, band.values]),
        [
            replace(one, effects=np.concatenate([one.effects, other.effects]))
            for one in squares.components
            for other in band.components
            if one.cause == other.cause
        ],
    )
    # The calibration and the tool, each the same in both.
    assert [one.cause.name for one in together.components] == ["calibration", "tool"]
    # Five standard errors of 20 000 draws of 0.3 K are 0.01 K; as much for the second order.
    np.testing.assert_allclose(read.mean(axis=0), together.values, atol=0.02)
    spread = together.standard_uncertainty
    # A standard deviation of 20 000 draws is good to 0.5 %, three times that; of a correlation to
    # 0.7 %, three times that. Slopes change by 0.5 % where the draws go.
    np.testing.assert_allclose(read.std(axis=0), spread, rtol=0.02)
    # Three times 0.7 %.
    np.testing.assert_allclose(np.corrcoef(read.T), together.correlation(), atol=0.021)
    # The calibration is a part that shows.
    part = together.contribution("calibration") / spread
    assert part.min() > 0.05


def test_the_errors_of_a_calibration_come_back_from_a_file(tmp_path):
    fit = fit_calibration(SakumaHattori, BODIES, counts_of(BODIES), BAND, 2.0, 0.3, 1.0).calibration
    measurement = looked_at(fit)
    write_measurement(measurement, tmp_path / "m.nc")
    again = read_measurement(tmp_path / "m.nc")
    assert again.calibration_errors is not None
    np.testing.assert_array_equal(again.calibration_errors.effects, fit.errors.effects)
    assert again.calibration_errors.identity == fit.errors.identity
    # Two files by one calibration have its errors in common, two calibrations do not.
    same = rake_grid(again, TOOL).estimate - rake_grid(measurement, TOOL).estimate
    assert np.nanmax(same.standard_uncertainty) < 1e-9
    other = fit_calibration(
        SakumaHattori, BODIES, counts_of(BODIES), BAND, 2.0, 0.4, 1.0
    ).calibration
    apart = rake_grid(looked_at(other), TOOL).estimate - rake_grid(measurement, TOOL).estimate
    assert np.nanmin(apart.contribution("calibration")) > 0.5
    alone = Measurement.from_radiance(
        measurement.radiance, fit.band, measurement.times, RASTER, 573.15
    )
    write_measurement(alone, tmp_path / "alone.nc")
    without = read_measurement(tmp_path / "alone.nc")
    assert without.calibration_errors is None and without.calibration_uncertainty is None
    for result in (rake_grid(without, TOOL), band_profile(without, TOOL, curve=CURVE)):
        assert not result.estimate.only("calibration").components
        assert result.estimate.unevaluated == ("calibration",)


KNOWN = measured([np.full(RASTER.shape, 700.0)], relative_uncertainty=0.01).data


def test_errors_without_their_radiance_are_refused():
    with pytest.raises(ValueError, match=r"'calibration_errors' over .* is missing"):
        Measurement(KNOWN.drop_vars("calibration_radiance")).calibration_errors  # noqa: B018


def test_the_same_tool_has_the_same_errors_and_another_has_its_own():
    frame = measured([temperature_at(np.stack([X, Y], axis=-1))])
    one = rake_grid(frame, TOOL, uncertainty=FOUND).frame_estimate[0, 3]
    same = rake_grid(frame, TOOL, uncertainty=FOUND).frame_estimate[0, 3]
    assert (one - same).standard_uncertainty == pytest.approx(0.0, abs=DOUBLE)
    elsewhere = TOOL.at((1e-6, 0.0))
    other = rake_grid(frame, elsewhere, uncertainty=FOUND).frame_estimate[0, 3]
    assert (one - other).standard_uncertainty > one.standard_uncertainty


def test_the_command_writes_the_calibration_s_part(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    images = [BandImage(shift=shift).temperature() for shift in (-3e-6, 0.0)]
    write_measurement(measured(images, relative_uncertainty=0.01), tmp_path / "m.nc")
    said = typed("rake m.nc --out grid.csv").output
    estimate = rake_grid(read_measurement("m.nc")).estimate
    with (tmp_path / "grid.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    for column in ("calibration_uncertainty_K", "standard_uncertainty_K"):
        found = [float(row[column] or "nan") for row in rows]
        expected = estimate.contribution("calibration").ravel()
        # Nine printed digits.
        np.testing.assert_allclose(found, expected, atol=1e-7)
    most = np.nanmax(expected)
    lines = [line.split() for line in said.splitlines()]
    (line,) = (line for line in lines if line[:1] == ["calibration"])
    # Two printed digits.
    assert float(line[-1]) == pytest.approx(most, rel=0.05)
    assert "Errors of calibration move all squares together" in said
