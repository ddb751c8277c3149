"""Images in TIFF, PNG and MATLAB files: the numbers that the writer meant, or a refusal."""

import struct
import subprocess
import sys
from datetime import datetime, timedelta

import h5py
import numpy as np
import pytest
import scipy.io
import tifffile
from PIL import Image, ImageOps, PngImagePlugin
from tolerances import DOUBLE, SINGLE

from chipglow.io.cameras.formats import find_format, read_here
from chipglow.io.cameras.stacks import Stated
from chipglow.io.sources import SourceError
from chipglow.io.sources.grids.grid import GridSource
from chipglow.scene import Raster

ROWS, COLUMNS = 12, 16
STACK = (29315 + 200 * np.arange(5 * ROWS * COLUMNS).reshape(5, ROWS, COLUMNS) % 30011).astype("u2")
IMAGE = STACK[0]
BYTES = (STACK >> 8).astype("u1")


def read(path, **stated):
    stated = {"unit": "counts", "interval": 1e-3, **stated}
    return read_here(path, find_format(path), None, Stated(**stated))


def refusal(path, **stated):
    with pytest.raises(ValueError, match=path.name.split("*")[0]) as caught:
        read(path, **stated)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def check_import(path, expected):
    """An import reads the same numbers, in kelvins."""
    source = GridSource(str(path), spacing=1.0, interval=1.0)
    rows, columns = expected.shape[-2:]
    frames = source.frames(Raster(0.0, 0.0, 1.0, rows, columns))
    for frame, image in zip(frames, expected, strict=True):
        np.testing.assert_allclose(frame.fields["temperature"], image, rtol=SINGLE)


def tiff(path, values, **options):
    tifffile.imwrite(path, values, **options)
    return path


def imagej(values=STACK, **stated):
    return {"values": values, "imagej": True, "metadata": {"axes": "TYX", **stated}}


GREY = {"photometric": "minisblack"}
RGB = {"photometric": "rgb"}
PLANES = {"photometric": "rgb", "planarconfig": "separate"}
"""The default of tifffile for 3 and 4 frames."""
FRAMES = "frames in time"

TIFF_RIGHT = {
    "one image": ({"values": IMAGE}, IMAGE, ""),
    "black is zero": ({"values": STACK, **GREY}, STACK, ""),
    "large numbers are dark": (
        {"values": IMAGE, "photometric": "miniswhite"},
        IMAGE,
        "large numbers are dark",
    ),
    "2 frames of tifffile": ({"values": STACK[:2]}, STACK[:2], ""),
    "3 frames of tifffile": ({"values": STACK[:3], **PLANES}, STACK[:3], "3 planes of colours"),
    "4 frames of tifffile": ({"values": STACK[:4], **PLANES}, STACK[:4], "4 planes of colours"),
    "5 frames of tifffile": ({"values": STACK}, STACK, ""),
    "3 grey planes": (
        {"values": STACK[:3], **GREY, "planarconfig": "separate"},
        STACK[:3],
        "The 3 planes that",
    ),
    "5 grey planes": ({"values": STACK, **GREY, "planarconfig": "separate"}, STACK, "5 planes"),
    "3 planes, zlib": ({"values": STACK[:3], **RGB, "compression": "zlib"}, STACK[:3], "3 planes"),
    "frames of ImageJ": (imagej(), STACK, ""),
    "slices of ImageJ": (imagej(axes="ZYX"), STACK, "5 slices of the file are"),
    "channels of ImageJ": (imagej(axes="CYX"), STACK, "5 channels of the file are"),
    "3 frames of ImageJ": (imagej(STACK[:3]), STACK[:3], ""),
    "frames of OME": ({"values": STACK, "ome": True, "metadata": {"axes": "TYX"}}, STACK, ""),
    "slices of OME": ({"values": STACK, "ome": True, "metadata": {"axes": "ZYX"}}, STACK, FRAMES),
    "big-endian": ({"values": STACK, "byteorder": ">", **GREY}, STACK, ""),
    "BigTIFF": ({"values": STACK, "bigtiff": True, **GREY}, STACK, ""),
    "tiles": ({"values": STACK, "tile": (16, 16), **GREY}, STACK, ""),
    "zlib, predictor": (
        {"values": STACK, "compression": "zlib", "predictor": True, **GREY},
        STACK,
        "",
    ),
    "LZW, predictor": (
        {"values": STACK, "compression": "lzw", "predictor": True, **GREY},
        STACK,
        "",
    ),
    "8 bits": ({"values": BYTES, **GREY}, BYTES, ""),
    "12 bits": ({"values": IMAGE >> 4, "bitspersample": 12}, IMAGE >> 4, ""),
    "signed": ({"values": STACK.astype("i2"), **GREY}, STACK.astype("i2"), ""),
    "32 bits": ({"values": STACK.astype("u4") * 9, **GREY}, STACK.astype("u4") * 9, ""),
    "float16": ({"values": (STACK / 64).astype("f2"), **GREY}, (STACK / 64).astype("f2"), ""),
    "float64": ({"values": STACK / 7, **GREY}, STACK / 7, ""),
    "pixels per centimetre": (
        {"values": IMAGE, "resolution": (100, 100), "resolutionunit": "centimeter"},
        IMAGE,
        "pixel pitch of 100 µm, which is not used",
    ),
    "pixels of ImageJ": (
        {**imagej(IMAGE, axes="YX", unit="mm"), "resolution": (10, 10)},
        IMAGE,
        "pixel pitch of 0.1 mm",
    ),
    "pixels of ImageJ in µm": (
        {**imagej(IMAGE, axes="YX", unit="\\u00B5m"), "resolution": (0.5, 0.5)},
        IMAGE,
        "pixel pitch of 2 µm",
    ),
    "missing numbers": (
        {"values": IMAGE.astype("f4"), "extratags": [(42113, 2, 0, "29315", True)]},
        np.where(IMAGE == 29315, np.nan, IMAGE),
        "",
    ),
    "missing numbers, integers": (
        {"values": IMAGE, "extratags": [(42113, 2, 0, "29315.0", True)]},
        np.where(IMAGE == 29315, np.nan, IMAGE),
        "",
    ),
    "impossible missing number": (
        {"values": IMAGE, "extratags": [(42113, 2, 0, "-9999", True)]},
        IMAGE,
        "",
    ),
}

