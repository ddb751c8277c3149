"""Files of FLIR's cameras: FFF, SEQ and CSQ, and JPEG with the same records inside.

The layout follows ExifTool's documentation of FLIR's tags.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from math import exp, isfinite, nan, sqrt
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import PlanckConversion
from chipglow.io.cameras.binary import (
    Binary,
    CameraFile,
    CutShortError,
    check_picture,
    layout,
    opened,
    text_of,
)
from chipglow.io.sources import SourceError
from chipglow.io.sources.grids.images import ORIENTATION, roughness
from chipglow.io.sources.source import reading, required
from chipglow.quantities import ZERO_CELSIUS
from chipglow.text import Notes

_MAGIC: Final = b"FFF\0"
_JPEG: Final = b"\xff\xd8\xff"
_EXIF: Final = b"Exif\0\0"
_JPEG_LS: Final = b"\xff\xf7"
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_ENDS: Final = {"PNG": b"IEND\xaeB`\x82", "JPEG-LS": b"\xff\xd9"}
_HEADER: Final = layout(
    64, magic=("S4", 0), version=("<u4", 20), place=("<u4", 24), count=("<u4", 28)
)
_ENTRY: Final = layout(32, kind=("<u2", 0), sort=("<u2", 2), offset=("<u4", 12), size=("<u4", 16))

_MOST_RECORDS: Final = 1000
"""Most records of a frame; more are a damaged file."""

_RAW, _CAMERA = 1, 32
"""Kinds of records: counts, and settings of the camera."""

_RAW_HEADER: Final = 32
"""Bytes before the counts of a record."""

_BIG_ENDIAN: Final = 1
"""Sort of a record with big-endian numbers."""

_MOST_PADDING: Final = 1 << 20
"""Most bytes after the last frame that may be padding: 1 MiB."""

_LARGE: Final = 100.0
"""An exponent that is possible, and no transmittance."""

_RAW_FIELDS: Final = layout(_RAW_HEADER, width=("<u2", 2), height=("<u2", 4))
_CAMERA_FIELDS: Final = layout(
    0x466,
    emissivity=("<f4", 0x20),
    distance=("<f4", 0x24),
    reflected=("<f4", 0x28),
    atmosphere=("<f4", 0x2C),
    window_temperature=("<f4", 0x30),
    window=("<f4", 0x34),
    humidity=("<f4", 0x3C),
    r1=("<f4", 0x58),
    b=("<f4", 0x5C),
    f=("<f4", 0x60),
    alpha_1=("<f4", 0x70),
    alpha_2=("<f4", 0x74),
    beta_1=("<f4", 0x78),
    beta_2=("<f4", 0x7C),
    air_part=("<f4", 0x80),
    hottest=("<f4", 0x90),
    coldest=("<f4", 0x94),
    model=("S32", 0xD4),
    serial=("S16", 0x104),
    lens=("S16", 0x170),
    filter=("S16", 0x1EC),
    o=("<i4", 0x308),
    r2=("<f4", 0x30C),
    least_count=("<u2", 0x310),
    most_counts=("<u2", 0x312),
    seconds=("<u4", 0x384),
    milliseconds=("<u4", 0x388),
    rate=("<u2", 0x464),
)


@dataclass(frozen=True)
class _Frame:
    """Start and length of a frame's records by their kind, and the order of its counts."""

    records: dict[int, tuple[int, int]]
    big_endian: bool
    end: int


def _fields(raw: bytes, kind: np.dtype[Any]) -> dict[str, Any]:
    """Return fields of a record; 0, or no text, for later ones that are not there."""
    order: Any = "<" if raw[:2] == b"\x02\0" else ">"
    whole = raw[: kind.itemsize].ljust(kind.itemsize, b"\0")
    values = np.frombuffer(whole, kind.newbyteorder(order))[0].item()
    return dict(zip(kind.names or (), values, strict=True))


