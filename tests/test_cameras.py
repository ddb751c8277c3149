"""Files of cameras: what is read is what was there, and what is wrong is one clear error."""

import lzma
import struct
from functools import partial
from pathlib import Path

import camera_files as files
import h5py
import numpy as np
import pytest
import scipy.io
import tifffile
import xarray as xr
from hypothesis import given, settings, strategies as st
from PIL import Image
from tolerances import SINGLE

from chipglow.camera import Recording
from chipglow.io.cameras import read_recording, write_hcc
from chipglow.io.cameras.cine import _CURVE
from chipglow.io.cameras.formats import find_format, read_here
from chipglow.io.cameras.stacks import Stated
from chipglow.io.sources import SourceError

REFERENCE = Path(__file__).parent / "reference" / "flir"
PICTURES = files.pictures()


def jpeg_ls(image):
    return pytest.importorskip("imagecodecs").jpegls_encode(image)


def a_recording(signal=PICTURES, quantity="counts", **changed):
    known = {"times": np.arange(len(signal)) / 600, "integration_time": 30e-6, "saturation": 16382}
    return Recording(signal=signal, quantity=quantity, camera="any", **{**known, **changed})


def hcc(path):
    write_hcc(path, a_recording())
    return path.read_bytes()


def make(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return path


# FLIR


def test_a_frame_of_a_real_camera(tmp_path):
    path = tmp_path / "t420.fff"
    path.write_bytes(lzma.decompress((REFERENCE / "t420.fff.xz").read_bytes()))
    recording = read_recording(path)
    assert recording.signal.shape == (1, 240, 320)
    assert recording.camera == "FLIR T420 (with SC, serial number 62109905"
    assert recording.quantity == "counts"
    # Beside its counts the camera keeps the middle and the range that it shows, here 784 counts.
    assert abs(np.median(recording.signal) - 18044) < 0.05 * 784
    told = recording.object_parameters
    assert (told.emissivity, told.reflected, told.atmosphere) == pytest.approx(
        (0.95, 295.15, 292.15)
    )
    assert told.transmittance == 1  # an object at 0 m
    # A room, and the upper end of its range is 150 degC as it says elsewhere.
    temperature = recording.conversion.temperature(recording.signal)
    assert 295 < temperature.min() < temperature.max() < 302.5  # up to 302 K measured
    assert recording.conversion.temperature(recording.saturation) == pytest.approx(
        423.15, rel=SINGLE
    )
    assert "Frame 0 was taken at 2024-08-23 14:29:24.092+00:00." in recording.notes.remarks


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_sequence_of_flir(tmp_path, order):
    content = files.seq(PICTURES, order=order) + b"an index"
    recording = read_recording(make(tmp_path, "a.seq", content))
    assert recording.notes.warnings == ["8 bytes after the last frame are not a frame."]
    assert np.array_equal(recording.signal, PICTURES)
    assert recording.times == pytest.approx(files.STAMPS)
    assert vars(recording.conversion) == pytest.approx(files.PLANCK, rel=SINGLE)
    assert recording.saturation == 59029


def test_big_endian_counts_and_zeros_between_frames(tmp_path):
    one = partial(files.fff, pack=lambda image: image.astype(">u2").tobytes(), sort=1)
    content = bytes(100).join(one(PICTURES[n], files.STAMPS[n]) for n in range(3)) + bytes(64)
    recording = read_recording(make(tmp_path, "a.seq", content))
    assert np.array_equal(recording.signal, PICTURES[:3])


@pytest.mark.parametrize("swapped", [True, False])
def test_png_is_read_whatever_the_order_of_its_bytes(tmp_path, swapped):
    content = files.flir_jpeg(PICTURES[0], pack=partial(files.png, swapped=swapped))
    path = make(tmp_path, "a.jpg", content)
    recording = read_here(path, "flir", None, Stated())
    assert np.array_equal(recording.signal, PICTURES[:1])


@pytest.mark.parametrize("behind", [b"\1", b"F", b"FFF", b"FFF\0", bytes(9), b"FFF\0" + bytes(70)])
def test_bytes_behind_the_last_record_of_a_jpeg_are_no_frame(tmp_path, behind):
    recording = read_recording(make(tmp_path, "a.jpg", files.flir_jpeg(PICTURES[0], behind=behind)))
    assert np.array_equal(recording.signal, PICTURES[:1])
    assert recording.notes.warnings == []


@pytest.mark.parametrize(
    ("exif", "warned"), [(1, False), (3, True), (6, True), (None, False), (b"Exif\0\0?", False)]
)
def test_the_orientation_of_a_jpeg_is_a_warning(tmp_path, exif, warned):
    if not isinstance(exif, bytes):
        stated = Image.Exif()
        if exif is not None:
            stated[274] = exif
        exif = stated.tobytes()
    recording = read_recording(make(tmp_path, "a.jpg", files.flir_jpeg(PICTURES[0], exif=exif)))
    assert np.array_equal(recording.signal, PICTURES[:1])
    assert ["EXIF orientation" in text for text in recording.notes.warnings] == [True] * warned


@pytest.mark.parametrize(
    ("counts", "least", "saturation"),
    [
        ((7481, 59029), 7481, 59029),
        ((7481, 65535), 7481, None),
        ((0, 59029), None, 59029),
        ((0, 65535), None, None),
        ((0, 0), None, None),
        ((9000, 8000), None, None),
    ],
)
def test_limits_of_flirs_counts(tmp_path, counts, least, saturation):
    path = make(tmp_path, "a.fff", files.fff(PICTURES[0], counts=counts))
    recording = read_recording(path)
    assert (recording.least_signal, recording.saturation) == (least, saturation)
    assert recording.under_range().sum() == np.sum(PICTURES[0] < (least or 0))
    assert recording.saturated().sum() == np.sum(PICTURES[0] > (saturation or 65535))


def test_jpeg_ls_is_read_in_a_process_of_its_own(tmp_path):
    path = make(tmp_path, "a.csq", files.seq(PICTURES, pack=jpeg_ls))
    recording = read_recording(path, slice(1, 4))
    assert np.array_equal(recording.signal, PICTURES[1:4])
    assert recording.times == pytest.approx(files.STAMPS[1:4])
    assert recording.object_parameters.emissivity == pytest.approx(0.95)
    assert recording.conversion.b == pytest.approx(1420.1)


def test_the_air_takes_what_flirs_formula_says(tmp_path):
    recording = read_recording(make(tmp_path, "a.fff", files.fff(PICTURES[0])))
    # By hand: 2 m of air of 19 degC and 50 %, omega = 8.14, between 0.9 of a window.
    water = 0.5 * np.exp(1.5587 + 0.06939 * 19 - 2.7816e-4 * 19**2 + 6.8455e-7 * 19**3)
    alpha, beta = np.array([[0.006569, 0.01262], [-0.002276, -0.00667]])
    thick = np.sqrt(2) * (alpha + beta * np.sqrt(water))
    air = np.array([1.9, -0.9]) @ np.exp(-thick)
    assert recording.object_parameters.transmittance == pytest.approx(0.9 * air, rel=SINGLE)
    assert recording.object_parameters.atmosphere == pytest.approx(292.15)
    assert any(
        "a window that lets 90 % pass, at 20 degC" in note for note in recording.notes.remarks
    )


def test_what_a_camera_cannot_have_been_told_is_left_out_and_said(tmp_path):
    told = {**files.OBJECT, "emissivity": 0.0}
    planck = {**files.PLANCK, "b": -1.0}
    path = make(tmp_path, "a.fff", files.fff(PICTURES[0], told=told, planck=planck))
    recording = read_recording(path)
    assert recording.conversion is None
    assert recording.object_parameters.emissivity == 1
    assert sum(note.startswith("Ignored") for note in recording.notes.remarks) == 2


def test_stamps_that_do_not_ascend_give_way_to_the_frame_rate(tmp_path):
    path = make(tmp_path, "a.seq", files.seq(PICTURES, np.zeros(5), rate=50))
    recording = read_recording(path)
    assert recording.times == pytest.approx(np.arange(5) / 50)
    assert any("The frames are 1/50 s apart" in assumed for assumed in recording.notes.assumed)
    assert read_recording(path, interval=0.1).times == pytest.approx(0.1 * np.arange(5))
    without = make(tmp_path, "b.seq", files.seq(PICTURES, np.zeros(5), rate=0))
    with pytest.raises(SourceError, match="give an interval"):
        read_recording(without)


@pytest.mark.usefixtures("read_here")
@pytest.mark.parametrize("pack", [files.plain, files.png, jpeg_ls])
def test_a_picture_that_ends_before_the_missing_end_of_a_file_is_whole(tmp_path, pack):
    # Thermimage's SampleCSQ.csq lacks the four last bytes that its list of records tells of.
    content = files.seq(PICTURES, pack=lambda image: pack(image) + bytes(4), camera_first=True)
    recording = read_recording(make(tmp_path, "a.csq", content[:-4]))
    assert np.array_equal(recording.signal, PICTURES)
    assert any("last 4 bytes of the file are missing" in note for note in recording.notes.remarks)
    cut = read_recording(make(tmp_path, "b.csq", content[:-20]))
    assert np.array_equal(cut.signal, PICTURES[:4])
    assert any("4 complete frames read" in warning for warning in cut.notes.warnings)


# PTW, CINE


@pytest.mark.parametrize("lock_in", [False, True])
def test_ptw(tmp_path, lock_in):
    recording = read_recording(make(tmp_path, "a.ptw", files.ptw(PICTURES, lock_in=lock_in)))
    assert np.array_equal(recording.signal, PICTURES)
    assert recording.times == pytest.approx(np.arange(5) / 600, rel=SINGLE)
    assert recording.integration_time == pytest.approx(30e-6)
    assert recording.saturation == 2**14 - 2
    assert recording.camera == "JADE MW, serial number J-1234"
    told = recording.object_parameters
    assert (told.emissivity, told.reflected) == pytest.approx((0.8, 296.15))
    assert (told.transmittance, told.atmosphere) == pytest.approx((0.98, 295.15))
    assert any("lock-in" in note for note in recording.notes.remarks) == lock_in
    assert not recording.notes.warnings


def test_ptw_as_altair_560_writes_it(tmp_path):
    # Three letters and two zeros; the size of a frame in words; every third frame is kept.
    content = files.ptw(PICTURES, period=1 / 100, stamps=0.03 * np.arange(5), words=True)
    path = make(tmp_path, "a.ptw", content)
    assert find_format(path) == "ptw"
    recording = read_recording(path)
    assert np.array_equal(recording.signal, PICTURES)
    assert np.array_equal(read_recording(path, slice(2, 4)).times, recording.times[2:4])


@pytest.mark.parametrize(
    ("period", "stamps", "times", "told"),
    [
        (1 / 100, [0, 0.03, 0.06, 0.09, 0.12], 0.03, "30000 us apart by their time stamps"),
        (1 / 100, [0, 0.025, 0.05, 0.075, 0.1], 0.025, "the period in the header is 10000 us"),
        (1 / 600, np.array([0, 1, 2, 12, 13]) / 600, 1 / 600, "frames may be missing"),
    ],
)
def test_times_of_ptw_whose_stamps_do_not_fit_its_period(tmp_path, period, stamps, times, told):
    recording = read_recording(make(tmp_path, "a.ptw", files.ptw(PICTURES, period, stamps)))
    assert recording.times == pytest.approx(times * np.arange(5), rel=SINGLE)
    (note,) = recording.notes.assumed + recording.notes.warnings
    assert told in note


def test_ptw_without_period_has_the_times_of_its_stamps_also_over_midnight(tmp_path):
    stamps = np.array([0.0, 0.5, 1.0, 2.5, 3.0])
    content = bytearray(files.ptw(PICTURES, period=0.0, stamps=stamps))
    frame = (len(content) - 3476) // 5
    for number in (3, 4):  # 60 seconds and more of a minute: the next day
        start = 3476 + number * frame
        content[start + 80], content[start + 81] = 0, 0
        content[start + 83] -= 60
    recording = read_recording(make(tmp_path, "a.ptw", bytes(content)))
    assert recording.times == pytest.approx(stamps)


@pytest.mark.parametrize(("kind", "bits"), [("8", 8), ("16", 12), ("12p", 12)])
def test_cine(tmp_path, kind, bits):
    truth = files.pictures(bits=bits)
    recording = read_recording(make(tmp_path, "a.cine", files.cine(truth, kind)))
    assert np.array_equal(recording.signal, truth)
    # Stamps of 4 / 2^32 s, the frames a 30000th of a second apart.
    assert recording.times == pytest.approx(np.arange(5) / 30_000, abs=2e-9)
    # Exposure times have steps of 2⁻³² s.
    assert recording.integration_time == pytest.approx(3e-6, abs=2.0**-32)
    assert recording.saturation == 2**bits - 2
    assert recording.camera == "Phantom 711, serial number 12345"
    assert any(note.startswith("The trigger was at 3.3") for note in recording.notes.remarks)
    path = make(tmp_path, "b.cine", files.cine(truth, kind, times=False))
    assert read_recording(path).times == pytest.approx(np.arange(5) / 30_000)


def test_codes_of_ten_bits_become_counts_that_are_proportional_to_light(tmp_path):
    codes = np.broadcast_to(np.arange(1024, dtype=np.uint16).reshape(16, 64), (1, 16, 64))
    recording = read_recording(make(tmp_path, "a.cine", files.cine(codes, "10p")))
    counts = recording.signal.ravel().astype(int)
    assert (np.diff(counts) >= 0).all()
    # From the maker's table, which every reader of such files has.
    known = {1: 5, 16: 19, 200: 204, 512: 998, 700: 1872, 900: 3159, 1014: 4064, 1023: 4095}
    # The curve is within two counts of the table.
    assert {code: counts[code] for code in known} == pytest.approx(known, abs=2)


@pytest.mark.parametrize(("kind", "bits", "shift"), [("8", 8, 0), ("16", 12, 4), ("10p", 10, 6)])
def test_ffmpeg_sees_the_same_in_cine(tmp_path, kind, bits, shift):
    av = pytest.importorskip("av")
    path = make(tmp_path, "a.cine", files.cine(files.pictures(bits=bits), kind))
    with av.open(str(path)) as container:
        seen = np.stack([frame.to_ndarray() for frame in container.decode(video=0)]) >> shift
    counts = _CURVE[seen] if kind == "10p" else seen  # FFmpeg leaves the codes as they are
    assert np.array_equal(counts, read_recording(path).signal)


@pytest.mark.parametrize("viewer", [(1, 0, 0), (0, 1, 0), (0, 0, 90), (1, 1, -90), (0, 0, 0)])
def test_settings_of_cine_for_viewers_are_a_warning(tmp_path, viewer):
    recording = read_recording(make(tmp_path, "a.cine", files.cine(PICTURES, viewer=viewer)))
    assert np.array_equal(recording.signal, PICTURES)
    warned = ["tells viewers to turn the image" in text for text in recording.notes.warnings]
    assert warned == [True] * any(viewer)


def test_cine_whose_exposure_changes_has_no_integration_time(tmp_path):
    exposures = [3e-6, 3e-6, 5e-6, 5e-6, 5e-6]
    path = make(tmp_path, "a.cine", files.cine(PICTURES, exposures=exposures))
    recording = read_recording(path)
    assert recording.integration_time is None
    assert any("The integration time varies" in warning for warning in recording.notes.warnings)
    # A step of exposure times.
    assert read_recording(path, slice(2, 5)).integration_time == pytest.approx(5e-6, abs=2.0**-32)


# HCC


def test_counts_come_back_from_hcc(tmp_path):
    write_hcc(tmp_path / "a.hcc", a_recording())
    recording = read_recording(tmp_path / "a.hcc")
    assert np.array_equal(recording.signal, PICTURES)
    assert recording.quantity == "counts"
    assert recording.times == pytest.approx(np.arange(5) / 600, abs=1e-7)  # steps of 0.1 us
    assert recording.integration_time == pytest.approx(30e-6)
    assert recording.saturation == 16382


@settings(max_examples=60)
@given(
    low=st.floats(-1e6, 1e6),
    spread=st.one_of(st.just(0.0), st.floats(1e-30, 1e6)),
    seed=st.integers(0, 99),
    quantity=st.sampled_from(["radiance", "temperature"]),
)
def test_any_value_comes_back_from_hcc_within_half_a_step(
    tmp_path_factory, low, spread, seed, quantity
):
    values = low + spread * np.random.default_rng(seed).random((1, 2, 64))
    path = tmp_path_factory.mktemp("any") / "a.hcc"
    write_hcc(path, a_recording(values, quantity))
    assert read_recording(path).quantity == quantity
    rounding = 2.0**-23 * np.abs(values).max()
    error = np.abs(read_recording(path).signal - values).max()
    assert error <= np.ptp(values) / 65535 + 2 * rounding + 2.0**-100


def test_fasthcc_sees_the_same(tmp_path):
    fasthcc = pytest.importorskip("fasthcc")
    write_hcc(tmp_path / "a.hcc", a_recording(300.0 + PICTURES / 20, "temperature"))
    theirs, headers = fasthcc.read_hcc(tmp_path / "a.hcc", metadata=True)
    assert theirs.shape == PICTURES.shape
    assert headers[3]["AcquisitionFrameRate"] == 600
    calibrated = fasthcc.read_hcc(tmp_path / "a.hcc", calibrated=True)
    assert np.array_equal(calibrated, read_recording(tmp_path / "a.hcc").signal)
    fasthcc.write_hcc(tmp_path / "b.hcc", PICTURES, frame_rate=100.0, exposure_time=55.5)
    recording = read_recording(tmp_path / "b.hcc")
    assert recording.times == pytest.approx(np.arange(5) / 100)
    assert recording.integration_time == pytest.approx(55.5e-6)
    calibrated = fasthcc.read_hcc(tmp_path / "b.hcc", calibrated=True)
    assert np.array_equal(recording.signal, calibrated)


@pytest.mark.parametrize(
    ("recording", "text"),
    [
        (a_recording(PICTURES + 0.5), "whole numbers"),
        (a_recording(PICTURES.astype(int) * 100), "from 0 to 65535"),
        (a_recording(np.full((5, 9, 64), np.nan), "temperature"), "not finite"),
        (a_recording(PICTURES[..., :60]), "64 to"),
        (a_recording(times=np.zeros(5)), "do not ascend"),
    ],
)
def test_what_hcc_cannot_hold_is_refused_and_nothing_is_left(tmp_path, recording, text):
    with pytest.raises(ValueError, match=text):
        write_hcc(tmp_path / "a.hcc", recording)
    assert not list(tmp_path.iterdir())


# Arrays


def write_npy(path):
    np.save(path, PICTURES)


def write_tiffs(path):
    for number, image in enumerate(PICTURES):
        tifffile.imwrite(str(path).replace("*", str(number)), image)


def write_mat(path):
    scipy.io.savemat(path, {"S": PICTURES.transpose(1, 2, 0), "t": np.arange(5.0)})


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        file["run/frames"] = PICTURES
        file["run/dark"] = PICTURES[:1]


STACKS = [
    ("a.npy", write_npy, {}),
    ("a_*.tif", write_tiffs, {}),
    ("a.mat", write_mat, {"axes": ("y", "x", "time")}),
    ("a.h5", write_hdf5, {"dataset": "frames"}),
]


@pytest.mark.parametrize(("name", "write", "told"), STACKS)
def test_arrays(tmp_path, name, write, told):
    path = tmp_path / name
    write(path)
    told = Stated(quantity="counts", interval=1e-3, **told)
    for frames in (slice(None), slice(1, 3), slice(None, None, -2)):
        recording = read_here(path, find_format(path), frames, told)
        assert np.array_equal(recording.signal, PICTURES[frames])
        assert recording.times == pytest.approx(1e-3 * np.arange(5)[frames])


def test_tables_of_temperature_in_degrees_celsius(tmp_path):
    for number in range(3):
        np.savetxt(tmp_path / f"T_{number}.csv", PICTURES[number] / 40, fmt="%.3f", delimiter=";")
    told = Stated(unit="degC", interval=0.1)
    recording = read_here(tmp_path / "T_*.csv", "csv", None, told)
    assert recording.quantity == "temperature"
    # Three digits in the file, and 32 bits of a value near 600.
    assert np.abs(recording.signal - PICTURES[:3] / 40 - 273.15).max() < 6e-4


@pytest.mark.parametrize(("mark", "decimal"), [(";", ","), (",", "."), ("\t", ".")])
def test_lines_of_text_before_an_exported_table_are_left_out(tmp_path, mark, decimal):
    rows = [mark.join(f"{v:.2f}".replace(".", decimal) for v in row) for row in PICTURES[0] / 40]
    text = f"File:{mark}IR_0001.jpg\n\nEmissivity:{mark}0{decimal}95\n" + "\n".join(rows)
    path = make(tmp_path, "a.csv", text.encode())
    recording = read_here(path, "csv", None, Stated(unit="degC"))
    # Tables with two decimals, in K.
    assert np.abs(recording.signal[0] - PICTURES[0] / 40 - 273.15).max() < 0.006
    assert recording.notes.remarks[-1] == (
        "Ignored text that is not part of the matrix: lines 1, 3."
    )


def test_a_file_that_says_units_times_and_packing_needs_no_more(tmp_path):
    temperature = 20.0 + PICTURES / 100
    data = xr.Dataset(
        {"T": (("time", "y", "x"), temperature, {"units": "celsius"})},
        {"time": ("time", 10 + np.arange(5) / 4, {"units": "ms"})},
    )
    scale = {"scale_factor": 0.01, "add_offset": 100.0}
    packing = {"T": {"dtype": "i2", "_FillValue": -32768, **scale}}
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf", encoding=packing)
    recording = read_here(tmp_path / "a.nc", "netcdf", slice(1, None), Stated())
    assert recording.quantity == "temperature"
    # Whole steps of 0.01 K: rounding.
    assert np.abs(recording.signal - temperature[1:] - 273.15).max() < 1e-9
    assert recording.times == pytest.approx(np.arange(1, 5) * 0.25e-3)


@pytest.mark.parametrize(
    ("told", "text"),
    [
        ({"interval": 1e-3}, "unit: is missing, the file says none"),
        ({"quantity": "temperature", "interval": 1e-3}, "unit: is missing, the file says none"),
        ({"quantity": "counts"}, "give the interval between frames"),
        ({}, "unit: is missing, .*; give the interval between frames"),
        ({"quantity": "counts", "interval": 0.0}, "interval: 0 s, expected more than 0 s"),
        ({"quantity": "heat"}, "quantity: 'heat', expected none, counts, radiance"),
        ({"unit": "bar"}, "unit: is 'bar'"),
        ({"quantity": "radiance", "unit": "K"}, "radiance is not in K"),
        ({"quantity": "counts", "interval": 1.0, "dataset": "b"}, "no dataset 'b'"),
        (
            {"quantity": "counts", "interval": 1.0, "axes": ("y", "z")},
            r"axes: \(\'y\', \'z\'\), expected time, y and x",
        ),
        ({"format": "avi"}, "format: is 'avi'"),
        ({"quantity": "counts", "interval": 1.0, "frames": slice(9, 12)}, "none of them"),
    ],
)
def test_what_is_not_known_must_be_told_and_must_be_possible(tmp_path, told, text):
    write_npy(tmp_path / "a.npy")
    with pytest.raises(ValueError, match=text) as caught:
        read_recording(tmp_path / "a.npy", **told)
    assert "\n" not in str(caught.value)


def test_a_camera_file_says_itself_what_was_measured(tmp_path):
    path = make(tmp_path, "a.fff", files.fff(PICTURES[0]))
    with pytest.raises(ValueError, match="states itself what was measured"):
        read_recording(path, quantity="temperature")


# Any file


OWN = {
    "flir": lambda folder: files.seq(PICTURES),
    "ptw": lambda folder: files.ptw(PICTURES),
    "cine": lambda folder: files.cine(PICTURES),
    "hcc": lambda folder: hcc(folder / "written.hcc"),
}


@pytest.mark.parametrize("kind", OWN)
def test_only_the_chosen_frames_are_read(tmp_path, kind, monkeypatch):
    path = make(tmp_path, "any.bin", OWN[kind](tmp_path))
    assert find_format(path) == kind
    whole = read_recording(path)
    for frames in (slice(1, 3), slice(-1, None), slice(None, None, 2), slice(3, 0, -1)):
        part = read_recording(path, frames)
        assert np.array_equal(part.signal, PICTURES[frames])
        assert np.array_equal(part.times, whole.times[frames])
    from chipglow.io.cameras import binary

    read = []
    own = binary.Binary.read
    monkeypatch.setattr(binary.Binary, "read", lambda self, a, n: read.append(n) or own(self, a, n))
    read_recording(path, slice(4, 5))
    assert sum(n for n in read if n > PICTURES[0].nbytes // 2) < 2 * PICTURES[0].nbytes + 4000


@pytest.mark.parametrize("kind", OWN)
def test_of_a_file_cut_anywhere_the_whole_frames_are_read_or_it_is_one_error(tmp_path, kind):
    content = OWN[kind](tmp_path)
    known = []
    for length in np.linspace(1, len(content) - 1, 60).astype(int):
        path = make(tmp_path, "a.bin", content[:length])
        try:
            recording = read_here(path, kind, None, Stated())
        except SourceError as error:
            assert "a.bin" in str(error)
            assert "\n" not in str(error)
            assert not known
            continue
        known.append(len(recording.signal))
        assert np.array_equal(recording.signal, PICTURES[: known[-1]])
        # FLIR and Telops do not tell how many frames there should be.
        ends_with_one = kind in ("flir", "hcc") and length == known[-1] * len(content) // 5
        assert ends_with_one or any("truncated" in warning for warning in recording.notes.warnings)
    assert set(known) == {1, 2, 3, 4}


@pytest.mark.parametrize("kind", OWN)
def test_any_change_of_a_file_is_one_error_or_a_recording(tmp_path, kind):
    random = np.random.default_rng(11)
    content = OWN[kind](tmp_path)
    # Most of what can go wrong is in the headers: of the file, and of its first frame.
    near = {"cine": 44 + 40 + 12432 + 200, "ptw": 3476 + 200, "flir": 200, "hcc": 256}[kind]
    refused = 0
    for turn in range(300):
        changed = bytearray(content)
        for _ in range(random.integers(1, 4)):
            place = int(random.integers(near if turn % 4 else len(content)))
            if turn % 2:
                place %= {"cine": 150, "ptw": 150, "flir": 150, "hcc": 48}[kind]
            changed[place] = random.choice([0, 1, 127, 128, 255, random.integers(256)])
        path = make(tmp_path, "a.bin", bytes(changed))
        try:
            recording = read_here(path, kind, None, Stated())
        except SourceError as error:
            refused += 1
            assert "\n" not in str(error)
            assert len(str(error)) < 500
        else:
            assert recording.signal.size <= 10 * PICTURES.size
            assert np.isfinite(recording.times).all()
    assert 20 < refused < 300


@pytest.mark.parametrize("name", ["a.seq", "a.ptw", "a.hcc", "a.cine", "a.tif", "a.xyz", "a.csv"])
@pytest.mark.parametrize("content", [b"", b"GIF89a" + bytes(500), b"\xff\xd8\xff\xe0" + bytes(50)])
def test_a_file_of_another_kind_is_one_error(tmp_path, name, content):
    path = make(tmp_path, name, content)
    with pytest.raises(SourceError, match=name.replace(".", "[.]")):
        read_here(path, find_format(path), None, Stated("counts", interval=1.0))


def test_absurd_dimensions_are_refused_before_memory_is_taken(tmp_path):
    wide = np.zeros((1, 2), np.uint16)
    one = bytearray(files.fff(wide, pack=partial(files.png, swapped=False)))
    struct.pack_into("<HH", one, 128 + 2, 60_000, 60_000)
    with pytest.raises(SourceError, match=r"3\.6e\+09 samples"):
        read_here(make(tmp_path, "a.fff", bytes(one)), "flir", None, Stated())
    cine = bytearray(files.cine(PICTURES))
    struct.pack_into("<ii", cine, 48, 65_000, -65_000)
    with pytest.raises(SourceError, match="no whole frame"):
        read_recording(make(tmp_path, "a.cine", bytes(cine)))


def test_what_a_process_of_its_own_refuses_is_the_same_error(tmp_path):
    path = make(tmp_path, "a.csq", files.seq(PICTURES, pack=lambda image: jpeg_ls(image)[:300]))
    with pytest.raises(SourceError, match=r"a\.csq: frame 0: cannot be read"):
        read_recording(path)
