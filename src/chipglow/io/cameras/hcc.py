"""Files of Telops' cameras, HCC: a header and 16-bit samples a frame."""

from math import ceil, log2
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.camera.recording import Quantity
from chipglow.io import atomic_path
from chipglow.io.cameras.binary import (
    Binary,
    Timing,
    check_picture,
    chosen_frames,
    common_exposure,
    first_moment,
    layout,
    note_truncation,
    opened,
)
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
_EXPOSURE: Final = 1e-8
_RATE: Final = 1e-3
_SUBSECOND: Final = 1e-7
_WITH_TIME: Final = 10
_MODES: Final[dict[int, tuple[str, Quantity | None]]] = {
    0: ("raw", "counts"),
    255: ("raw", "counts"),
    1: ("corrected for non-uniformity", "counts"),
    2: ("radiometric temperature", "temperature"),
    3: ("in-band radiance", "radiance"),
    4: ("in-band irradiance", None),
}
_WRITTEN_MODE: Final = {"counts": 0, "temperature": 2, "radiance": 3}
_VERSION: Final = (12, 7)
_MOST: Final = 65_535
_GREATEST: Final = 1e30
_LEAST_EXPONENT: Final = -100


def is_hcc(head: bytes) -> bool:
    """Whether a file begins like one of Telops: TC, and a version that is no letter."""
    return head[:2] == b"TC" and len(head) > 3 and 5 <= head[3] < 32


