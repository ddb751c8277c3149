"""A measurement beside simulations: differences, E_n, and which set fits where."""

import csv
import json
from dataclasses import replace
from math import erf, hypot, sqrt

import numpy as np
import pytest
from command import typed
from drawn import in_a_notebook
from hypothesis import given, strategies as st
from measured_band import BAND, RASTER, TOOL, BandImage, measured
from PIL import Image
from scipy.ndimage import gaussian_filter
from tolerances import DOUBLE

from chipglow.camera import Flag, Measurement
from chipglow.io import write_measurement
from chipglow.laboratory.chip.frames import frame_scatter
from chipglow.laboratory.comparison import StatedUncertainties, compare, normalised_error
from chipglow.laboratory.comparison.comparison import SURE, _confidences
from chipglow.scene import ToolGeometry
from chipglow.uncertainty import Estimate

SOLVED = 1e-7
"""In K: temperatures are found from radiances to 1.6e-10."""

X, Y = np.meshgrid(RASTER.x, RASTER.y)
CURVE = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-230e-6, 230e-6]])
FINE = replace(RASTER, spacing=5e-6, rows=79, columns=96)
STATED = StatedUncertainties(temperature=5.0)


def parts(result):
    """What is compared at the rake face and in the band; both are there."""
    assert result.grid is not None and result.band is not None
    return result.grid, result.band


def random(estimate):
    """Standard uncertainty of what differs from value to value."""
    return np.hypot(estimate.contribution("position"), estimate.contribution("frames"))


def field(x, y):
    """Radiance temperature of a chip that is linear in x and y."""
    return 700.0 + 2e5 * x + 1e5 * y


def frames(temperature, count=3, **options):
    return measured([temperature] * count, **options)


def slope_of(temperature):
    """Kelvins for a radiance that is off by its own amount, by a difference of 1 in 10 000."""
    radiance = float(BAND.radiance(temperature))
    return (float(BAND.temperature(1.0001 * radiance)) - temperature) / 1e-4


# E_n


@given(
    away=st.floats(-300, 300),
    first=st.tuples(st.floats(0.1, 50), st.floats(0.1, 50)),
    second=st.tuples(st.floats(0.1, 50), st.floats(0.1, 50)),
)
def test_e_n_is_the_difference_over_its_expanded_uncertainty(away, first, second):
    one, other = (
        Estimate([700.0 + shift])
        .with_component("systematic", parts[0])
        .with_component("position", parts[1], per_element=True)
        for shift, parts in ((0.0, first), (away, second))
    )
    expected = abs(700.0 + away - 700.0) / (2 * hypot(*first, *second))
    # A dozen roundings of 2^-53 each.
    assert normalised_error(one, other)[0] == pytest.approx(expected, rel=12 * 2.0**-53)
    back = normalised_error(other, one)
    np.testing.assert_allclose(normalised_error(one, other), back, rtol=DOUBLE)


# The difference


def test_pixels_and_places_may_differ():
    """The same linear field in images of 6 and 5 µm, where the tips are at different places."""
    tip = (33e-6, -21e-6)
    x, y = np.meshgrid(FINE.x, FINE.y)
    simulated = frames(field(x - tip[0], y - tip[1]), raster=FINE).with_tool(TOOL.at(tip))
    result = compare(frames(field(X, Y)), {"same": simulated}, TOOL, CURVE, STATED)
    for part in parts(result):
        away = part.simulated[0].values - part.measured.values
        assert np.isfinite(away).sum() > 30
        # A ten-thousandth of a kelvin for the way through radiance.
        assert np.nanmax(np.abs(away)) < 1e-3
    assert (result.fits["values_with_E_n_up_to_1"] == result.fits["values"]).all()
    assert len(result.fits) == 4
    count = result.fits["values"].sum()
    assert result.statement == f"same: {count} of {count} values agree (E_n up to 1)."
    assert "same is 0 K too" in result.sentences[0]


