"""Files of Telops' cameras, HCC: a header and 16-bit samples per frame."""

from math import ceil, log2
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.camera.recording import SignalKind
from chipglow.io.atomic import atomic_path
from chipglow.io.cameras.binary import Binary, CameraFile, check_picture, layout
from chipglow.io.sources import SourceError
from chipglow.text import Notes

_HEADER: Final = layout(
    256,
    signature=("S2", 0),
    minor=("u1", 2),
    major=("u1", 3),
    header_length=("<u2", 4),
    frame=("<u4", 8),
    data_offset=("<f4", 12),
    data_exponent=("i1", 16),
    exposure=("<u4", 24),
    mode=("u1", 28),
    width=("<u2", 32),
    height=("<u2", 34),
    rate=("<u4", 44),
    seconds=("<u4", 100),
    subseconds=("<u4", 104),
    filter_position=("u1", 128),
    resolution=("u1", 225),
    serial=("<u4", 248),
)

_EXPOSURE_UNIT: Final = 1e-8
"""Unit of the exposure in s."""

_RATE_UNIT: Final = 1e-3
"""Unit of the frame rate in Hz."""

_SUBSECOND_UNIT: Final = 1e-7
"""Unit of the fraction of a second in s."""

_TICKS: Final = 10_000_000
"""Number of these units per second."""

_FEWEST_COLUMNS: Final = 64
"""Columns with which two lines of a picture hold the 256 bytes of a header."""

_FIRST_WITH_TIME: Final = 10
"""Major version from which headers state the time."""

_MODES: Final[dict[int, tuple[str, SignalKind | None]]] = {
    0: ("raw", "counts"),
    255: ("raw", "counts"),
    1: ("corrected for non-uniformity", "counts"),
    2: ("radiometric temperature", "temperature"),
    3: ("in-band radiance", "radiance"),
    4: ("in-band irradiance", None),
}
"""Name and quantity of each mode."""

_WRITTEN_MODE: Final = {"counts": 0, "temperature": 2, "radiance": 3}
"""Mode of each quantity that is written."""

_WRITTEN_VERSION: Final = (12, 7)
"""Major and minor version of written files."""

_LARGEST_COUNT: Final = 65_535
"""Largest count and size: 16 bits."""

_LARGEST_VALUE: Final = 1e30
"""Values beyond cannot be scaled in single precision."""

_LEAST_EXPONENT: Final = -100
"""Smallest power of two of a count's value."""


class Hcc(CameraFile):
    """Telops' HCC.

    Raw and corrected samples are counts. Calibrated ones are temperature or in-band radiance,
    sample · 2^DataExp + DataOffset, frame by frame.
    """

    def __init__(self, binary: Binary, notes: Notes) -> None:
        super().__init__(binary, notes)
        first = self.first = binary.marked(0, _HEADER, b"TC", "Telops")
        self.shape = first["height"], first["width"]
        check_picture(self.path, *self.shape)
        label, quantity = _MODES.get(first["mode"], (f"mode {first['mode']}", None))
        if quantity is None:
            raise SourceError(
                f"{self.path}: holds {label}, expected counts, temperature or in-band radiance"
            )
        self.quantity = quantity
        self.dtype = np.uint16 if quantity == "counts" else np.float32
        self.header_length = self._header_length()
        self.stride = self.header_length + 2 * first["height"] * first["width"]
        self.complete, rest = divmod(binary.size, self.stride)
        version = f"Telops header {first['major']}.{first['minor']}"
        notes.remarks.append(f"The samples are {label} ({version}).")
        if rest:
            self.note_truncation()

    def _header_length(self) -> int:
        """Return the length of a frame's header: two lines of the picture, or as it states."""
        first, size = self.first, self.binary.size
        pixels = 2 * first["width"] * first["height"]
        stated = (4 * first["width"], first["header_length"])
        lengths = [length for length in stated if length >= _HEADER.itemsize]
        # A file without a frame that is cut tells it by its size, else the second header does.
        lengths.sort(key=lambda length: size % (length + pixels) != 0)
        for length in lengths:
            rest = size - length - pixels
            if rest >= 0 and b"TC".startswith(self.binary.read(length + pixels, min(2, rest))):
                return int(length)
        raise SourceError(
            f"{self.path}: is truncated or damaged, it has {size} bytes and no whole frame of "
            f"{first['width']} columns and {first['height']} rows with a second one behind it"
        )

    def _headers(self, chosen: range) -> NDArray[Any]:
        return np.concatenate([self.binary.numbers(n * self.stride, 1, _HEADER) for n in chosen])

    def picture(self, number: int) -> NDArray[Any]:
        header = self.binary.record(number * self.stride, _HEADER)
        for name in ("signature", "width", "height", "mode"):
            if header[name] != self.first[name]:
                raise SourceError(
                    f"{self.path}: frame {number}: {name} is {header[name]}, expected "
                    f"{self.first[name]} as in the first frame"
                )
        start = number * self.stride + self.header_length
        image = self.binary.numbers(start, self.shape[0] * self.shape[1], "<u2").reshape(self.shape)
        if self.quantity == "counts":
            return image
        scale: float = 2.0 ** header["data_exponent"]
        offset: float = header["data_offset"]
        largest = _LARGEST_COUNT * scale + abs(offset)
        if not largest < np.finfo(np.float32).max:
            raise SourceError(
                f"{self.path}: DataOffset and DataExp give {largest:g}, expected less"
            )
        return image * scale + offset

    def times(self, chosen: range) -> NDArray[np.float64]:
        first, headers = self.first, self._headers(chosen)
        rate = first["rate"] * _RATE_UNIT
        if first["major"] < _FIRST_WITH_TIME or not headers["seconds"].any():
            return self.stamped(chosen, None, rate)
        self.note_start(first["seconds"] + _SUBSECOND_UNIT * first["subseconds"])
        # Whole seconds first: their difference is exact.
        stamps = (
            headers["seconds"].astype(np.int64)
            - first["seconds"]
            + _SUBSECOND_UNIT * (headers["subseconds"].astype(np.int64) - first["subseconds"])
        )
        return self.stamped(chosen, stamps, rate)

    def facts(self, chosen: range) -> dict[str, Any]:
        first, headers = self.first, self._headers(chosen)
        if len(np.unique(headers["filter_position"])) > 1:
            self.notes.warnings.append("The filter wheel turned between frames.")
        is_raw = first["mode"] in (0, 255) and 8 <= first["resolution"] <= 16
        return {
            "camera": f"Telops, serial number {first['serial']}" if first["serial"] else "Telops",
            "integration_time": self.common_exposure(headers["exposure"] * _EXPOSURE_UNIT),
            "saturation": 2.0 ** first["resolution"] - 2 if is_raw else None,
        }


