"""Grey images of measured numbers in TIFF and PNG files, as arrays."""

import logging
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import lru_cache, partial
from math import isfinite, prod
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.grids.file_array import FileArray, Key, Read, check_samples, list_array
from chipglow.io.sources.source import SourceError, head_of, required
from chipglow.text import Notes

ORIENTATION: Final = 274
"""Tag of TIFF and EXIF that states how an image is turned and mirrored."""

Turn = Callable[[NDArray[Any]], NDArray[Any]]
"""Turns images, the last two axes of an array."""

TURNS: Final[Mapping[int, Turn]] = {
    1: lambda images: images,
    2: lambda images: images[..., ::-1],
    3: lambda images: images[..., ::-1, ::-1],
    4: lambda images: images[..., ::-1, :],
    5: lambda images: images.swapaxes(-1, -2),
    6: lambda images: images[..., ::-1, :].swapaxes(-1, -2),
    7: lambda images: images[..., ::-1, ::-1].swapaxes(-1, -2),
    8: lambda images: images[..., ::-1].swapaxes(-1, -2),
}
"""From stored to upright images by the value of `ORIENTATION`."""

_TRANSPOSED: Final = (5, 6, 7, 8)
"""TIFF orientations with exchanged rows and columns."""


def _turn(orientation: object, notes: Notes) -> int:
    """Return and note the orientation to apply; an undefined one is noted only."""
    if orientation == 1:
        return 1
    if isinstance(orientation, int) and orientation in TURNS:
        notes.remarks.append(
            f"The images are turned upright as their tag Orientation, {orientation}, states."
        )
        return orientation
    notes.warnings.append(f"The tag Orientation is {orientation}, expected 1 to 8; it is ignored.")
    return 1


# TIFF


_BLACK_IS_ZERO: Final = ("MINISBLACK", "LINEAR_RAW")
_MOST_BITS_OF_COLOURS: Final = 8
"""Planes of more bits are usually a stack of frames, which tifffile writes so by default."""

_GDAL: Final = 42112
"""TIFF tag of GDAL's metadata."""

_NO_DATA: Final = 42113
"""TIFF tag of GDAL's missing value."""

_GDAL_ROLES: Final = {"scale": "scale_factor", "offset": "add_offset", "unittype": "units"}
"""Attributes of NetCDF by the roles of items of GDAL's metadata."""

_X_RESOLUTION: Final = 282
"""TIFF tag XResolution."""

_PHOTOMETRIC: Final = 262
"""TIFF tag PhotometricInterpretation."""

_INCH_AND_CENTIMETRE: Final = {2: 0.0254, 3: 0.01}
"""Units in m by the value of the TIFF tag ResolutionUnit."""

_POLYNOMIALS: Final = (0, 1, 2, 3)
"""ImageJ's calibration functions that are polynomials, of degree 1 to 4."""

_NO_FUNCTION: Final = 20
"""ImageJ's code of an image without a calibration function."""


