"""What every report's page is made of: one self-contained HTML file of sections."""

import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Final, NamedTuple

import xarray as xr
from pydantic import BaseModel

from chipglow import __version__
from chipglow.drawing.drawing import FigureFile
from chipglow.io import write_dataset
from chipglow.text import json_schema


class Section(NamedTuple):
    """A section of a page: its id, its heading and its body as HTML."""

    name: str
    heading: str
    body: str


class Statement(NamedTuple):
    """A sentence of the answer, and the id of what explains it."""

    text: str
    link: str


class Term(NamedTuple):
    """A word of a report: its id, the word, and what it means or how it is computed."""

    key: str
    name: str
    text: str


class Line(NamedTuple):
    """A line of a table: its texts, of which all but the first are numbers.

    Parameters
    ----------
    texts : sequence of str
        One for each column.
    unit : str
        That of the numbers; "1" for those of dimension one, empty where the texts are settings.
    link : str
        Id of what explains it; empty for none.
    where : str
        Stands under the first text.
    """

    texts: Sequence[str]
    unit: str = ""
    link: str = ""
    where: str = ""


def shown(text: str) -> str:
    """A text as HTML, in which no line ends between a number and its unit."""
    return _BEFORE_UNIT.sub("\u00a0", escape(text))


_BEFORE_UNIT: Final = re.compile(r"(?<=\d) (?=[°%µ]|[KN]\b|mm\b|1/s)|(?<=±) | (?=±)")


