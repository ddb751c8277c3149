"""True temperature from radiance and emissivity: Equation 2 solved, and how sure that is."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from command import typed, words
from drawn import in_a_notebook, on_given_axes, on_new_axes, points_of
from heated_chip import BAND, CELSIUS, RASTER, REGIONS, measured, table_1
from tolerances import DOUBLE

from chipglow.camera import CalibrationErrors, Flag, LinearCalibration, Measurement
from chipglow.io import write_measurement
from chipglow.laboratory import emissivity as em
from chipglow.laboratory.recordings import fit_calibration
from chipglow.scene import Area, Polygon, Region
from chipglow.uncertainty import Estimate, from_xarray

SOLVED = 1e-6
"""In K: temperatures that are solved for; radiances are in double precision here."""

ROOM = 293.0
WHOLE = Area("chip", "chip", np.ones(RASTER.shape, dtype=bool), True)
HOT = 600.0 + CELSIUS
HEATING = em.Heating(391.0 + CELSIUS, ROOM, 2.0, 5.0)
BODIES = np.arange(200.0, 701.0, 100.0) + CELSIUS
OFFSET, GAIN = 400.0, 1.8
KNOWN = em.EmissivityLine.constant(0.42)


def image(emissivity=0.42, kelvins=HOT, reflected=ROOM, **more):
    values = np.full(RASTER.shape, emissivity)
    return measured(values, reference=kelvins, reflected=reflected, **more)


def fitted(generator=None, common=0.0, spread=0.3):
    """A calibration whose blackbodies are as far off as they are said to be."""
    shift = np.zeros(BODIES.size)
    if generator is not None:
        shift = generator.normal(0.0, common) + generator.normal(0.0, spread, BODIES.size)
    counts = OFFSET + GAIN * BAND.radiance(BODIES + shift)
    return fit_calibration(
        LinearCalibration, BODIES, counts, BAND, 0.01, spread, common
    ).calibration


def developed(calibration, kelvins, emissivity, frames=1, noise=0.0, seed=0, room=ROOM):
    """A measurement of an even object by a calibration, from the counts of the true camera."""
    true = image(emissivity, kelvins, room, frames=frames, noise=noise, seed=seed).radiance
    counts = OFFSET + GAIN * true
    found = Measurement.from_radiance(
        calibration.radiance(counts), BAND, np.arange(frames) / 600.0, RASTER,
        calibration_errors=calibration.errors,
    )  # fmt: skip
    vars(found)["band"] = BAND
    return found


@pytest.mark.parametrize("emissivity", [0.05, 0.42, 1.0])
@pytest.mark.parametrize("celsius", [60.0, 391.0, 1200.0])
def test_an_object_of_known_emissivity_shows_its_temperature(emissivity, celsius):
    found = em.true_temperature(
        [image(emissivity, celsius + CELSIUS)], WHOLE, em.EmissivityLine.constant(emissivity)
    )
    assert found.estimate.values == pytest.approx(celsius + CELSIUS, abs=SOLVED)
    assert found.estimate.standard_uncertainty == pytest.approx(0.0, abs=DOUBLE)


def of_gain(gain, uncertainty=0.0):
    """Measurement by a camera that shows so much too much, and states it as uncertain."""
    radiance = image(gain=gain).radiance
    mean = radiance.mean()
    errors = CalibrationErrors(np.array([0.0, 2 * mean]), np.array([[0.0, 2 * uncertainty * mean]]))
    return Measurement.from_radiance(radiance, BAND, np.zeros(1), RASTER, None, None, errors)


def hotter(kelvins):
    radiance = BAND.radiance(BAND.temperature(image().radiance) + kelvins)
    return Measurement.from_radiance(radiance, BAND, np.zeros(1), RASTER)


@pytest.mark.parametrize(
    ("cause", "stated", "changed"),
    [
        (
            "emissivity",
            {"emissivity": em.EmissivityLine.constant(0.42, 1e-4)},
            {"emissivity": em.EmissivityLine.constant(0.4199)},
        ),
        (
            "reflected",
            {"surroundings": em.reflected_temperature(ROOM, 0.01)},
            {"surroundings": em.reflected_temperature(ROOM - 0.01)},
        ),
        ("calibration", {"seen": of_gain(1.0, 1e-4)}, {"seen": of_gain(1.0001)}),
        ("calibration", {"camera_uncertainty": 0.1}, {"seen": hotter(0.1)}),
    ],
)
def test_a_part_of_the_uncertainty_is_that_of_a_small_change(cause, stated, changed):
    """It is the change of the result when its cause changes by its uncertainty."""

    def found(seen=None, emissivity=KNOWN, surroundings=None, **more):
        seen = [image()] if seen is None else [seen]
        around = surroundings or em.reflected_temperature(ROOM)
        return em.true_temperature(seen, WHOLE, emissivity, around, **more).estimate

    change = found(**changed).values - found().values
    # To first order; 2e-4 was seen.
    assert found(**stated).contribution(cause) == pytest.approx(change, rel=1e-3)


def test_cold_surroundings_are_part_of_the_uncertainty():
    """Below 200 K a band has no table; what is reflected there counts as elsewhere."""
    known = em.EmissivityLine.constant(0.05)
    cold, warmer = (
        true_of(known, around, emissivity=0.05, kelvins=330.0, reflected=190.0).estimate
        for around in (em.reflected_temperature(190.0, 1.0), em.reflected_temperature(191.0))
    )
    assert cold.values == pytest.approx(330.0, abs=SOLVED)
    change = cold.values - warmer.values
    # At 190 K the radiance rises by 9 % per kelvin: half of that is the second order.
    assert cold.contribution("reflected") == pytest.approx(change, rel=0.045)
    assert cold.standard_uncertainty == pytest.approx(cold.contribution("reflected"))


def test_few_images_widen_the_interval():
    images = [image(drift=2.0, seed=seed) for seed in range(3)]
    found = em.true_temperature(images, WHOLE, KNOWN).estimate
    # Three repetitions, two degrees of freedom: Student's 4.3.
    assert found.degrees_of_freedom == pytest.approx(2.0)
    # Half of the last digit.
    assert found.coverage_factor() == pytest.approx(4.303, abs=5e-4)
    alone = em.true_temperature(images[:1], WHOLE, KNOWN).estimate
    assert np.isnan(alone.contribution("repeatability"))


def test_an_uncertain_emissivity_has_an_asymmetric_interval():
    found = em.true_temperature([image()], WHOLE, em.EmissivityLine.constant(0.42, 0.08))
    # The temperature falls with the emissivity, so quantiles are those of the emissivity.
    ends = 0.42 - 0.08 * 1.959964, 0.42 + 0.08 * 1.959964
    radiance = BAND.radiance(np.array([HOT, ROOM]))
    high, low = (
        float(BAND.temperature(radiance[1] + 0.42 / end * (radiance[0] - radiance[1])))
        for end in ends
    )
    # The interval is stable to half a unit of the second digit of u, here 0.5 K.
    assert (found.distribution.low, found.distribution.high) == pytest.approx((low, high), abs=1.0)
    assert not found.distribution.validates(found.estimate)
    exact = em.true_temperature([image()], WHOLE, em.EmissivityLine.constant(0.42, 0.005))
    assert exact.distribution.validates(exact.estimate)


def test_errors_that_emissivity_and_image_share_cancel():
    """At the temperature of the heating itself, only the thermocouple's error is left."""
    calibration = fitted(common=1.0)
    heated = developed(calibration, HEATING.reference, 0.42)
    emissivity = em.determine_emissivity([heated], HEATING).of(WHOLE).line
    found = em.true_temperature([heated], WHOLE, emissivity, calibration=calibration)
    assert found.estimate.values == pytest.approx(HEATING.reference, abs=SOLVED)
    assert found.correlation == pytest.approx(1.0)
    assert found.estimate.contribution("calibration") == pytest.approx(0.0, abs=SOLVED)
    # Differences of second order in the 5 K of the surroundings.
    assert found.estimate.contribution("reflected") == pytest.approx(0.0, abs=1e-3)
    # Differences of second order in 2 K of 664 K: 1e-4.
    assert found.estimate.contribution("reference") == pytest.approx(
        HEATING.reference_uncertainty, rel=2e-4
    )
    apart = em.true_temperature([heated], WHOLE, emissivity)
    assert apart.correlation is None
    assert apart.estimate.contribution("calibration") > 0.5
    elsewhere = em.true_temperature(
        [heated], WHOLE, emissivity, em.reflected_temperature(ROOM, 5.0), calibration
    )
    assert elsewhere.estimate.contribution("reflected") > 0.01