class Flir(CameraFile):
    """FLIR's radiometric JPEG, FFF, SEQ and CSQ: counts."""

    def __init__(self, binary: Binary, notes: Notes) -> None:
        inside = _records(binary, notes)
        super().__init__(inside, notes)
        self.frames = self._find_frames(single=inside is not binary)
        self.complete = len(self.frames)
        self.shape = self._shape(0)
        check_picture(self.path, *self.shape)
        self.camera_fields = cache(self._camera_fields)

    def _find_frames(self, single: bool) -> list[_Frame]:
        """Find all frames that are whole; a JPEG has a single one, whatever follows it."""
        found: list[_Frame] = []
        place: int | None = 0
        while place is not None:
            try:
                found.append(_frame(self.binary, place, len(found), self.notes))
            except CutShortError:
                if not found:
                    raise
                self.complete = len(found)
                self.note_truncation()
                break
            place = None if single else self._next(found[-1].end)
        return found

    def _next(self, end: int) -> int | None:
        """Find the next frame: there may be zeros or something else before it."""
        size = self.binary.size
        rest = self.binary.read(end, min(4, size - end))
        if rest != _MAGIC:
            rest = self.binary.read(end, min(_MOST_PADDING, size - end))
        begin = rest.find(_MAGIC)
        if begin >= 0:
            return end + begin
        if rest.strip(b"\0"):
            self.notes.warnings.append(f"{size - end} bytes after the last frame are not a frame.")
        return None

    def _shape(self, number: int) -> tuple[int, int]:
        place, _ = self.frames[number].records[_RAW]
        fields = _fields(self.binary.read(place, _RAW_HEADER), _RAW_FIELDS)
        return fields["height"], fields["width"]

    def picture(self, number: int) -> NDArray[np.uint16]:
        name, frame = f"{self.path}: frame {number}", self.frames[number]
        rows, columns = self.shape
        if self._shape(number) != self.shape:
            raise SourceError(
                f"{name} has another shape than frame 0, expected {columns} columns and {rows} rows"
            )
        stored = self.binary.read(*frame.records[_RAW])[_RAW_HEADER:]
        packing = _packing(stored)
        with reading(name):
            if not packing:
                order = ">u2" if frame.big_endian else "<u2"
                return np.frombuffer(stored, order, rows * columns).reshape(rows, columns)
            values = _unpacked(name, packing, stored)
        if values.shape != self.shape or values.dtype != np.uint16:
            raise SourceError(f"{name}: its {packing} is {values.dtype} of shape {values.shape}")
        return _in_order(values)

    def _camera_fields(self, number: int) -> dict[str, Any]:
        place, length = self.frames[number].records.get(_CAMERA, (0, 0))
        return _fields(
            self.binary.read(place, min(length, _CAMERA_FIELDS.itemsize)), _CAMERA_FIELDS
        )

    def _moment(self, number: int) -> float:
        """Return the time of a frame in s since 1970; NaN if the file does not state it."""
        fields = self.camera_fields(number)
        seconds, milliseconds = fields["seconds"], fields["milliseconds"]
        return float(seconds + (milliseconds & 0xFFFF) / 1000) if seconds else nan

    def times(self, chosen: range) -> NDArray[np.float64]:
        if self.complete == 1:
            return np.zeros(1)
        stamps = np.array([self._moment(number) for number in chosen]) - self._moment(0)
        # Stamps are whole milliseconds.
        return self.stamped(chosen, np.round(stamps, 3), self.camera_fields(chosen[0])["rate"])

    def facts(self, chosen: range) -> dict[str, Any]:
        fields = self.camera_fields(chosen[0])
        self.note_start(self._moment(0))
        model, serial = text_of(fields["model"]), text_of(fields["serial"])
        name = model if model.startswith("FLIR") else f"FLIR {model}".strip()
        # Cameras without a limit state the end of 16 bits.
        least, most = fields["least_count"], fields["most_counts"]
        facts = {
            "camera": f"{name}, serial number {serial}" if serial else name,
            "saturation": float(most) if least < most < 65_535 else None,
            "least_signal": float(least) if 0 < least < most else None,
            "conversion": self._conversion(fields),
            "object_parameters": self._object(fields),
        }
        for part in ("lens", "filter"):
            if text := text_of(fields[part]):
                self.notes.remarks.append(f"{part.capitalize()}: {text}.")
        low, high = fields["coldest"], fields["hottest"]
        # Above 10,000 K the fields are not a range of the camera.
        if 0 < low < high < 10_000:
            self.notes.remarks.append(
                f"The camera was set to measure from {low - ZERO_CELSIUS:g} to "
                f"{high - ZERO_CELSIUS:g} degC."
            )
        return facts

    def _conversion(self, fields: dict[str, Any]) -> PlanckConversion | None:
        try:
            return PlanckConversion(**{name: fields[name] for name in ("r1", "b", "f", "o", "r2")})
        except ValueError as error:
            self.notes.remarks.append(
                f"Ignored the impossible conversion to temperature in the file ({error})."
            )
            return None

    def _object(self, fields: dict[str, Any]) -> Any:
        distance, humidity, atmosphere, window = (
            fields[name] for name in ("distance", "humidity", "atmosphere", "window")
        )
        transmittance = window if 0 < window < np.inf else 1.0
        if isfinite(distance) and isfinite(humidity) and isfinite(atmosphere):
            fraction = humidity / 100 if humidity > 2 else humidity
            self.notes.remarks.append(
                f"Set in the camera: an object at {distance:g} m and a humidity of "
                f"{fraction * 100:g} %."
            )
            transmittance *= _through_air(fields, distance, fraction, atmosphere)
        if isfinite(window) and window != 1:
            self.notes.remarks.append(
                f"Set in the camera: a window that lets {window * 100:g} % pass, at "
                f"{fields['window_temperature'] - ZERO_CELSIUS:g} degC; here it is as warm as the "
                "air."
            )
        given = {name: fields[name] for name in ("emissivity", "reflected", "atmosphere")}
        known = {name: value for name, value in given.items() if isfinite(value)}
        return self.object_parameters(transmittance=transmittance, **known)


