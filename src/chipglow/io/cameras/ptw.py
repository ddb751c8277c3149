"""Files of FLIR's older research cameras, PTW: Cedip's, written by Altair."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.cameras.binary import Binary, CameraFile, check_picture, evenly, layout, text_of
from chipglow.io.sources import SourceError
from chipglow.quantities import Array
from chipglow.radiometry import Band
from chipglow.text import Notes

# Places as in the Altair Reference Guide DL002U-D, after pyradi's ryptw.
_HEADER: Final = layout(
    1563,
    signature=("S3", 0),
    header_size=("<u4", 11),
    frame_header_size=("<u4", 15),
    frame_size=("<u4", 19),
    frames=("<u4", 27),
    year=("<u2", 35),
    day=("u1", 37),
    month=("u1", 38),
    minute=("u1", 39),
    hour=("u1", 40),
    camera=("S20", 44),
    lens=("S20", 64),
    filter=("S20", 84),
    emissivity=("<f4", 141),
    ambient=("<f4", 145),
    distance=("<f4", 149),
    transmittance=("<f4", 170),
    atmosphere=("<f4", 184),
    cut_on=("<f4", 188),
    cut_off=("<f4", 192),
    serial=("S11", 220),
    scale=("<u2", 277),
    scale_unit=("S10", 279),
    columns=("<u2", 377),
    rows=("<u2", 379),
    bits=("<u2", 381),
    period=("<f4", 403),
    integration_time=("<f4", 407),
    comment=("S1000", 563),
)
_STAMP: Final = layout(
    161,
    minute=("u1", 80),
    hour=("u1", 81),
    hundredths=("u1", 82),
    second=("u1", 83),
    thousandths=("u1", 160),
)

_LOCK_IN: Final = (1220, 3907, 1204, 2382)
"""First values of a line of lock-in data."""

_DAY: Final = 86_400.0
"""Seconds per day, after which the clock restarts at 0."""

_STAMPED: Final = 0.002
"""Two stamps of whole milliseconds may be off by that much in s."""
_CLOCK: Final = 2e-4
"""Relative difference of the computer's clock, which stamps, and the camera's."""


class Ptw(CameraFile):
    """FLIR's PTW: counts."""

    def __init__(self, binary: Binary, notes: Notes) -> None:
        super().__init__(binary, notes)
        header = self.header = binary.marked(0, _HEADER, b"CED", "PTW")
        rows, columns = header["rows"], header["columns"]
        check_picture(self.path, rows, columns)
        self.stride = self._stride()
        self.complete = min(header["frames"], (binary.size - header["header_size"]) // self.stride)
        self.start = header["header_size"] + header["frame_header_size"]
        first = binary.numbers(self.start, min(columns, 4), "<u2")
        # A line of lock-in data may come before each picture.
        if lock_in := rows > 1 and tuple(first) == _LOCK_IN:
            lines = (self.stride - header["frame_header_size"]) // (2 * columns)
            self.start, rows = self.start + 2 * columns, min(rows, lines - 1)
        self.shape = rows, columns
        self._note_header(lock_in)
        if self.complete < header["frames"]:
            self.note_truncation()

    def _stride(self) -> int:
        """Return the bytes from frame to frame; refuse a header that does not fit its pictures."""
        header, size = self.header, self.header["frame_size"]
        needed = header["frame_header_size"] + 2 * header["rows"] * header["columns"]
        # Files of Altair 5.60 count words of 16 bits, others bytes.
        stride = next((length for length in (size, 2 * size) if length >= needed), 0)
        if not stride or header["header_size"] < _HEADER.itemsize:
            raise SourceError(
                f"{self.path}: is damaged, its header has {header['header_size']} bytes, a frame "
                f"{size} bytes or words, and its picture needs {needed} bytes"
            )
        return stride

    def picture(self, number: int) -> NDArray[np.uint16]:
        rows, columns = self.shape
        start = self.start + number * self.stride
        return self.binary.numbers(start, rows * columns, "<u2").reshape(rows, columns)

    def times(self, chosen: range) -> Array:
        header = self.header
        period = header["period"] if 0 < header["period"] < _DAY else None
        rate = 1 / period if period else 0.0
        if header["frame_header_size"] < _STAMP.itemsize:
            return self.stamped(chosen, None, rate)
        last = self.complete - 1
        stamps = np.array([self._stamp(number) for number in (0, *chosen, last)])
        since = np.mod(stamps[1:] - stamps[0], _DAY)
        since, mean = since[:-1], since[-1] / max(last, 1)
        if period is None or not since.any():
            return self.stamped(chosen, since, rate)
        return self._clocked_times(chosen, since, mean, period)

    def _clocked_times(self, chosen: range, since: Array, mean: float, period: float) -> Array:
        """Return times by the header's period, or by the stamps where they do not fit it.

        The stamps are in s after the file's first frame, in whole milliseconds, with a mean step:
        a period that fits them is the finer measure.
        """
        allowed = _STAMPED + _CLOCK * float(since.max())
        for step in (period, round(mean / period) * period, mean):
            times = evenly(chosen, step)
            if np.abs(times - since).max() > allowed:
                continue
            if step != period:
                self.notes.assumed.append(
                    f"The frames are {step * 1e6:g} us apart by their time stamps; the period in "
                    f"the header is {period * 1e6:g} us."
                )
            return times
        times = evenly(chosen, period)
        self.notes.warnings.append(
            f"The times follow the frame period, {period * 1e6:g} us; the time stamps differ by up "
            f"to {np.abs(times - since).max():.3g} s, so frames may be missing."
        )
        return times

    def _stamp(self, number: int) -> float:
        stamp = self.binary.record(self.header["header_size"] + number * self.stride, _STAMP)
        seconds = stamp["second"] + stamp["hundredths"] / 100 + stamp["thousandths"] / 1000
        return float(3600 * stamp["hour"] + 60 * stamp["minute"] + seconds)

    def facts(self, chosen: range) -> dict[str, Any]:
        header = self.header
        name, serial = text_of(header["camera"]) or "Cedip", text_of(header["serial"])
        return {
            "camera": f"{name}, serial number {serial}" if serial else name,
            "integration_time": _positive(header["integration_time"]),
            "saturation": 2.0 ** header["bits"] - 2 if 8 <= header["bits"] <= 16 else None,
            "object_parameters": self.object_parameters(
                emissivity=header["emissivity"],
                reflected=header["ambient"],
                transmittance=_positive(header["transmittance"]),
                atmosphere=_positive(header["atmosphere"]),
            ),
            "stated_band": self._stated_band(),
        }

    def _stated_band(self) -> Band | None:
        """Return the camera's band, whose unit the file does not state: um presumably."""
        low, high = self.header["cut_on"], self.header["cut_off"]
        # Other numbers are not limits of a band in µm.
        return Band(1e-6 * low, 1e-6 * high) if 0.1 < low < high < 100 else None

    def _note_header(self, lock_in: bool) -> None:
        header, remarks = self.header, self.notes.remarks
        remarks.append(
            f"Saved on {header['year']:04d}-{header['month']:02d}-{header['day']:02d} at "
            f"{header['hour']:02d}:{header['minute']:02d}, by the clock of the computer."
        )
        for name in ("lens", "filter", "comment"):
            if text := text_of(header[name]):
                remarks.append(f"{name.capitalize()}: {text}.")
        if self._stated_band():
            remarks.append(
                f"The file says that the camera is sensitive from {header['cut_on']:g} to "
                f"{header['cut_off']:g}, in um presumably."
            )
        if _positive(header["distance"]) is not None:
            remarks.append(f"Distance to the object: {header['distance']:g} m.")
        if header["scale"]:
            remarks.append(
                f"The file has its own scale in {text_of(header['scale_unit']) or 'some unit'}"
                "; it is not applied."
            )
        if lock_in:
            remarks.append("The first line of each frame holds lock-in data and is left out.")


def _positive(value: float) -> float | None:
    return value if 0 < value < np.inf else None
