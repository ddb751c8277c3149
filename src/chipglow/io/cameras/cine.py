"""Files of Vision Research's Phantom cameras, CINE."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.io.cameras.binary import (
    Binary,
    CutShortError,
    Timing,
    check_picture,
    chosen_frames,
    common_exposure,
    first_moment,
    layout,
    note_truncation,
    opened,
    read_pictures,
)
from chipglow.io.sources import SourceError
from chipglow.text import Notes

_FILE: Final = layout(
    44,
    mark=("S2", 0),
    compression=("<u2", 4),
    first=("<i4", 16),
    count=("<u4", 20),
    picture_header=("<u4", 24),
    setup=("<u4", 28),
    places=("<u4", 32),
    trigger=("<u8", 36),
)
_PICTURE: Final = layout(
    40, width=("<i4", 4), height=("<i4", 8), bits=("<u2", 14), packing=("<u4", 16)
)
_SETUP: Final = layout(
    1600,
    mark=("S2", 140),
    length=("<u2", 142),
    serial=("<u4", 743),
    rate=("<u4", 768),
    camera=("<u4", 792),
    colours=("<u4", 808),
    bits=("<u4", 896),
    shutter=("<u4", 1568),
)
_BLOCK: Final = np.dtype([("size", "<u4"), ("kind", "<u2"), ("more", "<u2")])
_TIMES, _EXPOSURES = 1002, 1003
_TICK: Final = 2.0**-32
_PACKED_10, _PACKED_12 = 256, 1024


def is_cine(head: bytes) -> bool:
    """Whether a file begins like one of Phantom's."""
    return head[:4] == b"CI\x2c\0"


@dataclass(frozen=True)
class _Pictures:
    """How the pictures of a file are stored; `size` in bytes."""

    height: int
    width: int
    size: int
    unpack: Callable[[NDArray[np.uint8]], NDArray[np.uint16]]
    upward: bool
    bits: int

    def image(self, raw: bytes) -> NDArray[np.uint16]:
        """Return the counts of a picture, row 0 at the top."""
        stored = np.frombuffer(raw, np.uint8).reshape(self.height, -1)
        rows = self.unpack(stored)[:, : self.width]
        return rows[::-1] if self.upward else rows


@dataclass(frozen=True)
class _Cine:
    """A file and its headers."""

    binary: Binary
    header: dict[str, Any]
    setup: dict[str, Any]
    pictures: _Pictures

    @classmethod
    def of(cls, binary: Binary) -> "_Cine":
        """Read the headers."""
        header = binary.record(0, _FILE)
        if header["mark"] != b"CI":
            raise SourceError(
                f"{binary.path}: begins with {header['mark']!r}, expected 'CI' (CINE)"
            )
        setup = binary.record(header["setup"], _SETUP)
        if setup["mark"] != b"ST":
            raise SourceError(
                f"{binary.path}: the camera's settings begin with {setup['mark']!r}, not 'ST'"
            )
        return cls(binary, header, setup, _pictures(binary, header, setup))

    def start(self, place: int) -> int:
        """Return where the image of a frame begins, behind its annotation."""
        length = int(self.binary.numbers(place, 1, "<u4")[0])
        size = int(self.binary.numbers(place + length - 4, 1, "<u4")[0]) if length >= 8 else 0
        if size != self.pictures.size:
            raise SourceError(
                f"{self.binary.path}: is damaged, a frame has {size} bytes, expected "
                f"{self.pictures.size}"
            )
        return place + length

    def image(self, place: int) -> NDArray[np.uint16]:
        """Return the counts of a frame."""
        return self.pictures.image(self.binary.read(self.start(place), self.pictures.size))

    def whole(self, places: NDArray[np.int64]) -> int:
        """Return how many frames, from the first on, are whole: a cut file lacks the last ones."""
        beyond = np.flatnonzero(places + self.pictures.size > self.binary.size)
        count = int(beyond[0]) if beyond.size else places.size
        while count:
            try:
                if self.start(int(places[count - 1])) + self.pictures.size <= self.binary.size:
                    break
            except CutShortError:
                pass
            count -= 1
        return count

    def of_frames(self, kind: int, dtype: str) -> NDArray[Any] | None:
        """Return the numbers of a tagged block before the frames, one a frame; None without it."""
        count = self.header["count"]
        size = _BLOCK.itemsize + count * np.dtype(dtype).itemsize
        place = self.header["setup"] + self.setup["length"]
        while place + _BLOCK.itemsize <= min(self.header["places"], self.binary.size):
            block = self.binary.record(place, _BLOCK)
            if (block["kind"], block["size"]) == (kind, size):
                return self.binary.numbers(place + _BLOCK.itemsize, count, dtype)
            if not block["more"] or block["size"] < _BLOCK.itemsize:
                break
            place += block["size"]
        return None


