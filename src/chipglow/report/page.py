"""What every report's page is made of: one self-contained HTML file of sections."""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files

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


def table_part(heads: Sequence[str], body: Iterable[str]) -> str:
    """A table of rows of HTML; all columns but the first are numbers."""
    first, *numbers = heads
    head = f"<th>{escape(first)}</th>" + "".join(
        f'<th class="number">{escape(name)}</th>' for name in numbers
    )
    return (
        f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n"
        + "\n".join(body)
        + ("\n</tbody></table>")
    )


def number_cells(texts: Sequence[str], heads: Sequence[str]) -> str:
    """Cells of numbers; on a narrow screen each says the head of its column itself."""
    return "".join(
        f'<td class="number" data-head="{escape(head)}">{escape(text)}</td>'
        for text, head in zip(texts, heads, strict=True)
    )


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