def tiff_arrays(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    """Yield the series of grey images in a TIFF file, and its times if it states them."""
    status = path.stat()
    file, arrays = _tiff(path, status.st_size, status.st_mtime_ns)
    file.filehandle.open()
    stack.callback(file.filehandle.close)
    yield from (replace(one, notes=one.notes + Notes()) for one in arrays)


@lru_cache(maxsize=1)
def _tiff(path: Path, _size: int, _changed: int) -> tuple[Any, tuple[FileArray, ...]]:
    """Return a TIFF file, which is closed, and its arrays.

    The last one is kept: one who looks at frame after frame reads the tags of all images once.
    """
    import tifffile

    with _errors_logged("tifffile") as errors, tifffile.TiffFile(path) as file:
        every = list(file.series)
        return file, tuple(_tiff_series(path, file, every, errors))


def _tiff_series(
    path: Path, file: Any, every: Sequence[Any], errors: Sequence[str]
) -> Iterator[FileArray]:
    """Yield the series of grey images, and their times; an error of tifffile is one."""
    if errors:
        raise SourceError(f"{path}: is damaged or truncated: {errors[0]}")
    reasons = {number: _not_grey(series) for number, series in enumerate(every, start=1)}
    skipped = {number: reason for number, reason in reasons.items() if reason}
    if every and len(skipped) == len(every):
        raise SourceError(f"{path}: {skipped[1]}")
    for number, series in enumerate(every, start=1):
        if number not in skipped:
            notes = Notes(
                remarks=[f"Ignored series {other}: {why}." for other, why in skipped.items()]
            )
            name = f"series_{number}" if number > 1 else ""
            yield from _series_arrays(path, name, file, series, notes)


@contextmanager
def _errors_logged(name: str) -> Iterator[list[str]]:
    """Collect errors that a library logs while it continues with the rest of a file."""
    said: list[str] = []
    handler = logging.Handler(logging.ERROR)
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logging.getLogger(name).addHandler(handler)
    try:
        yield said
    finally:
        logging.getLogger(name).removeHandler(handler)


def _not_grey(series: Any) -> str:
    """Return why a series is not of measured numbers, one per pixel; empty if it may be."""
    page = series.keyframe
    kind = _photometric(page)
    if series.dtype is None or series.dtype.kind not in "fiu":
        return f"its numbers are {series.dtype}, expected integers or floating-point numbers"
    if kind == "PALETTE":
        return "its numbers are indices of a palette of colours, not measured values"
    if page.is_reduced:
        return "it is a reduced copy of another image"
    if "S" in series.axes:
        count, depth = page.samplesperpixel, page.bitspersample
        if not series.axes.startswith("S"):
            return f"has {count} numbers per pixel ({kind}), must have a single one"
        if kind != "MINISBLACK" and not (kind == "RGB" and depth > _MOST_BITS_OF_COLOURS):
            return f"has {count} planes of colours ({kind}, {depth} bits), expected grey images"
    elif kind not in (*_BLACK_IS_ZERO, "MINISWHITE"):
        return f"its numbers are colours ({kind}), expected grey images"
    return ""


def _photometric(page: Any) -> str:
    """Return the name of the tag PhotometricInterpretation; without it, black is zero."""
    if _PHOTOMETRIC not in page.tags:
        return "MINISBLACK"
    return str(getattr(page.photometric, "name", page.photometric))


def _series_arrays(
    path: Path, name: str, file: Any, series: Any, notes: Notes
) -> Iterator[FileArray]:
    page = series.keyframe
    stacked = _stacked_axis(path, series, notes)
    orientation = _turn(_orientation(path, series), notes)
    if _photometric(page) == "MINISWHITE":
        notes.warnings.append(
            "The file states that large numbers are dark (PhotometricInterpretation: min-is-white);"
            " the numbers are used as stored."
        )
    _note_pitch(file, page, notes)
    convert, attributes = _imagej_calibration(path, file, page, notes)
    if _NO_DATA in page.tags:
        attributes |= _no_data(page)
    if _GDAL in page.tags:
        attributes |= _gdal_packing(page, notes)
    shape, read = tuple(series.shape), _tiff_reader(path, series)
    if orientation in _TRANSPOSED:
        shape = (*shape[:-2], shape[-1], shape[-2])
    read = partial(_turned_part, read, TURNS[orientation], convert)
    dims = ("time", "y", "x")[-len(shape) :]
    yield FileArray(name, shape, read, dims, attributes, notes=notes)
    if stacked in ("frames", "slices") and (step := _time_step(file)):
        times = step[0] * np.arange(shape[0], dtype=np.float64)
        yield list_array(f"{name or 'images'}/time", times, step[1])


def _stacked_axis(path: Path, series: Any, notes: Notes) -> str:
    """Return what the images of a series are besides rows and columns; empty for a single one."""
    names = {"T": "frames", "Z": "slices", "C": "channels", "S": "planes"}
    longer = {
        names.get(axis, "images"): length
        for axis, length in zip(series.axes, series.shape, strict=True)
        if axis not in "YX"
    }
    if series.axes[-2:] != "YX" or len(series.shape) != 2 + len(longer) or len(longer) > 1:
        sides = ", ".join(f"{length} {axis}" for axis, length in longer.items())
        raise SourceError(
            f"{path}: its axes {series.axes} have lengths {series.shape} ({sides}), expected "
            "images along one axis, then rows and columns"
        )
    kind = next(iter(longer), "")
    if kind == "planes":
        colours = " of colours" if _photometric(series.keyframe) == "RGB" else ""
        notes.assumed.append(
            f"The {longer[kind]} planes{colours} that the file states are frames in time."
        )
    elif kind in ("slices", "channels"):
        notes.assumed.append(f"The {longer[kind]} {kind} of the file are frames in time.")
    return kind


def _orientation(path: Path, series: Any) -> Any:
    """Return the orientation of all images; writers may state it in the first one only."""
    first = series.keyframe.tags.valueof(ORIENTATION, default=1)
    for page in series.pages:
        stated = page.tags.valueof(ORIENTATION, default=first) if hasattr(page, "tags") else first
        if stated != first:
            raise SourceError(
                f"{path}: its images have the orientations {first} and {stated}, which must be "
                "the same"
            )
    return first


def _imagej(file: Any) -> Mapping[str, Any]:
    return (file.imagej_metadata or {}) if file.is_imagej else {}


def _imagej_text(file: Any, key: str) -> str:
    r"""Return a text of ImageJ's description, which may write a letter as \u00B5."""
    text = str(_imagej(file).get(key, ""))
    return re.sub(r"\\u([0-9A-Fa-f]{4})", lambda match: chr(int(match[1], 16)), text).strip()


def _imagej_calibration(
    path: Path, file: Any, page: Any, notes: Notes
) -> tuple[Turn | None, dict[str, Any]]:
    """Return what applies ImageJ's calibration function to stored numbers, and their unit."""
    stated = _imagej(file)
    function = stated.get("cf", _NO_FUNCTION)
    if function == _NO_FUNCTION:
        return None, {}
    if function not in _POLYNOMIALS:
        raise SourceError(
            f"{path}: ImageJ's calibration function cf is {function}, expected a polynomial (cf 0 "
            "to 3); save the image in ImageJ as 32-bit, which applies the function"
        )
    names = [f"c{power}" for power in range(function + 2)]
    values = [stated.get(name) for name in names]
    if not all(isinstance(one, int | float) and isfinite(one) for one in values):
        pairs = ", ".join(f"{name} {value}" for name, value in zip(names, values, strict=True))
        raise SourceError(f"{path}: ImageJ's calibration has {pairs}, expected numbers")
    if page.dtype.kind == "f":
        raise SourceError(
            f"{path}: states a calibration function of ImageJ for floating-point numbers, which "
            "ImageJ does not apply, expected integers"
        )
    unit = _imagej_text(file, "vunit")
    unit = "" if unit.lower() == "gray value" else unit
    terms = " + ".join(
        f"{value:.9g}" + ("", " n")[power > 0] + (f"^{power}" if power > 1 else "")
        for power, value in enumerate(values)
    )
    notes.remarks.append(
        f"The stored numbers n are converted by ImageJ's calibration function, {terms}"
        f"{f', to {unit}' if unit else ''}."
    )
    return partial(_polynomial, np.array(values, np.float64)), {"units": unit} if unit else {}


def _polynomial(coefficients: NDArray[np.float64], numbers: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(np.polynomial.polynomial.polyval(numbers, coefficients))


def _time_step(file: Any) -> tuple[float, str] | None:
    """Return the time between frames and its unit, as ImageJ or OME states it."""
    if file.is_ome:
        stated = _ome_pixels(file)
        step, unit = stated.get("TimeIncrement", "0"), stated.get("TimeIncrementUnit", "s")
    else:
        step = _imagej(file).get("finterval", 0)
        unit = _imagej_text(file, "tunit") or "s"
    try:
        seconds = float(step)
    except ValueError:
        return None
    return (seconds, unit) if 0 < seconds < np.inf else None


def _ome_pixels(file: Any) -> Mapping[str, str]:
    """Return the attributes of the first image of OME's description."""
    for element in ElementTree.fromstring(file.ome_metadata).iter():
        if element.tag.rpartition("}")[2] == "Pixels":
            return element.attrib
    return {}


def _note_pitch(file: Any, page: Any, notes: Notes) -> None:
    """Note the distance of the pixels that a file states; it is mostly meant for printing."""
    text = ""
    if file.is_ome:
        stated = _ome_pixels(file)
        if size := stated.get("PhysicalSizeX"):
            text = f"{size} {stated.get('PhysicalSizeXUnit', 'µm')}"
    elif _X_RESOLUTION in page.tags and page.tags[_X_RESOLUTION].value[0]:
        pixels, per = page.tags[_X_RESOLUTION].value
        unit = _imagej_text(file, "unit")
        if unit and unit not in ("pixel", "null"):
            text = f"{per / pixels:.6g} {unit}"
        elif page.resolutionunit in _INCH_AND_CENTIMETRE:
            metres = _INCH_AND_CENTIMETRE[page.resolutionunit] * per / pixels
            text = f"{1e6 * metres:.6g} µm"
    if text:
        notes.remarks.append(f"The file states a pixel pitch of {text}, which is not used.")


def _gdal_packing(page: Any, notes: Notes) -> dict[str, Any]:
    """Return scale, offset and unit that GDAL's metadata state for the stored numbers."""
    try:
        items = ElementTree.fromstring(str(page.tags[_GDAL].value).strip("\0 ")).iter("Item")
        stated = {_GDAL_ROLES[role]: str(one.text).strip() for one in items
                  if (role := one.get("role", "")) in _GDAL_ROLES}  # fmt: skip
        result = {name: text if name == "units" else float(text) for name, text in stated.items()}
    except (ElementTree.ParseError, ValueError):
        notes.warnings.append("The metadata of GDAL in the file are damaged and not used.")
        return {}
    if result:
        listed = ", ".join(f"{name} {value}" for name, value in result.items())
        notes.remarks.append(f"The metadata of GDAL in the file are applied: {listed}.")
    return result


def _no_data(page: Any) -> dict[str, float]:
    """Return the number that stands for a missing value (tag GDAL_NODATA), if one can."""
    try:
        number = float(str(page.tags[_NO_DATA].value).strip("\0 "))
    except ValueError:
        return {}
    if page.dtype.kind != "f" and not (
        number.is_integer() and np.iinfo(page.dtype).min <= number <= np.iinfo(page.dtype).max
    ):
        return {}
    return {"_FillValue": number if page.dtype.kind == "f" else int(number)}


def _turned_part(read: Read, turn: Turn, convert: Turn | None, key: Key) -> NDArray[Any]:
    """Return a part of images that are read whole, turned and converted."""
    whole = (*key[:-2], slice(None), slice(None))
    rows, columns = key[-2:]
    part = turn(read(whole))[..., rows, columns]
    return np.ascontiguousarray(part if convert is None else convert(part))


def _tiff_reader(path: Path, series: Any) -> Read:
    if series.dataoffset is not None:
        dtype = np.dtype(series.parent.byteorder + series.dtype.char)
        return partial(_mapped_part, path, dtype, series.dataoffset, tuple(series.shape))
    pages = list(series.pages)
    for page in pages:
        ends = [a + n for a, n in zip(page.dataoffsets, page.databytecounts, strict=True)]
        if max(ends, default=0) > path.stat().st_size:
            raise SourceError(f"{path}: is truncated, a picture ends at byte {max(ends)}")
    return partial(_pages_part, path, series, pages)


def _mapped_part(
    path: Path, dtype: np.dtype[Any], offset: int, shape: tuple[int, ...], key: Key
) -> NDArray[Any]:
    """Return a part of a file that is mapped into memory only meanwhile."""
    return np.array(np.memmap(path, dtype, "r", offset, shape)[key])


def _pages_part(path: Path, series: Any, every: Sequence[Any], key: Key) -> NDArray[Any]:
    if series.axes.startswith("S"):
        return np.asarray(_decoded(path, every[0])[key])
    pages = every[key[0]] if len(series.shape) > 2 else every
    check_samples(str(path), len(pages) * prod(series.shape[-2:]))
    part = np.stack([_decoded(path, page)[key[-2:]] for page in pages])
    return part[0] if len(series.shape) == 2 else part


def _decoded(path: Path, page: Any) -> NDArray[Any]:
    try:
        return np.asarray(page.asarray(maxworkers=1))
    except (ValueError, NotImplementedError, ImportError):
        required("imagecodecs", path, "camera", "imagecodecs for its packing")
        raise


# PNG


_PNG_HEADER: Final = 26
"""Bytes of a PNG file up to bit depth and colour type."""

_PNG_COLOURS: Final = {
    2: "its pixels have colours",
    3: "its numbers are indices of a palette of colours",
    4: "its pixels have a transparency",
    6: "its pixels have colours and a transparency",
}
"""Colour types of PNG that are refused, with the reason."""

_SWAPPED: Final = 0.25
"""Ratio of differences of neighbours, with bytes swapped and as read, of a file written swapped."""


def png_arrays(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    """Yield the grey image of a PNG file with 8 or 16 bits."""
    from PIL import Image

    head = head_of(path, _PNG_HEADER)
    depth, colours = head[24], head[25]
    if colours != 0 or depth not in (8, 16):
        kind = _PNG_COLOURS.get(colours, f"its pixels have {depth} bits")
        raise SourceError(f"{path}: {kind}, expected grey pixels of 8 or 16 bits")
    with Image.open(path, formats=["PNG"]) as picture:
        check_samples(str(path), prod(picture.size))
        count = getattr(picture, "n_frames", 1)
        if count > 1:
            raise SourceError(f"{path}: has {count} images, must have a single one per file")
        stored = np.asarray(picture).astype(np.uint8 if depth == 8 else np.uint16)
        information, orientation = picture.info, picture.getexif().get(ORIENTATION, 1)
    _check_bytes(path, stored)
    notes = Notes()
    image = TURNS[_turn(orientation, notes)](stored)
    gamma = information.get("gamma", 1.0)
    if gamma != 1.0:
        notes.warnings.append(
            f"The file states a gamma of {gamma:g}: its numbers may not be proportional to counts."
        )
    if (clear := information.get("transparency")) is not None:
        notes.warnings.append(f"The file states that {clear} is transparent; it is used as stored.")
    yield FileArray("", image.shape, lambda key: image[key], ("y", "x"), notes=notes)


def _check_bytes(path: Path, image: NDArray[Any]) -> None:
    """Refuse 16-bit numbers whose bytes are swapped, as in images extracted from FLIR's files.

    Neighbours in an image are similar, unless the bytes are swapped. Multiples of 256 are 8 bits in
    the upper byte.
    """
    if image.itemsize == 1 or not (image & 0xFF).any():
        return
    if roughness(image.byteswap()) < _SWAPPED * roughness(image):
        raise SourceError(
            f"{path}: the two bytes of its numbers are in the wrong order, as in images extracted "
            "from files of FLIR; read the camera's own file, or swap the bytes"
        )


def roughness(values: NDArray[np.uint16]) -> int:
    """Return the sum of differences between neighbours in an image."""
    wide = values.astype(np.int64)
    return int(np.abs(np.diff(wide, axis=0)).sum() + np.abs(np.diff(wide, axis=1)).sum())
