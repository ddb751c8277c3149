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
    MOST_FRAMES,
    Binary,
    CutShortError,
    Timing,
    check_picture,
    chosen_frames,
    first_moment,
    note_trailing_bytes,
    object_parameters,
    opened,
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
_MOST_PACKED: Final = 1100
"""More samples than that a byte are in no picture that is packed without loss."""
_ZERO: Final = 273.15
_LARGE: Final = 100.0
"""An exponent that is possible, and no transmittance."""


def is_flir(head: bytes) -> bool:
    """Whether a file begins like one of FLIR's; a JPEG may be anyone's."""
    return head[:4] == _MAGIC or head[:3] == _JPEG


@dataclass(frozen=True)
class _Frame:
    """Where the records of a frame are: start and length by their kind, and the raw one's order."""

    records: dict[int, tuple[int, int]]
    big_endian: bool
    end: int


@dataclass(frozen=True)
class _Fields:
    """Fields of a record, of which the later ones may not be there."""

    raw: bytes

    def number(self, place: int, kind: str) -> float:
        """A number; NaN if it is not there."""
        order = "<" if self.raw[:2] == b"\x02\0" else ">"
        if place + calcsize(kind) > len(self.raw):
            return float("nan")
        return float(unpack_from(order + kind, self.raw, place)[0])

    def text(self, place: int, length: int) -> str:
        """A text; empty if it is not there."""
        return text_of(self.raw[place : place + length])


