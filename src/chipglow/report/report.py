"""The report's folder: page, figures, numbers, arrays and the study as run."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Final

from chipglow import __version__
from chipglow.drawing.drawing import FigureFile
from chipglow.errors import StudyResult
from chipglow.report.camera_rows import camera_rows, camera_table
from chipglow.report.chip_rows import chip_rows
from chipglow.report.comparison import CauseRow, Row, cause_rows, comparison_rows
from chipglow.report.evidence import answer, error_definition
from chipglow.report.figures import draw_figures
from chipglow.report.page import (
    Line,
    answer_part,
    closing_sections,
    document,
    figure_part,
    table_part,
    write_files,
)
from chipglow.report.paper import REFERENCE, EmissivityTexts, stands_beside, table_1
from chipglow.report.results import results_dataset, summary
from chipglow.report.steady_tool import steady_tool_part, steady_tool_summary, tool_rows

_BESIDE_PAPER: Final = {
    "comparison": "The paper beside this study",
    "figures": "The paper's figures and tables",
    "beyond": "Beyond the paper",
}
_STEADY: Final = "A tool that has been cutting for long"
_OWN: Final = {
    "comparison": "The errors, and more",
    "emissivity": "Emissivity",
    "beyond": "Figures",
}


def write_report(
    result: StudyResult,
    folder: Path,
    title: str,
    study_text: str,
    provenance: Mapping[str, str],
    remarks: Sequence[str] = (),
    settings: Sequence[tuple[str, str, str]] = (),
    steady: StudyResult | None = None,
) -> Path:
    """Write everything that a study gives into a folder.

    Parameters
    ----------
    result : StudyResult
        The study.
    folder : Path
        An existing folder, such as a temporary one that is moved into place at the end.
    title : str
        Heads the page.
    study_text : str
        The study's YAML, written as ``study.yaml`` and shown in the report.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    remarks : sequence of str
        What a reader must know before quoting a number: sentences under the answer.
    settings : sequence of tuple
        Settings of the cut beside the paper's, see `paper.table_2`; none for a scene from a file.
    steady : StudyResult, optional
        The same study with a tool that has been cutting for long, to stand beside it.

    Returns
    -------
    Path
        ``report.html``; beside it are ``figures/``, ``summary.json``, ``results.nc`` and
        ``study.yaml``.

    Raises
    ------
    OSError
        If something can't be written.
    """
    pictures = folder / "figures"
    pictures.mkdir()
    beside = stands_beside(result)
    rows, causes, chip = comparison_rows(result), cause_rows(result), chip_rows(result.chip)
    camera = camera_rows(result.camera, result.raster)
    beside_steady = tool_rows(result, steady) if steady else []
    figures, emissivities = list(draw_figures(result, pictures)), table_1(result)
    bodies = {
        "comparison": _comparison(result, rows),
        "figures": "\n".join(_in_the_papers_order(figures, emissivities, settings)),
        "emissivity": _emissivities(emissivities),
        "beyond": "\n".join(figure_part(figure) for figure in figures if not figure.paper),
    }
    titles = (_BESIDE_PAPER if beside else _OWN).items()
    first, *others = [(name, head, bodies[name]) for name, head in titles if bodies[name]]
    sections = [
        ("answer", "The answer", answer_part(answer(result), remarks)),
        first,
        ("scatter", "What makes the scatter", _causes(causes)),
        *others,
        *([("steady-tool", _STEADY, steady_tool_part(result, beside_steady))] if steady else []),
        ("chip", "The chip", _chip_table(chip)),
        *([("camera", "The camera", camera_table(camera))] if camera else []),
        *closing_sections(study_text, provenance),
        ("cite", "How to cite", _citation()),
    ]
    return write_files(
        folder,
        document(title, sections),
        results_dataset(result, provenance),
        {
            **summary(rows, causes, chip, provenance, camera),
            **({"steady_tool": steady_tool_summary(beside_steady)} if steady else {}),
        },
        study_text,
    )


def _comparison(result: StudyResult, rows: Sequence[Row]) -> str:
    beside = stands_beside(result)
    text = (
        f"{error_definition(result)} PSF: point spread function. Here: mean ± standard deviation "
        "over the draws of segment, texture and pixel phase, or ± standard uncertainty where there "
        "is one number. One draw: one frame"
    )
    heads: tuple[str, ...] = ("Quantity", "Here", "Range of draws", "One draw")
    if not beside:
        text += "."
    else:
        text += (
            " by the paper's procedure. Differs: whether one more draw would be as far off as the "
            "paper's figure in fewer than 5 of 100 cases."
        )
        heads = ("Quantity", "Paper", *heads[1:], "Differs")
    return table_part(text, heads, (_comparison_line(row, beside) for row in rows))


def _comparison_line(row: Row, beside: bool) -> Line:
    texts = [row.here_text, row.range_text, row.one_draw_text]
    if beside:
        texts = [row.paper_text, *texts, row.differs_text]
    where = f"Paper: {row.where}" if row.where else ""
    return Line((row.quantity, *texts), row.explanation, where)


def _causes(rows: Sequence[CauseRow]) -> str:
    if not rows:
        return "<p>One draw only: it says nothing of the scatter.</p>"
    names = [f"{name} ({count})" for name, count, _, _ in rows[0].causes]
    text = (
        "Each cause in the mean over the others: standard deviation, and its part of the sum of "
        "squares. In brackets above, how many values it took. Causes together: what none of them "
        "makes by itself."
    )
    lines = (Line((row.quantity, *row.texts)) for row in rows)
    return table_part(text, ("Quantity", *names), lines)


def _chip_table(rows: Sequence[Row]) -> str:
    lines = (Line((row.quantity, row.value_text, row.spread_text), row.explanation) for row in rows)
    return table_part("", ("Quantity", "Here", "Spread"), lines)


def _in_the_papers_order(
    figures: Sequence[FigureFile],
    emissivities: Sequence[EmissivityTexts],
    settings: Sequence[tuple[str, str, str]],
) -> Iterator[str]:
    """Figures by their numbers; Table 1 after Figure 3, Table 2 after Figure 4."""
    after = {"Figure 3": _table_1(emissivities), "Figure 4": _table_2(settings)}
    for figure in figures:
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
    lines = (
        Line((row.feature, row.true, row.mean, row.standard_deviation, row.textures))
        for row in rows
    )
    return table_part(text, heads, lines) if rows else ""


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
    lines = (
        Line((row.feature, row.paper, row.true, row.mean, row.standard_deviation, row.textures))
        for row in rows
    )
    table = table_part(text, heads, lines)
    return _titled("table-1", "Table 1: emissivity of heated chips and tool", table)


def _table_2(rows: Sequence[tuple[str, str, str]]) -> str:
    if not rows:
        return ""
    heads = ("Setting", "Paper", "Here")
    text = (
        "Settings of the cutting simulation. Not legible: a cell of the paper's table that its "
        "copy does not show."
    )
    table = table_part(text, heads, map(Line, rows))
    return _titled("table-2", "Table 2: settings of the simulation", table)


def _titled(name: str, title: str, table: str) -> str:
    return f'<div class="part" id="{name}">\n<h3>{escape(title)}</h3>\n{table}\n</div>'


def _citation() -> str:
    own = f"chipglow {__version__}: a virtual infrared camera for metal cutting."
    return (
        f"<p>This program: {escape(own)} Name the version and attach the study above.</p>\n"
        f"<p>The method: {escape(REFERENCE)}</p>"
    )
