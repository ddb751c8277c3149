"""Files of FLIR's cameras: FFF, SEQ and CSQ, and JPEG with the same records inside."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from math import exp, isfinite, sqrt
from pathlib import Path
from struct import calcsize, unpack_from
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import PlanckConversion, Recording
from chipglow.io.cameras.binary import (
    Binary,
    CutShortError,
    Timing,
    check_picture,
    chosen_frames,
    first_moment,
    note_truncation,
    object_parameters,
    opened,
    read_pictures,
    text_of,
)
from chipglow.io.sources import SourceError
from chipglow.io.sources.source import reading, required
from chipglow.radiometry import ObjectParameters
from chipglow.text import Notes

_MAGIC: Final = b"FFF\0"
_JPEG: Final = b"\xff\xd8\xff"
_JPEG_LS: Final = b"\xff\xf7"
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_PNG_END: Final = b"IEND\xaeB`\x82"
_JPEG_END: Final = b"\xff\xd9"
_HEADER_LENGTH: Final = 64
_ENTRY: Final = "HHIIIIIII"
_ENTRY_LENGTH: Final = calcsize(">" + _ENTRY)
_MOST_RECORDS: Final = 1000
_RAW, _CAMERA = 1, 32
_RAW_HEADER: Final = 32
_BIG_ENDIAN: Final = 1
_MOST_PADDING: Final = 1 << 20
_ZERO: Final = 273.15
_LARGE: Final = 100.0
"""An exponent that is possible, and no transmittance."""


def is_flir(head: bytes) -> bool:
    """Whether a file begins like one of FLIR's; a JPEG may be anyone's."""
    return head[:4] == _MAGIC or head[:3] == _JPEG


@dataclass(frozen=True)
class _Frame:
    """Start and length of a frame's records by their kind, and the order of its counts."""

    records: dict[int, tuple[int, int]]
    big_endian: bool
    end: int


@dataclass(frozen=True)
class _Fields:
    """Fields of a record, of which the later ones may not be there."""

    raw: bytes

    def number(self, place: int, kind: str) -> float:
        """Return a number; NaN if it is not there."""
        order = "<" if self.raw[:2] == b"\x02\0" else ">"
        if place + calcsize(kind) > len(self.raw):
            return float("nan")
        return float(unpack_from(order + kind, self.raw, place)[0])

    def text(self, place: int, length: int) -> str:
        """Return a text; empty if it is not there."""
        return text_of(self.raw[place : place + length])


