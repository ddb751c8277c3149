"""The paper's study corrected: its numbers, and what the report says and draws of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from analytic_chip import AnalyticChip

from chipglow import Estimate
from chipglow.analysis import CorrectionPlan
from chipglow.analysis.corrected import RAKE_FACE, SHEAR_BAND, corrected_windows
from chipglow.report import corrected, numbers
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import all_rows
from chipglow.report.summary import summary
from chipglow.study import Study
from chipglow.surface import CHIP_1, CHIP_2
from chipglow.uncertainty import Cause, Component

SURFACES = {"chip 1": CHIP_1, "chip 2": CHIP_2}


@pytest.fixture(scope="module")
def scene():
    return AnalyticChip(frames=60).scene()


@pytest.fixture(scope="module")
def analysis(scene, chip_analysis):
    """The analytic chip with its shown exposure corrected beside the edge."""
    shown = chip_analysis.data.attrs["shown_instant"]
    frames = {
        name: type(one)(one.data.isel(time=[shown]))
        for name, one in chip_analysis.measurements.items()
    }
    cut = chip_analysis.cut
    windows = corrected_windows(
        scene,
        chip_analysis.camera,
        SURFACES,
        frames,
        cut.segments[0],
        CorrectionPlan({"chip 2": 0.02}),
        {RAKE_FACE: "chip 2", SHEAR_BAND: "chip 1"},
        cut.heated,
    )
    return replace(chip_analysis, cut=replace(cut, corrected=tuple(windows)))


def test_the_correction_is_near_the_truth_and_its_intervals_contain_it(analysis):
    for window in analysis.cut.corrected:
        measured, found = (
            one.value(window).number for one in numbers.WINDOW if one.key.endswith("rms_K")
        )
        assert found < 0.5 * measured
        # 95 % are promised. Textures with a grain of three pixels leave about 60 independent
        # values, whose fraction scatters by 2.8 %: three standard deviations.
        assert numbers.held_fraction(window).number > 0.95 - 3 * 0.028


def test_places_are_the_pixels_beside_the_face_and_on_the_ridge(analysis):
    segment = analysis.cut.segments[0]
    rake, band = (window.places[0] for window in analysis.cut.corrected)
    assert (rake.name, rake.surface) == ("rake face", "chip 2")
    assert (band.name, band.surface) == ("shear band", "chip 1")
    raster = analysis.cut.corrected[0].correction.raster
    x, y = np.meshgrid(raster.x, raster.y)
    distance = segment.tool.signed_distance(x[rake.pixels], y[rake.pixels])
    assert (distance > 0).all() and (distance < raster.spacing).all()
    ridge = segment.band.ridge.points
    centres = np.stack([x[band.pixels], y[band.pixels]], axis=-1)
    nearest = np.abs(centres[:, None] - ridge).max(axis=-1).min(axis=1)
    # Points of the ridge are within half a pixel of the centre, and half their distance apart.
    assert nearest.max() <= raster.spacing / 2 * (1 + 1e-9)
    assert (np.diff(rake.distance) >= 0).all()


def test_the_true_temperature_is_that_of_the_mean_radiance(scene, analysis):
    """Away from outlines it is the mean over the samples of a pixel and the frames."""
    window = analysis.cut.corrected[0]
    band, raster = analysis.camera.band, window.correction.raster
    row, column = np.argwhere(window.judged & (window.correction.data["zone"][0].values == 0))[0]
    start, duration = analysis.cut.segments[0].start, analysis.camera.integration_time
    first = scene.frame_at(start)
    frames = range(first, first + round(duration / scene.frame_spacing))
    own = np.ix_(
        np.abs(scene.raster.y - raster.y[row]) < raster.spacing / 2,
        np.abs(scene.raster.x - raster.x[column]) < raster.spacing / 2,
    )
    radiance = [band.radiance(scene.field("temperature", frame)[own]) for frame in frames]
    # Radiance is tabulated to 1e-4 of itself, which is 0.02 K.
    expected = float(band.temperature(np.mean(radiance)))
    # Twice in the mean and its inverse, and rounded.
    assert window.true[row, column] == pytest.approx(expected, abs=0.05)


def test_stated_uncertainties_come_before_those_of_the_heated_chip(analysis):
    rake, band = analysis.cut.corrected
    assert rake.emissivity_uncertainty == 0.02
    row = next(
        row for one in analysis.cut.heated for row in one.rows if row.feature == "chip 1 chip body"
    )
    assert band.emissivity_uncertainty == float(row.found.estimate.standard_uncertainty)
    stated = {
        "surface.chips.chip 2.body.mean": {"standard": 0.03},
        "camera.psf.numerical_aperture": {"standard": "2 %"},
    }
    plan = Study(uncertainty={"inputs": stated}).known
    assert plan == CorrectionPlan({"chip 2": 0.03}, pytest.approx(0.02))
    assert Study(correction=False).known is None


PLACE = SimpleNamespace(
    measured=900.0,
    true=1008.0,
    estimate=Estimate(
        np.array(1000.0), (Component(Cause("texture", "4", 1, 4.0), np.array([[5.0]])),)
    ),
)
STUDENT = 2.776445
"""Student's factor for 95 % and four degrees of freedom, from tables."""


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("measured_degC", 626.85),
        ("corrected_degC", 726.85),
        ("corrected_low_degC", 726.85 - 5 * STUDENT),
        ("corrected_high_degC", 726.85 + 5 * STUDENT),
        ("true_degC", 734.85),
    ],
)
def test_numbers_of_a_place(key, expected):
    entry = next(entry for entry in numbers.PLACE if entry.key == key)
    # The factor has seven digits.
    assert entry.shown(PLACE).number == pytest.approx(expected, abs=1e-5)