COLOURS = np.stack([BYTES[0]] * 3, -1)

TIFF_REFUSED = {
    "palette": (
        {"values": BYTES[0], "photometric": "palette", "colormap": np.zeros((3, 256), "u2")},
        "palette of colours",
    ),
    "palette, stack": (
        {"values": BYTES, "photometric": "palette", "colormap": np.zeros((3, 256), "u2")},
        "palette of colours",
    ),
    "colours": ({"values": COLOURS, **RGB}, "3 numbers per pixel (RGB)"),
    "colours, 16 bits": ({"values": np.stack([IMAGE] * 3, -1), **RGB}, "3 numbers per pixel (RGB)"),
    "planes of colours": ({"values": BYTES[:3], **PLANES}, "3 planes of colours (RGB, 8 bits)"),
    "planes of cyan, magenta ...": (
        {"values": STACK[:4], "photometric": "separated", "planarconfig": "separate"},
        "4 planes of colours (SEPARATED",
    ),
    "mosaic": ({"values": IMAGE, "photometric": 32803}, "are colours (CFA)"),
    "samples": (
        {"values": STACK.transpose(1, 2, 0), **GREY, "planarconfig": "contig"},
        "5 numbers per pixel (MINISBLACK)",
    ),
    "grey and alpha": (
        {"values": np.stack([IMAGE] * 2, -1), **GREY, "extrasamples": ["unassalpha"]},
        "2 numbers per pixel",
    ),
    "frames and slices": (
        imagej(np.zeros((2, 3, ROWS, COLUMNS), "u2"), axes="TZYX"),
        "(2 frames, 3 slices), expected images along one axis",
    ),
    "frames and channels": (
        imagej(np.zeros((2, 3, ROWS, COLUMNS), "u2"), axes="TCYX"),
        "(2 frames, 3 channels)",
    ),
    "4 axes": ({"values": np.zeros((2, 3, ROWS, COLUMNS), "u2"), **GREY}, "one axis"),
    "frames of planes": (
        {"values": np.zeros((2, 3, ROWS, COLUMNS), "u2"), **RGB, "planarconfig": "separate"},
        "3 numbers per pixel",
    ),
    "complex": ({"values": IMAGE.astype("c8")}, "its numbers are complex64"),
    "bilevel": ({"values": IMAGE > 30000}, "its numbers are bool"),
}