def _through_air(
    fields: dict[str, Any], distance: float, humidity: float, temperature: float
) -> float:
    """Return the transmission of the air by FLIR's formula, from the camera's constants.

    Minkina and Dudzik, Infrared Thermography: Errors and Uncertainties (2009), Section 2.3.
    """
    names = ("alpha_1", "beta_1", "alpha_2", "beta_2", "air_part")
    alpha_1, beta_1, alpha_2, beta_2, part = constants = [fields[name] for name in names]
    celsius = temperature - ZERO_CELSIUS
    # Beyond these limits, in °C and m, the fields are not the state of the air.
    known = isfinite(sum(constants)) and -100 < celsius < 100
    if not known or not (0 <= distance < 1e6 and 0 <= humidity <= 1):
        return 1.0
    # Water in air in g/m³.
    water = humidity * exp(
        1.5587 + 6.939e-2 * celsius - 2.7816e-4 * celsius**2 + 6.8455e-7 * celsius**3
    )
    first, second = (
        exp(min(_LARGE, -sqrt(distance) * (alpha + beta * sqrt(water))))
        for alpha, beta in ((alpha_1, beta_1), (alpha_2, beta_2))
    )
    return float(part * first + (1 - part) * second)


# Records


def _records(binary: Binary, notes: Notes) -> Binary:
    """Return what of a JPEG is FLIR's, in numbered segments; another file as it is."""
    if binary.read(0, min(3, binary.size)) != _JPEG:
        return binary
    parts: dict[int, bytes] = {}
    last, place, marker = 0, 2, 0
    while marker != 0xFFDA:  # the picture itself
        marker, length = (int(n) for n in binary.numbers(place, 2, ">u2"))
        if marker >> 8 != 0xFF or length < 2:
            raise SourceError(f"{binary.path}: is damaged, no segment of the JPEG at byte {place}")
        segment = binary.read(place + 4, length - 2) if marker == 0xFFE1 else b""
        if segment[:5] == b"FLIR\0" and len(segment) >= 8:
            parts[segment[6]], last = segment[8:], segment[7]
        if segment.startswith(_EXIF):
            _note_orientation(segment, notes)
        place += 2 + length
    if not parts:
        raise SourceError(f"{binary.path}: is a JPEG without FLIR's counts in it")
    if sorted(parts) != list(range(last + 1)):
        raise SourceError(
            f"{binary.path}: has {len(parts)} parts of FLIR's records, expected {last + 1}"
        )
    inside = b"".join(parts[number] for number in range(last + 1))
    return Binary(binary.path, BytesIO(inside), len(inside))