def test_stated_intervals_hold_the_truth():
    """Of 200 laboratories with all errors drawn, 95 % of the intervals hold the truth.

    Between 181 and 199 of 200 are within with a probability of 0.998.
    """
    generator = np.random.default_rng(7)
    within = 0
    scores = []
    for _ in range(200):
        calibration = fitted(generator, common=0.5)
        room = ROOM + generator.normal(0.0, HEATING.reflected_uncertainty)
        oven = HEATING.reference + generator.normal(0.0, HEATING.reference_uncertainty)
        seed = int(generator.integers(1 << 30))
        heated = developed(calibration, oven, 0.42, 4, 5.0, seed, room)
        hot = developed(calibration, HOT, 0.42, 4, 5.0, seed + 1, room)
        emissivity = em.determine_emissivity([heated], HEATING).of(WHOLE).line
        found = em.true_temperature([hot], WHOLE, emissivity, calibration=calibration)
        within += abs(found.estimate.values - HOT) <= found.estimate.expanded_uncertainty()
        scores.append((found.estimate.values - HOT) / found.estimate.standard_uncertainty)
    assert 181 <= within <= 199
    # The standard deviation of 200 standard normal numbers is within 0.85 to 1.15 (3 sigma).
    assert 0.85 < np.std(scores) < 1.15


