"""Numbers in reports: each formula against values that are computed in another way."""

from collections.abc import Mapping
from dataclasses import fields, replace
from math import isnan, nan
from types import SimpleNamespace

import numpy as np
import pytest
from GTC import type_a
from jinja2 import nodes

from chipglow.analysis import CuttingForces, image_error, line_error
from chipglow.chip import ChipMetrics, ChipScan, CutHistory, Inertia, Segmentation
from chipglow.report import numbers, result_rows
from chipglow.report.facts import Facts
from chipglow.report.page import environment, texts
from chipglow.report.quoted import Quoted
from chipglow.report.rows import all_rows, main_readings
from chipglow.report.shown_units import SHOWN_UNITS
from chipglow.scene import Raster

ENTRIES = (*numbers.FORCES, *numbers.SEGMENT, *numbers.CHIP, *numbers.CAMERA)
VALLEYS = 1e-6 * np.array([130.0, 237.0, 331.6, 427.4])
DEGREES = np.array([0.31, 0.27, 0.35, 0.29])
SPEED = 4.2
ROUNDING = 1e-12
"""Relative: some roundings of double precision, which other orders of the same sum differ by."""


def uncertain(values):
    """Return mean, standard uncertainty and degrees of freedom of the mean by GTC."""
    return type_a.estimate(list(map(float, values)))


PERIOD = uncertain(np.diff(VALLEYS))
DEGREE = uncertain(DEGREES)
SEGMENTATION = Segmentation(
    peaks=VALLEYS[:1],
    valleys=VALLEYS,
    period=PERIOD.x,
    period_uncertainty=PERIOD.u,
    peak=410e-6,
    peak_standard_deviation=7e-6,
    valley=290e-6,
    valley_standard_deviation=5e-6,
    degree=DEGREE.x,
    degree_uncertainty=DEGREE.u,
)
CHIP = ChipMetrics(
    **{field.name: getattr(SEGMENTATION, field.name) for field in fields(SEGMENTATION)},
    frequency=1 / PERIOD.x,
    speed=SPEED,
    spacing=PERIOD.x * SPEED,
    spacing_uncertainty=PERIOD.u * SPEED,
    chip_spacing=180e-6,
    feed=300e-6,
    thickness=350e-6,
    ratio=0.857,
    chip_speed=1.9,
    chip_speed_standard_deviation=0.3,
    contact=600e-6,
    contact_standard_deviation=20e-6,
    shear_angle=np.pi / 6,
    shear_angle_standard_deviation=np.pi / 60,
    band_width=40e-6,
    band_width_standard_deviation=3e-6,
    band_rate=81e3,
    band_strain=2.5,
    cutting_mean=625e3,
    cutting_swing=174e3,
    thrust_mean=279e3,
    thrust_swing=90e3,
    scan=ChipScan(400e-6, np.zeros(1), np.zeros(1)),
)
FORCES = CuttingForces(
    history=CutHistory(
        **dict.fromkeys(("time", "cutting", "thrust", "thickness"), np.zeros(1)),
        start=0.0,
        cutting_mean=625e3,
        cutting_swing=174e3,
        thrust_mean=279e3,
        thrust_swing=90e3,
        segmentation=SEGMENTATION,
    ),
    unaccounted=0.005,
    inertia=Inertia(kinetic_fraction=0.0053, force_fraction=0.006, mass_scaling=100.0),
)
DETECTOR = SimpleNamespace(
    half_netd=0.017,
    half_temperature=673.15,
    full_temperature=1173.15,
    netd=lambda kelvins: 1e-4 * kelvins,
)
CAMERA = numbers.CalibratedCamera(SimpleNamespace(lower_limit=573.15), DETECTOR)

CERTAIN = {
    "segments_count": 4,
    "cutting_force_mean_N_per_mm": 625.0,
    "cutting_force_swing_N_per_mm": 174.0,
    "thrust_force_mean_N_per_mm": 279.0,
    "energy_unaccounted_percent": 0.5,
    "kinetic_fraction_percent": 0.53,
    "inertia_force_fraction_percent": 0.6,
    "chip_spacing_um": 180.0,
    "feed_um": 300.0,
    "chip_thickness_um": 350.0,
    "chip_ratio": 0.857,
    "shear_band_rate_per_s": 81e3,
    "shear_band_strain": 2.5,
    "netd_half_K": 0.017,
    "netd_half_temperature_degC": 400.0,
    "netd_lower_K": 0.057315,
    "lower_limit_degC": 300.0,
    "saturated_degC": 900.0,
}
"""By hand from the values above, in the unit of the key."""