def _note_orientation(segment: bytes, notes: Notes) -> None:
    """Warn of an image that viewers turn: the counts are stored as the sensor reads them."""
    from PIL import Image

    exif = Image.Exif()
    with suppress(Exception):  # damaged EXIF concerns the visible image only
        exif.load(segment)
    if (orientation := exif.get(ORIENTATION, 1)) != 1:
        notes.warnings.append(
            f"The JPEG states the EXIF orientation {orientation}, by which viewers turn the image; "
            "the counts are not turned (set quarter_turns or mirror)."
        )


def _frame(binary: Binary, start: int, number: int, notes: Notes) -> _Frame:
    entry, header = _ENTRY, binary.marked(start, _HEADER, b"FFF", "FLIR")
    if not 100 <= header["version"] < 200:
        entry, header = _ENTRY.newbyteorder(">"), binary.record(start, _HEADER.newbyteorder(">"))
    count, place = header["count"], start + header["place"]
    if not 0 < count <= _MOST_RECORDS:
        raise SourceError(
            f"{binary.path}: frame {number} says {count} records, expected 1 to {_MOST_RECORDS}"
        )
    records: dict[int, tuple[int, int]] = {}
    big_endian, end = False, place + count * _ENTRY.itemsize
    entries = binary.numbers(place, count, entry)
    for kind, sort, offset, size in entries.tolist():
        if kind == 0:
            continue
        missing = start + offset + size - binary.size
        if missing > 0:
            size -= missing
            if kind != _RAW or not _whole_picture(binary, start + offset, size):
                raise CutShortError(
                    f"{binary.path}: is truncated or damaged, {missing} bytes of a record of frame "
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
    """Return whether a record of counts, of which the end is missing, has all of them."""
    if length <= _RAW_HEADER:
        return False
    stored = binary.read(place, length)
    counts = stored[_RAW_HEADER:]
    if packing := _packing(counts):
        return counts.rstrip(b"\0").endswith(_ENDS[packing])
    fields = _fields(stored, _RAW_FIELDS)
    return bool(len(counts) >= 2 * fields["width"] * fields["height"] > 0)


# Counts


def has_packed_counts(path: Path) -> bool:
    """Return whether the counts of a file are packed as PNG or JPEG-LS."""
    with opened(path) as file:
        binary = _records(file, Notes())
        stored = binary.read(*_frame(binary, 0, 0, Notes()).records[_RAW])
        return _packing(stored[_RAW_HEADER:]) != ""


def _packing(stored: bytes) -> str:
    if stored[:8] == _PNG:
        return "PNG"
    return "JPEG-LS" if stored[:3] == _JPEG and _JPEG_LS in stored[:256] else ""


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

    Neighbours in an image are similar, unless the bytes of its counts are swapped.
    """
    swapped = values.byteswap()
    return swapped if roughness(swapped) < roughness(values) else values
