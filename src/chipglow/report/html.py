"""The report as one self-contained page."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import Final

from chipglow import __version__
from chipglow.report.chip import ChipRow
from chipglow.report.comparison import Row
from chipglow.report.figures import FigureFile

TITLE: Final = "Temperature measurement of segmented chip formation"

_LEAD: Final = (
    "What an infrared camera makes of a known, simulated cutting process, and how far it is off: "
    "the study of Heigel and Whitenton (2010), done anew."
)

_PAPER: Final = (
    "J. C. Heigel, E. P. Whitenton: The effects of emissivity and camera point spread function on "
    "the temperature measurement of segmented chip formation using infrared thermography. "
    "Proceedings of the ASME International Manufacturing Science and Engineering Conference, 2010."
)

_SECTIONS: Final = (
    ("comparison", "The paper beside this study"),
    ("chip", "The chip"),
    ("figures", "Figures"),
    ("study", "The study as run"),
    ("cite", "How to cite"),
)


def page(
    rows: Sequence[Row],
    definition: str,
    chip: Sequence[ChipRow],
    figures: Sequence[FigureFile],
    study_text: str,
    provenance: Mapping[str, str],
) -> str:
    """Self-contained page with the pictures in it.

    Parameters
    ----------
    rows : sequence of Row
        The paper's figures beside ours.
    definition : str
        What an error is, as a sentence.
    chip : sequence of ChipRow
        What describes the chip.
    figures : sequence of FigureFile
        Figures, whose PNG files are read.
    study_text : str
        The study's YAML.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    """
    links = "".join(f'<a href="#{name}">{escape(title)}</a>' for name, title in _SECTIONS)
    bodies = {
        "comparison": _table(rows, definition),
        "chip": _chip_table(chip),
        "figures": "\n".join(_figure(figure) for figure in figures),
        "study": f"<pre><code>{escape(study_text)}</code></pre>",
        "cite": _citation(),
    }
    sections = "\n".join(
        f'<h2 id="{name}">{escape(title)}</h2>\n{bodies[name]}' for name, title in _SECTIONS
    )
    css = files("chipglow.report").joinpath("page.css").read_text(encoding="utf-8")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(TITLE)}</title>
<style>
{css}</style>
</head>
<body>
<header>
<h1>{escape(TITLE)}</h1>
<p class="lead">{escape(_LEAD)}</p>
{_definitions(provenance)}
<nav>{links}</nav>
</header>
<main>
{sections}
<footer>Made by chipglow {escape(__version__)}.</footer>
</main>
</body>
</html>
"""


def _definitions(provenance: Mapping[str, str]) -> str:
    items = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>\n" for name, value in provenance.items()
    )
    return f"<dl>\n{items}</dl>"


def _table(rows: Sequence[Row], definition: str) -> str:
    body = "\n".join(_row(row) for row in rows)
    return f"""<p>{escape(definition)} PSF: point spread function.</p>
<div class="scroll"><table>
<thead><tr><th>Quantity</th><th class="number">Paper</th><th class="number">Here</th>
<th class="number">Difference</th><th>Why</th></tr></thead>
<tbody>
{body}
</tbody></table></div>"""


def _chip_table(rows: Sequence[ChipRow]) -> str:
    body = "\n".join(
        f'<tr><td>{escape(row.quantity)}</td><td class="number here">{escape(row.value_text)}</td>'
        f'<td class="number">{escape(row.spread_text)}</td>'
        f'<td class="why">{escape(row.explanation)}</td></tr>'
        for row in rows
    )
    return f"""<div class="scroll"><table>
<thead><tr><th>Quantity</th><th class="number">Here</th><th class="number">Spread</th>
<th>How</th></tr></thead>
<tbody>
{body}
</tbody></table></div>"""


def _row(row: Row) -> str:
    where = f'<span class="where">{escape(row.where)}</span>' if row.where else ""
    return (
        f"<tr><td>{escape(row.quantity)}{where}</td>"
        f'<td class="number">{escape(row.paper_text)}</td>'
        f'<td class="number here">{escape(row.here_text)}</td>'
        f'<td class="number">{escape(row.difference_text)}</td>'
        f'<td class="why">{escape(row.explanation)}</td></tr>'
    )


def _figure(figure: FigureFile) -> str:
    picture = b64encode(figure.png.read_bytes()).decode("ascii")
    return (
        f'<h3 id="{escape(figure.name)}">{escape(figure.title)}</h3>\n'
        f'<figure><img alt="{escape(figure.title)}" src="data:image/png;base64,{picture}">\n'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


def _citation() -> str:
    own = f"chipglow {__version__}: a virtual infrared camera for metal cutting."
    return (
        f"<p>This program: {escape(own)} Name the version and attach the study above.</p>\n"
        f"<p>The method: {escape(_PAPER)}</p>"
    )