def read_hcc(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of Telops' HCC; see `CameraFormat`.

    Raw and corrected samples are counts. Calibrated ones are temperature or in-band radiance,
    sample · 2^DataExp + DataOffset, frame by frame.
    """
    with opened(path) as binary:
        first = binary.record(0, _HEADER)
        if first["signature"] != b"TC":
            raise SourceError(f"{path}: begins with {first['signature']!r}, expected 'TC' (Telops)")
        check_picture(path, first["height"], first["width"])
        label, quantity = _MODES.get(first["mode"], (f"mode {first['mode']}", None))
        if quantity is None:
            raise SourceError(
                f"{path}: holds {label}, expected counts, temperature or in-band radiance"
            )
        frame = _frame(_header_length(binary, first), first["height"], first["width"])
        whole, rest = divmod(binary.size, frame.itemsize)
        chosen = chosen_frames(path, frames, whole, first["height"] * first["width"])
        stored = np.empty(len(chosen), frame)
        for position, number in enumerate(chosen):
            stored[position] = binary.numbers(number * frame.itemsize, 1, frame)[0]
    headers = stored["header"]
    _check_alike(path, headers, first, chosen)
    version = f"Telops header {first['major']}.{first['minor']}"
    notes = Notes(remarks=[f"The samples are {label} ({version})."])
    if rest:
        note_truncation(notes, whole)
    return Recording(
        signal=_signal(stored, quantity, path),
        quantity=quantity,
        times=_times(headers, first, Timing(path, chosen, interval, notes)),
        camera=f"Telops, serial number {first['serial']}" if first["serial"] else "Telops",
        integration_time=_integration_time(headers, notes),
        saturation=_saturation(first),
        notes=notes,
    )


def _frame(header_length: int, height: int, width: int) -> np.dtype[Any]:
    rest = header_length - _HEADER.itemsize
    return np.dtype([("header", _HEADER), ("", f"V{rest}"), ("image", "<u2", (height, width))])


def _header_length(binary: Binary, first: dict[str, Any]) -> int:
    """Return the length of a frame's header: two lines of the picture, or what the header says."""
    pixels = 2 * first["width"] * first["height"]
    said: list[int] = [4 * first["width"], first["header_length"]]
    lengths = [length for length in said if length >= _HEADER.itemsize]
    # A file without a frame that is cut tells it by its size, else the second header does.
    lengths.sort(key=lambda length: binary.size % (length + pixels) != 0)
    for length in lengths:
        second = length + pixels
        rest = binary.size - second
        if rest >= 0 and b"TC".startswith(binary.read(second, min(2, rest))):
            return length
    raise SourceError(
        f"{binary.path}: is cut short or damaged, it has {binary.size} bytes and no whole frame of "
        f"{first['width']} columns and {first['height']} rows with a second one behind it"
    )


def _check_alike(path: Path, headers: NDArray[Any], first: dict[str, Any], chosen: range) -> None:
    for name in ("signature", "width", "height", "mode"):
        wrong = np.flatnonzero(headers[name] != first[name])
        if wrong.size:
            raise SourceError(
                f"{path}: frame {chosen[wrong[0]]}: {name} is {headers[name][wrong[0]]}, expected "
                f"{first[name]} as in the first frame"
            )


def _signal(stored: NDArray[Any], quantity: Quantity, path: Path) -> NDArray[Any]:
    if quantity == "counts":
        return np.ascontiguousarray(stored["image"])
    headers = stored["header"]
    scale = np.exp2(headers["data_exponent"].astype(np.float64))[:, None, None]
    offset = headers["data_offset"].astype(np.float64)[:, None, None]
    greatest = _MOST * scale + np.abs(offset)
    if not (greatest < np.finfo(np.float32).max).all():
        raise SourceError(f"{path}: DataOffset and DataExp give {greatest.max():g}, expected less")
    return np.asarray(stored["image"] * scale + offset, np.float32)


def _times(headers: NDArray[Any], first: dict[str, Any], timing: Timing) -> NDArray[np.float64]:
    rate = first["rate"] * _RATE
    if timing.interval is not None:
        return timing.even(timing.interval)
    if first["major"] < _WITH_TIME or not headers["seconds"].any():
        return timing.stamped(None, rate)
    timing.notes.remarks.extend(first_moment(first["seconds"] + _SUBSECOND * first["subseconds"]))
    # Whole seconds first: their difference is exact.
    stamps = (
        headers["seconds"].astype(np.int64)
        - first["seconds"]
        + _SUBSECOND * (headers["subseconds"].astype(np.int64) - first["subseconds"])
    )
    return timing.stamped(stamps, rate)


def _integration_time(headers: NDArray[Any], notes: Notes) -> float | None:
    if len(np.unique(headers["filter_position"])) > 1:
        notes.warnings.append("The filter wheel turned between frames.")
    return common_exposure(headers["exposure"] * _EXPOSURE, notes)


def _saturation(first: dict[str, Any]) -> float | None:
    raw = first["mode"] in (0, 255)
    return 2.0 ** first["resolution"] - 2 if raw and 8 <= first["resolution"] <= 16 else None


def write_hcc(path: str | Path, recording: Recording) -> None:
    """Write frames as Telops' HCC.

    Counts are written as raw, temperature and radiance in steps of a power of two, the smallest
    with which 16 bits reach over all values.

    Parameters
    ----------
    path : str or Path
        The file; it is whole or not there.
    recording : Recording
        What to write. Its saturation is kept if it is one less than a power of two, less one:
        16 382 counts are 14 bits.

    Raises
    ------
    ValueError
        If a value cannot be written: counts that are not whole or not from 0 to 65 535, values
        that are not finite, times before the first, fewer than 64 columns.
    """
    target = Path(path)
    count, height, width = recording.signal.shape
    if not 64 <= width <= _MOST or height > _MOST:
        raise ValueError(
            f"{target}: signal has {width} columns and {height} rows, Telops' HCC has 64 to {_MOST}"
            f" columns and up to {_MOST} rows"
        )
    samples, exponent, offset = _samples(target, recording)
    headers = _headers(target, recording, width, height, count)
    headers["header_length"] = 4 * width
    headers["data_exponent"], headers["data_offset"] = exponent, offset
    with atomic_path(target) as unfinished, unfinished.open("wb") as stream:
        for header, image in zip(headers, samples, strict=True):
            frame = np.zeros(1, _frame(4 * width, height, width))
            frame["header"], frame["image"] = header, image
            stream.write(frame.tobytes())


def _samples(path: Path, recording: Recording) -> tuple[NDArray[np.uint16], int, float]:
    values = np.asarray(recording.signal, np.float64)
    low, high = float(values.min()), float(values.max())
    if not (low > -_GREATEST and high < _GREATEST):
        raise ValueError(
            f"{path}: signal has values that are not finite or beyond {_GREATEST:g}, expected less"
        )
    if recording.quantity == "counts":
        if low < 0 or high > _MOST or (values != np.round(values)).any():
            raise ValueError(
                f"{path}: counts go from {low:g} to {high:g}, expected whole numbers from 0 to "
                f"{_MOST}"
            )
        return values.astype(np.uint16), 0, 0.0
    # The header keeps the offset in 32 bits, rounded down here so that no sample is under 0.
    offset = float(np.nextafter(np.float32(low), np.float32(-np.inf)))
    exponent = max(ceil(log2((high - offset) / _MOST)), _LEAST_EXPONENT)
    return np.round((values - offset) / 2.0**exponent).astype(np.uint16), exponent, offset


def _headers(path: Path, recording: Recording, width: int, height: int, count: int) -> NDArray[Any]:
    # A camera's clock never shows 0 seconds: readers take that for a header without time.
    ticks = np.round(recording.times / _SUBSECOND).astype(np.int64) + 10_000_000
    steps = np.diff(recording.times)
    if ticks.min() < 10_000_000 or (np.diff(ticks) <= 0).any() or ticks.max() >= 10_000_000 * 2**32:
        raise ValueError(f"{path}: times do not ascend from 0 in steps of 0.1 us or more")
    headers = np.zeros(count, _HEADER)
    headers["signature"] = b"TC"
    headers["major"], headers["minor"] = _VERSION
    headers["frame"] = np.arange(count)
    headers["width"], headers["height"] = width, height
    headers["mode"] = _WRITTEN_MODE[recording.quantity]
    headers["exposure"] = round((recording.integration_time or 0.0) / _EXPOSURE)
    headers["rate"] = round(min(1 / (np.median(steps) * _RATE), 2**32 - 1)) if count > 1 else 0
    headers["seconds"], headers["subseconds"] = np.divmod(ticks, 10_000_000)
    saturation = recording.saturation
    if saturation is not None and 8 <= log2(saturation + 2) <= 16 and log2(saturation + 2) % 1 == 0:
        headers["resolution"] = round(log2(saturation + 2))
    return headers
