"""Files of a pattern in the order that the numbers in their names state."""

import re
from collections.abc import Sequence
from decimal import Decimal
from errno import ENOENT
from glob import glob, has_magic
from itertools import pairwise
from pathlib import Path
from typing import Final

from chipglow.io.sources.source import SourceError

_MOMENT: Final = re.compile(
    r"(?<!\d)((?:19|20)\d\d)([-_.]?)(\d\d)\2(\d\d)"
    r"(?:[-_.T ]*(\d\d)([-_.:h]?)(\d\d)[-_.:m]?(\d\d)(?:[-_.,](\d{1,9}))?)?(?!\d)",
    re.ASCII,
)
"""Date with the year first, and maybe the time: its digits sort as one number."""

_BODY: Final = r"(?:(?<!\d\.)\d+\.\d+(?![\d.]*\d)|\d+)(?:[eE][+-]?\d+)?"
_NUMBERS: Final = tuple(
    re.compile(f"((?:(?<![{before}])[+-])?{_BODY})", re.ASCII) for before in ("0-9A-Za-z", "0-9")
)
"""Numbers whose sign does not follow a letter or digit, and those whose sign may follow a letter:
``img-1`` has a sign if there is an ``img1`` too."""

_YEAR_LAST: Final = re.compile(r"(0[1-9]|[12]\d|3[01])(0[1-9]|[12]\d|3[01])(19|20)\d\d", re.ASCII)
_WHOLE: Final = re.compile(r"[+-]?\d+", re.ASCII)

_LARGEST_COUNT: Final = 10_000_000
"""Largest number in the names of a series of files."""


def natural(name: str) -> tuple[tuple[int, str], ...]:
    """Return a key that sorts 9 before 10."""
    words = re.split(r"(\d+)", name)
    return tuple((int(word), "") if word.isdecimal() else (-1, word) for word in words)


def files_of(pattern: str | Path, *, gaps_allowed: bool = True) -> tuple[Path, ...]:
    """Return the files of a path or pattern such as ``chip_*.vtu``, by the numbers in their names.

    Names that do not state the order are a `SourceError`; so is a missing number in an otherwise
    regular series, unless gaps are allowed.
    """
    if Path(pattern).exists():
        return (Path(pattern),)
    if not has_magic(str(pattern)):
        raise FileNotFoundError(ENOENT, "there is no such file", str(pattern))
    names = glob(str(pattern))  # noqa: PTH207  the folder may be part of the pattern
    if not names:
        raise FileNotFoundError(ENOENT, "no file has such a name", str(pattern))
    files = tuple(Path(name) for name in _in_order(pattern, sorted(names)))
    if not gaps_allowed and (gap := missing_number(files)):
        raise SourceError(f"{pattern}: {gap}, expected the whole series, or the time of each file")
    return files


def missing_number(files: Sequence[Path]) -> str:
    """Return which number is missing in a regular series of files; empty if none is."""
    if len(files) < 3:
        return ""
    columns = zip(*_numbers([str(file) for file in files]), strict=True)
    # Numbers with a point, an exponent or as large as dates are times, whose steps may vary.
    whole = [list(map(int, column)) for column in columns if all(map(_WHOLE.fullmatch, column))]
    rising = [one for one in whole if all(a < b for a, b in pairwise(one))]
    if not rising or rising[-1][-1] > _LARGEST_COUNT:
        return ""
    counts = rising[-1]
    steps = [after - before for before, after in pairwise(counts)]
    usual = max(sorted(set(steps)), key=steps.count)
    for file, count, step in zip(files, counts, steps, strict=False):
        # A step that is twice the usual one is a file that got lost; the last is often shorter.
        if step > usual and step % usual == 0:
            return f"after {file.name} number {count + usual} is missing"
    return ""


def _in_order(pattern: str | Path, names: list[str]) -> list[str]:
    """Return names by their numbers; raise an error if these do not decide."""
    if len(names) == 1:
        return names
    try:
        columns = list(zip(*_numbers(names), strict=True))
        varying = [column for column in columns if len(set(column)) > 1]
        for column in varying:
            _check_readable(column)
        keys = list(zip(*([Decimal(text) for text in column] for column in varying), strict=True))
        ordered = sorted(zip(keys, names, strict=True))
        for (before, one), (after, other) in pairwise(ordered):
            one, other = Path(one).name, Path(other).name
            if before == after:
                raise ValueError(f"{one} and {other} have the same number")
            if any(a > b for a, b in zip(before, after, strict=True)):
                raise ValueError(f"the numbers in {one} and {other} contradict each other")
    except ValueError as error:
        raise SourceError(
            f"{pattern}: the names do not state the order of the files: {error}; rename the files "
            "so that one number counts them"
        ) from None
    return [name for _, name in ordered]


def _numbers(names: Sequence[str]) -> list[list[str]]:
    """Return the numbers in each name as text; the text between them must be the same."""
    plain = [_MOMENT.sub(_digits, name) for name in names]
    for number in _NUMBERS:
        words = [number.split(name) for name in plain]
        if len({tuple(word.lower() for word in one[::2]) for one in words}) == 1:
            return [one[1::2] for one in words]
    first = [word.lower() for word in words[0][::2]]
    other = next(
        name
        for name, one in zip(names, words, strict=True)
        if [word.lower() for word in one[::2]] != first
    )
    raise ValueError(
        f"{Path(names[0]).name} and {Path(other).name} differ in more than the numbers"
    )


def _digits(match: re.Match[str]) -> str:
    year, _, month, day, *time = match.groups("")
    hour, _, minute, second, fraction = time
    return f"{year}{month}{day}{hour}{minute}{second}" + (f".{fraction}" if fraction else "")


def _check_readable(column: Sequence[str]) -> None:
    """Refuse numbers that can be read in two ways."""
    if all(text.startswith("-") for text in column):
        raise ValueError(f"the sign in {column[0]} may be a hyphen, as all numbers have it")
    if all(_YEAR_LAST.fullmatch(text) for text in column):
        raise ValueError(f"{column[0]} may be a date with the year last")
    fractions = [text.partition(".")[2] for text in column]
    if len(set(map(len, fractions))) > 1 and any(text.endswith("0") for text in fractions):
        raise ValueError(f"the point in {', '.join(column[:3])} may separate two numbers")