def test_bias_and_rms_by_hand():
    hotter = field(X, Y) + np.where(Y > 60e-6, 20.0, 0.0)
    result = compare(frames(field(X, Y)), {"hotter": frames(hotter)}, TOOL, CURVE, STATED)
    assert result.band is not None
    away = result.band.simulated[0].values - result.band.measured.values
    near, far = result.fits.iloc[2:].iloc
    # The curve rises at 45 degrees, so 100 µm from the edge it is 71 µm up.
    assert far.bias_K == pytest.approx(20.0, abs=SOLVED)
    assert far.rms_K == pytest.approx(20.0, abs=SOLVED)
    values = away[np.isfinite(away) & (result.band.distance < 100e-6)]
    assert near.bias_K == pytest.approx(values.mean())
    assert near.rms_K == pytest.approx(np.sqrt((values**2).mean()))
    assert near.rms_K > near.bias_K > 0


# Uncertainty


def test_the_uncertainty_is_made_of_its_parts():
    temperature, stated = np.full(RASTER.shape, 750.0), StatedUncertainties(emissivity=0.1)
    known = frames(temperature, relative_uncertainty=0.03)
    result = compare(known, {"chip": frames(temperature)}, TOOL, CURVE, stated)
    kelvin = slope_of(750.0)
    # Where nothing varies only the calibration and the emissivity are left.
    for part in parts(result):
        for estimate, expected in ((part.measured, 0.03), (part.simulated[0], 0.1)):
            found = estimate.standard_uncertainty[np.isfinite(estimate.values)]
            # A slope by a difference of 1 in 10 000 errs by its curvature: 3e-5 was seen.
            np.testing.assert_allclose(found, expected * kelvin, rtol=1e-4)
    expected = kelvin * hypot(0.03, 0.1)
    # By the same slope.
    assert result.fits["bias_standard_uncertainty_K"][0] == pytest.approx(expected, rel=1e-4)


def test_the_position_counts_where_the_temperature_rises():
    chip, stated = frames(field(X, Y)), StatedUncertainties(1.0, 0.0, 4e-6)
    result = compare(chip, {"same": chip}, TOOL, CURVE, stated)
    for part in parts(result):
        found = random(part.measured)[np.isfinite(part.measured.values)]
        # The bend of a straight slope is 0; the way through radiance leaves a thousandth.
        np.testing.assert_allclose(found, 4e-6 * hypot(2e5, 1e5), rtol=1e-3)


def test_frames_that_differ_make_the_mean_uncertain():
    base = field(X, Y)
    three = measured([base - 9.0, base, base + 9.0])
    result = compare(three, {"same": frames(base)}, TOOL, CURVE, StatedUncertainties(5.0, 0.0, 0.0))
    for part in parts(result):
        found = random(part.measured)[np.isfinite(part.measured.values)]
        # Three frames do not show whether they are alike, and count as one.
        np.testing.assert_allclose(found, 9.0, rtol=1e-3)


def test_a_pixel_without_light_does_not_take_the_uncertainty_away():
    clean = frames(field(X, Y), relative_uncertainty=0.02)
    radiance, flags = clean.radiance.copy(), clean.flags.copy()
    radiance[0, 20:30, 40:60], flags[0, 20:30, 40:60] = 0.0, Flag.DEAD
    damaged = Measurement.from_radiance(
        radiance, BAND, clean.times, RASTER, 573.15, flags, clean.calibration_errors
    )
    result = compare(damaged, {"same": frames(field(X, Y))}, TOOL, CURVE)
    for part in parts(result):
        known = np.isfinite(part.measured.values)
        assert np.isfinite(part.measured.standard_uncertainty[known]).all()
        assert known.sum() > 30