def read_cine(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of Phantom's CINE as counts; see `CameraFormat`.

    Pictures of 8 and 16 bits, and 10 and 12 bits packed, in grey. Packed 10 bits are codes of a
    curve like that of Recommendation ITU-R BT.709 and become 12 bits that are proportional to
    light.
    """
    with opened(path) as binary:
        file = _Cine.of(binary)
        header, setup, pictures = file.header, file.setup, file.pictures
        places = binary.numbers(header["places"], header["count"], "<i8")
        whole = file.whole(places)
        chosen = chosen_frames(path, frames, whole, pictures.height * pictures.width)
        signal = read_pictures(
            chosen,
            (pictures.height, pictures.width),
            lambda number: file.image(int(places[number])),
        )
        notes = Notes(remarks=[f"Frame 0 is number {header['first']} of the recording."])
        if whole < header["count"]:
            note_truncation(notes, whole)
        times = _times(file, Timing(path, chosen, interval, notes))
        integration_time = _integration_time(file, chosen, notes)
    return Recording(
        signal=signal,
        quantity="counts",
        times=times,
        camera=f"Phantom {setup['camera']}, serial number {setup['serial']}",
        integration_time=integration_time,
        saturation=2.0**pictures.bits - 2,
        notes=notes,
    )


def _pictures(binary: Binary, header: dict[str, Any], setup: dict[str, Any]) -> _Pictures:
    path = binary.path
    picture = binary.record(header["picture_header"], _PICTURE)
    height, width = abs(picture["height"]), picture["width"]
    check_picture(path, height, width)
    bits, packing = picture["bits"], picture["packing"]
    if header["compression"] != 0 or setup["colours"] & 0xFFFFFF or bits in (24, 48):
        raise SourceError(f"{path}: is compressed or in colours, expected plain grey pictures")
    if packing == _PACKED_10 and width % 4 == 0:
        return _Pictures(height, width, height * width * 5 // 4, _unpack_10, False, 12)
    if packing == _PACKED_12 and width % 2 == 0:
        return _Pictures(height, width, height * width * 3 // 2, _unpack_12, False, 12)
    if packing != 0 or bits not in (8, 16):
        raise SourceError(
            f"{path}: has pictures of {bits} bits in packing {packing} of {width} columns, "
            "expected 8 or 16 bits plain, or 10 or 12 bits packed"
        )
    line = -(-width * bits // 32) * 4  # as in Windows' bitmaps
    real = setup["bits"] if 8 <= setup["bits"] <= bits else bits
    kind = "u1" if bits == 8 else "<u2"
    return _Pictures(
        height,
        width,
        height * line,
        lambda stored: stored.view(kind).astype(np.uint16),
        picture["height"] > 0,
        real,
    )


def _unpack_10(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Unpack four codes in five bytes, the highest bits first, and return their counts."""
    a, b, c, d, e = np.moveaxis(stored.reshape(len(stored), -1, 5).astype(np.uint16), -1, 0)
    codes = (a << 2 | b >> 6, (b & 63) << 4 | c >> 4, (c & 15) << 6 | d >> 2, (d & 3) << 8 | e)
    return _CURVE[np.stack(codes, axis=-1).reshape(len(stored), -1)]


def _unpack_12(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Unpack two counts in three bytes, the highest bits first."""
    a, b, c = np.moveaxis(stored.reshape(len(stored), -1, 3).astype(np.uint16), -1, 0)
    return np.stack((a << 4 | b >> 4, (b & 15) << 8 | c), axis=-1).reshape(len(stored), -1)


def _curve() -> NDArray[np.uint16]:
    """Return counts of 12 bits by code of 10 bits.

    The maker publishes a table. This is the curve of Recommendation ITU-R BT.709 with constants
    fitted to it: within two counts of the table, and clipped where it is.
    """
    codes = np.arange(1024)
    fraction = (codes - 63.5573) / (1041.4199 - 63.5573)
    power = (np.maximum(fraction + 0.0962, 0) / 1.0962) ** (1 / 0.4502)
    light = np.where(fraction < 0.081, fraction / 4.6157, power)
    counts = np.clip(np.round(64.0143 + 4237.8147 * light), 0, 4095)
    return np.where(codes < 1015, counts, 4095).astype(np.uint16)


_CURVE: Final = _curve()


def _times(file: _Cine, timing: Timing) -> NDArray[np.float64]:
    if timing.interval is not None:
        return timing.even(timing.interval)
    stamps = file.of_frames(_TIMES, "<u8")
    if stamps is None:
        return timing.stamped(None, file.setup["rate"])
    ticks = stamps >> 2 << 2  # the two lowest bits are flags
    after = float(int(file.header["trigger"]) - int(ticks[0])) * _TICK
    remarks = timing.notes.remarks
    remarks.extend(first_moment(float(ticks[0]) * _TICK))
    remarks.append(f"The trigger was at {after:.9g} s.")
    since = (ticks[list(timing.frames)] - ticks[0]).astype(np.int64) * _TICK
    return timing.stamped(since, file.setup["rate"])


def _integration_time(file: _Cine, chosen: range, notes: Notes) -> float | None:
    exposures = file.of_frames(_EXPOSURES, "<u4")
    if exposures is None:
        return file.setup["shutter"] * 1e-9 or None
    return common_exposure(exposures[list(chosen)] * _TICK, notes)