SCATTERED = {
    "chip_peak_um": (410.0, 7.0),
    "chip_valley_um": (290.0, 5.0),
    "chip_speed_m_per_s": (1.9, 0.3),
    "chip_contact_um": (600.0, 20.0),
    "shear_angle_deg": (30.0, 3.0),
    "shear_band_width_um": (40.0, 3.0),
}
"""Values and standard deviations of single values."""

MEASURED = {
    "segment_period_us": 1e6 * PERIOD,
    "segmentation_degree_percent": 100 * DEGREE,
    "segment_frequency_kHz": 1e-3 / PERIOD,
    "segment_spacing_um": 1e6 * PERIOD * SPEED,
}
"""Uncertain numbers, propagated by GTC."""


def shown(key, sources=(FORCES, CHIP, CAMERA)):
    tables = (numbers.FORCES, numbers.CHIP, numbers.CAMERA)
    for entries, source in zip(tables, sources, strict=True):
        for entry in entries:
            if entry.key == key:
                return entry.shown(source)
    raise KeyError(key)


def test_every_number_is_tested_here():
    of_segments = {entry.key for entry in numbers.SEGMENT}
    keys = [entry.key for entry in ENTRIES]
    assert len(keys) == len(set(keys))
    assert set(keys) == of_segments | {*CERTAIN, *SCATTERED, *MEASURED}


@pytest.mark.parametrize("key", CERTAIN)
def test_a_number_without_uncertainty_is_in_the_unit_of_its_key(key):
    value = shown(key)
    assert value.number == pytest.approx(CERTAIN[key], rel=ROUNDING)
    assert isnan(value.uncertainty) and isnan(value.freedom)


@pytest.mark.parametrize("key", SCATTERED)
def test_a_number_that_scatters_states_a_deviation_without_degrees_of_freedom(key):
    value = shown(key)
    assert value[:2] == pytest.approx(SCATTERED[key], rel=ROUNDING)
    assert isnan(value.freedom)


@pytest.mark.parametrize("key", MEASURED)
def test_uncertainty_and_degrees_of_freedom_are_those_of_the_guide(key):
    """Of four valleys there are three intervals: the period and its relatives have n - 2 = 2."""
    expected = MEASURED[key]
    assert shown(key) == pytest.approx((expected.x, expected.u, expected.df), rel=ROUNDING)


def test_the_uncertainty_of_the_frequency_is_its_change_with_the_period():
    step = 1e-5 * PERIOD.x
    slope = (1 / (PERIOD.x + step) - 1 / (PERIOD.x - step)) / (2 * step)
    expected = 1e-3 * abs(slope) * PERIOD.u
    # A central difference of 1/T over a relative step h is off by h², 1e-10.
    assert shown("segment_frequency_kHz").uncertainty == pytest.approx(expected, rel=1e-9)


def test_a_camera_without_a_lower_limit_has_no_netd_there():
    ideal = numbers.CalibratedCamera(SimpleNamespace(lower_limit=None), DETECTOR)
    sources = (FORCES, CHIP, ideal)
    assert isnan(shown("netd_lower_K", sources).number)
    assert isnan(shown("lower_limit_degC", sources).number)
    assert shown("saturated_degC", sources).number == pytest.approx(900.0)