def test_few_frames_and_an_unknown_calibration_are_doubtful():
    one, far = measured([field(X, Y)]), frames(field(X, Y + 1e-4))
    result = compare(one, {"same": frames(field(X, Y)), "far": far}, TOOL, CURVE)
    assert result.statement.startswith("The sets cannot be distinguished at the rake face")
    assert "same is nearest, but one measured frame does not show" in result.sentences[0]
    warnings = " ".join(result.notes.warnings)
    assert "Only 1 frame" in warnings
    assert "does not state the uncertainty of its calibration" in warnings
    stated = compare(one, {"a": one}, TOOL, CURVE, STATED)
    assert "calibration" not in " ".join(stated.notes.warnings)


# Which fits


def test_the_best_set_is_told_for_each_place():
    """Set a is right at the face, set b where the curve runs."""
    base = field(X, Y)
    on_face = TOOL.signed_distance(X, Y) < 26e-6
    sets = {
        "a": frames(base - np.where(on_face, 0.0, 60.0)),
        "b": frames(base - np.where(on_face, 60.0, 0.0)),
    }
    result = compare(frames(base), sets, TOOL, CURVE, STATED)
    assert result.best["simulation"].tolist() == ["a", "b", "b", "b"]
    assert result.sentences[0].startswith(
        "At the rake face, up to 18 µm deep, a fits best (in 100 % of the draws"
    )
    assert "b is 60 K too cold" in result.sentences[0]
    assert result.statement == (
        "a fits best at the rake face, up to 18 µm deep. b fits best in the chip, over 18 µm from "
        "the face; in the shear band, under 100 µm from the edge; in the shear band, 100 µm and "
        "farther."
    )


@pytest.mark.parametrize(("cold", "hot", "stated"), [(10.0, 30.0, 15.0), (20.0, 24.0, 10.0)])
def test_how_sure_the_best_is(cold, hot, stated):
    """Sets a too cold and b too hot, a < b: with a common error of the measurement the first stays
    nearer while that error is up to (b - a) / 2, whose probability is the normal distribution's.
    """
    base = np.full(RASTER.shape, 700.0)
    sets = {"cold": frames(base - cold), "hot": frames(base + hot)}
    result = compare(frames(base), sets, TOOL, CURVE, StatedUncertainties(temperature=stated))
    expected = 0.5 * (1 + erf((hot - cold) / 2 / stated / sqrt(2)))
    assert set(result.best["simulation"]) == {"cold"}
    # 4000 draws: 0.8 %.
    np.testing.assert_allclose(result.best["confidence"], expected, atol=0.025)
    assert all("cannot be distinguished (cold is nearest" in one for one in result.sentences)
    assert result.statement.startswith("The sets cannot be distinguished")


def test_found_bands_are_compared_at_the_same_distance():
    """The band of the simulation is turned: its ridge is elsewhere, its temperature the same."""
    images = [BandImage(angle=angle, bend=1e-3, deviation=20e-6) for angle in (0.7, 0.8)]
    one, other = (frames(image.temperature()) for image in images)
    result = compare(one, {"turned": other}, TOOL, stated=STATED)
    assert result.band is not None
    away = result.band.simulated[0].values - result.band.measured.values
    inside = (result.band.distance > 70e-6) & (result.band.distance < 350e-6)
    # Reading between four pixels of a Gaussian of 200 K, 3.3 pixels wide: up to 4.6 K.
    assert np.abs(away[inside]).max() < 4.6
    assert any(
        "is fully developed" in text and text.startswith("turned: ")
        for text in result.notes.assumed
    )


def test_frames_that_have_moved_are_left_out():
    images = [BandImage(bend=1e-3, shift=shift).temperature() for shift in (0.0, 0.0, 0.0, 40e-6)]
    images[3] = images[3] - 30.0
    result = compare(
        measured(images), {"a": frames(images[0])}, TOOL, stated=StatedUncertainties(5, 0, 0)
    )
    assert result.band is not None
    known = np.isfinite(result.band.measured.values)
    np.testing.assert_allclose(random(result.band.measured)[known], 0.0, atol=SOLVED)


