"""The report's folder: page, figures, numbers, arrays and the study as run."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Final

from chipglow import __version__
from chipglow.analysis import StudyResult
from chipglow.drawing.drawing import FigureFile
from chipglow.report.camera_rows import camera_rows
from chipglow.report.chip_rows import chip_rows
from chipglow.report.comparison import (
    CauseRow,
    PartRow,
    Row,
    cause_rows,
    cut_rows,
    error_rows,
    part_rows,
)
from chipglow.report.error_player import cut_player
from chipglow.report.evidence import answer, answer_note, error_definition
from chipglow.report.figures import draw_figures
from chipglow.report.page import (
    Line,
    Section,
    Term,
    answer_part,
    document,
    figure_part,
    repeat_section,
    table_part,
    terms_part,
    titled_part,
    write_files,
)
from chipglow.report.paper import CITATION, EmissivityTexts, stands_beside, table_1
from chipglow.report.results import results_dataset
from chipglow.report.steady_tool import ToolRow, steady_tool_part, tool_rows
from chipglow.report.summary import cut_summary
from chipglow.report.terms import INTERVAL, PSF
from chipglow.study import Study


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
        ``report.html``; beside it are ``figures/``, ``summary.json`` and its schema,
        ``results.nc`` and ``study.yaml``.

    Raises
    ------
    OSError
        If something can't be written.
    """
    pictures = folder / "figures"
    pictures.mkdir()
    errors, cut = error_rows(result), cut_rows(result)
    chip, camera = chip_rows(result.chip), camera_rows(result.camera, result.raster)
    causes, parts = cause_rows(result), part_rows(result)
    beside_steady = tool_rows(result, steady) if steady else []
    figures = {figure.name: figure for figure in draw_figures(result, pictures)}
    apart = {name: _figure(figures.pop(name, None)) for name in _APART}
    compared = [*errors, *(row for row in cut if row.paper is not None)]
    others = [row for row in cut if row.paper is None]
    tables = (
        *_emissivity_tables(result, settings),
        ("cut", "The cut", f"{table_part('', _HEADS, map(_line, others))}\n{apart['forces']}"),
        ("chip", "The chip", f"{_single(chip)}\n{apart['chip-thickness']}"),
        ("camera", "The camera", _single(camera) if camera else ""),
    )
    found = [row.term for row in (*cut, *chip, *camera)] + [row.term for row in beside_steady]
    sections = [
        Section(
            "answer",
            "The answer",
            answer_part(answer(result), _note(result), remarks, cut_player(result).html),
        ),
        Section(
            "causes",
            "What causes it",
            "\n".join(
                (
                    _parts(parts),
                    terms_part(row.term for row in errors),
                    titled_part("scatter", "What makes the scatter", _causes(causes)),
                    apart["psf-sensitivity"],
                    *_steady(result, beside_steady),
                )
            ),
        ),
        Section(
            "comparison",
            "The paper beside this study" if stands_beside(result) else "The errors, and figures",
            "\n".join((_comparison(result, compared), *map(figure_part, figures.values()))),
        ),
        Section("tables", "Tables", "\n".join(titled_part(*one) for one in tables if one[2])),
        repeat_section(
            _command(result, steady is not None),
            study_text,
            provenance,
            [*_terms(result), *found],
            _citation(),
        ),
    ]
    return write_files(
        folder,
        document(title, sections),
        results_dataset(result, provenance),
        cut_summary([*errors, *cut], causes, parts, chip, camera, beside_steady, provenance),
        study_text,
    )


_APART: Final = ("psf-sensitivity", "forces", "chip-thickness")
"""Figures that stand beside what they explain; the others are in the paper's order."""