def read_flir(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of FLIR's radiometric JPEG, FFF, SEQ or CSQ as counts; see `CameraFormat`.

    The layout is that of ExifTool's documentation of FLIR's tags.
    """
    notes = Notes()
    with _records(path) as binary:
        places = _frames(binary, notes)
        shape = _shape(binary, places[0])
        chosen = chosen_frames(path, frames, len(places), shape[0] * shape[1])
        signal = read_pictures(
            chosen, shape, lambda number: _image(binary, places[number], number, shape)
        )
        start = _moment(_camera_fields(binary, places[0]))
        cameras = [_camera_fields(binary, places[number]) for number in chosen]
    stamps = np.array([_moment(fields) - start for fields in cameras])
    fields = cameras[0]
    notes.remarks.extend(first_moment(start))
    recording = Recording(
        signal=signal,
        quantity="counts",
        times=_times(stamps, fields, len(places), Timing(path, chosen, interval, notes)),
        camera=_camera(fields),
        saturation=_saturation(fields),
        conversion=_conversion(fields, notes),
        object_parameters=_object(fields, notes),
        notes=notes,
    )
    notes.remarks.extend(_further(fields))
    return recording


# Records


@contextmanager
def _records(path: Path) -> Iterator[Binary]:
    """Open the file, or what of a JPEG is FLIR's."""
    with opened(path) as binary:
        if binary.read(0, min(3, binary.size)) != _JPEG:
            yield binary
            return
        inside = _inside_jpeg(binary)
    yield Binary(path, BytesIO(inside), len(inside))


def _inside_jpeg(binary: Binary) -> bytes:
    """Return FLIR's records, which lie in numbered segments of a JPEG."""
    parts: dict[int, bytes] = {}
    last, place, marker = 0, 2, 0
    while marker != 0xFFDA:  # the picture itself
        marker, length = (int(n) for n in binary.numbers(place, 2, ">u2"))
        if marker >> 8 != 0xFF or length < 2:
            raise SourceError(f"{binary.path}: is damaged, no segment of the JPEG at byte {place}")
        segment = binary.read(place + 4, length - 2) if marker == 0xFFE1 else b""
        if segment[:5] == b"FLIR\0" and len(segment) >= 8:
            parts[segment[6]], last = segment[8:], segment[7]
        place += 2 + length
    if not parts:
        raise SourceError(f"{binary.path}: is a JPEG without FLIR's counts in it")
    if sorted(parts) != list(range(last + 1)):
        raise SourceError(
            f"{binary.path}: has {len(parts)} parts of FLIR's records, expected {last + 1}"
        )
    return b"".join(parts[number] for number in range(last + 1))


def _frames(binary: Binary, notes: Notes) -> list[_Frame]:
    """Find all frames that are whole."""
    found: list[_Frame] = []
    place: int | None = 0
    while place is not None:
        try:
            found.append(_frame(binary, place, len(found), notes))
        except CutShortError:
            if not found:
                raise
            note_truncation(notes, len(found))
            break
        place = _next(binary, found[-1].end, notes)
    return found


def _next(binary: Binary, end: int, notes: Notes) -> int | None:
    """Find the next frame: there may be zeros or something else before it."""
    if binary.read(end, min(4, binary.size - end)) == _MAGIC:
        return end
    rest = binary.read(end, min(_MOST_PADDING, binary.size - end))
    begin = rest.find(_MAGIC)
    if begin >= 0:
        return end + begin
    if rest.strip(b"\0"):
        notes.warnings.append(f"{binary.size - end} bytes after the last frame are not a frame.")
    return None


def _frame(binary: Binary, start: int, number: int, notes: Notes) -> _Frame:
    header = binary.read(start, _HEADER_LENGTH)
    if header[:4] != _MAGIC:
        raise SourceError(f"{binary.path}: begins with {header[:4]!r}, expected 'FFF' (FLIR)")
    order = "<" if 100 <= unpack_from("<I", header, 20)[0] < 200 else ">"
    place, count = unpack_from(order + "II", header, 24)
    if not 0 < count <= _MOST_RECORDS:
        raise SourceError(
            f"{binary.path}: frame {number} says {count} records, expected 1 to {_MOST_RECORDS}"
        )
    length = count * _ENTRY_LENGTH
    table = binary.read(start + place, length)
    records: dict[int, tuple[int, int]] = {}
    big_endian, end = False, start + place + length
    for entry in range(0, length, _ENTRY_LENGTH):
        kind, sort, _, _, offset, size, *_ = unpack_from(order + _ENTRY, table, entry)
        if kind == 0:
            continue
        missing = start + offset + size - binary.size
        if missing > 0:
            size -= missing
            if kind != _RAW or not _whole_picture(binary, start + offset, size):
                raise CutShortError(
                    f"{binary.path}: is cut short or damaged, {missing} bytes of a record of frame "
                    f"{number} are missing"
                )
            notes.remarks.append(
                f"The last {missing} bytes of the file are missing; the picture of frame {number} "
                "ends before them."
            )
        records.setdefault(kind, (start + offset, size))
        big_endian |= kind == _RAW and sort == _BIG_ENDIAN
        end = max(end, start + offset + size)
    if _RAW not in records or records[_RAW][1] <= _RAW_HEADER:
        raise SourceError(f"{binary.path}: frame {number} has no counts (record 1)")
    return _Frame(records, big_endian, end)


def _whole_picture(binary: Binary, place: int, length: int) -> bool:
    """Whether a record of counts, of which the end is missing, has all of them."""
    if length <= _RAW_HEADER:
        return False
    stored = binary.read(place, length)
    counts = stored[_RAW_HEADER:]
    packing = _packing(counts)
    if packing:
        return counts.rstrip(b"\0").endswith(_PNG_END if packing == "PNG" else _JPEG_END)
    fields = _Fields(stored[:_RAW_HEADER])
    return len(counts) >= 2 * int(fields.number(2, "H")) * int(fields.number(4, "H")) > 0


# Counts


def _shape(binary: Binary, frame: _Frame) -> tuple[int, int]:
    fields = _Fields(binary.read(frame.records[_RAW][0], _RAW_HEADER))
    width, height = (int(fields.number(place, "H")) for place in (2, 4))
    check_picture(binary.path, height, width)
    return height, width


def packed_counts(path: Path) -> bool:
    """Whether the counts of a file are packed as PNG or JPEG-LS, so that libraries unpack them."""
    with _records(path) as binary:
        place, length = _frame(binary, 0, 0, Notes()).records[_RAW]
        return _packing(binary.read(place, length)[_RAW_HEADER:]) != ""


def _packing(stored: bytes) -> str:
    if stored[:8] == _PNG:
        return "PNG"
    return "JPEG-LS" if stored[:3] == _JPEG and _JPEG_LS in stored[:256] else ""


def _image(
    binary: Binary, frame: _Frame, number: int, shape: tuple[int, int]
) -> NDArray[np.uint16]:
    name = f"{binary.path}: frame {number}"
    if _shape(binary, frame) != shape:
        raise SourceError(
            f"{name} has another shape than frame 0, expected {shape[1]} columns and {shape[0]} "
            "rows"
        )
    place, length = frame.records[_RAW]
    stored = binary.read(place, length)[_RAW_HEADER:]
    packing = _packing(stored)
    with reading(name):
        if not packing:
            order = ">u2" if frame.big_endian else "<u2"
            return np.frombuffer(stored, order, shape[0] * shape[1]).reshape(shape)
        values = _unpacked(name, packing, stored)
    if values.shape != shape or values.dtype != np.uint16:
        raise SourceError(f"{name}: its {packing} is {values.dtype} of shape {values.shape}")
    return _in_order(values)


def _unpacked(name: str, packing: str, stored: bytes) -> NDArray[Any]:
    if packing == "PNG":
        from PIL import Image

        with Image.open(BytesIO(stored), formats=["PNG"]) as picture:
            counts = np.asarray(picture)
            return counts.astype(np.uint16) if picture.mode == "I" else counts
    imagecodecs = required("imagecodecs", name, "camera", "imagecodecs for JPEG-LS")
    return np.asarray(imagecodecs.jpegls_decode(stored))


def _in_order(values: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return counts with their bytes in order: most cameras, not all, write PNG with them swapped.

    Neighbours of a picture are alike, unless the bytes of its counts are swapped.
    """
    swapped = values.byteswap()
    return swapped if _roughness(swapped) < _roughness(values) else values


def _roughness(values: NDArray[np.uint16]) -> int:
    wide = values.astype(np.int64)
    return int(np.abs(np.diff(wide, axis=0)).sum() + np.abs(np.diff(wide, axis=1)).sum())


# What the camera knows


def _camera_fields(binary: Binary, frame: _Frame) -> _Fields:
    place, length = frame.records.get(_CAMERA, (0, 0))
    return _Fields(binary.read(place, min(length, 4096)))


def _moment(fields: _Fields) -> float:
    """Return the time of a frame in s since 1970; NaN if it is not said."""
    seconds, milliseconds = fields.number(0x384, "I"), fields.number(0x388, "I")
    if not (seconds > 0 and isfinite(milliseconds)):
        return float("nan")
    return seconds + (int(milliseconds) & 0xFFFF) / 1000


def _times(
    stamps: NDArray[np.float64], fields: _Fields, count: int, timing: Timing
) -> NDArray[np.float64]:
    if timing.interval is not None or count == 1:
        return timing.even(timing.interval or 0.0)
    return timing.stamped(np.round(stamps, 3), fields.number(0x464, "H"))


def _camera(fields: _Fields) -> str:
    model, serial = fields.text(0xD4, 32), fields.text(0x104, 16)
    name = model if model.startswith("FLIR") else f"FLIR {model}".strip()
    return f"{name}, serial number {serial}" if serial else name


def _saturation(fields: _Fields) -> float | None:
    """Return the greatest count of the camera's range; cameras without it say all 16 bits."""
    low, high = fields.number(0x310, "H"), fields.number(0x312, "H")
    return high if low < high < 65_535 else None


def _conversion(fields: _Fields, notes: Notes) -> PlanckConversion | None:
    try:
        return PlanckConversion(
            r1=fields.number(0x58, "f"),
            b=fields.number(0x5C, "f"),
            f=fields.number(0x60, "f"),
            o=fields.number(0x308, "i"),
            r2=fields.number(0x30C, "f"),
        )
    except ValueError as error:
        notes.remarks.append(
            f"Ignored the impossible conversion to temperature in the file ({error})."
        )
        return None


def _object(fields: _Fields, notes: Notes) -> ObjectParameters:
    distance, humidity = _finite(fields, 0x24), _finite(fields, 0x3C)
    atmosphere, window = _finite(fields, 0x2C), _finite(fields, 0x34)
    transmittance = window if window is not None and window > 0 else 1.0
    if distance is not None and humidity is not None and atmosphere is not None:
        fraction = humidity / 100 if humidity > 2 else humidity
        notes.remarks.append(
            f"Set in the camera: an object at {distance:g} m and a humidity of "
            f"{fraction * 100:g} %."
        )
        transmittance *= _through_air(fields, distance, fraction, atmosphere)
    if window is not None and window != 1:
        notes.remarks.append(
            f"Set in the camera: a window that lets {window * 100:g} % pass, at "
            f"{fields.number(0x30, 'f') - _ZERO:g} degC; here it is as warm as the air."
        )
    return object_parameters(
        notes,
        emissivity=_finite(fields, 0x20),
        reflected=_finite(fields, 0x28),
        transmittance=transmittance,
        atmosphere=atmosphere,
    )


def _through_air(fields: _Fields, distance: float, humidity: float, temperature: float) -> float:
    """Return the transmission of the air by FLIR's formula, from the camera's constants.

    Minkina and Dudzik, Infrared Thermography: Errors and Uncertainties (2009), Section 2.3.
    """
    alpha, beta = ((fields.number(a, "f"), fields.number(a + 4, "f")) for a in (0x70, 0x78))
    fraction = fields.number(0x80, "f")
    celsius = temperature - _ZERO
    known = isfinite(sum(alpha) + sum(beta) + fraction) and -100 < celsius < 100
    if not known or not (0 <= distance < 1e6 and 0 <= humidity <= 1):
        return 1.0
    water = humidity * exp(
        1.5587 + 6.939e-2 * celsius - 2.7816e-4 * celsius**2 + 6.8455e-7 * celsius**3
    )
    first, second = (
        exp(min(_LARGE, -sqrt(distance) * (a + b * sqrt(water))))
        for a, b in zip(alpha, beta, strict=True)
    )
    return fraction * first + (1 - fraction) * second


def _finite(fields: _Fields, place: int) -> float | None:
    value = fields.number(place, "f")
    return value if isfinite(value) else None


def _further(fields: _Fields) -> Iterator[str]:
    for name, place in (("Lens", 0x170), ("Filter", 0x1EC)):
        if text := fields.text(place, 16):
            yield f"{name}: {text}."
    low, high = _finite(fields, 0x94), _finite(fields, 0x90)
    if low is not None and high is not None and 0 < low < high < 10_000:
        yield f"The camera was set to measure from {low - _ZERO:g} to {high - _ZERO:g} degC."