@pytest.mark.parametrize(("stated", "least", "most"), [(None, 0.0, 0.8), (0.01, 0.9, 1.0)])
def test_a_drift_between_recordings_is_held_if_it_is_stated(stated, least, most):
    """1 % from the recording of the emissivity to that of the hot chip, of 60 repeats."""
    generator, within = np.random.default_rng(1), 0
    heating = replace(HEATING, drift=stated)
    for seed in range(60):
        ends = zip((HEATING.reference, HOT), 1 + 0.01 * generator.standard_normal(2), strict=True)
        heated, hot = (
            Measurement.from_radiance(
                drifted * image(0.42, kelvins, noise=5.0, seed=seed).radiance,
                BAND,
                np.zeros(1),
                RASTER,
            )
            for kelvins, drifted in ends
        )
        read = replace(heating, reference=HEATING.reference + 0.5 * generator.standard_normal(),
                       reference_uncertainty=0.5, reflected_uncertainty=0.0)  # fmt: skip
        row = em.determine_emissivity([heated], read).of(WHOLE)
        found = em.true_temperature([hot], WHOLE, row.line, drift=stated)
        within += abs(found.estimate.values - HOT) < found.estimate.expanded_uncertainty()
    assert least <= within / 60 <= most
    assert np.isnan(row.estimate.contribution("drift")) is np.bool_(stated is None)


def test_several_recordings_show_the_drift_themselves():
    images = [image(0.42, HEATING.reference, noise=1.0, seed=k) for k in range(4)]
    shown = [
        Measurement.from_radiance(f * one.radiance, BAND, np.zeros(1), RASTER)
        for f, one in zip((0.97, 0.99, 1.01, 1.03), images, strict=True)
    ]
    row = em.determine_emissivity(shown, HEATING).of(WHOLE)
    assert row.estimate.contribution("drift") == 0.0
    # 0.0258 has three digits; the noise of a frame adds less than 1 %.
    assert row.estimate.contribution("repeatability") == pytest.approx(0.42 * 0.0258 / 2, rel=0.02)
    more = em.determine_emissivity(shown, replace(HEATING, drift=0.1)).of(WHOLE)
    # A tenth of the radiance over the root of four, of which the repeatability holds a part.
    together = np.hypot(
        more.estimate.contribution("drift"), more.estimate.contribution("repeatability")
    )
    # The factors of the images have a mean of 1, and their noise adds less than 1 %.
    assert together == pytest.approx(0.1 * 0.42 / 2, rel=0.02)