@pytest.mark.parametrize(("written", "expected", "note"), TIFF_RIGHT.values(), ids=TIFF_RIGHT)
def test_tiff_gives_the_numbers_that_were_written(tmp_path, written, expected, note):
    path = tiff(tmp_path / ("a.ome.tif" if "ome" in written else "a.tif"), **written)
    recording = read(path)
    expected = expected.reshape(-1, ROWS, COLUMNS)
    np.testing.assert_array_equal(recording.signal, expected)
    notes = [*recording.notes.assumed, *recording.notes.warnings, *recording.notes.remarks]
    notes.remove("Row 0 is the upper edge.")
    assert [note in text for text in notes] == ([True] if note else [])
    check_import(path, expected)


@pytest.mark.parametrize(("written", "reason"), TIFF_REFUSED.values(), ids=TIFF_REFUSED)
def test_tiff_without_one_measured_number_per_pixel_is_refused(tmp_path, written, reason):
    path = tiff(tmp_path / "a.tif", **written)
    assert reason in refusal(path)
    with pytest.raises(SourceError) as caught:
        GridSource(str(path), spacing=1.0).survey()
    assert reason in str(caught.value)


def test_pages_of_other_kinds_are_ignored_with_a_note_or_asked_for(tmp_path):
    path = tiff(tmp_path / "thumbnail.tif", IMAGE)
    tiff(path, COLOURS[::2, ::2], append=True, subfiletype=1)
    recording = read(path)
    np.testing.assert_array_equal(recording.signal, [IMAGE])
    assert recording.notes.remarks == ["Ignored series 2: it is a reduced copy of another image."]
    path = tiff(tmp_path / "visible.tif", COLOURS, **RGB)
    tiff(path, IMAGE, append=True)
    recording = read(path)
    np.testing.assert_array_equal(recording.signal, [IMAGE])
    assert recording.notes.remarks == [
        "Ignored series 1: has 3 numbers per pixel (RGB), must have a single one."
    ]
    path = tiff(tmp_path / "sizes.tif", IMAGE)
    tiff(path, IMAGE[::2], append=True)
    assert "give the dataset with the frames, it has 'series_2' of shape (6, 16)" in refusal(path)
    np.testing.assert_array_equal(read(path, dataset="series_2").signal, [IMAGE[::2]])


# Orientation


def turned_by_pillow(image, orientation):
    """Pillow turns images by their EXIF, independently of this package."""
    picture = Image.fromarray(image)
    picture.getexif()[274] = orientation
    return np.asarray(ImageOps.exif_transpose(picture))


def oriented(path, values, orientation, **options):
    return tiff(path, values, extratags=[(274, 3, 1, orientation, True)], metadata=None, **options)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("frames", [1, 3, 5])
@pytest.mark.parametrize("compression", [None, "zlib"])
def test_tiff_is_turned_as_its_orientation_states(tmp_path, orientation, frames, compression):
    path = oriented(
        tmp_path / "a.tif", STACK[:frames], orientation, compression=compression, **GREY
    )
    expected = np.stack([turned_by_pillow(one, orientation) for one in STACK[:frames]])
    recording = read(path)
    np.testing.assert_array_equal(recording.signal, expected)
    assert len(recording.notes.remarks) == (orientation != 1)
    check_import(path, expected)
    part = read_here(path, "tiff", slice(-1, None), Stated(unit="counts", interval=1.0))
    np.testing.assert_array_equal(part.signal, expected[-1:])


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_series_of_turned_files(tmp_path, orientation):
    for number, image in enumerate(STACK):
        oriented(tmp_path / f"a_{number}.tif", image, orientation)
    expected = np.stack([turned_by_pillow(one, orientation) for one in STACK])
    np.testing.assert_array_equal(read(tmp_path / "a_*.tif").signal, expected)


def test_an_undefined_orientation_is_ignored_with_a_warning(tmp_path):
    recording = read(oriented(tmp_path / "a.tif", IMAGE, 0))
    np.testing.assert_array_equal(recording.signal, [IMAGE])
    assert recording.notes.warnings == ["The tag Orientation is 0, expected 1 to 8; it is ignored."]


def test_images_of_different_orientations_are_refused(tmp_path):
    path = oriented(tmp_path / "a.tif", IMAGE, 1)
    oriented(path, IMAGE, 3, append=True)
    assert "the orientations 1 and 3, which" in refusal(path)