def test_the_reference_says_which_frames_are_compared():
    """Two places of the band; the later one is 40 µm on and hotter."""
    images = [BandImage(bend=1e-3, shift=shift).temperature() for shift in (0.0, 40e-6)]
    images[1] = images[1] + 30.0
    one, other = measured([images[0], images[1]]), frames(images[0])
    early, late = (
        compare(one, {"a": other}, TOOL, stated=STATED, reference=number).fits.iloc[-1]
        for number in (0, 1)
    )
    assert early.bias_K == pytest.approx(0.0, abs=SOLVED)
    assert late.bias_K < -10.0


# What cannot be compared


def test_without_a_band_the_rake_face_is_left():
    base = np.where(TOOL.signed_distance(X, Y) < 100e-6, 650.0, 500.0)
    result = compare(frames(base), {"same": frames(base)}, TOOL, stated=STATED)
    assert result.band is None
    assert "The shear band is left out: measured:" in " ".join(result.notes.warnings)
    assert result.fits["place"].str.contains("rake face|chip").all()


def test_another_rake_angle_and_no_tool_are_said():
    base = frames(field(X, Y))
    other = base.with_tool(ToolGeometry(rake_angle=0.0))
    data = base.data.copy()
    data.attrs = {k: v for k, v in data.attrs.items() if not k.startswith("tool_")}
    result = compare(base, {"other": other, "none": Measurement(data)}, TOOL, CURVE, STATED)
    assert "The rake angle of other differs by 7 degrees." in result.notes.warnings
    assert any("none: The file states no tool" in text for text in result.notes.assumed)


# The command


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    base = field(X, Y)
    write_measurement(frames(base), tmp_path / "measured.nc")
    write_measurement(frames(base - 40.0, surface="chip 1"), tmp_path / "one.nc")
    write_measurement(frames(base + 4.0), tmp_path / "two.nc")
    rows = "\n".join(f"{1e6 * x},{1e6 * y}" for x, y in CURVE)
    (tmp_path / "curve.csv").write_text(f"x_um,y_um\n{rows}\n", encoding="utf-8")
    return tmp_path


def test_the_command_writes_what_it_says(folder):
    options = "--curve curve.csv --uncertainty '5 K' --out result --plot picture.png"
    assert "two fits best" in typed(f"compare measured.nc one.nc two.nc {options}").output
    summary = json.loads((folder / "result" / "summary.json").read_text(encoding="utf-8"))
    assert summary["simulations"] == ["chip 1", "two"]
    assert [place["best"] for place in summary["places"]] == ["two"] * 4
    fit = summary["places"][0]["fits"][0]
    assert fit["bias_K"] == pytest.approx(-40.0, abs=SOLVED)
    assert fit["bias_standard_uncertainty_K"] >= 5.0
    with (folder / "result" / "comparison.csv").open(encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if row["E_n"]]
    for row in rows:
        expanded = hypot(float(row["measured_expanded_K"]), float(row["simulated_expanded_K"]))
        expected = abs(float(row["difference_K"])) / expanded
        # Nine printed digits of each.
        assert float(row["E_n"]) == pytest.approx(expected, rel=1e-7)
    assert {row["place"] for row in rows} == {"rake face", "shear band"}
    for name in ("result/comparison.png", "picture.png"):
        with Image.open(folder / name) as picture:
            assert picture.width > 800
    assert (folder / "result" / "comparison.svg").is_file()


# Noise that is alike from place to place and from frame to frame


def alike(generator, count=24, places=60, time=0.7, space=4.0):
    """Noise of 6 K that is alike over some places and some frames, shape (frames, places)."""
    fresh = gaussian_filter(generator.standard_normal((count + 40, places)), (0, space))
    noise = np.empty_like(fresh)
    noise[0] = fresh[0]
    for k in range(1, len(fresh)):
        noise[k] = time * noise[k - 1] + sqrt(1 - time**2) * fresh[k]
    return 6.0 * noise[-count:] / fresh.std()


def of_mean(scatter):
    """Standard uncertainty of the mean over all places."""
    return Estimate(np.zeros(scatter.variance.shape), (scatter,)).mean().standard_uncertainty