def own(line):
    """Emissivity of a constant line."""
    return line.at(line.middle).reshape()


# A line over the temperature

SLOPE = 4e-4
HEATED = (600.0, 700.0, 800.0)


def on_the_line(kelvins, slope=SLOPE):
    return 0.42 + slope * (kelvins - 700.0)


def rows_of_line(slope=SLOPE, temperatures=HEATED, **errors):
    """Areas of an object whose emissivity is on a line, at several temperatures."""
    for kelvins in temperatures:
        heated = image(on_the_line(kelvins, slope), kelvins)
        found = em.determine_emissivity([heated], replace(HEATING, reference=kelvins, **errors))
        yield found, found.of(WHOLE)


def line_of(*arguments, **more):
    return em.emissivity_line([row.line for _, row in rows_of_line(*arguments, **more)])


@pytest.mark.parametrize("kelvins", [650.0, 823.0, 1000.0])
@pytest.mark.parametrize("slope", [-4e-4, 0.0, 4e-4])
def test_a_line_is_taken_at_the_temperature_that_is_found(slope, kelvins):
    seen = image(on_the_line(kelvins, slope), kelvins)
    found = em.true_temperature([seen], WHOLE, line_of(slope))
    assert found.estimate.values == pytest.approx(kelvins, abs=SOLVED)
    # A slope of 4e-4/K over the temperature.
    assert found.emissivity == pytest.approx(on_the_line(kelvins, slope), abs=4e-4 * SOLVED)
    # Half a unit of the second digit at most; with a constant emissivity u is 12 % or more off.
    assert found.distribution.standard_uncertainty == pytest.approx(
        found.estimate.standard_uncertainty, rel=0.05
    )


@pytest.mark.parametrize("kelvins", [700.0, 900.0])
def test_the_budget_by_a_line_is_that_of_small_changes(kelvins):
    seen = image(on_the_line(kelvins), kelvins)
    line = line_of(reference_uncertainty=2.0, reflected_uncertainty=0.0)
    found = em.true_temperature([seen], WHOLE, line)
    shifted = []
    for sign in (-1.0, 1.0):
        # The same images, by someone whose thermocouple is 2 K off.
        rows = [
            em.determine_emissivity(
                [image(on_the_line(one), one)], replace(HEATING, reference=one + 2.0 * sign)
            )
            .of(WHOLE)
            .line
            for one in HEATED
        ]
        shifted.append(em.true_temperature([seen], WHOLE, em.emissivity_line(rows)).estimate.values)
    # Terms of second order in 2 K of 700 K are some 1e-5 of the first.
    assert found.estimate.effect("reference") == pytest.approx(
        (shifted[1] - shifted[0]) / 2, rel=1e-3
    )


def test_a_line_comes_back_from_its_file_with_its_covariance(tmp_path):
    maps, rows = zip(*rows_of_line(drift=0.01, reference_uncertainty=2.0), strict=True)
    line = em.emissivity_line([row.line for row in rows])
    em.write_emissivity(em.RegionEmissivities(maps, tuple((r,) for r in rows)), tmp_path / "e.nc")
    stored = em.read_emissivity_lines(tmp_path / "e.nc")["chip"]
    assert stored.heatings == tuple(replace(one, drift=None) for one in line.heatings)
    np.testing.assert_allclose(stored.estimate.values, line.estimate.values, rtol=DOUBLE)
    np.testing.assert_allclose(
        stored.estimate.covariance(), line.estimate.covariance(), rtol=DOUBLE
    )
    difference = stored.estimate - line.estimate
    assert difference.standard_uncertainty == pytest.approx(0.0, abs=DOUBLE)
    assert stored.estimate.warnings == line.estimate.warnings