def read_flir(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of FLIR's radiometric JPEG, FFF, SEQ or CSQ as counts; see `CameraFormat`.

    Notes
    -----
    The layout is that of ExifTool's documentation of FLIR's tags.
    """
    notes = Notes()
    with _records(path) as binary:
        places = _frames(binary, notes)
        first = places[0]
        height, width = _shape(binary, first, 0)
        chosen = chosen_frames(path, frames, len(places), height * width)
        signal = np.empty((len(chosen), height, width), np.uint16)
        stamps = np.empty(len(chosen))
        start = _moment(_camera_fields(binary, first))
        for position, number in enumerate(chosen):
            signal[position] = _image(binary, places[number], number, (height, width))
            stamps[position] = _moment(_camera_fields(binary, places[number])) - start
        fields = _camera_fields(binary, places[chosen[0]])
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
    """The file, or what of a JPEG is FLIR's."""
    with opened(path) as binary:
        if binary.read(0, min(3, binary.size), "the signature") != _JPEG:
            yield binary
            return
        inside = _inside_jpeg(binary)
    yield Binary(path, BytesIO(inside), len(inside))


def _inside_jpeg(binary: Binary) -> bytes:
    """FLIR's records, which lie in numbered segments of a JPEG."""
    parts: dict[int, bytes] = {}
    last, place = 0, 2
    while True:
        marker, length = (int(n) for n in binary.numbers(place, 2, ">u2", "a segment of the JPEG"))
        if marker >> 8 != 0xFF or length < 2:
            raise SourceError(f"{binary.path}: is damaged, no segment of the JPEG at byte {place}")
        if marker == 0xFFDA:  # the picture itself
            break
        if marker == 0xFFE1 and length >= 10:
            segment = binary.read(place + 4, length - 2, "a segment of the JPEG")
            if segment[:5] == b"FLIR\0":
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
    """Where all frames are that are whole."""
    found: list[_Frame] = []
    place: int | None = 0
    while place is not None:
        try:
            found.append(_frame(binary, place, len(found), notes))
        except CutShortError:
            if not found:
                raise
            note_trailing_bytes(notes, len(found), binary.size - place)
            break
        if len(found) > MOST_FRAMES:
            raise SourceError(f"{binary.path}: has over {MOST_FRAMES} frames")
        place = _next(binary, found[-1].end, notes)
    return found


def _next(binary: Binary, end: int, notes: Notes) -> int | None:
    """Where the next frame begins: there may be zeros or something else before it."""
    if binary.read(end, min(4, binary.size - end), "what follows a frame") == _MAGIC:
        return end
    rest = binary.read(end, min(_MOST_PADDING, binary.size - end), "what follows a frame")
    begin = rest.find(_MAGIC)
    if begin >= 0:
        return end + begin
    if rest.strip(b"\0"):
        notes.warnings.append(f"{binary.size - end} bytes after the last frame are not a frame.")
    return None


def _frame(binary: Binary, start: int, number: int, notes: Notes) -> _Frame:
    header = binary.read(start, _HEADER_LENGTH, f"the header of frame {number}")
    if header[:4] != _MAGIC:
        raise SourceError(f"{binary.path}: begins with {header[:4]!r}, expected 'FFF' (FLIR)")
    order = "<" if 100 <= unpack_from("<I", header, 20)[0] < 200 else ">"
    place, count = unpack_from(order + "II", header, 24)
    if not 0 < count <= _MOST_RECORDS:
        raise SourceError(
            f"{binary.path}: frame {number} says {count} records, expected 1 to {_MOST_RECORDS}"
        )
    length = count * _ENTRY_LENGTH
    table = binary.read(start + place, length, f"the list of records of frame {number}")
    records: dict[int, tuple[int, int]] = {}
    big_endian, end = False, start + place + length
    for entry in range(count):
        kind, sort, _, _, offset, size, *_ = unpack_from(
            order + _ENTRY, table, _ENTRY_LENGTH * entry
        )
        if kind == 0:
            continue
        missing = start + offset + size - binary.size
        if missing > 0:
            size -= missing
            if kind != _RAW or not _whole_picture(binary, start + offset, size):
                raise CutShortError(
                    f"{binary.path}: is cut short or damaged, a record of frame {number} ends at "
                    f"byte {binary.size + missing} of {binary.size}"
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
    stored = binary.read(place, length, "counts")
    counts = stored[_RAW_HEADER:]
    packing = _packing(counts)
    if packing:
        return counts.rstrip(b"\0").endswith(_PNG_END if packing == "PNG" else _JPEG_END)
    fields = _Fields(stored[:_RAW_HEADER])
    return len(counts) >= 2 * int(fields.number(2, "H")) * int(fields.number(4, "H")) > 0


# Counts


def _shape(binary: Binary, frame: _Frame, number: int) -> tuple[int, int]:
    fields = _Fields(binary.read(frame.records[_RAW][0], _RAW_HEADER, f"counts of frame {number}"))
    width, height = (int(fields.number(place, "H")) for place in (2, 4))
    check_picture(binary.path, height, width)
    length = frame.records[_RAW][1]
    if height * width > _MOST_PACKED * length:
        raise SourceError(
            f"{binary.path}: frame {number} says {width} columns and {height} rows, which are not "
            f"in {length} bytes"
        )
    return height, width


def packed_counts(path: Path) -> bool:
    """Whether the counts of a file are packed as PNG or JPEG-LS, so that libraries unpack them.

    Raises
    ------
    SourceError
        If it is damaged, cut short or of another kind.
    """
    with _records(path) as binary:
        place, length = _frame(binary, 0, 0, Notes()).records[_RAW]
        return _packing(binary.read(place, length, "counts of frame 0")[_RAW_HEADER:]) != ""


def _packing(stored: bytes) -> str:
    if stored[:8] == _PNG:
        return "PNG"
    return "JPEG-LS" if stored[:3] == _JPEG and _JPEG_LS in stored[:256] else ""


def _image(
    binary: Binary, frame: _Frame, number: int, shape: tuple[int, int]
) -> NDArray[np.uint16]:
    if _shape(binary, frame, number) != shape:
        raise SourceError(
            f"{binary.path}: frame {number} has another shape than frame 0, expected {shape[1]} "
            f"columns and {shape[0]} rows"
        )
    place, length = frame.records[_RAW]
    stored = binary.read(place, length, f"counts of frame {number}")[_RAW_HEADER:]
    packing = _packing(stored)
    if not packing:
        return _plain(binary.path, stored, frame.big_endian, number, shape)
    name = f"{binary.path}: frame {number}"
    with reading(name):
        values = (
            _from_png(stored, shape) if packing == "PNG" else _from_jpeg_ls(name, stored, shape)
        )
    if values.shape != shape or values.dtype != np.uint16:
        raise SourceError(f"{name}: its {packing} is {values.dtype} of shape {values.shape}")
    return _in_order(values)


def _plain(
    path: Path, stored: bytes, big_endian: bool, number: int, shape: tuple[int, int]
) -> NDArray[np.uint16]:
    count = shape[0] * shape[1]
    if len(stored) < 2 * count:
        raise SourceError(
            f"{path}: frame {number} has {len(stored)} bytes of counts, expected {2 * count}"
        )
    values = np.frombuffer(stored, ">u2" if big_endian else "<u2", count)
    return values.reshape(shape).astype(np.uint16)


def _from_png(stored: bytes, shape: tuple[int, int]) -> NDArray[Any]:
    from PIL import Image

    with Image.open(BytesIO(stored), formats=["PNG"]) as picture:
        if picture.size != shape[::-1]:
            raise ValueError(f"PNG of {picture.size} pixels, expected {shape[::-1]}")
        if not picture.mode.startswith("I"):
            raise ValueError(f"PNG of kind {picture.mode}, expected 16 bits of grey")
        return np.asarray(picture).astype(np.uint16)


def _from_jpeg_ls(name: str, stored: bytes, shape: tuple[int, int]) -> NDArray[Any]:
    imagecodecs = required("imagecodecs", name, "camera", "imagecodecs for JPEG-LS")
    height, width = unpack_from(">HH", stored, stored.index(_JPEG_LS) + 5)
    if (height, width) != shape:
        raise ValueError(f"JPEG-LS of {(width, height)} pixels, expected {shape[::-1]}")
    return np.asarray(imagecodecs.jpegls_decode(stored))


def _in_order(values: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Counts whose bytes are in order: most cameras, not all, write PNG with them swapped.

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
    return _Fields(binary.read(place, min(length, 4096), "what the camera says"))


def _moment(fields: _Fields) -> float:
    """When a frame was taken in s since 1970; NaN if it is not said."""
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
    """The greatest count of the camera's range; cameras that do not know it say all 16 bits."""
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
    """Transmission of the air by FLIR's formula, from the constants of the camera.

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
