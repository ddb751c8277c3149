"""Files of Vision Research's Phantom cameras, CINE."""

from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.cameras.binary import Binary, CameraFile, CutShortError, check_picture, layout
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
    mirrored=("<u4", 756),
    flipped=("<u4", 760),
    rate=("<u4", 768),
    camera=("<u4", 792),
    colours=("<u4", 808),
    turned=("<i4", 884),
    bits=("<u4", 896),
    shutter=("<u4", 1568),
)
_BLOCK: Final = np.dtype([("size", "<u4"), ("kind", "<u2"), ("more", "<u2")])

_TIMES, _EXPOSURES = 1002, 1003
"""Kinds of the blocks of times and exposure times."""

_TICK: Final = 2.0**-32
"""Unit of times in s."""

_PACKED_10, _PACKED_12 = 256, 1024
"""Codes of packed pictures of 10 and 12 bits."""


class Cine(CameraFile):
    """Phantom's CINE: pictures of 8 and 16 bits, and 10 and 12 bits packed, in grey.

    Packed 10 bits are codes of a curve like that of Recommendation ITU-R BT.709 and become 12 bits
    that are proportional to light.
    """

    def __init__(self, binary: Binary, notes: Notes) -> None:
        super().__init__(binary, notes)
        header = self.header = binary.marked(0, _FILE, b"CI", "CINE")
        setup = self.setup = binary.record(header["setup"], _SETUP)
        if setup["mark"] != b"ST":
            raise SourceError(
                f"{self.path}: the camera's settings begin with {setup['mark']!r}, not 'ST'"
            )
        self._choose_packing(binary.record(header["picture_header"], _PICTURE))
        self.places = binary.numbers(header["places"], header["count"], "<i8")
        self.complete = self._complete()
        notes.remarks.append(f"Frame 0 is number {header['first']} of the recording.")
        viewer = {name: setup[name] for name in ("mirrored", "flipped", "turned") if setup[name]}
        if viewer:
            stated = ", ".join(f"{name} {value}" for name, value in viewer.items())
            notes.warnings.append(
                f"The file tells viewers to turn the image ({stated}); it is not turned (set "
                "quarter_turns or mirror)."
            )
        if self.complete < header["count"]:
            self.note_truncation()

    def _choose_packing(self, picture: dict[str, Any]) -> None:
        height, width = abs(picture["height"]), picture["width"]
        check_picture(self.path, height, width)
        self.shape, self.packing = (height, width), picture["packing"]
        bits = self.bits = picture["bits"]
        if self.header["compression"] or self.setup["colours"] & 0xFFFFFF or bits in (24, 48):
            raise SourceError(
                f"{self.path}: is compressed or in colours, expected plain grey pictures"
            )
        self.upward = False
        # Pixels that share whole bytes, and bits of each.
        packed = {_PACKED_10: (4, 10), _PACKED_12: (2, 12)}.get(self.packing)
        if packed and width % packed[0] == 0:
            self.size, self.bits = height * width * packed[1] // 8, 12
            return
        if self.packing != 0 or bits not in (8, 16):
            raise SourceError(
                f"{self.path}: has pictures of {bits} bits in packing {self.packing} of {width} "
                "columns, expected 8 or 16 bits plain, or 10 or 12 bits packed"
            )
        self.size = height * (-(-width * bits // 32) * 4)  # as in Windows' bitmaps
        self.upward = picture["height"] > 0
        self.stored: str = "u1" if bits == 8 else "<u2"
        if 8 <= self.setup["bits"] <= bits:
            self.bits = self.setup["bits"]

    def _complete(self) -> int:
        """Return how many frames, from the first on, are whole: a cut file lacks the last ones."""
        beyond = np.flatnonzero(self.places + self.size > self.binary.size)
        count = int(beyond[0]) if beyond.size else self.places.size
        while count:
            with suppress(CutShortError):
                if self._start(count - 1) + self.size <= self.binary.size:
                    break
            count -= 1
        return count

    def _start(self, number: int) -> int:
        """Return where the image of a frame begins, behind its annotation."""
        place = int(self.places[number])
        length = int(self.binary.numbers(place, 1, "<u4")[0])
        size = int(self.binary.numbers(place + length - 4, 1, "<u4")[0]) if length >= 8 else 0
        if size != self.size:
            raise SourceError(
                f"{self.path}: is damaged, a frame has {size} bytes, expected {self.size}"
            )
        return place + length

    def picture(self, number: int) -> NDArray[np.uint16]:
        height, width = self.shape
        stored = self.binary.numbers(self._start(number), self.size, "u1").reshape(height, -1)
        if self.packing == _PACKED_10:
            return _unpack_10(stored)
        if self.packing == _PACKED_12:
            return _unpack_12(stored)
        rows = stored.view(self.stored).astype(np.uint16)[:, :width]
        return rows[::-1] if self.upward else rows

    def times(self, chosen: range) -> NDArray[np.float64]:
        stamps = self._of_frames(_TIMES, "<u8")
        if stamps is None:
            return self.stamped(chosen, None, self.setup["rate"])
        ticks = stamps >> 2 << 2  # the two lowest bits are flags
        after = float(self.header["trigger"] - int(ticks[0])) * _TICK
        self.note_start(float(ticks[0]) * _TICK)
        self.notes.remarks.append(f"The trigger was at {after:.9g} s.")
        since = (ticks[list(chosen)] - ticks[0]).astype(np.int64) * _TICK
        return self.stamped(chosen, since, self.setup["rate"])

    def facts(self, chosen: range) -> dict[str, Any]:
        exposures = self._of_frames(_EXPOSURES, "<u4")
        if exposures is None:
            integration_time = self.setup["shutter"] * 1e-9 or None  # ns
        else:
            integration_time = self.common_exposure(exposures[list(chosen)] * _TICK)
        return {
            "camera": f"Phantom {self.setup['camera']}, serial number {self.setup['serial']}",
            "integration_time": integration_time,
            "saturation": 2.0**self.bits - 2,
        }

    def _of_frames(self, kind: int, dtype: str) -> NDArray[Any] | None:
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
    # Codes of black and white, the curve's constants near 0.099, 0.45 and 4.5, and its counts.
    codes = np.arange(1024)
    fraction = (codes - 63.5573) / (1041.4199 - 63.5573)
    power = (np.maximum(fraction + 0.0962, 0) / 1.0962) ** (1 / 0.4502)
    light = np.where(fraction < 0.081, fraction / 4.6157, power)
    counts = np.clip(np.round(64.0143 + 4237.8147 * light), 0, 4095)
    return np.where(codes < 1015, counts, 4095).astype(np.uint16)


_CURVE: Final = _curve()
