"""From a camera's file to a measurement's: descriptions, calibration files, commands."""

import re
from dataclasses import replace
from pathlib import Path

import camera_files
import numpy as np
import pytest
import yaml
from analytic_chip import AnalyticChip
from command import run, settings_of
from PIL import Image
from tolerances import SINGLE

from chipglow.camera import (
    DeadElements,
    Detector,
    EnergyResponse,
    Flag,
    GainPattern,
    LinearCalibration,
    OffsetPattern,
    ReadNoise,
    Recording,
    SakumaHattori,
)
from chipglow.io import file_kind, read_measurement, write_measurement, write_scene
from chipglow.io.cameras import write_hcc
from chipglow.io.column_file import POINT_COLUMNS, read_bad_pixels, read_response, read_table
from chipglow.laboratory.recordings import (
    CalibrationDescription,
    MeasurementDescription,
    calibration_text,
    fit_calibration,
    load_calibration,
    load_description,
    load_measurement,
    measurement_text,
    uniform_counts,
)
from chipglow.laboratory.recordings.radiometric_calibration import calibrate_recording
from chipglow.radiometry import Band, TabulatedResponse
from chipglow.scene import ToolGeometry
from chipglow.text import DescriptionError

BAND = Band(3.8e-6, 5.1e-6)
SHAPE = (30, 40)
CELSIUS = np.arange(300.0, 1001.0, 100.0)
TEMPERATURE_UNCERTAINTY, COUNT_UNCERTAINTY = 0.3, 1.0
DETECTOR = Detector(
    response=EnergyResponse(1.8),
    gain=1.0,
    bits=14,
    terms=(GainPattern(0.03), DeadElements(0.003), OffsetPattern(20.0), ReadNoise(3.0)),
)
KELVINS = ["unit=K", "scale=0.05", "offset=300"]
"""With them the counts would be possible temperatures."""
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
TRUTH = 700.0 + 450.0 * np.exp(-((X - 20) ** 2 + (Y - 15) ** 2) / 100.0)
FIELDS = {
    "file": "chip.npy",
    "unit": "counts",
    "interval": "2 ms",
    "pitch": "6 um",
    "tip": [20.0, 30.0],
    "calibration": "calibration.yaml",
    "saturation": 16382.0,
    "bad_pixels": "find",
    "flat_field": {"low": "cold.npy", "high": "hot.npy"},
}


def seen(kelvins, count, rng):
    frames = np.broadcast_to(BAND.radiance(np.asarray(kelvins, np.float64)), (count, *SHAPE))
    return DETECTOR.counts(frames, rng).astype(np.uint16)


def points_text(rng):
    """Blackbodies whose true temperature differs from the noted one; the image's median."""
    lines = ["temperature_degC,counts,count_uncertainty,temperature_uncertainty_K"]
    for celsius in CELSIUS:
        true = celsius + 273.15 + rng.normal(0.0, TEMPERATURE_UNCERTAINTY)
        counts = np.median(seen(true, 4, rng))
        lines.append(f"{celsius:g},{counts:.3f},{COUNT_UNCERTAINTY},{TEMPERATURE_UNCERTAINTY}")
    return "\n".join(lines) + "\n"


def fill(folder, seed=1):
    """Files of a laboratory: blackbodies, uniform frames, a chip, a description of it all."""
    rng = np.random.default_rng(seed)
    (folder / "points.csv").write_text(points_text(rng))
    np.save(folder / "cold.npy", seen(623.15, 20, rng))
    np.save(folder / "hot.npy", seen(1123.15, 20, rng))
    np.save(folder / "chip.npy", seen(TRUTH, 5, rng))
    (folder / "chip.yaml").write_text(yaml.safe_dump(FIELDS))


