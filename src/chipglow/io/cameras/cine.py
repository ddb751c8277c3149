"""Files of Vision Research's Phantom cameras, CINE."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.io.cameras.binary import (
    MOST_FRAMES,
    Binary,
    CutShortError,
    Timing,
    check_picture,
    chosen_frames,
    common_exposure,
    first_moment,
    layout,
    note_missing_frames,
    opened,
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
_MOST_BLOCKS: Final = 1000
_TICK: Final = 2.0**-32
_PACKED_10, _PACKED_12 = 256, 1024


def is_cine(head: bytes) -> bool:
    """Whether a file begins like one of Phantom's."""
    return head[:4] == b"CI\x2c\0"


@dataclass(frozen=True)
class _Pictures:
    """How the pictures of a file are stored."""

    height: int
    width: int
    size: int
    unpack: Callable[[NDArray[np.uint8]], NDArray[np.uint16]]
    upward: bool
    bits: int

    def image(self, raw: bytes) -> NDArray[np.uint16]:
        """Counts of a picture, row 0 at the top."""
        stored = np.frombuffer(raw, np.uint8).reshape(self.height, -1)
        rows = self.unpack(stored)[:, : self.width]
        return rows[::-1] if self.upward else rows


def read_cine(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of Phantom's CINE as counts; see `CameraFormat`.

    Pictures of 8 and 16 bits, and 10 and 12 bits packed, in grey. Packed 10 bits are codes of a
    curve like that of Recommendation ITU-R BT.709 and become 12 bits that are proportional to
    light.
    """
    with opened(path) as binary:
        header = binary.record(0, _FILE, "the header")
        if header["mark"] != b"CI":
            raise SourceError(f"{path}: begins with {header['mark']!r}, expected 'CI' (CINE)")
        setup = binary.record(header["setup"], _SETUP, "the camera's settings")
        if setup["mark"] != b"ST":
            raise SourceError(
                f"{path}: the camera's settings begin with {setup['mark']!r}, not 'ST'"
            )
        pictures = _pictures(binary, header, setup)
        count = header["count"]
        if not 0 < count <= MOST_FRAMES:
            raise SourceError(f"{path}: says {count} frames, expected 1 to {MOST_FRAMES}")
        places = binary.numbers(header["places"], count, "<i8", "the places of the frames")
        whole = _whole(binary, places, pictures)
        chosen = chosen_frames(path, frames, whole, pictures.height * pictures.width)
        signal = np.empty((len(chosen), pictures.height, pictures.width), np.uint16)
        for position, number in enumerate(chosen):
            start = _image_start(binary, int(places[number]), pictures, number)
            signal[position] = pictures.image(binary.read(start, pictures.size, f"frame {number}"))
        notes = Notes(remarks=[f"Frame 0 is number {header['first']} of the recording."])
        note_missing_frames(notes, count, whole)
        blocks = _blocks(binary, header, setup)
        times = _times(binary, blocks, header, setup["rate"], Timing(path, chosen, interval, notes))
        integration_time = _integration_time(binary, blocks, header, setup, chosen, notes)
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
    picture = binary.record(header["picture_header"], _PICTURE, "the pictures' header")
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
    unpack = _bytes if bits == 8 else _words
    return _Pictures(height, width, height * line, unpack, picture["height"] > 0, real)


def _bytes(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    return stored.astype(np.uint16)


def _words(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    return stored.view("<u2").astype(np.uint16)


def _unpack_10(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Four codes in five bytes, the highest bits first, and what they stand for."""
    a, b, c, d, e = np.moveaxis(stored.reshape(len(stored), -1, 5).astype(np.uint16), -1, 0)
    codes = (a << 2 | b >> 6, (b & 63) << 4 | c >> 4, (c & 15) << 6 | d >> 2, (d & 3) << 8 | e)
    return _CURVE[np.stack(codes, axis=-1).reshape(len(stored), -1)]


def _unpack_12(stored: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Two counts in three bytes, the highest bits first."""
    a, b, c = np.moveaxis(stored.reshape(len(stored), -1, 3).astype(np.uint16), -1, 0)
    return np.stack((a << 4 | b >> 4, (b & 15) << 8 | c), axis=-1).reshape(len(stored), -1)


def _curve() -> NDArray[np.uint16]:
    """Counts of 12 bits by code of 10 bits.

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


def _whole(binary: Binary, places: NDArray[np.int64], pictures: _Pictures) -> int:
    """How many frames, from the first on, are whole: a cut file may lack the last ones.

    Raises
    ------
    CutShortError
        If none is.
    """
    _image_start(binary, int(places[0]), pictures, 0)
    beyond = np.flatnonzero(places + pictures.size > binary.size)
    count = int(beyond[0]) if beyond.size else places.size
    while True:
        try:
            _image_start(binary, int(places[count - 1]), pictures, count - 1)
        except CutShortError:
            count -= 1
        else:
            return count


def _image_start(binary: Binary, place: int, pictures: _Pictures, number: int) -> int:
    """Where the image of a frame begins, behind its annotation; refuses one that is not there."""
    what = f"frame {number}"
    length = int(binary.numbers(place, 1, "<u4", what)[0])
    size = int(binary.numbers(place + length - 4, 1, "<u4", what)[0]) if length >= 8 else 0
    if size != pictures.size or place + length + size > binary.size:
        kind = SourceError if size != pictures.size else CutShortError
        raise kind(
            f"{binary.path}: is cut short or damaged, {what} has {size} bytes from byte "
            f"{place + length} of {binary.size}, expected {pictures.size}"
        )
    return place + length


def _blocks(
    binary: Binary, header: dict[str, Any], setup: dict[str, Any]
) -> dict[int, tuple[int, int]]:
    """Where the tagged blocks between settings and frames are, and how long: by their kind."""
    found: dict[int, tuple[int, int]] = {}
    place, end = header["setup"] + setup["length"], min(header["places"], binary.size)
    while place + _BLOCK.itemsize <= end and len(found) < _MOST_BLOCKS:
        block = binary.record(place, _BLOCK, "a tagged block")
        if not _BLOCK.itemsize <= block["size"] <= end - place:
            break
        found.setdefault(block["kind"], (place + _BLOCK.itemsize, block["size"] - _BLOCK.itemsize))
        place += block["size"]
        if not block["more"]:
            break
    return found


def _of_frames(
    binary: Binary, blocks: dict[int, tuple[int, int]], kind: int, count: int, dtype: str
) -> NDArray[Any] | None:
    """Numbers of a tagged block, one a frame, if the file has it."""
    place, size = blocks.get(kind, (0, 0))
    if size != count * np.dtype(dtype).itemsize:
        return None
    return binary.numbers(place, count, dtype, "a tagged block")


def _times(
    binary: Binary,
    blocks: dict[int, tuple[int, int]],
    header: dict[str, Any],
    rate: int,
    timing: Timing,
) -> NDArray[np.float64]:
    if timing.interval is not None:
        return timing.even(timing.interval)
    stamps = _of_frames(binary, blocks, _TIMES, header["count"], "<u8")
    if stamps is None:
        return timing.stamped(None, rate)
    ticks = stamps >> 2 << 2  # the two lowest bits are flags
    after = float(int(header["trigger"]) - int(ticks[0])) * _TICK
    remarks = timing.notes.remarks
    remarks.extend(first_moment(float(ticks[0]) * _TICK))
    remarks.append(f"The trigger was at {after:.9g} s.")
    since = (ticks[list(timing.frames)] - ticks[0]).astype(np.int64) * _TICK
    return timing.stamped(since, rate)


def _integration_time(
    binary: Binary,
    blocks: dict[int, tuple[int, int]],
    header: dict[str, Any],
    setup: dict[str, Any],
    chosen: range,
    notes: Notes,
) -> float | None:
    exposures = _of_frames(binary, blocks, _EXPOSURES, header["count"], "<u4")
    if exposures is None:
        return setup["shutter"] * 1e-9 or None
    return common_exposure(exposures[list(chosen)] * _TICK, notes)