def test_regions_in_a_file_correlate_as_obsarray_says(tmp_path):
    """Means of two regions, as anyone reads them who knows obsarray's attributes."""
    left = np.broadcast_to(np.arange(RASTER.columns) < 20, RASTER.shape)
    halves = [Area("left", "left", left, True), Area("right", "right", ~left, True)]
    values = np.where(halves[0].mask, 0.42, 1.05)
    heating = replace(HEATING, drift=0.01, camera_uncertainty=1.0)
    found = em.determine_emissivity([measured(values, HEATING.reference, ROOM, frames=5)], heating)
    rows = [found.of(area) for area in halves]
    em.write_emissivity(em.RegionEmissivities((found,), (tuple(rows),)), tmp_path / "e.nc")
    with xr.open_dataset(tmp_path / "e.nc", engine="h5netcdf") as data:
        estimate = from_xarray(data.load(), "region_mean")
    expected = Estimate.stack([row.estimate for row in rows])
    np.testing.assert_allclose(estimate.covariance(), expected.covariance(), rtol=DOUBLE)
    # A hotter room makes a grey surface darker, and one that is over 1 brighter.
    stored = em.read_emissivity_lines(tmp_path / "e.nc")
    signs = [np.sign(own(one).effect("reflected")) for one in stored.values()]
    assert signs == [-1.0, 1.0]
    both = own(stored["left"]) - rows[0].estimate
    assert both.standard_uncertainty == pytest.approx(0.0, abs=DOUBLE)


def test_two_temperatures_by_one_emissivity_have_its_errors_in_common():
    emissivity = em.EmissivityLine.constant(0.42, 0.05)
    one, other = (
        em.true_temperature([image(seed=n)], WHOLE, emissivity).estimate for n in range(2)
    )
    assert (one - other).standard_uncertainty < 1e-6 * one.standard_uncertainty


def test_doubts_are_warnings(tmp_path):
    half = np.where(np.arange(RASTER.columns) < 20, HOT, HOT + 300.0)
    uneven = measured(np.full(RASTER.shape, 0.42), reference=HOT)
    uneven.data["radiance"].values[:] = 0.42 * BAND.radiance(half) + 0.58 * BAND.radiance(ROOM)
    found = em.true_temperature([uneven], WHOLE, em.EmissivityLine.constant(0.42, 0.01))
    assert any("is uneven" in warning for warning in found.estimate.warnings)
    flags = np.zeros((1, *RASTER.shape), np.uint8)
    flags[:, :, :10] = Flag.SATURATED
    found = em.true_temperature([image(flags=flags)], WHOLE, KNOWN)
    assert found.used.left_out == 300
    told = "300 of 1200 pixels are left out (300 saturated)"
    assert told in " ".join(found.estimate.warnings)
    assert em.true_temperature([image()], WHOLE, KNOWN).estimate.warnings == ()
    # Those of the emissivity travel to the temperature, also through its file.
    found = em.determine_emissivity([image(kelvins=HEATING.reference, flags=flags)], HEATING)
    em.write_emissivity(em.RegionEmissivities((found,), ((found.of(WHOLE),),)), tmp_path / "e.nc")
    stored = em.read_emissivity_lines(tmp_path / "e.nc")["chip"]
    (warning,) = em.true_temperature([image()], WHOLE, stored).estimate.warnings
    assert warning.startswith("Emissivity: chip: 300 of 1200 pixels are left out")


def true_of(line=KNOWN, surroundings=None, **more):
    return em.true_temperature([image(**more)], WHOLE, line, surroundings)


# The command


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "regions.yaml").write_text(REGIONS)
    write_measurement(measured(table_1(), reference=HOT), tmp_path / "hot.nc")
    return tmp_path


def said(options, file="hot.nc", regions="regions.yaml"):
    """What the command prints, without the breaks of its lines."""
    return words(typed(f"temperature {file} --regions {regions} --emissivity {options}").output)