def calibrate_points(folder):
    table, _ = read_table(folder / "points.csv", POINT_COLUMNS)
    fit = fit_calibration(
        LinearCalibration,
        table["temperature"], table["counts"], BAND,
        table["count_uncertainty"], table["temperature_uncertainty"], integration_time=1e-5,
    )  # fmt: skip
    (folder / "calibration.yaml").write_text(calibration_text(CalibrationDescription.of(fit)))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    fill(folder)
    calibrate_points(folder)
    return folder


@pytest.fixture
def laboratory(made, monkeypatch):
    """The folder with the files; tests write elsewhere."""
    monkeypatch.chdir(made)
    return made


# Files


def test_a_calibration_comes_back_from_its_file(tmp_path):
    kelvins = CELSIUS + 273.15
    response = TabulatedResponse((3.8e-6, 4.4e-6, 5.1e-6), (0.5, 1.0, 0.7))
    band = Band(*response.limits, response)
    for kind in (LinearCalibration, SakumaHattori):
        counts, said = 400.0 + 2.0 * band.radiance(kelvins), (1.0, 0.3, 0.5)
        fit = fit_calibration(
            kind, kelvins, counts, band, *said, integration_time=1e-5, range_name="A"
        )
        text = calibration_text(CalibrationDescription.of(fit))
        (tmp_path / "calibration.yaml").write_text(text)
        again, first = load_calibration(tmp_path / "calibration.yaml"), fit.calibration
        assert type(again) is type(first)
        np.testing.assert_array_equal(again.parameters, first.parameters)
        np.testing.assert_array_equal(again.covariance, first.covariance)
        limits = (first.lowest, first.highest, 1e-5, "A")
        assert (again.lowest, again.highest, again.integration_time, again.range) == limits
        np.testing.assert_allclose(again.band.response.wavelengths, response.wavelengths)


FALLING = {
    "model": "sakuma-hattori",
    "parameters": {"offset": 0.0, "A": -4e-6, "B": 1e-2, "C": 1e5},
    "covariance": np.eye(4).tolist(),
}


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"model": "cubic"}, "model: 'cubic', expected"),
        ({"parameters": {"offset": 1.0}}, "parameters: offset, expected offset, gain"),
        ({"parameters": {"offset": 1.0, "gain": -2.0}}, "gain is -2"),
        ({"covariance": [[1.0, 0.0], [0.0]]}, "covariance: rows are of different lengths"),
        ({"lowest": "2000 degC"}, "lowest is 2273.15 K and highest"),
        ({"response": [[3.8, 1.0, 2.0]]}, "response.0: .*, expected .* at most 2"),
        ({"band": "5.1-3.8 um"}, "reversed"),
        ({"colour": 1}, "unknown key 'colour'"),
        (FALLING, "counts fall with the temperature"),
    ],
)
def test_an_impossible_calibration_file_is_one_clear_error(laboratory, tmp_path, fields, message):
    described = yaml.safe_load((laboratory / "calibration.yaml").read_text())
    (tmp_path / "bad.yaml").write_text(yaml.safe_dump({**described, **fields}))
    with pytest.raises(DescriptionError, match=message) as caught:
        load_calibration(tmp_path / "bad.yaml")
    assert str(caught.value).startswith("bad.yaml: ")
    assert "\n" not in str(caught.value)