def write_hcc(path: str | Path, recording: Recording) -> None:
    """Write frames as Telops' HCC.

    Counts are written as raw, temperature and radiance in steps of a power of two, the smallest
    with which 16 bits reach over all values.

    Parameters
    ----------
    path : str or Path
        The file; it is whole or not there.
    recording : Recording
        The recording. Its saturation is kept if it is one less than a power of two, less one:
        16 382 counts are 14 bits.

    Raises
    ------
    ValueError
        If a value cannot be written: counts that are not whole or not from 0 to 65 535, values
        that are not finite, times before the first, fewer than 64 columns.
    """
    target = Path(path)
    count, height, width = recording.signal.shape
    if not _FEWEST_COLUMNS <= width <= _LARGEST_COUNT or height > _LARGEST_COUNT:
        raise ValueError(
            f"{target}: signal has {width} columns and {height} rows, Telops' HCC has "
            f"{_FEWEST_COLUMNS} to {_LARGEST_COUNT} columns and up to {_LARGEST_COUNT} rows"
        )
    samples, exponent, offset = _samples(target, recording)
    headers = _headers(target, recording, width, height, count)
    headers["header_length"] = 4 * width
    headers["data_exponent"], headers["data_offset"] = exponent, offset
    with atomic_path(target) as unfinished, unfinished.open("wb") as stream:
        for header, image in zip(headers, samples, strict=True):
            stream.write(header.tobytes().ljust(4 * width, b"\0"))
            stream.write(image.astype("<u2").tobytes())


def _samples(path: Path, recording: Recording) -> tuple[NDArray[np.uint16], int, float]:
    values = np.asarray(recording.signal, np.float64)
    low, high = float(values.min()), float(values.max())
    if not (low > -_LARGEST_VALUE and high < _LARGEST_VALUE):
        raise ValueError(
            f"{path}: signal has values that are not finite or beyond {_LARGEST_VALUE:g}, "
            "expected less"
        )
    if recording.quantity == "counts":
        if low < 0 or high > _LARGEST_COUNT or (values != np.round(values)).any():
            raise ValueError(
                f"{path}: counts go from {low:g} to {high:g}, expected whole numbers from 0 to "
                f"{_LARGEST_COUNT}"
            )
        return values.astype(np.uint16), 0, 0.0
    # The header keeps the offset in 32 bits, rounded down here so that no sample is under 0.
    offset = float(np.nextafter(np.float32(low), np.float32(-np.inf)))
    exponent = max(ceil(log2((high - offset) / _LARGEST_COUNT)), _LEAST_EXPONENT)
    return np.round((values - offset) / 2.0**exponent).astype(np.uint16), exponent, offset


def _headers(path: Path, recording: Recording, width: int, height: int, count: int) -> NDArray[Any]:
    # A camera's clock never shows 0 seconds: readers take that for a header without time.
    ticks = np.round(recording.times / _SUBSECOND_UNIT).astype(np.int64) + _TICKS
    steps = np.diff(recording.times)
    if ticks.min() < _TICKS or (np.diff(ticks) <= 0).any() or ticks.max() >= _TICKS * 2**32:
        raise ValueError(f"{path}: times do not ascend from 0 in steps of 0.1 us or more")
    headers = np.zeros(count, _HEADER)
    headers["signature"] = b"TC"
    headers["major"], headers["minor"] = _WRITTEN_VERSION
    headers["frame"] = np.arange(count)
    headers["width"], headers["height"] = width, height
    headers["mode"] = _WRITTEN_MODE[recording.quantity]
    headers["exposure"] = round((recording.integration_time or 0.0) / _EXPOSURE_UNIT)
    headers["rate"] = round(min(1 / (np.median(steps) * _RATE_UNIT), 2**32 - 1)) if count > 1 else 0
    headers["seconds"], headers["subseconds"] = np.divmod(ticks, _TICKS)
    saturation = recording.saturation
    if saturation is not None and 8 <= log2(saturation + 2) <= 16 and log2(saturation + 2) % 1 == 0:
        headers["resolution"] = round(log2(saturation + 2))
    return headers