def test_the_command_prints_what_it_found_and_assumed(folder):
    output = said("0.42")
    assert "body left" in output
    assert "Assumed: The emissivity is exact" in output
    assert "Assumed: The object reflects 293 K exactly" in output
    around = "--reflected '20 degC' --reflected-uncertainty '1 K'"
    output = said(f"0.42 --emissivity-uncertainty 0.01 {around} --table table.csv")
    assert "exact (--emissivity" not in output
    assert "reflects" not in output
    assert (folder / "table.csv").read_text().count("\n") == 5


def write_lines(maps, rows):
    """Write e.nc, in which each of the regions has the emissivity of the rows."""
    names = ("body left", "body right", "shear band 1", "shear band 2")
    tables = tuple(tuple(replace(row, name=name) for name in names) for row in rows)
    em.write_emissivity(em.RegionEmissivities(tuple(maps), tables), "e.nc")


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("temperatures", "range_", "doubtful"),
    [
        ((HEATING.reference,), "391 °C; u does not", True),
        ((HOT - 20.0,), "580 °C; u does not", False),
        ((560.0, 660.0), "287 °C to 387 °C", True),
        ((800.0, 900.0), "527 °C to 627 °C", False),
    ],
)
def test_an_emissivity_of_other_temperatures_is_doubtful(temperatures, range_, doubtful):
    """The samples' chip at 570 °C with the emissivity of 391 °C is read 18 K too hot."""
    write_lines(*zip(*rows_of_line(0.0, temperatures), strict=True))
    output = said("e.nc")
    one = len(temperatures) == 1
    assert ("The emissivity is the same at all temperatures" in output) is one
    assert ("The emissivity is a straight line over the temperature" in output) is not one
    assert (f"K away, at {range_}" in output) is doubtful


def test_a_region_without_emissivity_and_another_band_are_warned_about(folder):
    write_lines(*zip(*rows_of_line(0.0, HEATED), strict=True))
    more = REGIONS + "  another: {rectangle: [[2, 2], [6, 6]]}\n"
    (folder / "more.yaml").write_text(more)
    output = said("e.nc", regions="more.yaml")
    assert "Warning: another: left out, as no known emissivity" in output
    assert "Emissivities measured in" not in output
    with xr.open_dataset(folder / "hot.nc", engine="h5netcdf") as data:
        other = data.load()
    other.attrs |= {"band_lower": 3e-6, "band_upper": 5e-6}
    write_measurement(Measurement(other), folder / "other.nc")
    expected = "Warning: Emissivities measured in 3.8 µm to 5.1 µm are taken to hold in"
    assert expected in said("e.nc", "other.nc")


def test_temperatures_of_regions_are_drawn_with_their_intervals():
    emissivity = em.EmissivityLine.constant(0.42, 0.02)
    left, right = Polygon.rectangle((0, 0), (9, 30)), Polygon.rectangle((20, 0), (29, 30))
    regions = [Region("a", left), Region("b", right)]
    found = em.true_temperatures([image()], regions, emissivity)
    axes = on_given_axes(found)
    names, true = points_of(axes, "true temperature, 95 % interval")
    assert list(names) == ["a", "b"]
    frame = found.to_frame()
    np.testing.assert_allclose(true, frame.true_temperature_K - CELSIUS)
    _, radiance = points_of(axes, "radiance temperature")
    np.testing.assert_allclose(radiance, frame.radiance_temperature_K - CELSIUS)
    (bars,) = axes.containers
    low, high = (line.get_ydata() for line in bars.lines[1])
    np.testing.assert_allclose(low, frame.low_K - CELSIUS)
    np.testing.assert_allclose(high, frame.high_K - CELSIUS)
    assert on_new_axes(found).get_ylabel() == "temperature / °C"
    columns, rows, sentences = in_a_notebook(found)
    assert columns == list(frame.columns)
    assert [row[0] for row in rows] == ["a", "b"]
    assert sentences == [*found.notes.warnings, *found.notes.assumed]