def test_tables_are_read_with_their_units(tmp_path):
    table = tmp_path / "table.csv"
    table.write_text(
        "counts,temperature_degF,temperature_uncertainty_degF\n10,1112,1.8\n\n20,212,9\n"
    )
    read, _ = read_table(table, POINT_COLUMNS)
    assert read["temperature"] == pytest.approx([873.15, 373.15])
    assert read["temperature_uncertainty"] == pytest.approx([1.0, 5.0])
    assert read["counts"].tolist() == [10.0, 20.0]
    table.write_text("temperature_degC;counts\n600,5;1000\n700;2000\n")
    assert read_table(table, POINT_COLUMNS)[0]["temperature"] == pytest.approx([873.65, 973.15])
    table.write_text("wavelength_nm,response\n5000,0.5\n4000,1\n")
    assert read_response(table).wavelengths == pytest.approx((4e-6, 5e-6))
    table.write_text("column,row\n3,0\n")
    assert np.argwhere(read_bad_pixels(table, (2, 4))).tolist() == [[0, 3]]
    with pytest.raises(ValueError, match=r"pixel 3,0 is not in the image, expected .* 3 x 2"):
        read_bad_pixels(table, (2, 3))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no number in it"),
        ("temperature_degC,counts\n", "no number in it"),
        ("temperature,counts\n1,2\n", "line 1: 'temperature' has no unit, expected .*_degC"),
        ("temperature_K;counts\n1,234;2\n", "line 2, column 1: .* may be the decimal mark"),
        ("temperature_K;counts\n1.234;2.345\n", "the decimal mark is not certain"),
        ("temperature_um,counts\n1,2\n", "line 1: unknown unit 'um'"),
        ("temperature_K,colour\n1,2\n", "line 1: unknown column 'colour'"),
        ("temperature_K\n1\n", "expected a column 'counts', once"),
        ("temperature_K,counts,counts\n1,2,3\n", "expected a column 'counts', once"),
        ("temperature_K,counts\n1,2\n3\n", "line 3: has 1 cell separated by ',', expected 2"),
        ("temperature_K,counts\n1,nan\n", "line 2: counts is 'nan', expected a number"),
        ("temperature_K,counts\n1,two\n", "line 2"),
    ],
)
def test_a_table_that_is_none_is_one_clear_error(tmp_path, text, message):
    table = tmp_path / "table.csv"
    table.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_table(table, POINT_COLUMNS)
    assert str(caught.value).startswith(str(table))


# Descriptions


def test_a_description_is_read_back_from_its_text(tmp_path):
    for described in (
        MeasurementDescription(**FIELDS, band="3.8-5.1 um"),
        MeasurementDescription(),
    ):
        (tmp_path / "chip.yaml").write_text(measurement_text(described))
        assert load_description(tmp_path / "chip.yaml") == described


# The last two are not hours and minutes.
@pytest.mark.parametrize(
    ("text", "chosen"),
    [
        ("none", None),
        ("::10", slice(None, None, 10)),
        ("3:7:2", slice(3, 7, 2)),
        ("4:8", slice(4, 8)),
        ("10:20", slice(10, 20)),
    ],
)
def test_frames_are_chosen_as_in_python(text, chosen, tmp_path):
    (tmp_path / "chip.yaml").write_text(f"file: chip.hcc\nframes: {text}\n")
    for settings in ([], [f"frames={text}"]):
        assert load_description(tmp_path / "chip.yaml", settings).chosen_frames() == chosen


def test_the_measurement_holds_the_truth_within_its_uncertainty(laboratory):
    measured = load_measurement("chip.yaml")
    assert measured.times == pytest.approx(2e-3 * np.arange(5))
    # In m: far below a pixel.
    assert measured.raster.extent == pytest.approx((-120e-6, 120e-6, 0.0, 180e-6), abs=1e-12)
    dead = DETECTOR.terms[1].mask(SHAPE, DETECTOR.seed)
    assert dead.any()
    np.testing.assert_array_equal((measured.flags[0] & Flag.REPLACED) != 0, dead)


def test_pixels_that_are_replaced_are_not_called_saturated():
    stuck = np.zeros((6, 8), bool)
    stuck[[2, 4], [3, 6]] = True
    signal = np.full((2, 6, 8), 900, np.uint16)
    signal[:, stuck] = 2**14 - 1
    recording = Recording(
        signal, "radiance", np.arange(2.0), camera="camera", band=BAND, pitch=6e-6
    )

    def doubts(signal, bad):
        made = calibrate_recording(replace(recording, signal=signal), bad_pixels=bad)
        return [text for text in made.notes.warnings if "may be saturated" in text]

    assert doubts(signal, stuck) == []
    assert len(doubts(signal, None)) == 1
    signal[:, 0, 0] = 2**14 - 1
    (text,) = doubts(signal, stuck)
    assert text.startswith("2 values are 16383")  # of one pixel in two frames


