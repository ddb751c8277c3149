"""What every report's page is made of: one self-contained HTML file of sections."""

import json
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr

from chipglow import __version__
from chipglow.drawing.drawing import FigureFile


def document(title: str, sections: Sequence[tuple[str, str, str]]) -> str:
    """Self-contained page of sections.

    Parameters
    ----------
    title : str
        Heads the page.
    sections : sequence of tuple
        Name, heading and body of each; the body is HTML.
    """
    links = "".join(f'<a href="#{name}">{escape(heading)}</a>' for name, heading, _ in sections)
    bodies = "\n".join(
        f'<section id="{name}">\n<h2>{escape(heading)}</h2>\n{body}\n</section>'
        for name, heading, body in sections
    )
    css = files("chipglow.report").joinpath("page.css").read_text(encoding="utf-8")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{escape(title)}</title>
<style>
{css}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
<nav>{links}</nav>
</header>
<main>
{bodies}
<footer>Made by chipglow {escape(__version__)}.</footer>
</main>
</body>
</html>
"""


def answer_part(answer: Sequence[str], remarks: Sequence[str]) -> str:
    """What came out, then what a reader must know, as paragraphs."""
    sentences = "".join(f"<p>{escape(sentence)}</p>\n" for sentence in answer)
    boxes = "".join(f'<p class="remark">{escape(remark)}</p>\n' for remark in remarks)
    return f'<div class="answer">\n{sentences}</div>\n{boxes}'


class Line(NamedTuple):
    """A line of a table: its texts, of which all but the first are numbers, and what explains it.

    Parameters
    ----------
    texts : sequence of str
        One for each column.
    explanation : str
        Stands in a row of its own below; empty for none.
    where : str
        Stands under the first text.
    """

    texts: Sequence[str]
    explanation: str = ""
    where: str = ""


def table_part(text: str, heads: Sequence[str], lines: Iterable[Line]) -> str:
    """A paragraph, if there is a text, and a table; all its columns but the first are numbers."""
    first, *numbers = heads
    head = f"<th>{escape(first)}</th>" + "".join(
        f'<th class="number">{escape(name)}</th>' for name in numbers
    )
    body = "\n".join(row for line in lines for row in _rows(line, heads))
    paragraph = f"<p>{escape(text)}</p>\n" if text else ""
    return f"{paragraph}<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>"


def _rows(line: Line, heads: Sequence[str]) -> Iterator[str]:
    """Rows of a line; on a narrow screen each number says the head of its column itself."""
    first, *numbers = line.texts
    where = f'<span class="where">{escape(line.where)}</span>' if line.where else ""
    cells = "".join(
        f'<td class="number" data-head="{escape(head)}">{escape(text)}</td>'
        for text, head in zip(numbers, heads[1:], strict=True)
    )
    yield f"<tr><td>{escape(first)}{where}</td>{cells}</tr>"
    if line.explanation:
        yield f'<tr class="why"><td colspan="{len(heads)}">{escape(line.explanation)}</td></tr>'


def figure_part(figure: FigureFile) -> str:
    """A figure with its heading and its caption, the picture in it."""
    picture = b64encode(figure.png.read_bytes()).decode("ascii")
    title = f"{figure.paper}: {figure.title}" if figure.paper else figure.title
    return (
        f'<figure id="{escape(figure.name)}">\n<h3>{escape(title)}</h3>\n'
        f'<img alt="{escape(figure.alt)}" src="data:image/png;base64,{picture}">\n'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


def definition_list(provenance: Mapping[str, str]) -> str:
    """Names and texts, as a list."""
    items = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>\n" for name, value in provenance.items()
    )
    return f"<dl>\n{items}</dl>"


def closing_sections(study_text: str, provenance: Mapping[str, str]) -> list[tuple[str, str, str]]:
    """The sections with which every page ends: the study, and how the report was made."""
    return [
        ("study", "The study as run", f"<pre><code>{escape(study_text)}</code></pre>"),
        ("versions", "How it was made", definition_list(provenance)),
    ]


def write_files(
    folder: Path, page: str, data: xr.Dataset, numbers: Mapping[str, Any], study_text: str
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
    numbers : mapping
        Written as ``summary.json``.
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
    packed = {
        str(name): {"zlib": True, "complevel": 4}
        for name, values in data.data_vars.items()
        if values.ndim > 1
    }
    data.to_netcdf(folder / "results.nc", engine="h5netcdf", encoding=packed)
    text = json.dumps(numbers, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    report = folder / "report.html"
    report.write_text(page, encoding="utf-8")
    return report
