"""Files of FLIR's older research cameras, PTW: Cedip's, written by Altair."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.io.cameras.binary import (
    Binary,
    Timing,
    check_picture,
    chosen_frames,
    layout,
    note_truncation,
    object_parameters,
    opened,
    read_pictures,
    text_of,
)
from chipglow.io.sources import SourceError
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
_DAY: Final = 86_400.0
_LONGEST_PERIOD: Final = 86_400.0
_STAMPED: Final = 0.002
"""Two stamps of whole milliseconds may be off by that much in s."""
_CLOCK: Final = 2e-4
"""Relative difference of the computer's clock, which stamps, and the camera's."""


def is_ptw(head: bytes) -> bool:
    """Whether a file begins like one of Cedip's or Agema's cameras.

    Behind the three letters are IP or, in files of Altair 5.60, zeros.
    """
    return head[:3] in (b"CED", b"AIO")


def read_ptw(path: Path, frames: slice | None = None, interval: float | None = None) -> Recording:
    """Read frames of FLIR's PTW as counts; see `CameraFormat`."""
    with opened(path) as binary:
        header = binary.record(0, _HEADER)
        if header["signature"] != b"CED":
            raise SourceError(f"{path}: begins with {header['signature']!r}, expected 'CED' (PTW)")
        rows, columns = header["rows"], header["columns"]
        check_picture(path, rows, columns)
        stride = _stride(path, header)
        whole = min(header["frames"], (binary.size - header["header_size"]) // stride)
        chosen = chosen_frames(path, frames, whole, rows * columns)
        skipped, rows = _lock_in(binary, header, stride)
        start = header["header_size"] + header["frame_header_size"] + 2 * columns * skipped

        def picture(number: int) -> NDArray[Any]:
            counts = binary.numbers(start + number * stride, rows * columns, "<u2")
            return counts.reshape(rows, columns)

        signal = read_pictures(chosen, (rows, columns), picture)
        notes = Notes(remarks=_notes(header, skipped))
        if whole < header["frames"]:
            note_truncation(notes, whole)
        times = _times(binary, header, stride, whole, Timing(path, chosen, interval, notes))
    return Recording(
        signal=signal,
        quantity="counts",
        times=times,
        camera=_camera(header),
        integration_time=_positive(header["integration_time"]),
        saturation=2.0 ** header["bits"] - 2 if 8 <= header["bits"] <= 16 else None,
        object_parameters=object_parameters(
            notes,
            emissivity=header["emissivity"],
            reflected=header["ambient"],
            transmittance=_positive(header["transmittance"]),
            atmosphere=_positive(header["atmosphere"]),
        ),
        notes=notes,
    )


def _stride(path: Path, header: dict[str, Any]) -> int:
    """Return the bytes from frame to frame; refuse a header that does not fit its pictures."""
    size = header["frame_size"]
    needed = header["frame_header_size"] + 2 * header["rows"] * header["columns"]
    # Files of Altair 5.60 count words of 16 bits, others bytes.
    stride = next((length for length in (size, 2 * size) if length >= needed), 0)
    if not stride or header["header_size"] < _HEADER.itemsize:
        raise SourceError(
            f"{path}: is damaged, its header has {header['header_size']} bytes, a frame {size} "
            f"bytes or words, and its picture needs {needed} bytes"
        )
    return stride


def _lock_in(binary: Binary, header: dict[str, Any], stride: int) -> tuple[int, int]:
    """Return the lines to skip before the picture, and its rows: lock-in data may come first."""
    rows, columns = header["rows"], header["columns"]
    start = header["header_size"] + header["frame_header_size"]
    first = binary.numbers(start, min(columns, 4), "<u2")
    if tuple(first) != _LOCK_IN or rows == 1:
        return 0, rows
    lines = (stride - header["frame_header_size"]) // (2 * columns)
    return 1, min(rows, lines - 1)


def _times(
    binary: Binary, header: dict[str, Any], stride: int, whole: int, timing: Timing
) -> NDArray[np.float64]:
    if timing.interval is not None:
        return timing.even(timing.interval)
    period = header["period"] if 0 < header["period"] < _LONGEST_PERIOD else None
    rate = 1 / period if period else 0.0
    if header["frame_header_size"] < _STAMP.itemsize:
        return timing.stamped(None, rate)
    numbers = (0, *timing.frames, whole - 1)
    stamps = np.array([_stamp(binary, header["header_size"] + n * stride) for n in numbers])
    since = np.mod(stamps[1:] - stamps[0], _DAY)
    since, mean = since[:-1], since[-1] / max(numbers[-1], 1)
    if period is None or not since.any():
        return timing.stamped(since, rate)
    return _clocked_times(since, mean, period, timing)


def _clocked_times(
    since: NDArray[np.float64], mean: float, period: float, timing: Timing
) -> NDArray[np.float64]:
    """Return times by the header's period, or by the stamps where they do not fit it.

    The stamps are in s after the file's first frame, in whole milliseconds, with a mean step.
    """
    allowed = _STAMPED + _CLOCK * float(since.max())
    times = timing.even(period)
    # The stamps are whole milliseconds, so that a period that fits them is the finer measure.
    apart = float(np.abs(times - since).max())
    if apart <= allowed:
        return times
    for own in (round(mean / period) * period, mean):
        evenly = timing.even(own)
        if np.abs(evenly - since).max() <= allowed:
            timing.notes.assumed.append(
                f"The frames are {own * 1e6:g} us apart by their time stamps; the period in the "
                f"header is {period * 1e6:g} us."
            )
            return evenly
    timing.notes.warnings.append(
        f"The times follow the frame period, {period * 1e6:g} us; the time stamps differ by up to "
        f"{apart:.3g} s, so frames may be missing."
    )
    return times


def _stamp(binary: Binary, start: int) -> float:
    stamp = binary.record(start, _STAMP)
    seconds = stamp["second"] + stamp["hundredths"] / 100 + stamp["thousandths"] / 1000
    return float(3600 * stamp["hour"] + 60 * stamp["minute"] + seconds)


def _positive(value: float) -> float | None:
    return value if 0 < value < np.inf else None


def _camera(header: dict[str, Any]) -> str:
    name, serial = text_of(header["camera"]), text_of(header["serial"])
    return ", ".join(
        part for part in (name or "Cedip", serial and f"serial number {serial}") if part
    )


def _notes(header: dict[str, Any], skipped: int) -> list[str]:
    notes = [
        f"Saved on {header['year']:04d}-{header['month']:02d}-{header['day']:02d} at "
        f"{header['hour']:02d}:{header['minute']:02d}, by the clock of the computer."
    ]
    for name in ("lens", "filter", "comment"):
        if text := text_of(header[name]):
            notes.append(f"{name.capitalize()}: {text}.")
    if 0 < header["cut_on"] < header["cut_off"] < 100:
        notes.append(
            f"The file says that the camera is sensitive from {header['cut_on']:g} to "
            f"{header['cut_off']:g}, in um presumably."
        )
    if _positive(header["distance"]) is not None:
        notes.append(f"Distance to the object: {header['distance']:g} m.")
    if header["scale"]:
        notes.append(
            f"The file has a scale of its own in {text_of(header['scale_unit']) or 'some unit'}; "
            "it is not applied."
        )
    if skipped:
        notes.append("The first line of each frame holds lock-in data and is left out.")
    return notes