def test_a_camera_file_alone_with_settings(laboratory):
    settings = [f"{name}={yaml.safe_dump(value, default_flow_style=True, width=999).strip()}"
                for name, value in FIELDS.items() if name not in ("file", "tip")]  # fmt: skip
    settings = [setting.removesuffix("\n...") for setting in settings]
    direct, described = load_measurement("chip.npy", settings), load_measurement("chip.yaml")
    np.testing.assert_array_equal(direct.radiance, described.radiance)
    assert direct.raster.left == 0.0
    assert load_measurement("chip.npy", [*settings, "tip=20,30"]).raster == described.raster
    assert "lower left corner" in direct.data.attrs["assumed"]


def test_object_parameters_are_said_or_as_recorded(laboratory, tmp_path):
    shown = np.full((1, 4, 5), 900.0)
    np.save(tmp_path / "shown.npy", shown)
    settings = ["unit=K", "interval=1 ms", "pitch=6 um", "band=3.8-5.1 um"]
    plain = load_measurement(tmp_path / "shown.npy", settings)
    # The inverse of Planck's law: 2e-10 K.
    np.testing.assert_allclose(plain.radiance_temperature(), 900.0, rtol=0, atol=1e-9)
    told = load_measurement(tmp_path / "shown.npy", [*settings, "object_parameters.emissivity=0.5"])
    expected = 0.5 * BAND.radiance(900.0) + 0.5 * BAND.radiance(293.15)
    np.testing.assert_allclose(told.radiance, expected, rtol=SINGLE)
    assert "emissivity 0.5" in told.data.attrs["object_parameters"]


@pytest.mark.parametrize(("band", "warned"), [("3.8-5.1 um", False), ("3-5 um", True)])
def test_a_band_that_the_file_states_is_compared_with_the_calibrations(
    laboratory, tmp_path, band, warned
):
    (tmp_path / "chip.ptw").write_bytes(camera_files.ptw(camera_files.pictures()))
    described = yaml.safe_load((laboratory / "calibration.yaml").read_text())
    (tmp_path / "cal.yaml").write_text(yaml.safe_dump({**described, "band": band}))
    settings = ["pitch=6 um", "integration_time=10 us", f"calibration={tmp_path / 'cal.yaml'}"]
    attributes = load_measurement(tmp_path / "chip.ptw", settings).data.attrs
    warnings = attributes.get("warnings", "")
    assert (
        "The file states a band of 3.8-5.1 um, the calibration is for 3-5" in warnings
    ) == warned


def test_a_response_takes_the_place_of_limits(tmp_path):
    np.save(tmp_path / "shown.npy", np.full((1, 4, 5), 900.0))
    (tmp_path / "response.csv").write_text("wavelength_um,response\n3,0\n4,1\n5,0\n")
    settings = ["unit=K", "interval=1 ms", "pitch=6 um", f"band={tmp_path / 'response.csv'}"]
    measured = load_measurement(tmp_path / "shown.npy", settings)
    assert (measured.band.lower, measured.band.upper) == pytest.approx((3e-6, 5e-6))
    assert measured.radiance[0, 0, 0] < 0.6 * Band(3e-6, 5e-6).radiance(900.0)


