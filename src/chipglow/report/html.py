"""The report as one self-contained page: the answer first, then what it rests on."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from chipglow import __version__
from chipglow.drawing.drawing import FigureFile
from chipglow.laboratory.chip.metrics_table import ChipRow
from chipglow.report.comparison import CauseRow, Row
from chipglow.report.page import (
    answer_part,
    definition_list,
    document,
    figure_part,
    number_cells,
    table_part,
)
from chipglow.report.paper import EmissivityTexts

_PAPER: Final = (
    "J. C. Heigel, E. P. Whitenton: The effects of emissivity and camera point spread function on "
    "the temperature measurement of segmented chip formation using infrared thermography. "
    "Proceedings of the ASME International Manufacturing Science and Engineering Conference, 2010."
)

_BESIDE_PAPER: Final = {
    "comparison": "The paper beside this study",
    "figures": "The paper's figures and tables",
    "beyond": "Beyond the paper",
}
_OWN: Final = {
    "comparison": "The errors, and more",
    "emissivity": "Emissivity",
    "beyond": "Figures",
}


@dataclass(frozen=True)
class Content:
    """What the page shows.

    Parameters
    ----------
    title : str
        The study's title: heads the page.
    answer : sequence of str
        What came out, in a few sentences.
    remarks : sequence of str
        What the reader must know before quoting: assumptions, a coarse grid.
    rows : sequence of Row
        The paper's figures beside ours.
    causes : sequence of CauseRow
        What makes the headlines scatter.
    definition : str
        What an error is, as a sentence.
    chip : sequence of ChipRow
        What describes the chip.
    figures : sequence of FigureFile
        Figures, whose PNG files are read.
    emissivities : sequence of EmissivityTexts
        The paper's Table 1 beside the study's.
    settings : sequence of tuple
        The paper's Table 2 beside the study's: what is set, there and here; empty without a cut.
    study_text : str
        The study's YAML.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    beside_paper : bool
        Whether the study is the paper's, and stands beside it.
    """

    title: str
    answer: Sequence[str]
    remarks: Sequence[str]
    rows: Sequence[Row]
    causes: Sequence[CauseRow]
    definition: str
    chip: Sequence[ChipRow]
    figures: Sequence[FigureFile]
    emissivities: Sequence[EmissivityTexts]
    settings: Sequence[tuple[str, str, str]]
    study_text: str
    provenance: Mapping[str, str]
    beside_paper: bool


def page(content: Content) -> str:
    """Self-contained page with the pictures in it.

    Parameters
    ----------
    content : Content
        What it shows.
    """
    titles = _BESIDE_PAPER if content.beside_paper else _OWN
    bodies = {
        "comparison": _comparison(content),
        "figures": "\n".join(_in_the_papers_order(content)),
        "emissivity": _emissivities(content.emissivities),
        "beyond": "\n".join(figure_part(figure) for figure in content.figures if not figure.paper),
    }
    middle = [(name, title, bodies[name]) for name, title in titles.items() if bodies[name]]
    sections = [
        ("answer", "The answer", answer_part(content.answer, content.remarks)),
        middle[0],
        ("scatter", "What makes the scatter", _causes(content.causes)),
        *middle[1:],
        ("chip", "The chip", _chip_table(content.chip)),
        (
            "study",
            "The study as run",
            f"<pre><code>{escape(content.study_text)}</code></pre>",
        ),
        ("versions", "How it was made", definition_list(content.provenance)),
        ("cite", "How to cite", _citation()),
    ]
    return document(content.title, sections)


def _comparison(content: Content) -> str:
    text = (
        f"{content.definition} PSF: point spread function. Here: mean ± standard deviation over "
        "the draws of segment, texture and pixel phase, or ± standard uncertainty where there is "
        "one number. One draw: one frame"
    )
    heads: tuple[str, ...] = ("Quantity", "Here", "Range of draws", "One draw")
    if not content.beside_paper:
        text += "."
    else:
        text += (
            " by the paper's procedure. Differs: whether one more draw would be as far off as the "
            "paper's figure in fewer than 5 of 100 cases."
        )
        heads = ("Quantity", "Paper", *heads[1:], "Differs")
    return f"<p>{escape(text)}</p>\n" + table_part(heads, _comparison_rows(content, heads))


def _comparison_rows(content: Content, heads: Sequence[str]) -> Iterator[str]:
    for row in content.rows:
        texts = [row.here_text, row.range_text, row.one_draw_text]
        if content.beside_paper:
            texts = [row.paper_text, *texts, row.differs_text]
        where = f'<span class="where">Paper: {escape(row.where)}</span>' if row.where else ""
        yield f"<tr><td>{escape(row.quantity)}{where}</td>{number_cells(texts, heads[1:])}</tr>"
        yield f'<tr class="why"><td colspan="{len(heads)}">{escape(row.explanation)}</td></tr>'


def _causes(rows: Sequence[CauseRow]) -> str:
    if not rows:
        return "<p>One draw only: it says nothing of the scatter.</p>"
    names = [f"{name} ({count})" for name, count, _, _ in rows[0].causes]
    text = (
        "Each cause in the mean over the others: standard deviation, and its part of the sum of "
        "squares. In brackets above, how many values it took. Causes together: what none of them "
        "makes by itself."
    )
    heads = ("Quantity", *names)
    body = (
        f"<tr><td>{escape(row.quantity)}</td>{number_cells(row.texts, heads[1:])}</tr>"
        for row in rows
    )
    return f"<p>{escape(text)}</p>\n" + table_part(heads, body)


def _chip_table(rows: Sequence[ChipRow]) -> str:
    heads = ("Quantity", "Here", "Spread")
    body = (
        f"<tr><td>{escape(row.quantity)}</td>"
        f"{number_cells((row.value_text, row.spread_text), heads[1:])}</tr>\n"
        f'<tr class="why"><td colspan="{len(heads)}">{escape(row.explanation)}</td></tr>'
        for row in rows
    )
    return table_part(heads, body)


def _in_the_papers_order(content: Content) -> Iterator[str]:
    """Figures by their numbers; Table 1 after Figure 3, Table 2 after Figure 4."""
    after = {"Figure 3": _table_1(content.emissivities), "Figure 4": _table_2(content.settings)}
    for figure in content.figures:
        if figure.paper:
            yield figure_part(figure)
            yield after.pop(figure.paper, "")
    yield from after.values()


def _emissivities(rows: Sequence[EmissivityTexts]) -> str:
    """Table 1 of a study that is not the paper's."""
    heads = ("Feature", "Put in", "Found", "Standard deviation found", "Several textures")
    text = (
        "Emissivity of evenly heated objects as mean ± standard deviation put into the study. "
        f"{_FOUND} The camera's blur takes from the standard deviation, and draws narrow shear "
        "bands toward the bodies beside them."
    )
    body = (
        f"<tr><td>{escape(row.feature)}</td>"
        + number_cells((row.true, row.mean, row.deviation, row.textures), heads[1:])
        + "</tr>"
        for row in rows
    )
    return f"<p>{escape(text)}</p>\n" + table_part(heads, body) if rows else ""


