"""What every reader of other people's fields offers: a survey, and frames sampled on a raster."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.scene import Raster, SampledFrame
from chipglow.text import Notes, check_own_data


class SourceError(ValueError):
    """A source that cannot be read: the message names the file, the field and what was expected."""


def required(module: str, file: object, extra: str, called: str = "") -> Any:
    """A library that reads a file and comes with an extra of chipglow.

    Parameters
    ----------
    module : str
        What is imported.
    file : object
        The file, as the error calls it.
    extra : str
        The extra.
    called : str
        The library's name, if it is not the module's.

    Raises
    ------
    SourceError
        If it is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        needs = called or module
        expected = f"expected pip install 'chipglow[{extra}]'"
        raise SourceError(f"{file}: needs {needs}, {expected}") from None


@contextmanager
def naming(name: object) -> Iterator[None]:
    """Put a name, such as that of the file, before what is wrong, which is a SourceError then."""
    try:
        yield
    except ValueError as error:
        raise SourceError(f"{name}: {error}") from error


def damaged(file: object, error: BaseException, kind: str = "") -> SourceError:
    """The error for a file whose reader, of a kind of files, stumbles over it."""
    said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    as_kind = f" as {kind}" if kind else ""
    return SourceError(
        f"{file}: cannot be read{as_kind}, it is damaged or of another kind ({said})"
    )


def check_hdf5(file: Path) -> None:
    """Refuse an HDF5 file that is damaged or takes data from other files."""
    try:
        with naming(file):
            check_own_data(file)
    except (OSError, RuntimeError, KeyError) as error:
        raise damaged(file, error, "HDF5") from None


@dataclass(frozen=True)
class Survey:
    """What is in a source, before its frames are read.

    Parameters
    ----------
    kind : str
        What it is, for people: ``mesh, 12 files of VTK XML``.
    times : ndarray
        Times of the frames in s, ascending, shape (frames,).
    extent : tuple of float
        Left, right, bottom and top of what is there in m, in the scene's frame of reference: of
        the first and the last frame together.
    found : mapping
        Which of `chipglow.scene.READABLE` come from which field of the source.
    unused : tuple of str
        Fields of the source that nothing is taken from.
    spacing : float, optional
        Side of the source's own samples in m, if they are regular.
    temperatures : tuple of float, optional
        Least and greatest temperature in K of the frames that were looked at, as samples may have
        them; NaN if there is none at all.
    notes : Notes
        Assumptions, and what the file states or lacks.
    """

    kind: str
    times: NDArray[np.float64]
    extent: tuple[float, float, float, float]
    found: Mapping[str, str]
    unused: tuple[str, ...] = ()
    spacing: float | None = None
    temperatures: tuple[float, float] | None = None
    notes: Notes = field(default_factory=Notes)


def even_times(count: int, interval: float | None, notes: Notes) -> NDArray[np.float64]:
    """Times in s of frames that are as far apart: by 1 s if nobody says it, which is remarked."""
    if interval is None and count > 1:
        notes.assumed.append("The files contain no times: frames are 1 s apart.")
    return (1.0 if interval is None else interval) * np.arange(count, dtype=np.float64)


def span_of(values: ArrayLike) -> tuple[float, float]:
    """Least and greatest of what is a number; NaN if nothing is."""
    numbers = np.asarray(values, np.float64)
    known = numbers[np.isfinite(numbers)]
    return (float(known.min()), float(known.max())) if known.size else (np.nan, np.nan)


class Source(ABC):
    """Someone else's fields.

    A source is a frozen dataclass that says where the fields are and what they mean; it opens files
    only in its methods, so that it can be handed to another process. Its declared
    fields are the section of an import's description, which sets the fields ``files``, ``names``,
    ``units``, ``placement`` and ``interval``, as far as it has them; all need a default.

    Attributes
    ----------
    title : str
        What such sources are, for the comment on the section.
    endings : tuple of str
        Endings of such files' names, in small letters.
    """

    title: ClassVar[str] = ""
    endings: ClassVar[tuple[str, ...]] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Its files, as paths and patterns, and folders where there may be more of them."""
        return ()

    @abstractmethod
    def survey(self) -> Survey:
        """Look at what is there.

        Raises
        ------
        SourceError
            If it cannot be read.
        OSError
            If a file is missing or not accessible.
        """

    @abstractmethod
    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one after the other; no more than a few are in memory.

        Parameters
        ----------
        raster : Raster
            Where the samples shall be.
        start : int
            Number of the first frame to sample; those before it are skipped.

        Raises
        ------
        SourceError
            If a frame cannot be read.
        """