def test_a_measurement_is_read_as_it_is(laboratory, tmp_path):
    measured = load_measurement("chip.yaml")
    write_measurement(measured, tmp_path / "measured.nc")
    assert file_kind(tmp_path / "measured.nc") == "measurement"
    again = load_measurement(tmp_path / "measured.nc")
    np.testing.assert_array_equal(again.radiance, measured.radiance)
    with pytest.raises(ValueError, match="--set: 'pitch=6 um' describes nothing"):
        load_measurement(tmp_path / "measured.nc", ["pitch=6 um"])
    write_scene(AnalyticChip(frames=2).scene(), tmp_path / "scene.nc")
    with pytest.raises(ValueError, match=r"scene\.nc: is a scene, .* measure creates"):
        load_measurement(tmp_path / "scene.nc")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["pitch=none"], "chip.yaml: pitch: is missing"),
        (["calibration=none"], "chip.yaml: calibration: is missing"),
        (["integration_time=20 us"], "integration time of 10 us, the recording has 20 us"),
        (["band=3-5 um"], "band 3.8-5.1 um, the recording has 3-5 um"),
        (["band=3 to 5"], "band: '3 to 5' is not a band"),
        (["frames=one"], "frames: 'one', expected first:end"),
        (["flat_field.low=none"], "flat_field.low: is missing"),
        (["flat_field.high=cold.npy", "flat_field.low=hot.npy"], "second brighter"),
        (["flat_field.low=small.npy", "flat_field.high=none"], "pixels, expected 4 x 3"),
        (["flat_field.low=few.npy"], "2 frames, expected 8 or more"),
        (["saturation=5000"], "flat_field.high: .* saturated"),
        (["mirror=left"], "mirror: 'left', expected"),
        (["quarter_turns=5"], "quarter_turns: 5, expected 0 to 3"),
        (["tip=[1, 2, 3]"], "tip"),
        (["tip=10.5,a"], "tip"),
        (["object_parameters.emissivity=2"], "emissivity: 2, expected more than 0"),
        (["colour=red"], "unknown key 'colour'"),
        (["file=none"], "file: is missing"),
        ([*KELVINS, "calibration=none", "band=3-5 um"], "not linear in light"),
        ([*KELVINS, "flat_field={}", "bad_pixels=none"], "holds temperature, expected counts"),
    ],
)
def test_what_cannot_be_is_one_clear_error(laboratory, settings, message):
    np.save(laboratory / "small.npy", np.ones((20, 3, 4)))
    np.save(laboratory / "few.npy", np.load(laboratory / "cold.npy")[:2])
    with pytest.raises(ValueError, match=message) as caught:
        load_measurement("chip.yaml", settings)
    assert "\n" not in str(caught.value)


# Commands


def test_calibrate_prints_fits_and_writes_the_preferred(laboratory, tmp_path):
    out, plot = tmp_path / "calibration.yaml", tmp_path / "calibration.png"
    said = run(
        "calibrate", "points.csv", "--band", "3.8-5.1 um", "--model", "both", "--out", out,
        "--plot", plot, "--integration-time", "10 us", "--range", "A",
        "--common-uncertainty", "0.5 K",
    )  # fmt: skip
    assert "Preferred: linear" in said
    assert "degrees of freedom" in said
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert said.splitlines()[-2:] == [str(out), str(plot)]
    calibration = load_calibration(out)
    assert (calibration.integration_time, calibration.range) == (1e-5, "A")
    assert (calibration.lowest, calibration.highest) == pytest.approx((573.15, 1273.15))
    # Half a kelvin that all points have in common is there at every temperature.
    kelvins = np.array([700.0, 900.0, 1100.0])
    uncertainty = calibration.uncertainty(calibration.counts(kelvins)) / BAND.slope(kelvins)
    assert (uncertainty > 0.35).all()