_HERE: Final = Term(
    "mean",
    "Here",
    "Mean ± sample standard deviation of the draws. Of a single number ± is its standard "
    "uncertainty, or what its explanation says; a number without it has none that is known.",
)
_ONE_DRAW: Final = Term(
    "one-draw",
    "One draw",
    "What a single frame gives: one segment, one texture, one position of the pixels.",
)
_DIFFERS: Final = Term(
    "differs",
    "Differs",
    "Whether the paper's figure lies outside the 95 % interval. Of a single number: whether the "
    "two are more than two standard uncertainties apart.",
)
_MOTION: Final = Term(
    "motion",
    "Motion",
    "Radiance temperature of the mean over the exposure less that of its peak, at one sample of "
    "the scene: the error of infinitely small pixels.",
)
_FOOTPRINT: Final = Term(
    "footprint",
    "Footprint",
    "What is left of the error: a detector element measures the mean radiance of its footprint "
    "(the size of source), and is compared with another value in it.",
)
_REST: Final = Term(
    "rest",
    "Motion and footprint",
    "Both together, where the motion's part is not known: the error less the PSF's portion.",
)
_SCATTER: Final = Term(
    "causes-of-scatter",
    "Segment, texture, pixel phase",
    "What is drawn anew: which segment of the chip is looked at, the random pattern of the "
    "emissivity, and where the pixels lie on the scene. Each cause in the mean over the others: "
    "standard deviation of these means, and its part of the sum of squares.",
)
_TOGETHER: Final = Term(
    "together", "Causes together", "What none of the causes makes by itself: a rest."
)
_HEADS: Final = ("Quantity", _HERE, INTERVAL, _ONE_DRAW)


def _note(result: StudyResult) -> str:
    headlines = list(result.draws.headlines.values())
    return answer_note(headlines[0].error if headlines else None)


def _terms(result: StudyResult) -> Iterator[Term]:
    yield Term("error", "Error", error_definition(result))
    yield from (_HERE, INTERVAL, _ONE_DRAW)
    if stands_beside(result):
        yield _DIFFERS
    yield from (PSF, _MOTION, _FOOTPRINT, _REST, _SCATTER, _TOGETHER)
    yield _FOUND


def _figure(figure: FigureFile | None) -> str:
    return figure_part(figure) if figure else ""


def _line(row: Row) -> Line:
    texts = (row.quantity, row.here_text, row.interval_text, row.one_draw_text)
    return Line(texts, row.unit or "1", row.term.key)


def _single(rows: Sequence[Row]) -> str:
    """Table of what was not drawn."""
    lines = (Line((row.quantity, row.here_text), row.unit or "1", row.term.key) for row in rows)
    return table_part("", _HEADS[:2], lines)


def _comparison(result: StudyResult, rows: Sequence[Row]) -> str:
    if not stands_beside(result):
        return table_part(error_definition(result), _HEADS, map(_line, rows))
    lines = (
        Line(
            (row.quantity, row.paper_text, *_line(row).texts[1:], row.differs_text),
            row.unit,
            row.term.key,
            f"Paper: {row.where}" if row.where else "",
        )
        for row in rows
    )
    heads = ("Quantity", "Paper", *_HEADS[1:], _DIFFERS)
    return table_part(error_definition(result), heads, lines)


def _parts(rows: Sequence[PartRow]) -> str:
    """Of what each error consists; motion and footprint apart where that is known."""
    names = ("psf", "motion", "footprint", "rest")
    shown = [name for name in names if any(name in row.parts for row in rows)]
    heads = {"psf": PSF, "motion": _MOTION, "footprint": _FOOTPRINT, "rest": _REST}
    lines = (
        Line(
            (row.quantity, row.error_text, *(row.text(name) for name in shown)),
            "°C",
            f"why-{row.key}",
        )
        for row in rows
    )
    text = "Each error of the answer, and its parts: mean ± standard deviation over the draws."
    error = Term("error", "Error", "")
    return table_part(text, ("Quantity", error, *(heads[name] for name in shown)), lines)