def document(title: str, sections: Sequence[Section]) -> str:
    """Self-contained page of sections, which loads nothing and runs nothing but its own script.

    Parameters
    ----------
    title : str
        Heads the page.
    sections : sequence of Section
        What is on it.
    """
    links = "".join(f'<a href="#{name}">{escape(heading)}</a>' for name, heading, _ in sections)
    bodies = "\n".join(
        f'<section id="{name}">\n<h2>{escape(heading)}</h2>\n{body}\n</section>'
        for name, heading, body in sections
    )
    css, script = (
        files("chipglow.report").joinpath(name).read_text(encoding="utf-8")
        for name in ("page.css", "player.js")
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{escape(title)}</title>
<style>
{css}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
<nav aria-label="Sections">{links}</nav>
</header>
<main>
{bodies}
<footer>Made by chipglow {escape(__version__)}.</footer>
</main>
<script>
{script}</script>
</body>
</html>
"""


_POLICY: Final = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
)


def answer_part(
    answer: Iterable[Statement], note: str, remarks: Sequence[str], picture: str
) -> str:
    """What came out, how to read it, a picture, then what a reader must know."""
    sentences = "".join(
        f'<p>{shown(text)} <a href="#{link}">How and why</a></p>\n' for text, link in answer
    )
    boxes = "".join(f'<p class="remark">{shown(remark)}</p>\n' for remark in remarks)
    if note:
        sentences += f'<p class="note">{shown(note)} <a href="#terms">All words</a></p>\n'
    return f'<div class="answer">\n{sentences}</div>\n{picture}\n{boxes}'


def table_part(text: str, heads: Sequence[str | Term], lines: Iterable[Line]) -> str:
    """A paragraph, if there is a text, and a table; all its columns but the first are numbers.

    Parameters
    ----------
    text : str
        The paragraph.
    heads : sequence of str or Term
        Of the columns; a term's refers to what it means.
    lines : iterable of Line
        The table.
    """
    names = [head.name if isinstance(head, Term) else head for head in heads]
    first, *numbers = map(_head, heads)
    head = f'<th scope="col">{first}</th>' + "".join(
        f'<th scope="col" class="number">{name}</th>' for name in numbers
    )
    body = "\n".join(_row(line, names) for line in lines)
    paragraph = f"<p>{shown(text)}</p>\n" if text else ""
    return f"{paragraph}<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>"


def _head(head: str | Term) -> str:
    return _linked(head.name, head.key) if isinstance(head, Term) else escape(head)


def _linked(text: str, link: str) -> str:
    return f'<a href="#{link}">{shown(text)}</a>' if link else shown(text)


def _row(line: Line, heads: Sequence[str]) -> str:
    """A line's row; on a narrow screen each number says the head of its column itself."""
    first, *numbers = line.texts
    where = f'<span class="where">{shown(line.where)}</span>' if line.where else ""
    cells = "".join(
        f'<td class="number" data-head="{escape(head)}"{_unit(text, line)}>{shown(text)}</td>'
        for text, head in zip(numbers, heads[1:], strict=True)
    )
    return f"<tr><td>{_linked(first, line.link)}{where}</td>{cells}</tr>"


def _unit(text: str, line: Line) -> str:
    is_number = line.unit and any(letter.isdigit() for letter in text)
    return f' data-unit="{escape(line.unit)}"' if is_number else ""


def titled_part(name: str, title: str, body: str) -> str:
    """A part of a section with its own heading."""
    return f'<div class="part" id="{name}">\n<h3>{escape(title)}</h3>\n{body}\n</div>'


def figure_part(figure: FigureFile) -> str:
    """A figure with its heading and its caption, the picture in it."""
    picture = b64encode(figure.png.read_bytes()).decode("ascii")
    title = f"{figure.paper}: {figure.title}" if figure.paper else figure.title
    return (
        f'<figure id="{escape(figure.name)}">\n<h3>{escape(title)}</h3>\n'
        f'<img alt="{escape(figure.alt)}" src="data:image/png;base64,{picture}">\n'
        f"<figcaption>{shown(figure.caption)}</figcaption></figure>"
    )


def terms_part(terms: Iterable[Term]) -> str:
    """Terms with what they mean, to which tables and sentences refer."""
    items = "".join(
        f'<dt id="{key}">{escape(name)}</dt><dd>{shown(text)}</dd>\n' for key, name, text in terms
    )
    return f"<dl>\n{items}</dl>"


def repeat_section(
    command: str, study_text: str, provenance: Mapping[str, str], terms: Iterable[Term], cite: str
) -> Section:
    """The section with which every page ends: all that it takes to get the same numbers.

    Parameters
    ----------
    command : str
        Computes them from the study's file.
    study_text : str
        The study's YAML.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    terms : iterable of Term
        How each number is found.
    cite : str
        How to cite, as HTML.
    """
    pairs = "".join(
        f"<dt>{escape(name)}</dt><dd>{shown(value)}</dd>\n" for name, value in provenance.items()
    )
    again = (
        "<p>With the same versions the study below, which is beside this page as study.yaml, gives "
        f"the same numbers:</p>\n<pre><code>{escape(command)}</code></pre>"
    )
    parts = (
        ("command", "The command", again),
        ("terms", "How each number is found", terms_part(terms)),
        ("study", "The study as run", f"<pre><code>{escape(study_text)}</code></pre>"),
        ("versions", "Versions", f'<dl class="pairs">\n{pairs}</dl>'),
        ("cite", "How to cite", cite),
    )
    return Section(
        "repeat", "How to repeat it", "\n".join(titled_part(*part) for part in parts if part[2])
    )


def write_files(
    folder: Path, page: str, data: xr.Dataset, numbers: BaseModel, study_text: str
) -> Path:
    """Write page, arrays, numbers and study into a folder.

    Parameters
    ----------
    folder : Path
        An existing folder.
    page : str
        Written as ``report.html``.
    data : xarray.Dataset
        Written as ``results.nc``.
    numbers : BaseModel
        Written as ``summary.json``, its JSON schema as ``summary.schema.json``.
    study_text : str
        Written as ``study.yaml``.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OSError
        If something can't be written.
    """
    write_dataset(data, folder / "results.nc")
    text = numbers.model_dump_json(indent=2, exclude_defaults=True)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    schema = json_schema(type(numbers))
    (folder / "summary.schema.json").write_text(schema, encoding="utf-8")
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    report = folder / "report.html"
    report.write_text(page, encoding="utf-8")
    return report