def test_calibrate_says_what_is_doubtful(laboratory):
    (laboratory / "bare.csv").write_text("temperature_K,counts\n600,1000\n800,2500\n1000,5000\n")
    gray = ("--emissivity", "0.97", "--emissivity-uncertainty", "0.005")
    for arguments, sentences in (
        (
            ("points.csv", "--band", "2-2.5 um", "--out", "wrong.yaml"),
            (
                *("Warning: linear: The residuals are", "(common_uncertainty)"),
                *("The blackbody's emissivity is 1", "Assumed: The camera did not drift"),
            ),
        ),
        (("points.csv", "--band", "3.8-5.1 um", *gray), ["The blackbody reflects 20 degC"]),
        (("bare.csv", "--band", "3.8-5.1 um"), ["Warning: The uncertainty is from the scatter"]),
    ):
        said = run("calibrate", *arguments)
        assert [one for one in sentences if one not in said] == []
    # It is in the file, and said wherever the calibration is used.
    assert any("chi-squared" in one for one in load_calibration("wrong.yaml").warnings)
    given = ["unit=counts", "interval=1 ms", "pitch=6 um", "calibration=wrong.yaml"]
    assert "Warning: Calibration: The residuals" in run("convert", "chip.npy", *settings_of(given))


def test_convert_makes_a_measurement_and_says_what_it_assumed(laboratory, tmp_path):
    out = tmp_path / "measured.nc"
    said = run("convert", "chip.yaml", "--out", out, "--set", "tip=none")
    assert said.startswith("The file with your settings:")
    for words in ("counts as uint16", "5 of 40 x 30 pixels", "replaced by neighbours",
                  "standard uncertainty", "Assumed: The origin of coordinates"):  # fmt: skip
        assert words in said
    assert read_measurement(out).data.attrs["calibration"].startswith("straight line")
    assert "already a measurement" in run("convert", out, code=2)


def test_what_is_assumed_and_doubtful_of_a_camera_s_file_is_said_by_who_takes_it(laboratory):
    counts = np.load("chip.npy")
    counts[:, 0, 0] = 65535
    np.save("clipped.npy", counts)
    (laboratory / "all.yaml").write_text(
        "regions: {all: {rectangle: [[10, 10], [30, 20]], feature: chip body}}"
    )
    (laboratory / "tool.yaml").write_text("{rake_angle: 0 deg, tip: [0 um, 0 um]}")
    Image.fromarray(np.zeros((60, 80), np.uint8)).save("visible.png")
    corners = ["5,5,10,11", "35,5,70,11", "35,25,70,51", "5,25,10,51"]
    head = "infrared_column,infrared_row,visible_column,visible_row"
    (laboratory / "corners.csv").write_text("\n".join([head, *corners]) + "\n")
    for command in (
        ["emissivity", "chip.yaml", "--reference", "900 degC", "--regions", "all.yaml"],
        ["rake", "chip.yaml", "--tool", "tool.yaml"],
        ["temperature", "chip.yaml", "--emissivity", "0.5", "--regions", "all.yaml"],
        ["register", "chip.yaml", "visible.png", "--points", "corners.csv"],
    ):
        said = run(*command, *settings_of(["file=clipped.npy", "saturation=none"]))
        assert said.count("Assumed: No pixel is saturated") == 1
        assert "Warning: 5 values are 65535" in said


@pytest.mark.usefixtures("laboratory")
def test_convert_only_looks_without_out():
    settings = settings_of(["unit=counts", "interval=1 ms"])
    said = run("convert", "chip.npy", *settings)
    assert "Settings are missing for a measurement. chip.npy: calibration: is missing" in said
    said = run("convert", "chip.npy", *settings, "--out", "never.nc", code=2)
    assert said.count("calibration: is missing") == 1
    said = run("convert", "chip.npy", "--out", "never.nc", code=2)
    assert said.count("\n") == 1
    for what in ("chip.npy", "unit: is missing", "give the interval", "pitch: is missing",
                 "calibration (of counts) or band: is missing"):  # fmt: skip
        assert what in said
    assert not Path("never.nc").exists()


