"""How a table in text is written: what is between its numbers, and whether it is whole."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chipglow.io.sources.source import SourceError

if TYPE_CHECKING:
    import pandas as pd

_LARGEST_TABLE: Final = 1_000_000_000
_LONGEST_LINE: Final = 4_000_000
_MOST_COMMENTS: Final = 1000
_LAST_LINES: Final = 100
_FEWEST_ALIKE: Final = 10
_NUMBER: Final = r"[-+]?(?:\d++(?:[.,]\d*+)?|[.,]\d++)(?:[eE][-+]?\d++)?|nan"
_NUMBERS: Final = re.compile(rf"(?:{_NUMBER})(?:[;,\s]\s*+(?:{_NUMBER}))*+[;,\s]*", re.IGNORECASE)


@dataclass(frozen=True)
class TextTable:
    """Table in text."""

    path: Path
    first: str
    """Its first line apart from comments."""
    separator: str
    decimal: str

    @property
    def cells(self) -> list[str]:
        """Cells of the first line, without quotes."""
        return [cell.strip().strip("\"'") for cell in self._split(self.first)]

    @classmethod
    def look_at(cls, path: Path, skipped: int = 0) -> "TextTable":
        """Find out how a table behind some lines is written; refuse one that is truncated."""
        size = path.stat().st_size
        if size > _LARGEST_TABLE:
            raise SourceError(f"{path}: has {size} bytes, expected up to {_LARGEST_TABLE}")
        lines = list(islice(filter(None, _lines(path, skipped)), 2))
        if not lines:
            raise SourceError(f"{path}: there is no number in it")
        first, last = lines[0], lines[-1]
        if "\0" in first:
            raise SourceError(f"{path}: is not text, expected a table of numbers")
        separator = next((mark for mark in ";\t," if mark in first), r"\s+")
        decimal = "," if separator != "," and "," in last and "." not in last else "."
        table = cls(path, first, separator, decimal)
        table._check_end()
        return table

    def read(self, **options: Any) -> "pd.DataFrame":
        """Read the table by `pandas.read_csv` with more of its options."""
        import pandas as pd

        with self.path.open(encoding="utf-8-sig") as stream:
            return pd.read_csv(
                stream,
                sep=self.separator,
                decimal=self.decimal,
                comment="#",
                skipinitialspace=True,
                **options,
            )

    def line_of(self, row: int) -> int:
        """Return the number of the line of a row, 0 being that after the names of columns."""
        with self.path.open(encoding="utf-8-sig") as stream:
            known = [number for number, line in enumerate(stream, 1) if _without_comment(line)]
        return known[row + 1]

    def _split(self, line: str) -> list[str]:
        return line.split() if self.separator == r"\s+" else line.split(self.separator)

    def _check_end(self) -> None:
        """Refuse a last line that lacks cells, or lacks decimals and the end of the line."""
        size = self.path.stat().st_size
        with self.path.open("rb") as stream:
            stream.seek(max(0, size - _LONGEST_LINE))
            text = stream.read().decode("utf-8", "replace")
        lines = text.split("\n")[size > _LONGEST_LINE :]
        known = [line for line in map(_without_comment, lines) if line][-_LAST_LINES:]
        *others, last = map(self._split, known or [""])
        expected = len(self._split(self.first))
        if len(last) != expected:
            raise SourceError(
                f"{self.path}: its last line has {len(last)} cells, expected {expected}: it is cut "
                "short"
            )
        numbers = [row[-1].strip() for row in others if len(row) == expected]
        decimals = [self._decimals(cell) for cell in numbers if _NUMBERS.fullmatch(cell)]
        alike = len(set(decimals)) == 1 and len(decimals) >= _FEWEST_ALIKE
        whole = text.endswith(("\n", "\r"))
        if alike and not whole and self._decimals(last[-1].strip()) < decimals[0]:
            raise SourceError(
                f"{self.path}: ends with {last[-1].strip()!r} and no end of line, expected a "
                f"number such as {numbers[-1]!r}: it is truncated, or lacks its end of line"
            )

    def _decimals(self, number: str) -> int:
        return len(number.partition(self.decimal)[2])


def _without_comment(line: str) -> str:
    return line.split("#")[0].strip()


def lines_of_text(path: Path) -> int:
    """Return the number of lines before the first one of numbers alone; 0 without one."""
    lines = enumerate(_lines(path))
    return next((number for number, line in lines if _NUMBERS.fullmatch(line)), 0)


def _lines(path: Path, skipped: int = 0) -> Iterator[str]:
    """Yield the first lines after the skipped ones, without comments."""
    with path.open(encoding="utf-8-sig") as stream:
        for number in range(skipped + _MOST_COMMENTS):
            line = stream.readline(_LONGEST_LINE)
            if not line:
                return
            if len(line) == _LONGEST_LINE:
                raise SourceError(f"{path}: a line has over {_LONGEST_LINE} letters")
            if number >= skipped:
                yield _without_comment(line)
