"""An array of numbers in a file, which is read in parts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import prod
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import SourceError, reading
from chipglow.text import Notes

MOST_SAMPLES: Final = 100_000_000
"""Maximum number of samples that are read at once."""

Key = tuple[slice, ...]
Read: TypeAlias = Callable[[Key], NDArray[Any]]
"""Returns the part of an array given by a slice for every axis."""


@dataclass(frozen=True)
class FileArray:
    """Numeric array in a file, or in a series of files."""

    name: str
    """Its name in the file; empty where the format has none."""
    shape: tuple[int, ...]
    read: Read
    dims: tuple[str, ...] = ()
    """Names of its axes, if the file states them."""
    attributes: Mapping[str, Any] = field(default_factory=dict)
    """``units``, ``scale_factor``, ``_FillValue`` and others: text, a number or an array."""
    chunks: tuple[int, ...] | None = None
    """Shape of the parts that the file keeps together."""
    path: str = ""
    """The file or pattern."""
    notes: Notes = field(default_factory=Notes)
    """Assumptions, warnings and corrections of the reader, of the parts read so far."""

    def __str__(self) -> str:
        return f"{self.path}: {self.name}"

    @property
    def short(self) -> str:
        """Last part of the name."""
        return self.name.rsplit("/", 1)[-1]

    @property
    def unit(self) -> str | None:
        unit = self.attributes.get("units")
        return unit if isinstance(unit, str) else None

    @property
    def size(self) -> int:
        return prod(self.shape)

    def part(self, key: Key = ()) -> NDArray[Any]:
        """Read the part given by a slice for every axis, or all of it."""
        key = key or (slice(None),) * len(self.shape)
        lengths = [len(range(length)[along]) for length, along in zip(self.shape, key, strict=True)]
        check_samples(str(self), prod(lengths))
        check_samples(f"{self}: a chunk", prod(self.chunks or ()))
        with reading(self):
            return self.read(key)


def list_array(name: str, values: NDArray[np.float64], unit: str) -> FileArray:
    """Return values of a coordinate as an array of a file."""
    return FileArray(name, values.shape, lambda key: values[key], attributes={"units": unit})


def check_samples(name: str, count: int) -> None:
    """Refuse to read more at once than `MOST_SAMPLES`."""
    if count > MOST_SAMPLES:
        raise SourceError(f"{name}: {count:.3g} samples at once, expected up to {MOST_SAMPLES:.3g}")