def _causes(rows: Sequence[CauseRow]) -> str:
    if not rows:
        return "<p>One draw only: it says nothing of the scatter.</p>"
    *names, together = (f"{name} ({count})" for name, count, _, _ in rows[0].causes)
    heads = [*(_SCATTER._replace(name=name) for name in names), _TOGETHER._replace(name=together)]
    text = (
        "How far each cause alone makes the errors scatter, as a standard deviation, and in "
        "brackets its part of the sum of squares. In the heads: how many values it took."
    )
    lines = (
        Line((row.quantity, *row.texts), row.unit, f"why-{row.key}")
        for row in rows
        if row.unit == "°C"
    )
    return table_part(text, ("Quantity", *heads), lines)


def _steady(result: StudyResult, rows: list[ToolRow]) -> Iterator[str]:
    if rows:
        title = "A tool that has been cutting for long"
        yield titled_part("steady-tool", title, steady_tool_part(result, rows))


def _command(result: StudyResult, steady: bool) -> str:
    if steady:
        quick = stands_beside(result) and result.plan.study == Study.quick()
        return f"chipglow reproduce{' --quick' if quick else ''} --steady-tool --out results"
    return "chipglow run study.yaml --out results"


def _emissivity_tables(
    result: StudyResult, settings: Sequence[tuple[str, str, str]]
) -> Iterator[tuple[str, str, str]]:
    """Tables 1 and 2 of the paper; of another study the first without the paper's numbers."""
    rows = table_1(result)
    if not stands_beside(result):
        yield ("emissivity", "Emissivity", _emissivities(rows))
        return
    yield ("table-1", "Table 1: emissivity of heated chips and tool", _table_1(rows))
    yield ("table-2", "Table 2: settings of the simulation", _table_2(settings))


_FOUND: Final = Term(
    "found",
    "Emissivity found",
    "From the image of an evenly heated object: mean and standard uncertainty of one region "
    "(thermocouple of 2 K assumed), and the standard deviation over its pixels. Several textures: "
    "mean ± standard deviation of the means of several textures. The camera's blur takes from the "
    "standard deviation, and draws narrow shear bands toward the bodies beside them.",
)
_EMISSIVITY_HEADS: Final = (
    "Put in",
    _FOUND._replace(name="Found"),
    _FOUND._replace(name="Standard deviation found"),
    _FOUND._replace(name="Several textures"),
)


def _emissivities(rows: Sequence[EmissivityTexts]) -> str:
    """Table 1 of a study that is not the paper's."""
    text = "Emissivity of evenly heated objects as mean ± standard deviation put into the study."
    lines = (
        Line((row.feature, row.true, row.mean, row.standard_deviation, row.textures), "1")
        for row in rows
    )
    return table_part(text, ("Feature", *_EMISSIVITY_HEADS), lines) if rows else ""


def _table_1(rows: Sequence[EmissivityTexts]) -> str:
    text = (
        "Emissivity as mean ± standard deviation in the paper and put into the study, and what "
        "comes back. Same as the paper: procedure and numbers. Different: here the truth is known."
    )
    lines = (
        Line(
            (row.feature, row.paper, row.true, row.mean, row.standard_deviation, row.textures), "1"
        )
        for row in rows
    )
    return table_part(text, ("Feature", "Paper", *_EMISSIVITY_HEADS), lines) if rows else ""


def _table_2(rows: Sequence[tuple[str, str, str]]) -> str:
    text = (
        "Settings of the cutting simulation. Not legible: a cell of the paper's table that its "
        "copy does not show."
    )
    return table_part(text, ("Setting", "Paper", "Here"), map(Line, rows)) if rows else ""


def _citation() -> str:
    own = f"chipglow {__version__}: a virtual infrared camera for metal cutting."
    return (
        f"<p>This program: {escape(own)} Name the version and attach the study above.</p>\n"
        f"<p>The method: {escape(CITATION)}</p>"
    )