def test_numbers_of_a_segment(chip_analysis):
    segment = chip_analysis.cut.segments[0]
    widths = np.linspace(30e-6, 50e-6, segment.band.widths.size)
    rate = np.linspace(1e4, 9e4, segment.band.rate.size)
    moment = replace(segment.band, widths=widths, rate=rate)
    made = replace(segment, momentary_band=moment, contact_length=612e-6)
    values = {entry.key: entry.shown(made).number for entry in numbers.SEGMENT}
    # The widths rise linearly with the index, so the median of any symmetric part is the mean; the
    # middle half by length may leave out one point more on one side: half a step.
    step = 20.0 / (widths.size - 1)
    # That half of a step.
    assert values["band_width_um"] == pytest.approx(40.0, abs=step / 2 + 1e-9)
    assert values["band_peak_rate_per_s"] == 9e4
    assert values["contact_length_um"] == pytest.approx(612.0, rel=ROUNDING)
    points = segment.band.ridge.points
    chords = np.hypot(*np.diff(points, axis=0).T).sum()
    assert values["band_length_um"] == pytest.approx(1e6 * chords, rel=ROUNDING)


def test_a_contact_is_truncated_within_three_samples_of_the_upper_or_left_border(chip_analysis):
    segment = chip_analysis.cut.segments[0]
    x, y = segment.tool.rake_point(segment.contact_length)
    spacing = 2e-6

    def is_truncated(to_left, to_top):
        """Move the borders so that the contact ends this many samples from them."""
        left, top = x - to_left * spacing, y + to_top * spacing
        return numbers.contact_is_truncated(segment, Raster(left, top, spacing, 400, 400))

    assert not is_truncated(4, 4)
    assert is_truncated(2, 4)
    assert is_truncated(4, 2)


def test_a_mean_of_contacts_is_a_least_length_if_one_of_them_is_truncated(chip_analysis):
    first = chip_analysis.cut.segments[0]
    whole = [replace(first, contact_length=length) for length in (100e-6, 150e-6)]
    truncated = replace(first, contact_length=900e-6)

    def row(segments):
        cut = replace(chip_analysis.cut, segments=tuple(segments))
        rows = result_rows(replace(chip_analysis, cut=cut))
        return next(row for row in rows if row.key == "contact_length_um")

    assert not row(whole).is_least
    assert row([*whole, truncated]).is_least
    assert row([*whole, truncated]).cells["mean"] == "more than 383 µm"


def test_values_and_differences_are_shown_in_units():
    assert SHOWN_UNITS["°C"].number(373.15) == pytest.approx(100.0)
    assert SHOWN_UNITS["°C"].difference(2.0) == 2.0
    assert SHOWN_UNITS["°"].number(np.pi) == pytest.approx(180.0)
    assert SHOWN_UNITS["m/min"].number(4.0) == 240.0
    assert {entry.unit for entry in ENTRIES} <= set(SHOWN_UNITS)


def test_the_rows_of_a_report_are_these_numbers(chip_analysis):
    """The table of the chip has the key, number, uncertainty and freedom of each entry."""
    result = replace(chip_analysis, cut=replace(chip_analysis.cut, chip=CHIP, forces=FORCES))
    rows = all_rows(Facts(result))
    assert [row.key for row in rows["chip"]] == [entry.key for entry in numbers.CHIP]
    for row in (*rows["chip"], *rows["cut"][: len(numbers.FORCES)]):
        value = shown(row.key)
        assert row.here == value.number
        found = [nan if one is None else one for one in (row.uncertainty, row.freedom)]
        assert found == pytest.approx(value[1:], nan_ok=True)
    frequency = next(row for row in rows["chip"] if row.key == "segment_frequency_kHz")
    # Student's factor for two degrees of freedom: 4.30.
    expected = 4.302653 * MEASURED["segment_frequency_kHz"].u
    # Student's factor has seven digits.
    assert frequency.expanded_uncertainty == pytest.approx(expected, rel=1e-6)


def templates(node):
    """Yield all texts of a parsed YAML file."""
    if isinstance(node, str):
        yield node
    elif isinstance(node, Mapping):
        for part in node.values():
            yield from templates(part)
    elif isinstance(node, list | tuple):
        for part in node:
            yield from templates(part)


@pytest.mark.parametrize("name", ["texts", "paper"])
def test_the_texts_do_not_compute(name):
    """Their templates place, format and choose; no arithmetic and no statistics."""
    arithmetic = (
        nodes.Add, nodes.Sub, nodes.Mul, nodes.Div, nodes.FloorDiv, nodes.Mod, nodes.Pow,
    )  # fmt: skip
    for text in templates(texts(name)):
        parsed = environment().parse(text)
        assert not list(parsed.find_all(arithmetic)), text
        methods = {call.node.attr for call in parsed.find_all(nodes.Call) if is_method(call)}
        assert methods <= {"items", "set_emissivity"}, text


