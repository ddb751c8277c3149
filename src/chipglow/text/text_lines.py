"""Lines of text files in any of the usual encodings."""

import codecs
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chipglow.text.cells import NumberFormat, TableError
from chipglow.text.regular_file import check_regular

_LARGEST_FILE: Final = 250_000_000
"""In bytes; the lines of such a table take about 1 GB of memory."""

_HEAD: Final = 100_000
"""Bytes that hold the first two lines of any table whose columns have names."""

_LONGEST_LINE: Final = 4_000_000
"""Maximum number of characters of a line; a file with a longer one is not a table."""

_TOO_LONG: Final = re.compile(rf"(?m)^[^\r\n]{{{_LONGEST_LINE + 1}}}")
_BYTE_ORDER_MARKS: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)

_FEWEST_ALIKE: Final = 10
"""Rows that must agree before the decimals of a last cell without end of line are judged."""


@dataclass(frozen=True)
class TextLines:
    """Lines of a file."""

    path: Path
    lines: list[str]
    ended: bool
    """Whether the last line has an end."""
    remarks: list[str]
    """Remarks on the encoding."""


def read_lines(path: Path) -> TextLines:
    """Read the lines of a text file in UTF-8, UTF-16 or Windows-1252."""
    check_regular(path)
    size = path.stat().st_size
    if size > _LARGEST_FILE:
        raise TableError(f"{path}: has {size} bytes, expected up to {_LARGEST_FILE}")
    text, encoding = _decoded(path, path.read_bytes())
    if "\0" in text:
        raise TableError(f"{path}: is not text, expected a table of numbers")
    if _TOO_LONG.search(text):
        raise TableError(f"{path}: a line has over {_LONGEST_LINE} letters")
    lines = _lines(text)
    ended = lines[-1] == ""
    remarks = (
        ["The text is not UTF-8 and was read as Windows-1252."] if encoding == "cp1252" else []
    )
    return TextLines(path, lines[:-1] if ended else lines, ended, remarks)


def first_lines(path: Path) -> list[str]:
    """Return the lines in the first bytes of a file; the last one may be cut."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return _lines(_decoded(path, head)[0])


def _lines(text: str) -> list[str]:
    # Some programs write an end of line twice: \r\r\n.
    return re.split(r"\r*\n|\r", text.replace("\u2212", "-"))


def _decoded(path: Path, raw: bytes) -> tuple[str, str]:
    """Return text and its encoding; the text of a file that is not text contains zeros."""
    encoding = next((name for mark, name in _BYTE_ORDER_MARKS if raw.startswith(mark)), "utf-8")
    for name, start in (("utf-16-le", 1), ("utf-16-be", 0)):
        # One of the two bytes of a digit or separator in UTF-16 is zero.
        if encoding == "utf-8" and 2 * raw[start::2].count(0) > len(raw[start::2]):
            encoding = name
    try:
        return raw.decode(encoding), encoding
    except UnicodeDecodeError:
        if encoding != "utf-8":
            raise TableError(f"{path}: is not text in {encoding}, it may be truncated") from None
        return raw.decode("cp1252", "replace"), "cp1252"


def check_last_number(path: Path, numbers: Sequence[str], last: str, form: NumberFormat) -> None:
    """Refuse the last number of a file if it lacks decimals that those above it have."""
    decimals = {len(cell.partition(form.decimal)[2]) for cell in numbers[-100:]}
    alike = len(decimals) == 1 and len(numbers) >= _FEWEST_ALIKE
    if alike and len(last.partition(form.decimal)[2]) < decimals.pop():
        raise TableError(
            f"{path}: ends with {last!r} and no end of line, expected a number such as "
            f"{numbers[-1]!r}: it is truncated, or lacks its end of line"
        )
