"""The report as one self-contained HTML page: what it is made of, and its Jinja2 template."""

import re
from base64 import b64encode
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from chipglow import __version__


class Term(NamedTuple):
    """A word of the report: its id on the page, the word and its meaning."""

    key: str
    name: str
    text: str = ""


class Line(NamedTuple):
    """A row of a table: texts, unit of the numbers, id of its explanation, and its source."""

    texts: Sequence[str]
    unit: str = ""
    key: str = ""
    where: str = ""


class Table(NamedTuple):
    """A table with a paragraph above it; all columns but the first are numbers."""

    text: str
    heads: Sequence[Term]
    lines: Sequence[Line]


class FigureFile(NamedTuple):
    """A figure as written: file name without ending, heading, figure of the paper, texts, PNG."""

    name: str
    title: str
    paper: str
    caption: str
    alt: str
    png: Path


class Terms(NamedTuple):
    """Words with their meanings, to which tables and sentences refer."""

    terms: Sequence[Term]


class Answer(NamedTuple):
    """The sentences of the answer (each with the id of its explanation), and a note on reading."""

    statements: Sequence[Term]
    note: str


class Remarks(NamedTuple):
    """Sentences in boxes."""

    sentences: Sequence[str]


class Failure(NamedTuple):
    """A part that could not be computed or drawn, and the reason."""

    title: str
    reason: str


class Text(NamedTuple):
    """A paragraph and preformatted text."""

    text: str = ""
    code: str = ""


class Pairs(NamedTuple):
    """Names with their values."""

    rows: Sequence[tuple[str, str]]


class Part(NamedTuple):
    """Blocks under one heading; the template has a macro for each class of block.

    Without a heading they belong to the section itself.
    """

    key: str
    title: str
    blocks: Sequence[Any]


class Section(NamedTuple):
    """A section of the page."""

    key: str
    title: str
    parts: Sequence[Part]


def page(title: str, sections: Sequence[Section]) -> str:
    """Return the page as HTML, which loads nothing and runs its own script only."""
    shown = [section for section in sections if section.parts]
    template = environment().get_template("report.html")
    return template.render(title=title, sections=shown, version=__version__)


@cache
def environment() -> Environment:
    """Return the Jinja2 environment of the report's templates; it escapes all text."""
    made = Environment(
        loader=PackageLoader("chipglow.report"), autoescape=True, undefined=StrictUndefined
    )
    made.filters |= {"shown": _shown, "data_url": _data_url, "has_digit": _has_digit, "kind": _kind}
    return made


_BEFORE_UNIT: Final = re.compile(r"(?<=\d) (?=[°%µ]|[KN]\b|mm\b|1/s)|(?<=±) | (?=±)")


def _shown(text: str) -> Markup:
    """Escape a text and keep each number on one line with its unit."""
    return Markup(_BEFORE_UNIT.sub("\u00a0", str(escape(text))))


def _data_url(png: Path) -> str:
    return f"data:image/png;base64,{b64encode(png.read_bytes()).decode('ascii')}"


def _has_digit(text: str) -> bool:
    return any(letter.isdigit() for letter in text)


def _kind(block: Any) -> str:
    """Return the name of a block's macro in the template."""
    return type(block).__name__.lower()