def test_show_shows_a_measurement(laboratory, tmp_path):
    out, plot = tmp_path / "measured.nc", tmp_path / "measured.svg"
    measured = load_measurement("chip.yaml", ["lower_limit=450 degC"])
    write_measurement(measured.with_tool(ToolGeometry()), out)
    said = run("show", out, "--at", "4 ms", "--plot", plot)
    for words in (
        *("40 x 30 of 6 µm", "at 4000 µs", "below the lower range limit", "450 °C"),
        *("10 µs", "3.8 µm to 5.1 µm", "rake -7°"),
    ):
        assert words in said
    assert plot.read_text().startswith("<?xml")
    said = run("show", out, "--at", "1 s", code=2)
    assert "--at: 1000000 us is not in the measurement, expected 0 us to 8000 us" in said


def test_init_writes_the_description(tmp_path):
    path = tmp_path / "chip.yaml"
    run("init", path, "--measurement")
    assert load_description(path) == MeasurementDescription()
    assert "# The tip of the tool" in path.read_text()
    run("init", path, "--measurement", "--import", "--force", code=2)


# Recordings of blackbodies


CAMERA = ["unit=counts", "interval=2 ms", "saturation=16382"]
CORRECTED = [*CAMERA, "flat_field.low=cold.npy", "flat_field.high=hot.npy", "bad_pixels=find"]


def test_counts_of_a_black_body_are_those_of_corrected_sensors(laboratory):
    np.save("body.npy", seen(873.15, 12, np.random.default_rng(3)))
    cold, hot = (np.load(laboratory / name).mean(axis=0) for name in ("cold.npy", "hot.npy"))
    # Corrected pixels have the median pixel's offset and gain, here without any noise.
    expected = [np.median(cold), np.median(cold) + np.median(hot - cold)]
    for name, mean, level in (("cold.npy", cold, expected[0]), ("hot.npy", hot, expected[1])):
        # Rounding of counts of 1000.
        assert uniform_counts(name, CORRECTED)[0] == pytest.approx(level, abs=1e-9)
        assert uniform_counts(name, CAMERA)[0] == pytest.approx(mean.mean(), rel=1e-12)  # rounding
    # Straight between both: counts are linear in light.
    radiance = BAND.radiance(np.array([623.15, 873.15, 1123.15]))
    fraction = (radiance[1] - radiance[0]) / (radiance[2] - radiance[0])
    body, _ = uniform_counts("body.npy", CORRECTED)
    # Of 4096 pixels whose noise is one count: 0.015 measured.
    assert body == pytest.approx(expected[0] + fraction * (expected[1] - expected[0]), abs=0.05)


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ((0, 59029), None),
        ((5000, 59029), "10.00% of it is below the camera's range, expected a brighter object"),
        ((0, 5000), "90.00% of it is saturated, expected a darker object"),
    ],
)
def test_a_blackbody_outside_the_range_of_flirs_counts_is_refused(tmp_path, counts, message):
    image = np.full((40, 40), 9000, np.uint16)
    image[:4] = 3000
    path = tmp_path / "body.fff"
    path.write_bytes(camera_files.fff(image, counts=counts))
    if message is None:
        assert uniform_counts(path)[0] == pytest.approx(8400.0)
        return
    with pytest.raises(ValueError, match=re.escape(message)):
        uniform_counts(path)