def test_a_bit_order_from_the_lowest_is_read(tmp_path):
    path = tiff(tmp_path / "a.tif", IMAGE, metadata=None)
    raw = bytearray(path.read_bytes())
    with tifffile.TiffFile(path) as file:
        page = file.pages[0]
        place, size, software = page.dataoffsets[0], page.databytecounts[0], page.tags[305]
    # In the place of the tag Software: FillOrder 2, in which each byte is reversed. Readers
    # do not need ascending tags.
    raw[software.offset : software.offset + 12] = struct.pack("<HHIHH", 266, 3, 1, 2, 0)
    stored = np.frombuffer(raw, "u1", size, place)
    flipped = np.packbits(np.unpackbits(stored.reshape(-1, 1), axis=1)[:, ::-1], axis=1)
    raw[place : place + size] = flipped.tobytes()
    path.write_bytes(raw)
    np.testing.assert_array_equal(read(path).signal, [IMAGE])


# ImageJ


COEFFICIENTS = {"c0": -273.15, "c1": 0.01, "c2": 1e-8, "c3": -1e-14, "c4": 1e-20}


@pytest.mark.parametrize("function", range(4))
@pytest.mark.parametrize("frames", [1, 5])
def test_the_calibration_function_of_imagej_is_applied(tmp_path, function, frames):
    stated = {name: COEFFICIENTS[name] for name in list(COEFFICIENTS)[: function + 2]}
    written = imagej(STACK[:frames], cf=function, vunit="degC", finterval=0.02, **stated)
    path = tiff(tmp_path / "a.tif", **written)
    expected = sum(c * STACK[:frames].astype(float) ** n for n, c in enumerate(stated.values()))
    recording = read(path, unit=None, interval=None)
    assert recording.quantity == "temperature"
    np.testing.assert_allclose(recording.signal, expected + 273.15, rtol=DOUBLE)
    assert recording.times == pytest.approx(0.02 * np.arange(frames))
    assert "ImageJ's calibration function, -273.15 + 0.01 n" in recording.notes.remarks[0]
    check_import(path, expected + 273.15)


IMAGEJ_UNITS = [
    ({"finterval": 0.25}, 0.25),
    ({"finterval": 0.25, "tunit": "sec"}, 0.25),
    ({"finterval": 250, "tunit": "ms"}, 0.25),
    ({"finterval": 250, "tunit": "msec"}, 0.25),
    ({"finterval": 250, "tunit": "\\u00B5s"}, 250e-6),
    ({"finterval": 250, "tunit": "usec"}, 250e-6),
    ({"finterval": 0.5, "tunit": "min"}, 30.0),
    ({"finterval": 0.25, "axes": "ZYX"}, 0.25),
    ({"finterval": 0}, None),
    ({"finterval": -1.0}, None),
    ({"finterval": "nan"}, None),
    ({"fps": 25.0}, None),
    ({"finterval": 0.25, "axes": "CYX"}, None),
    ({"finterval": 0.25, "tunit": "ticks"}, "ticks"),
]


@pytest.mark.parametrize(("stated", "step"), IMAGEJ_UNITS)
def test_the_frame_interval_of_imagej(tmp_path, stated, step):
    path = tiff(tmp_path / "a.tif", **imagej(**stated))
    if isinstance(step, float):
        assert read(path, interval=None).times == pytest.approx(step * np.arange(5))
    else:
        assert (step or "give the interval between frames") in refusal(path, interval=None)
    assert read(path, interval=1e-3).times == pytest.approx(1e-3 * np.arange(5))


def test_the_time_increment_of_ome(tmp_path):
    stated = {"axes": "TYX", "TimeIncrement": 2.0, "TimeIncrementUnit": "ms", "PhysicalSizeX": 1.5}
    path = tiff(tmp_path / "a.ome.tif", STACK, ome=True, metadata=stated)
    recording = read(path, interval=None)
    assert recording.times == pytest.approx(2e-3 * np.arange(5))
    assert "The file states a pixel pitch of 1.5 µm, which is not used." in recording.notes.remarks


def test_imagej_stores_signed_numbers_with_an_offset(tmp_path):
    stated = {"cf": 0, "c0": -32768.0, "c1": 1.0, "vunit": "Gray Value"}
    path = tiff(tmp_path / "a.tif", **imagej(**stated))
    np.testing.assert_array_equal(read(path).signal, STACK.astype(int) - 32768)
    assert "unit: is missing, the file says none" in refusal(path, unit=None)


