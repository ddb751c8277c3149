"""What a reader of meshes over time offers, and series of files."""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from glob import glob, has_magic
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

from chipglow.io.sources.file_order import natural
from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.source import SourceError


class MeshReader(ABC):
    """Meshes over time.

    Attributes
    ----------
    kind : str
        What it is, for people.
    times : tuple of float, optional
        Times of the frames in the file's unit; None if the files have none.
    count : int
        Number of frames.
    assumed : tuple of str
        What had to be assumed, a sentence each.
    known : mapping
        Names that fields have in this format alone, by those of a scene.
    """

    kind: str
    times: tuple[float, ...] | None
    count: int
    assumed: tuple[str, ...] = ()
    known: Mapping[str, str] = MappingProxyType({})

    @abstractmethod
    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame.

        Raises
        ------
        SourceError
            If it cannot be read.
        """

    @abstractmethod
    def file(self, number: int) -> Path:
        """The file that holds a frame, for messages."""


def files_of(path: Path, *, gaps_allowed: bool) -> tuple[Path, ...]:
    """Files of a path or a pattern such as ``chip_*.vtu``, by the numbers in their names.

    Raises
    ------
    SourceError
        If a number is missing where the others are evenly apart, unless gaps are allowed.
    FileNotFoundError
        If there is no file.
    """
    if path.exists():
        return (path,)
    if not has_magic(str(path)):
        raise FileNotFoundError(f"{path}: no such file")
    names = glob(str(path))  # noqa: PTH207  the folder may be part of the pattern
    files = [Path(name) for name in sorted(names, key=natural)]
    if not files:
        raise FileNotFoundError(f"{path}: no file matches this pattern")
    if not gaps_allowed:
        _check_gaps(path, files)
    return tuple(files)


def _check_gaps(path: Path, files: Sequence[Path]) -> None:
    numbers = [[int(digits) for digits in re.findall(r"\d+", file.name)] for file in files]
    columns = [set(column) for column in zip(*numbers, strict=False)]
    counted = [at for at, column in enumerate(columns) if len(column) == len(files)]
    if len(files) < 3 or not counted:
        return
    counts = [row[counted[-1]] for row in numbers]
    steps = [after - before for before, after in pairwise(counts)]
    usual = max(sorted(set(steps)), key=steps.count)
    for file, count, step in zip(files, counts, steps, strict=False):
        # A step that is twice the usual one is a file that got lost; the last is often shorter.
        if step > usual and step % usual == 0:
            raise SourceError(
                f"{path}: after {file.name} number {count + usual} is missing, expected the "
                "whole series, or the time of each file"
            )