def is_method(call):
    """Whether a call is of a method of a value, such as a mean, and not of a macro."""
    return isinstance(call.node, nodes.Getattr)


def test_every_number_has_its_words_and_nothing_else():
    rows = texts()["rows"]
    assert set(rows) == {entry.key for entry in ENTRIES}
    for part in (rows, texts()["readings"]):
        for words in part.values():
            assert set(words) == {"quantity", "text"}


@pytest.fixture(scope="module")
def quoted(chip_analysis):
    return Quoted(chip_analysis)


def test_what_captions_quote_of_the_images(quoted, chip_analysis):
    data = chip_analysis.data
    inside = data.material.values != 0
    temperature = np.broadcast_to(data.temperature.values, inside.shape)
    assert quoted.hottest == temperature[inside].max()
    flags = data.flagged.values
    assert quoted.flagged_fraction == np.count_nonzero(flags) / flags.size
    errors = image_error(data)
    for name, lowest in quoted.lowest_errors.items():
        values = errors.sel(surface=name).values
        assert lowest == np.nanmin(values[data.flagged.sel(surface=name).values == 0])
    assert list(quoted.lowest_errors) == list(data.surface.values)
    assert quoted.rake_square == pytest.approx(3 * chip_analysis.camera.pitch)


def test_what_sentences_quote_of_the_lines(quoted, chip_analysis):
    error = line_error(chip_analysis.data, "band")
    distance = error.distance.values
    draws = error.values.reshape(-1, distance.shape[-1])
    at = np.broadcast_to(distance, error.shape).reshape(draws.shape)
    workpiece = [np.nanmin(one[x <= 0]) for one, x in zip(draws, at, strict=True)]
    chip = [np.nanmin(one[x >= 0]) for one, x in zip(draws, at, strict=True)]
    # Means of the same values in another order.
    assert quoted.beside_band == pytest.approx((np.mean(workpiece), np.mean(chip)), rel=ROUNDING)
    along = line_error(chip_analysis.data, "contact").values[0, 0, 0]
    assert quoted.contact_error == (np.nanmin(along), np.nanmax(along))


def test_what_sentences_quote_of_the_band(quoted, chip_analysis):
    cut = chip_analysis.cut
    segments = [replace(cut.segments[0], sweep=sweep) for sweep in (2e-6, 5e-6)]

    def of(**changes):
        changed = replace(cut, segments=tuple(changes.pop("segments", cut.segments)))
        return Quoted(replace(chip_analysis, cut=replace(changed, **changes)))

    assert of(segments=segments).band_travel == pytest.approx(3.5e-6)
    assert isnan(of(segments=[*segments, replace(segments[0], sweep=nan)]).band_travel)
    width = cut.segments[0].band_width / chip_analysis.camera.psf.fwhm
    assert quoted.band_width_over_psf == pytest.approx(width)
    without = replace(chip_analysis, camera=replace(chip_analysis.camera, psf=None))
    assert isnan(Quoted(without).band_width_over_psf)
    for degree, is_weak in ((0.149, True), (0.15, False), (nan, False)):
        weak = replace(SEGMENTATION, degree=degree)
        history = replace(FORCES.history, segmentation=weak)
        assert of(forces=replace(FORCES, history=history)).is_weakly_segmented is is_weak


def test_the_main_readings_of_a_cut_are_at_its_main_places(chip_analysis):
    assert list(main_readings(Facts(chip_analysis))) == ["rake", "band", "band_worst"]


def test_an_unknown_contact_of_the_chip_is_said(chip_analysis):
    unknown = replace(CHIP, contact=nan, contact_standard_deviation=nan)
    result = replace(chip_analysis, cut=replace(chip_analysis.cut, chip=unknown))
    rows = {row.key: row for row in all_rows(Facts(result))["chip"]}
    assert rows["chip_contact_um"].here is None
    assert rows["chip_contact_um"].explanation.startswith("Unknown")
    assert "400 µm from the edge" in rows["chip_thickness_um"].explanation
    assert {row.key for row in result_rows(result)}.isdisjoint(rows)