@pytest.mark.parametrize("vunit", ["°C", "\\u00B0C", "C", "deg C", "celsius"])
def test_units_of_imagej(tmp_path, vunit):
    stated = {"cf": 0, "c0": 0.0, "c1": 0.01, "vunit": vunit}
    path = tmp_path / "a.tif"
    text = "ImageJ=1.53t\n" + "".join(f"{name}={value}\n" for name, value in stated.items())
    tiff(path, IMAGE, description=text.encode("cp1252"), metadata=None)
    recording = read(path, unit=None)
    np.testing.assert_allclose(recording.signal, [IMAGE * 0.01 + 273.15], rtol=DOUBLE)


@pytest.mark.parametrize(
    ("values", "stated", "reason"),
    [
        *((IMAGE, {"cf": n}, f"calibration function cf is {n}") for n in (-1, 4, 7, 11, 21, 22)),
        (IMAGE, {"cf": "straight"}, "calibration function cf is straight"),
        (IMAGE, {"cf": 1, "c0": 0.0, "c1": 1.0}, "c2 None, expected numbers"),
        (IMAGE, {"cf": 0, "c0": 0.0, "c1": "one"}, "c1 one, expected numbers"),
        (IMAGE.astype("f4"), {"cf": 0, "c0": 0.0, "c1": 1.0}, "for floating-point numbers"),
    ],
)
def test_other_calibrations_of_imagej_are_refused(tmp_path, values, stated, reason):
    assert reason in refusal(tiff(tmp_path / "a.tif", **imagej(values, axes="YX", **stated)))


def test_a_structure_of_matlab_is_refused_by_name(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"s": {"T": IMAGE}})
    assert "has only s (struct), expected matrices" in refusal(tmp_path / "a.mat")


def test_counts_of_a_calibrated_image_are_refused(tmp_path):
    stated = {"cf": 0, "c0": -273.15, "c1": 0.01, "vunit": "degC"}
    path = tiff(tmp_path / "a.tif", **imagej(IMAGE, axes="YX", **stated))
    assert "the file states values in degC, which are not counts" in refusal(path)


GDAL_ITEMS = {
    "scale and offset": (
        '<Item name="SCALE" sample="0" role="scale">0.01</Item>'
        '<Item name="OFFSET" sample="0" role="offset">-273.15</Item>'
        '<Item name="UNITTYPE" sample="0" role="unittype">degC</Item>',
        0.01 * IMAGE, "remarks",
    ),
    "other items": ('<Item name="AREA">Point</Item>', IMAGE, None),
    "damaged": ("<Item>", IMAGE, "warnings"),
}  # fmt: skip


@pytest.mark.parametrize(("items", "kelvins", "said"), GDAL_ITEMS.values(), ids=GDAL_ITEMS)
def test_scale_and_offset_of_gdal_are_applied(tmp_path, items, kelvins, said):
    text = f"<GDALMetadata>{items}</GDALMetadata>"
    path = tiff(tmp_path / "a.tif", IMAGE, extratags=[(42112, "s", 0, text, True)])
    recording = read(path, unit=None if said == "remarks" else "counts")
    np.testing.assert_allclose(recording.signal[0], kelvins, rtol=SINGLE)
    notes = {kind: any("GDAL" in text for text in found)
             for kind, found in vars(recording.notes).items()}  # fmt: skip
    assert notes == {kind: kind == said for kind in notes}


def test_imagejs_calibration_none_changes_nothing(tmp_path):
    path = tiff(tmp_path / "a.tif", **imagej(cf=20, c0=1.0, c1=2.0, vunit="Gray Value"))
    np.testing.assert_array_equal(read(path).signal, STACK)


def test_files_of_a_series_that_state_other_units_are_refused(tmp_path):
    for number, vunit in enumerate(("degC", "K")):
        stated = {"cf": 0, "c0": 0.0, "c1": 0.01, "vunit": vunit}
        tiff(tmp_path / f"a_{number}.tif", **imagej(IMAGE, axes="YX", **stated))
    with pytest.raises(SourceError, match=r"a_1\.tif: units of '' is K, expected degC as in"):
        read(tmp_path / "a_*.tif", unit=None)


# PNG