def test_a_flat_field_below_the_range_of_the_recording_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    image = np.full((40, 40), 9000, np.uint16)
    (tmp_path / "chip.fff").write_bytes(camera_files.fff(image, counts=(5000, 59029)))
    (tmp_path / "cold.fff").write_bytes(camera_files.fff(image // 3, counts=(5000, 59029)))
    settings = ["band=7.5-13 um", "pitch=6 um", "flat_field.low=cold.fff"]
    with pytest.raises(ValueError, match=r"flat_field\.low: 100% of it is below the range"):
        load_measurement("chip.fff", settings)


def test_a_blackbody_before_a_background_is_refused_until_its_region_is_given(tmp_path):
    """A hot disc on a cold ground, as an aperture shows it: its gain would be a fifth."""
    y, x = np.mgrid[:64, :64]
    disc, rng = np.hypot(x - 31.5, y - 31.5) < 16, np.random.default_rng(3)
    lines, celsius = ["temperature_degC,file,counts"], (300.0, 400.0, 500.0, 600.0)
    counts = 500.0 + 5.0 * BAND.radiance(np.array(celsius) + 273.15)
    for one, level in zip(celsius, counts, strict=True):
        frames = rng.normal(np.where(disc, level, 520.0), 3.0, (4, 64, 64))
        np.save(tmp_path / f"{one:g}.npy", frames.round().astype(np.uint16))
        lines.append(f"{one:g},{one:g}.npy,")
    lines.append(f"350,,{500.0 + 5.0 * float(BAND.radiance(623.15)):.1f}")
    (tmp_path / "points.csv").write_text("\n".join(lines))
    given = [tmp_path / "points.csv", "--band", "3.8-5.1 um", *settings_of(CAMERA)]
    refused = " ".join(run("calibrate", *given, code=2).split())
    assert re.search(r"300\.npy: is not uniform, a part of it differs by \d+ counts", refused)
    out = tmp_path / "calibration.yaml"
    run("calibrate", *given, "--region", "22:42,22:42", "--out", out)
    # Means of rounded counts: 3e-5 measured.
    assert load_calibration(out).parameters == pytest.approx([500.0, 5.0], rel=1e-4)


@pytest.mark.parametrize(
    ("table", "settings", "message"),
    [
        ("nothing.csv", [], "nothing.csv"),
        ("chip.npy", [], "chip.npy: is not text"),
        ("temperature_degC,counts\n300,1000\n", [], "wrong.csv: calibration: 1 points"),
        ("temperature_degC,counts\n300,3\n400,5\n500,9\n", CAMERA, "--set: .* no recordings"),
        ("temperature_degC,file\n300,none.npy\n", CAMERA, "none.npy"),
        ("temperature_degC,file\n300,hot.npy\n", [*CAMERA[:2], "saturation=2000"], "saturated"),
        ("temperature_degC,file\n300,hot.npy\n", [*KELVINS, "interval=1 ms"], "expected counts"),
        ("temperature_degC,file\nhot,hot.npy\n", CAMERA, "line 2: temperature is 'hot', expected"),
        ("temperature_degC,file,counts\n300,hot.npy,3\n", CAMERA, "line 2: expected either"),
        ("temperature_degC,file,counts\n300,,\n", CAMERA, "line 2: expected either counts or"),
        ("temperature_degC,file,counts\n300,,many\n", CAMERA, "line 2: counts is 'many', expected"),
    ],
)
def test_a_table_of_no_black_bodies_is_one_clear_error(laboratory, table, settings, message):
    if "\n" in table:
        (laboratory / "wrong.csv").write_text(table)
        table = "wrong.csv"
    arguments = [table, "--band", "3.8-5.1 um", *settings_of(settings)]
    assert re.search(message, " ".join(run("calibrate", *arguments, code=2).split()))


def test_uniform_frames_of_another_format_say_themselves_what_they_are(tmp_path):
    """A recording without words of its own, and uniform frames of a camera that has them."""
    rng = np.random.default_rng(4)
    detector = replace(DETECTOR, terms=(ReadNoise(3.0),))
    counts = detector.counts(np.full((10, 8, 64), 500.0), rng)
    np.save(tmp_path / "chip.npy", counts.astype(np.uint16))
    write_hcc(
        tmp_path / "even.hcc",
        Recording(
            counts,
            "counts",
            np.arange(10) / 600.0,
            camera="camera",
            integration_time=1e-5,
            saturation=16382.0,
        ),
    )
    fields = [*CAMERA, f"flat_field.low={tmp_path / 'even.hcc'}"]
    # Half a count: counts are whole.
    assert uniform_counts(tmp_path / "chip.npy", fields)[0] == pytest.approx(
        np.median(counts), abs=0.5
    )
