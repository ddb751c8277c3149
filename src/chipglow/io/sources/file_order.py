"""Files of a pattern, by the numbers in their names."""

import re
from collections.abc import Sequence
from errno import ENOENT
from glob import glob, has_magic
from itertools import pairwise
from pathlib import Path

from chipglow.io.sources.source import SourceError


def natural(name: str) -> tuple[tuple[int, str], ...]:
    """Return a key that sorts 9 before 10."""
    words = re.split(r"(\d+)", name)
    return tuple((int(word), "") if word.isdecimal() else (-1, word) for word in words)


def files_of(pattern: str | Path, *, gaps_allowed: bool = True) -> tuple[Path, ...]:
    """Return the files of a path or pattern such as ``chip_*.vtu``, by the numbers in their names.

    A missing number in an otherwise regular series is a `SourceError` unless gaps are allowed.
    """
    if Path(pattern).exists():
        return (Path(pattern),)
    if not has_magic(str(pattern)):
        raise FileNotFoundError(ENOENT, "there is no such file", str(pattern))
    names = glob(str(pattern))  # noqa: PTH207  the folder may be part of the pattern
    files = tuple(Path(name) for name in sorted(names, key=natural))
    if not files:
        raise FileNotFoundError(ENOENT, "no file has such a name", str(pattern))
    if not gaps_allowed:
        _check_gaps(pattern, files)
    return files


def _check_gaps(pattern: str | Path, files: Sequence[Path]) -> None:
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
                f"{pattern}: after {file.name} number {count + usual} is missing, expected the "
                "whole series, or the time of each file"
            )