def png(path, values, mode=None, **options):
    picture = Image.fromarray(values)
    (picture if mode is None else picture.convert(mode)).save(path, "PNG", **options)
    return path


def exif(orientation):
    stated = Image.Exif()
    stated[274] = orientation
    return stated


def chunk(kind, data):
    information = PngImagePlugin.PngInfo()
    information.add(kind, data)
    return information


SMOOTH = (7000 + 13 * np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)).astype("u2")

PNG_RIGHT = {
    "16 bits": (SMOOTH, {}, SMOOTH, ""),
    "8 bits": (BYTES[0], {}, BYTES[0], ""),
    "8 bits in the upper byte": ((SMOOTH & 0xFF00), {}, (SMOOTH & 0xFF00), ""),
    "noise": (
        np.random.default_rng(1).integers(0, 65536, (ROWS, COLUMNS), "u2"),
        {},
        np.random.default_rng(1).integers(0, 65536, (ROWS, COLUMNS), "u2"),
        "",
    ),
    "constant": (np.full_like(SMOOTH, 258), {}, np.full_like(SMOOTH, 258), ""),
    "best compression": (SMOOTH, {"optimize": True}, SMOOTH, ""),
    "gamma": (
        SMOOTH,
        {"pnginfo": chunk(b"gAMA", struct.pack(">I", 45455))},
        SMOOTH,
        "a gamma of 0.45455",
    ),
    "gamma 1": (SMOOTH, {"pnginfo": chunk(b"gAMA", struct.pack(">I", 100000))}, SMOOTH, ""),
    "resolution": (SMOOTH, {"dpi": (300, 300)}, SMOOTH, ""),
    "text": (SMOOTH, {"pnginfo": chunk(b"tEXt", b"Title\0a")}, SMOOTH, ""),
    **{
        f"EXIF {n}": (SMOOTH, {"exif": exif(n)}, turned_by_pillow(SMOOTH, n), f"Orientation, {n},")
        for n in range(2, 9)
    },
}

PNG_REFUSED = {
    "colours": (png, {"mode": "RGB"}, "have colours,"),
    "colours and alpha": (png, {"mode": "RGBA"}, "have colours and a transparency"),
    "palette": (png, {"mode": "P"}, "indices of a palette"),
    "grey and alpha": (png, {"mode": "LA"}, "have a transparency"),
    "bilevel": (png, {"mode": "1"}, "have 1 bits"),
}


@pytest.mark.parametrize(
    ("written", "options", "expected", "note"), PNG_RIGHT.values(), ids=PNG_RIGHT
)
def test_png_gives_the_numbers_that_were_written(tmp_path, written, options, expected, note):
    for number in range(3):
        png(tmp_path / f"a_{number}.png", written, **options)
    recording = read(tmp_path / "a_*.png")
    np.testing.assert_array_equal(recording.signal, [expected] * 3)
    notes = [*recording.notes.assumed, *recording.notes.warnings, *recording.notes.remarks]
    notes.remove("Row 0 is the upper edge.")
    assert [note in text for text in notes] == ([True] if note else [])
    check_import(tmp_path / "a_*.png", np.stack([expected] * 3))


@pytest.mark.parametrize(("write", "options", "reason"), PNG_REFUSED.values(), ids=PNG_REFUSED)
def test_png_of_colours_is_refused(tmp_path, write, options, reason):
    assert reason in refusal(write(tmp_path / "a.png", BYTES[0], **options))


def test_png_with_swapped_bytes_or_several_images_is_refused(tmp_path):
    path = png(tmp_path / "swapped.png", SMOOTH.byteswap())
    assert "in the wrong order, as in images extracted from files of FLIR" in refusal(path)
    frames = [Image.fromarray(one) for one in BYTES]
    frames[0].save(tmp_path / "animated.png", save_all=True, append_images=frames[1:])
    assert "has 5 images, must have a single one" in refusal(tmp_path / "animated.png")


def test_png_of_several_sizes_or_depths(tmp_path):
    png(tmp_path / "a_1.png", SMOOTH)
    png(tmp_path / "a_2.png", SMOOTH[:6])
    assert "a_2.png: expected an array '' of shape (12, 16)" in refusal(tmp_path / "a_*.png")


def test_a_truncated_png_is_refused(tmp_path):
    path = png(tmp_path / "a.png", np.random.default_rng(1).integers(0, 256, (99, 99), "u1"))
    path.write_bytes(path.read_bytes()[:5000])
    assert "a.png: cannot be read" in refusal(path)
    path.write_bytes(path.read_bytes()[:20])
    refusal(path)


