"""Base of the readers of proprietary camera formats: bytes of a file, and selected frames."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from chipglow.camera import Recording
from chipglow.camera.recording import SignalKind
from chipglow.io.sources import SourceError
from chipglow.io.sources.grids.file_array import check_samples
from chipglow.quantities import Array
from chipglow.radiometry import ObjectParameters
from chipglow.text import Notes

_TEN_YEARS: Final = 31_536_000.0 * 10
"""Seconds of ten years: a camera's clock that shows less since 1970 was not set."""


class CutShortError(SourceError):
    """A file that ends before what should be in it."""


@dataclass(frozen=True)
class Binary:
    """Bytes of a file; to read one that is not there is a CutShortError."""

    path: Path
    stream: BinaryIO
    size: int

    def read(self, start: int, count: int) -> bytes:
        if not (start >= 0 and count >= 0 and start + count <= self.size):
            raise CutShortError(
                f"{self.path}: is truncated or damaged, bytes {start} to {start + count} are "
                f"missing, it has {self.size}"
            )
        self.stream.seek(start)
        return self.stream.read(count)

    def numbers(self, start: int, count: int, dtype: DTypeLike) -> NDArray[Any]:
        """Return numbers, or records of a structured type, from a place."""
        kind: np.dtype[Any] = np.dtype(dtype)
        return np.frombuffer(self.read(start, count * kind.itemsize), kind)

    def record(self, start: int, dtype: np.dtype[Any]) -> dict[str, Any]:
        """Return the fields of one record of a structured type."""
        values = self.numbers(start, 1, dtype)[0].item()
        return dict(zip(dtype.names or (), values, strict=True))

    def marked(self, start: int, dtype: np.dtype[Any], mark: bytes, kind: str) -> dict[str, Any]:
        """Return the fields of a record whose first one has to be the mark of a kind of files."""
        record = self.record(start, dtype)
        found = next(iter(record.values()))
        if found != mark:
            raise SourceError(
                f"{self.path}: begins with {found!r}, expected {mark.decode()!r} ({kind})"
            )
        return record


def layout(length: int, /, **fields: tuple[str, int]) -> np.dtype[Any]:
    """Return the type of a header of `length` bytes: kind and first byte of each field."""
    kinds, places = zip(*fields.values(), strict=True)
    return np.dtype(
        {"names": list(fields), "formats": list(kinds), "offsets": list(places), "itemsize": length}
    )


@contextmanager
def opened(path: Path) -> Iterator[Binary]:
    """Open a file that is not empty."""
    if path.is_dir():
        raise SourceError(f"{path}: is a folder, expected a file")
    with path.open("rb") as stream:
        size = path.stat().st_size
        if size == 0:
            raise SourceError(f"{path}: is empty")
        yield Binary(path, stream, size)


def chosen_frames(path: Path, frames: slice | None, count: int, samples: int) -> range:
    """Return the numbers of the frames to read of `count` whole ones, of `samples` each."""
    if count <= 0:
        raise CutShortError(f"{path}: is truncated or damaged, it has no whole frame")
    numbers = range(count)[frames or slice(None)]
    if not numbers:
        raise SourceError(f"{path}: has {count} frames, none of them is among frames={frames}")
    check_samples(str(path), len(numbers) * samples)
    return numbers