def test_the_uncertainty_of_a_mean_over_frames_that_are_alike_is_theirs():
    generator = np.random.default_rng(5)
    shown = [alike(generator, 60) for _ in range(40)]
    true = np.std([one.mean(axis=0) for one in shown])
    stated = np.mean([np.sqrt(frame_scatter(one).variance) for one in shown])
    # 40 of 60 frames, of which few are independent: 10 % measured.
    assert stated == pytest.approx(true, rel=0.15)
    together = np.std([one.mean() for one in shown])
    # The same of means, which are fewer still: 16 % measured.
    assert np.mean([of_mean(frame_scatter(one)) for one in shown]) == pytest.approx(
        together, rel=0.25
    )
    even = generator.standard_normal((30, 200))
    # The mean of 200 standard deviations of 30 frames each is known to 0.9 %: four times that.
    assert np.sqrt(frame_scatter(even).variance).mean() == pytest.approx(1 / sqrt(30), rel=0.036)


@pytest.mark.parametrize(
    ("known", "count", "least", "most"),
    [(True, 24, 0.0, 0.25), (False, 24, 0.6, 1.0), *((True, few, 0.0, 0.12) for few in (3, 5, 7))],
)
def test_noise_that_is_alike_makes_no_set_of_two_the_best(known, count, least, most):
    """Two sets as far from the truth: each may be called best in 5 % of the measurements.

    Taken as independent, 3 frames call one best in 25 %, 5 or 7 in 42 % of the measurements.
    """
    sets, claims = [Estimate(np.full(60, 700.0 + away)) for away in (10.0, -10.0)], 0
    for seed in range(60):
        shown = 700.0 + alike(np.random.default_rng(seed), count)
        mean = Estimate(shown.mean(axis=0))
        alone = mean.with_component("position", shown.std(axis=0, ddof=1) / sqrt(len(shown)),
                                    per_element=True)  # fmt: skip
        found = replace(mean, components=(frame_scatter(shown),)) if known else alone
        best = int(np.argmin([((one.values - mean.values) ** 2).mean() for one in sets]))
        claims += _confidences(found, sets)[best] >= SURE
    # Without the frames' own patterns 84 % are called so; binomial: 6 of 60 +- 2.3.
    assert least <= claims / 60 <= most


def test_e_n_holds_as_often_as_it_says():
    """Noise between 12 frames: |t| of 11 degrees of freedom is up to 2 in 93 % of cases."""
    truth = np.full(RASTER.shape, 700.0)
    generator = np.random.default_rng(8)
    noisy = measured([truth + 6.0 * generator.standard_normal(truth.shape) for _ in range(12)])
    result = compare(noisy, {"true": frames(truth)}, TOOL, CURVE, StatedUncertainties(position=0.0))
    assert result.grid is not None
    e_n = normalised_error(result.grid.measured, result.grid.simulated[0])
    known = e_n[np.isfinite(e_n)]
    assert known.size > 70
    # The standard deviation of the fraction of 80 squares is 3 %: 2.7 times that.
    assert (known <= 1).mean() == pytest.approx(0.93, abs=0.08)


def test_a_comparison_is_drawn_as_a_figure_and_shown_by_its_fits():
    image = BandImage(deviation=20e-6).temperature()
    result = compare(frames(image, 2), {"set <1>": frames(image + 5.0)}, TOOL, stated=STATED)
    figure = result.plot()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[0].startswith("at the rake face") and titles[1] == "along the shear band"
    assert len(result.to_frame()) == sum(part.measured.values.size for part in parts(result))
    columns, rows, sentences = in_a_notebook(result)
    assert columns == result.fits.columns.tolist()
    assert [row[1] for row in rows] == ["set <1>"] * len(result.fits)
    assert rows[0][2] == f"{result.fits.bias_K[0]:.6g}"
    assert sentences == [*result.notes.warnings, *result.notes.assumed]