# MATLAB


def numbered(count=3, dates=None, start=1, name="Frame"):
    arrays = {f"{name}{start + n}": STACK[n % 5] for n in range(count)}
    for n, date in enumerate(dates or ()):
        arrays[f"{name}{start + n}_DateTime"] = np.array([date], float)
    return arrays


def clock(*seconds):
    """Lists of year to millisecond, from a moment before midnight on."""
    moments = [datetime(2024, 2, 28, 23, 59, 59) + timedelta(seconds=one) for one in seconds]
    return [
        [m.year, m.month, m.day, m.hour, m.minute, m.second, m.microsecond / 1000] for m in moments
    ]


def matlab_5(path, arrays):
    scipy.io.savemat(path, arrays)
    return path


def matlab_73(path, arrays):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            file[name] = np.asarray(values).T  # as MATLAB stores its columns
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    return path


SQUARE = STACK[:, :, :12]

MATLAB_RIGHT = {
    "frames with times": (numbered(3, clock(0, 0.5, 86400)), {}, STACK[:3], [0, 0.5, 86400]),
    "milliseconds": (numbered(2, clock(0, 2e-3)), {}, STACK[:2], [0, 2e-3]),
    "over a new year": (
        numbered(2, [[2023, 12, 31, 23, 59, 59, 900], [2024, 1, 1, 0, 0, 0, 100]]),
        {},
        STACK[:2],
        [0, 0.2],
    ),
    "frames with times replaced": (
        numbered(3, clock(0, 1, 2)),
        {"interval": 0.1},
        STACK[:3],
        [0, 0.1, 0.2],
    ),
    "frames without times": (numbered(3), {"interval": 1.0}, STACK[:3], [0, 1, 2]),
    "frames from 9 to 11": (numbered(3, start=9), {"interval": 1.0}, STACK[:3], [0, 1, 2]),
    "frame 0": (numbered(2, start=0), {"interval": 1.0}, STACK[:2], [0, 1]),
    "12 frames": (numbered(12), {"interval": 1.0}, STACK[np.arange(12) % 5], np.arange(12)),
    "a single frame": (numbered(1, clock(0)), {}, STACK[:1], [0]),
    "a list beside frames": (
        {**numbered(2), "x": np.arange(16.0)},
        {"interval": 1.0},
        STACK[:2],
        [0, 1],
    ),
    "a single image": ({"T": IMAGE}, {}, IMAGE[None], [0]),
    "y, x, time": (
        {"T": STACK.transpose(1, 2, 0)},
        {"axes": ("y", "x", "time"), "interval": 1.0},
        STACK,
        np.arange(5),
    ),
    "time, y, x": (
        {"T": STACK},
        {"axes": ("time", "y", "x"), "interval": 1.0},
        STACK,
        np.arange(5),
    ),
    "x, y, time": (
        {"T": STACK.transpose(2, 1, 0)},
        {"axes": ("x", "y", "time"), "interval": 1.0},
        STACK,
        np.arange(5),
    ),
    "y, x, time and a list": (
        {"T": STACK.transpose(1, 2, 0), "time": np.arange(5.0) / 4},
        {"axes": ("y", "x", "time")},
        STACK,
        np.arange(5) / 4,
    ),
}

AXES = "give the axes: y, x, time as MATLAB orders images"

MATLAB_REFUSED = {
    "3 axes": ({"T": STACK.transpose(1, 2, 0)}, {"interval": 1.0}, AXES),
    "3 axes of Python": ({"T": STACK}, {"interval": 1.0}, AXES),
    "a square stack": ({"T": np.zeros((12, 12, 12))}, {"interval": 1.0}, AXES),
    "4 axes": ({"T": np.zeros((2, 3, 4, 5))}, {"interval": 1.0}, "no array has 2 or 3 axes"),
    "frames without times": (numbered(3), {}, "give the interval between frames"),
    "dates of some": (numbered(3, clock(0, 1)), {}, "give the interval between frames"),
    "dates that stand still": (numbered(3, clock(0, 1, 1)), {}, "does not ascend"),
    "dates that go back": (numbered(3, clock(0, 2, 1)), {}, "does not ascend"),
    "impossible dates": (
        numbered(2, [[2024, 13, 1, 0, 0, 0, 0]] * 2),
        {},
        "Frame1_DateTime is [2024.0, 13.0",
    ),
    "short dates": (numbered(2, [[2024, 1, 1]] * 2), {}, "expected year, month, day, hour"),
    "dates that are no numbers": (numbered(2, [[np.nan] * 7] * 2), {}, "Frame1_DateTime is [nan"),
    "frames of two sizes": (
        {"Frame1": IMAGE, "Frame2": IMAGE[:6]},
        {"interval": 1.0},
        "give the dataset",
    ),
    "other names": (numbered(2, name="T"), {"interval": 1.0}, "give the dataset"),
    "frames and another image": (
        {**numbered(2), "Mask": IMAGE},
        {"interval": 1.0},
        "give the dataset with the frames, it has 'Frame' of shape (2, 12, 16), 'Mask'",
    ),
    "words": ({"T": "hot"}, {}, "no array of numbers"),
}


