"""How a table in text is written: what is between its numbers, and whether it is whole."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from chipglow.io.sources.source import SourceError

_LARGEST_TABLE: Final = 1_000_000_000
_LONGEST_LINE: Final = 4_000_000
_MOST_COMMENTS: Final = 1000
_LAST_LINES: Final = 100
_FEWEST_ALIKE: Final = 10
_FORM: Final = re.compile(r"[-+]?\d+(?:[.,](\d*))?(?:[eE][-+]?(\d*))?")
_NUMBER: Final = r"[-+]?(?:\d++(?:[.,]\d*+)?|[.,]\d++)(?:[eE][-+]?\d++)?|nan"
_NUMBERS: Final = re.compile(rf"(?:{_NUMBER})(?:[;,\s]\s*+(?:{_NUMBER}))*+[;,\s]*", re.IGNORECASE)


@dataclass(frozen=True)
class TextTable:
    """How a table in text is written.

    Parameters
    ----------
    first : str
        Its first line that is no comment.
    options : mapping
        What `pandas.read_csv` must know: how numbers are separated and written.
    """

    first: str
    options: Mapping[str, Any]

    @property
    def cells(self) -> list[str]:
        """Cells of the first line, without quotes."""
        separator = self.options["sep"]
        return [cell.strip().strip("\"'") for cell in _split(self.first, separator)]

    @classmethod
    def look_at(cls, path: Path, skipped: int = 0) -> "TextTable":
        """Find out how a table is written, from its first lines.

        Parameters
        ----------
        path : Path
            The file.
        skipped : int
            Number of lines before the table.

        Raises
        ------
        SourceError
            If it is empty, no text, too large or has a line that is too long.
        """
        if path.stat().st_size > _LARGEST_TABLE:
            raise SourceError(
                f"{path}: has {path.stat().st_size} bytes, expected up to {_LARGEST_TABLE}"
            )
        first, second = _two_lines(path, skipped)
        separator = next((mark for mark in ";\t," if mark in first), r"\s+")
        text = second or first
        decimal = "," if separator != "," and "," in text and "." not in text else "."
        lines, whole = _last_lines(path)
        cells = [_split(line, separator) for line in lines]
        last, expected = len(cells[-1]), len(_split(first, separator))
        if last != expected:
            raise SourceError(
                f"{path}: its last line has {last} cells, expected {expected}: it is cut short"
            )
        others = [row[-1] for row in cells[:-1] if len(row) == expected]
        if not whole and _is_part(cells[-1][-1], others):
            raise SourceError(
                f"{path}: ends with {cells[-1][-1].strip()!r} and no end of line, expected a "
                f"number such as {others[-1].strip()!r}: it is cut short, or lacks its end of line"
            )
        options = {"sep": separator, "decimal": decimal, "comment": "#", "skipinitialspace": True}
        return cls(first, options)


def line_of(path: Path, row: int) -> int:
    """Number of the line that holds a row of a table, 0 being that after the names of columns."""
    seen = -1
    with path.open(encoding="utf-8-sig") as stream:
        for number, line in enumerate(stream, start=1):
            seen += bool(line.split("#")[0].strip())
            if seen > row:
                return number
    raise ValueError(f"row: {row} of {path}, expected up to {seen - 1}")


def _split(line: str, separator: str) -> list[str]:
    return line.split() if separator == r"\s+" else line.split(separator)


def _last_lines(path: Path) -> tuple[list[str], bool]:
    """The last lines that are no comments, and whether the file ends with the end of a line.

    An empty one if the last is too long to be looked at.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(max(0, size - _LONGEST_LINE))
        text = stream.read().decode("utf-8-sig" if size <= _LONGEST_LINE else "utf-8", "replace")
    lines = text.split("\n")
    known = [line.split("#")[0].strip() for line in (lines if size <= _LONGEST_LINE else lines[1:])]
    return [line for line in known if line][-_LAST_LINES:] or [""], text.endswith(("\n", "\r"))


def _is_part(number: str, others: list[str]) -> bool:
    """Whether a number may have lost digits that all the others have."""
    decimals, exponent = _form(number)
    forms = [form for form in map(_form, others) if form != (-1, -1)]
    if not forms:
        return False
    same = len({exponent for _, exponent in forms}) == 1
    if same and exponent < forms[-1][1]:
        return True
    alike = len({decimals for decimals, _ in forms}) == 1 and len(forms) >= _FEWEST_ALIKE
    return same and alike and decimals < forms[-1][0] and exponent <= 0


def _form(number: str) -> tuple[int, int]:
    """How many decimals and digits of an exponent a number has; -1 each for what is none."""
    found = _FORM.fullmatch(number.strip())
    if found is None:
        return -1, -1
    return len(found[1] or ""), len(found[2]) if found[2] is not None else 0


def lines_of_text(path: Path) -> int:
    """Number of lines before the first one that holds nothing but numbers; 0 if there is none."""
    with path.open(encoding="utf-8-sig") as stream:
        for number in range(_MOST_COMMENTS):
            line = stream.readline(_LONGEST_LINE)
            if not line:
                return 0
            if _NUMBERS.fullmatch(line.split("#")[0].strip()):
                return number
    return 0


def _two_lines(path: Path, skipped: int) -> tuple[str, str]:
    """The first two lines that are no comments, of those behind the skipped ones."""
    lines: list[str] = []
    with path.open(encoding="utf-8-sig") as stream:
        for _ in range(skipped):
            stream.readline(_LONGEST_LINE)
        for _ in range(_MOST_COMMENTS):
            line = stream.readline(_LONGEST_LINE)
            if len(line) == _LONGEST_LINE:
                raise SourceError(f"{path}: a line has over {_LONGEST_LINE} letters")
            if line.split("#")[0].strip():
                lines.append(line.split("#")[0].strip())
            if not line or len(lines) == 2:
                break
    if not lines:
        raise SourceError(f"{path}: there is no number in it")
    if "\0" in lines[0]:
        raise SourceError(f"{path}: is no text, expected a table of numbers")
    return lines[0], lines[1] if len(lines) > 1 else ""