class CameraFile(ABC):
    """An open file of a camera: a class reads its headers when it is made and adds the rest."""

    shape: tuple[int, int]
    """Rows and columns of a picture."""
    complete: int
    """Number of whole frames."""
    quantity: SignalKind = "counts"
    dtype: DTypeLike = np.uint16

    def __init__(self, binary: Binary, notes: Notes) -> None:
        self.binary, self.path, self.notes = binary, binary.path, notes

    @abstractmethod
    def picture(self, number: int) -> NDArray[Any]:
        """Return the samples of a frame."""

    @abstractmethod
    def times(self, chosen: range) -> Array:
        """Return the times of frames in s, from the file's first one on."""

    @abstractmethod
    def facts(self, chosen: range) -> dict[str, Any]:
        """Return the other fields of the `Recording` of some frames."""

    @classmethod
    def recording(cls, path: Path, frames: slice | None, interval: float | None) -> Recording:
        """Read frames; see `CameraFormat`."""
        with opened(path) as binary:
            file = cls(binary, notes := Notes())
            rows, columns = file.shape
            chosen = chosen_frames(path, frames, file.complete, rows * columns)
            signal = np.empty((len(chosen), rows, columns), file.dtype)
            for position, number in enumerate(chosen):
                signal[position] = file.picture(number)
            return Recording(
                signal=signal,
                quantity=file.quantity,
                times=file.times(chosen) if interval is None else evenly(chosen, interval),
                notes=notes,
                **file.facts(chosen),
            )

    @classmethod
    def all_times(cls, path: Path, interval: float | None) -> Array:
        """Return the times of all whole frames in s; see `CameraFormat`."""
        with opened(path) as binary:
            file = cls(binary, Notes())
            every = chosen_frames(path, None, file.complete, 0)
            return file.times(every) if interval is None else evenly(every, interval)

    def stamped(self, chosen: range, stamps: Array | None, rate: float) -> Array:
        """Return stamps in s after the first frame if they ascend, or times by a rate in Hz."""
        if stamps is not None:
            steps = np.diff(stamps) * np.sign(chosen.step)
            if np.isfinite(stamps).all() and (steps > 0).all():
                return stamps
        if not (np.isfinite(rate) and rate > 0):
            raise SourceError(
                f"{self.path}: has neither time stamps that ascend nor a frame rate, give an "
                "interval"
            )
        self.notes.assumed.append(
            f"The frames are 1/{rate:g} s apart, as the file states; it has no ascending time "
            "stamps."
        )
        return evenly(chosen, 1 / rate)

    def note_truncation(self) -> None:
        """Warn that a file ends with an incomplete frame, or lacks some that it states."""
        self.notes.warnings.append(
            f"The file is truncated: {self.complete} complete frames read; the rest is ignored."
        )

    def note_start(self, seconds: float) -> None:
        """Note when frame 0 was taken, in s since 1970, unless the clock was not set."""
        if _TEN_YEARS < seconds < 2**32:
            when = datetime.fromtimestamp(seconds, UTC).isoformat(" ", "milliseconds")
            self.notes.remarks.append(f"Frame 0 was taken at {when}.")

    def common_exposure(self, exposures: Array) -> float | None:
        """Return the integration time in s of all frames; None if they differ or it is 0."""
        least, largest = float(exposures.min()), float(exposures.max())
        if least == largest:
            return least or None
        self.notes.warnings.append(
            f"The integration time varies from {least * 1e6:g} us to {largest * 1e6:g} us."
        )
        return None

    def object_parameters(self, **given: float | None) -> ObjectParameters:
        """Return what was set in a camera of the object; what is impossible is noted only."""
        known: dict[str, float] = {}
        for name, value in given.items():
            if value is None:
                continue
            try:
                ObjectParameters(**{name: value})
            except ValueError:
                self.notes.remarks.append(f"Ignored {name} {value:g}: out of range.")
            else:
                known[name] = value
        return ObjectParameters(**known)


def evenly(chosen: range, interval: float) -> Array:
    """Return times in s of frames that are as far apart, from the file's first one on."""
    return np.asarray(chosen, np.float64) * interval


def check_picture(path: Path, rows: int, columns: int, most: int = 65_535) -> None:
    """Refuse pictures without or with absurdly many rows or columns."""
    if not (0 < rows <= most and 0 < columns <= most):
        raise SourceError(
            f"{path}: says {columns} columns and {rows} rows, expected 1 to {most} of each"
        )


def text_of(raw: bytes) -> str:
    """Return the text up to the first zero, without what cannot be printed."""
    text = raw.split(b"\0")[0].decode("latin-1")
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