@pytest.mark.parametrize("write", [matlab_5, matlab_73])
@pytest.mark.parametrize(
    ("arrays", "stated", "expected", "times"), MATLAB_RIGHT.values(), ids=MATLAB_RIGHT
)
def test_matlab_gives_the_images_that_were_written(
    tmp_path, write, arrays, stated, expected, times
):
    recording = read(write(tmp_path / "a.mat", arrays), **{"interval": None, **stated})
    np.testing.assert_array_equal(recording.signal, expected)
    # Rounding of times of seconds.
    assert recording.times == pytest.approx(np.asarray(times, float), abs=1e-12)


@pytest.mark.parametrize(
    ("arrays", "stated", "reason"), MATLAB_REFUSED.values(), ids=MATLAB_REFUSED
)
def test_matlab_arrays_that_may_be_several_things_are_refused(tmp_path, arrays, stated, reason):
    path = matlab_5(tmp_path / "a.mat", arrays)
    assert reason in refusal(path, **{"interval": None, **stated})


def test_an_import_of_matlab_frames(tmp_path):
    path = matlab_5(tmp_path / "a.mat", numbered(3, clock(0, 0.5, 1.5)))
    check_import(path, STACK[:3])
    source = GridSource(str(path), spacing=1.0)
    assert source.survey().times == pytest.approx([0, 0.5, 1.5])
    path = matlab_5(tmp_path / "b.mat", {"T": STACK})
    with pytest.raises(SourceError, match=AXES):
        GridSource(str(path), spacing=1.0).survey()


def test_missing_numbers_of_frames_are_a_warning(tmp_path):
    arrays = {name: numbered(4)[name] for name in ("Frame1", "Frame2", "Frame4")}
    path = matlab_5(tmp_path / "a.mat", arrays)
    (warning,) = read(path).notes.warnings
    assert "Frame1 to Frame4 have gaps" in warning
    for number in (1, 2, 4):
        tiff(tmp_path / f"a_{number}.tif", IMAGE)
    (warning,) = read(tmp_path / "a_*.tif").notes.warnings
    assert "after a_2.tif number 3 is missing; the frames are taken as evenly spaced" in warning


# Extras


WITHOUT_IMAGECODECS = """
import sys
from pathlib import Path

sys.modules["imagecodecs"] = None
from chipglow.io.cameras.formats import read_here
from chipglow.io.cameras.stacks import Stated

for name in sys.argv[1:]:
    try:
        print(read_here(Path(name), "tiff", None, Stated(unit="counts", interval=1.0)).signal.sum())
    except ValueError as error:
        print(error)
"""


def test_without_imagecodecs_packed_tiff_names_the_extra(tmp_path):
    packed = {"lzw": False, "zlib": True, "packbits": True}
    for name in packed:
        tiff(tmp_path / f"{name}.tif", STACK, compression=name, **GREY)
    tiff(tmp_path / "bits.tif", IMAGE >> 4, bitspersample=12)
    names = [f"{name}.tif" for name in (*packed, "bits")]
    command = [sys.executable, "-c", WITHOUT_IMAGECODECS, *names]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    extra = 'run python -m pip install ".[camera]" in the folder of chipglow\'s source'
    for name, line in zip(names, done.stdout.splitlines(), strict=True):
        if packed.get(name.removesuffix(".tif")):
            assert int(line) == STACK.sum()
        else:
            assert line == f"{name}: needs imagecodecs for its packing; {extra}"
