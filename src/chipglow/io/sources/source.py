"""Interface of all readers of fields: a survey, and frames sampled on a raster."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from math import isfinite
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.scene import Raster, SampledFrame
from chipglow.text import Notes, TableError, check_own_data, needs_extra


class SourceError(ValueError):
    """A source that cannot be read: the message names the file, the field and what was expected."""


def required(module: str, file: object, extra: str, called: str = "") -> Any:
    """Import a library of an extra of chipglow; raise `SourceError` if it is not installed."""
    try:
        return import_module(module)
    except ImportError:
        raise SourceError(needs_extra(file, called or module, extra)) from None


@contextmanager
def naming(name: object) -> Iterator[None]:
    """Put a name, such as that of the file, before any ValueError, which becomes a SourceError."""
    try:
        yield
    except ValueError as error:
        raise SourceError(f"{name}: {error}") from error


@contextmanager
def table_errors() -> Iterator[None]:
    """Turn errors on text tables, which name the file, into SourceErrors."""
    try:
        yield
    except TableError as error:
        raise SourceError(str(error)) from None


def damaged(file: object, error: BaseException, kind: str = "") -> SourceError:
    """Return the error for a file, of a kind of files, whose reader raised another error."""
    said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    as_kind = f" as {kind}" if kind else ""
    return SourceError(
        f"{file}: cannot be read{as_kind}, it is damaged or of another kind ({said})"
    )


@contextmanager
def reading(file: object, kind: str = "") -> Iterator[None]:
    """Turn whatever a library raises over a damaged file into one `SourceError`."""
    try:
        yield
    except (SourceError, FileNotFoundError, PermissionError, MemoryError):
        raise
    except (Exception, SystemExit) as error:  # meshio ends the program for some files
        raise damaged(file, error, kind) from error


def check_hdf5(file: Path) -> None:
    """Refuse an HDF5 file that is damaged or takes data from other files."""
    with reading(file, "HDF5"), naming(file):
        check_own_data(file)


def head_of(file: Path, size: int) -> bytes:
    """Return the first bytes of a file, as many as there are."""
    with file.open("rb") as stream:
        return stream.read(size)


def mapped(file: Path) -> mmap:
    """Return the bytes of a file, mapped into memory."""
    with file.open("rb") as stream:
        return mmap(stream.fileno(), 0, access=ACCESS_READ)


@dataclass(frozen=True)
class Survey:
    """Contents of a source before its frames are read."""

    kind: str
    """Human-readable description: ``mesh, 12 files of VTK XML``."""
    times: NDArray[np.float64]
    """Times of the frames in s, ascending, shape (frames,)."""
    extent: tuple[float, float, float, float]
    """Left, right, bottom and top in m in the scene, of the first and the last frame together."""
    found: Mapping[str, str]
    """The source's fields by the names of `chipglow.scene.READABLE`."""
    unused: tuple[str, ...] = ()
    """Fields of the source that are not used."""
    spacing: float | None = None
    """Side of the source's own samples in m, if they are regular."""
    temperatures: tuple[float, float] | None = None
    """Smallest and largest temperature in K of some frames; NaN if they contain no number."""
    notes: Notes = field(default_factory=Notes)
    """Assumptions, and what the file states or lacks."""


def even_times(count: int, interval: float | None, notes: Notes) -> NDArray[np.float64]:
    """Return evenly spaced times in s: 1 s apart, which is noted, unless an interval is given."""
    if interval is not None and not (isfinite(interval) and interval > 0):
        raise SourceError(f"interval: {interval!r} s, expected more than 0")
    if interval is None and count > 1:
        notes.assumed.append("The files contain no times: frames are 1 s apart.")
    return (1.0 if interval is None else interval) * np.arange(count, dtype=np.float64)


def span_of(values: ArrayLike) -> tuple[float, float]:
    """Return the smallest and the largest finite value; NaN without one."""
    numbers = np.asarray(values, np.float64)
    known = numbers[np.isfinite(numbers)]
    return (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)


def extent_of(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of samples by their even centres, y descending."""
    across, down = (x[-1] - x[0]) / (x.size - 1) / 2, (y[0] - y[-1]) / (y.size - 1) / 2
    return float(x[0] - across), float(x[-1] + across), float(y[-1] - down), float(y[0] + down)


class Source(ABC):
    """Fields of another program or of a measurement.

    A source is a frozen dataclass that opens files only in its methods, so that it can be sent to
    another process. Its declared fields are the section of an import's description, which sets
    the fields ``files``, ``names``, ``units``, ``placement`` and ``interval`` if they exist; all
    need a default.
    """

    title: ClassVar[str] = ""
    """Name of such sources for the comment on the section."""
    endings: ClassVar[tuple[str, ...]] = ()
    """Endings of the names of their files, in lower case."""

    @property
    def own_files(self) -> Any:
        """Files that its section of an import's description names itself, instead of a source."""
        return None

    @abstractmethod
    def survey(self) -> Survey:
        """Return what the source contains.

        Raises
        ------
        SourceError
            If it cannot be read.
        OSError
            If a file is missing or not accessible.
        """

    @abstractmethod
    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one by one; only a few are in memory at a time.

        Parameters
        ----------
        raster : Raster
            Positions of the samples.
        start : int
            Index of the first frame to sample.

        Raises
        ------
        SourceError
            If a frame cannot be read.
        """


def check_times(name: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return times, which must ascend."""
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise SourceError(
            f"{name}: does not ascend, frame {i + 1} is at {times[i + 1]:.9g} s after "
            f"{times[i]:.9g} s"
        )
    return times
