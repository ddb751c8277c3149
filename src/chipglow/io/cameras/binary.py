"""What the readers of cameras' own formats share: bytes that are there, and frames chosen."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from chipglow.io.sources import SourceError
from chipglow.io.sources.arrays import check_samples
from chipglow.radiometry import ObjectParameters
from chipglow.text import Notes

MOST_FRAMES: Final = 10_000_000
"""Most frames of a file."""

_CLOCK_WAS_SET: Final = 31_536_000.0 * 10


class CutShortError(SourceError):
    """A file that ends before what should be in it."""


@dataclass(frozen=True)
class Binary:
    """Bytes of a file, of which none is read that is not there.

    Parameters
    ----------
    path : Path
        The file, as errors call it.
    stream : binary file
        Its bytes.
    size : int
        How many there are.
    """

    path: Path
    stream: BinaryIO
    size: int

    def read(self, start: int, count: int, what: str) -> bytes:
        """Bytes from a place.

        Parameters
        ----------
        start, count : int
            Which.
        what : str
            What they are, for errors.

        Raises
        ------
        CutShortError
            If the file has not so many.
        """
        if not (start >= 0 and count >= 0 and start + count <= self.size):
            raise CutShortError(
                f"{self.path}: is cut short or damaged, {what} should lie at bytes {start} to "
                f"{start + count} of {self.size}"
            )
        self.stream.seek(start)
        return self.stream.read(count)

    def numbers(self, start: int, count: int, dtype: DTypeLike, what: str) -> NDArray[Any]:
        """Numbers, or records of a structured type, from a place; see `read`."""
        kind: np.dtype[Any] = np.dtype(dtype)
        return np.frombuffer(self.read(start, count * kind.itemsize, what), kind)

    def record(self, start: int, dtype: DTypeLike, what: str) -> dict[str, Any]:
        """Fields of one record of a structured type; see `read`."""
        row = self.numbers(start, 1, dtype, what)[0]
        return {name: row[name].item() for name in row.dtype.names}


def layout(size: int, **fields: tuple[str, int]) -> np.dtype[Any]:
    """Structured type of a header.

    Parameters
    ----------
    size : int
        Bytes of the header.
    **fields
        Kind, as numpy writes it, and first byte of each field.
    """
    kinds, places = zip(*fields.values(), strict=True)
    names = list(fields)
    return np.dtype(
        {"names": names, "formats": list(kinds), "offsets": list(places), "itemsize": size}
    )


@contextmanager
def opened(path: Path) -> Iterator[Binary]:
    """Open a file.

    Raises
    ------
    SourceError
        If it is empty or no file.
    OSError
        If it is missing or not accessible.
    """
    if path.is_dir():
        raise SourceError(f"{path}: is a folder, expected a file")
    with path.open("rb") as stream:
        size = path.stat().st_size
        if size == 0:
            raise SourceError(f"{path}: is empty")
        yield Binary(path, stream, size)


def chosen_frames(path: Path, frames: slice | None, count: int, samples: int) -> range:
    """Numbers of the frames to read.

    Parameters
    ----------
    path : Path
        The file.
    frames : slice, optional
        Which; all by default.
    count : int
        How many it has.
    samples : int
        Samples of a frame.

    Raises
    ------
    SourceError
        If there is none, or they are too many to be read at once.
    """
    numbers = range(count)[frames or slice(None)]
    if not numbers:
        raise SourceError(f"{path}: has {count} frames, none of them is among frames={frames}")
    check_samples(str(path), len(numbers) * samples)
    return numbers


def check_picture(path: Path, rows: int, columns: int, most: int = 65_535) -> None:
    """Refuse pictures without or with absurdly many rows or columns.

    Raises
    ------
    SourceError
        If it is so.
    """
    if not (0 < rows <= most and 0 < columns <= most):
        raise SourceError(
            f"{path}: says {columns} columns and {rows} rows, expected 1 to {most} of each"
        )


def text_of(raw: bytes) -> str:
    """Text up to the first zero, without what cannot be printed."""
    text = raw.split(b"\0")[0].decode("latin-1")
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def first_moment(seconds: float) -> tuple[str, ...]:
    """A sentence on when frame 0 was taken, in s since 1970; none if the clock was not set."""
    if not _CLOCK_WAS_SET < seconds < 2**32:
        return ()
    when = datetime.fromtimestamp(seconds, UTC).isoformat(" ", "milliseconds")
    return (f"Frame 0 was taken at {when}.",)


@dataclass(frozen=True)
class Timing:
    """When the frames that are read were taken.

    Parameters
    ----------
    path : Path
        The file, as errors call it.
    frames : range
        Numbers of the frames.
    interval : float, optional
        Time between frames in s, if the user says it.
    notes : Notes
        Receives assumptions and warnings.
    """

    path: Path
    frames: range
    interval: float | None
    notes: Notes

    def even(self, interval: float) -> NDArray[np.float64]:
        """Times in s of frames that are as far apart, from the first one of the file on."""
        return np.asarray(self.frames, np.float64) * interval

    def stamped(self, stamps: NDArray[np.float64] | None, rate: float) -> NDArray[np.float64]:
        """Times in s from stamps, or from the frame rate where they are no good.

        Parameters
        ----------
        stamps : ndarray, optional
            Stamps of the frames in s after the first one of the file, shape (frames,).
        rate : float
            Frame rate in Hz; 0 if it is not known.

        Raises
        ------
        SourceError
            If the stamps do not ascend and the frame rate is not known.
        """
        if stamps is not None:
            steps = np.diff(stamps) * np.sign(self.frames.step)
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
        return self.even(1 / rate)


def note_missing_frames(notes: Notes, stated: int, complete: int) -> None:
    """Warn if a file contains fewer complete frames than its header states."""
    if complete < stated:
        notes.warnings.append(
            f"The file is truncated: {complete} of {stated} frames are complete; the others are "
            "ignored."
        )


def note_trailing_bytes(notes: Notes, complete: int, trailing: int) -> None:
    """Warn that a file ends with an incomplete frame."""
    notes.warnings.append(
        f"The file is truncated: {complete} complete frames read, {trailing} trailing bytes "
        "ignored."
    )


def common_exposure(exposures: NDArray[np.float64], notes: Notes) -> float | None:
    """The integration time in s that all frames have; None if they differ or it is not stated.

    Parameters
    ----------
    exposures : ndarray
        Integration time of each frame in s, shape (frames,); 0 where it is not stated.
    notes : Notes
        Receives a warning if they differ.
    """
    least, greatest = float(exposures.min()), float(exposures.max())
    if least == greatest:
        return least or None
    notes.warnings.append(
        f"The integration time varies from {least * 1e6:g} us to {greatest * 1e6:g} us."
    )
    return None


def object_parameters(notes: Notes, **given: float | None) -> ObjectParameters:
    """What was set in a camera of the object; impossible values are noted and left out.

    Parameters
    ----------
    notes : Notes
        Receives the ignored values.
    **given
        Fields of `ObjectParameters`.
    """
    known: dict[str, float] = {}
    for name, value in given.items():
        try:
            known |= (
                {} if value is None else {name: ObjectParameters(**{name: value}).__dict__[name]}
            )
        except ValueError:
            notes.remarks.append(f"Ignored {name} {value:g}: out of range.")
    return ObjectParameters(**known)