def test_the_corrected_temperature_states_its_uncertainty():
    value = numbers.corrected_temperature(PLACE)
    assert (value.uncertainty, value.freedom) == pytest.approx((5.0, 4.0))


def test_numbers_of_a_window():
    window = SimpleNamespace(
        judged=np.array([[True, True, True, False]]),
        held=np.array([[True, True, False, False]]),
        true=np.array([[700.0, 710.0, 720.0, 0.0]]),
        measurement=SimpleNamespace(
            radiance_temperature=lambda: np.array([[[690.0, 730.0, 700.0, 9.0]]])
        ),
        correction=SimpleNamespace(data={"temperature": [SimpleNamespace(values=np.array([[
            701.0, 708.0, 722.0, np.nan]]))]}),
        emissivity_uncertainty=0.01,
    )  # fmt: skip
    found = {entry.key: entry.shown(window).number for entry in numbers.WINDOW}
    assert found == pytest.approx(
        {
            "measured_rms_K": np.sqrt((10**2 + 20**2 + 20**2) / 3),
            "corrected_rms_K": np.sqrt((1 + 4 + 4) / 3),
            "held_percent": 100 * 2 / 3,
            "emissivity_uncertainty": 0.01,
        }
    )


def test_every_number_has_its_words_and_nothing_else():
    words = texts()["corrected"]
    assert set(words) == {entry.key for entry in (*numbers.PLACE, *numbers.WINDOW)}
    assert all(set(one) == {"quantity", "text"} for one in words.values())


def test_what_the_report_says_and_draws(analysis):
    facts = Facts(analysis)
    rows = all_rows(facts)
    found = summary(rows, analysis, {}, {})
    rake = analysis.cut.corrected[0].places[0]
    assert found.corrected["rake_face_true_degC"] == pytest.approx(rake.true - 273.15)
    uncertainty = float(rake.estimate.standard_uncertainty)
    assert found.corrected_uncertainty["rake_face_corrected_degC"] == pytest.approx(uncertainty)
    assert set(found.corrected) <= set(found.explanation)
    said = list(corrected.sentences(facts, {row.key: row for row in rows["corrected"]}))
    assert len(said) == 4  # two places, two surfaces
    assert f"is {rake.estimate.values - 273.15:.0f} ± " in said[0]
    assert f"the true temperature is {rake.true - 273.15:.0f} °C" in said[0]
    assert "uncertainty of the mean emissivity is 0.020." in said[2]
    images, curves = corrected.images(facts), corrected.curves(facts)
    assert [axes.get_title() for axes in images.axes][:3] == [
        "measured, chip 2", "corrected, chip 2", "true, chip 2",
    ]  # fmt: skip
    titles = [axes.get_title(loc) for axes in curves.axes for loc in ("left", "center")]
    assert {"rake face, chip 2", "shear band, chip 1"} <= set(titles)


def test_without_a_correction_the_report_has_none(chip_analysis):
    facts = Facts(chip_analysis)
    assert all_rows(facts)["corrected"] == []
    assert corrected.images(facts) is None and corrected.curves(facts) is None