_FOUND: Final = (
    "Found: mean and standard uncertainty of one heated object's region (thermocouple of 2 K "
    "assumed), and the standard deviation over its pixels; beside it mean ± standard deviation of "
    "the means of several textures."
)


def _table_1(rows: Sequence[EmissivityTexts]) -> str:
    if not rows:
        return ""
    heads = ("Feature", "Paper", "Put in", "Found", "Standard deviation found", "Several textures")
    text = (
        f"Emissivity as mean ± standard deviation in the paper and put into the study. {_FOUND} "
        "Same as the paper: procedure and numbers. Different: here the truth is known: the "
        "camera's blur takes from the standard deviation of bodies and tool, and draws narrow "
        "shear bands toward the bodies beside them."
    )
    body = (
        f"<tr><td>{escape(row.feature)}</td>"
        + number_cells((row.paper, row.true, row.mean, row.deviation, row.textures), heads[1:])
        + "</tr>"
        for row in rows
    )
    return _table_part("table-1", "Table 1: emissivity of heated chips and tool", text, heads, body)


def _table_2(rows: Sequence[tuple[str, str, str]]) -> str:
    if not rows:
        return ""
    heads = ("Setting", "Paper", "Here")
    text = (
        "Settings of the cutting simulation. Not legible: a cell of the paper's table that its "
        "copy does not show."
    )
    body = (
        f"<tr><td>{escape(name)}</td>{number_cells((there, here), heads[1:])}</tr>"
        for name, there, here in rows
    )
    return _table_part("table-2", "Table 2: settings of the simulation", text, heads, body)


def _table_part(name: str, title: str, text: str, heads: Sequence[str], body: Iterator[str]) -> str:
    return (
        f'<div class="part" id="{name}">\n<h3>{escape(title)}</h3>\n<p>{escape(text)}</p>\n'
        + table_part(heads, body)
        + "\n</div>"
    )


def _citation() -> str:
    own = f"chipglow {__version__}: a virtual infrared camera for metal cutting."
    return (
        f"<p>This program: {escape(own)} Name the version and attach the study above.</p>\n"
        f"<p>The method: {escape(_PAPER)}</p>"
    )
