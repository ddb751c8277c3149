"""The report: page, figures, numbers, arrays and the study as run, in one folder."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import xarray as xr
from matplotlib.figure import Figure
from PIL.Image import Image

from chipglow import __version__
from chipglow.analysis import Analysis, with_errors
from chipglow.drawing import drawing
from chipglow.io import write_dataset
from chipglow.report import attribution, corrected, cut_figures, figures, paper
from chipglow.report.answer import answer, changes
from chipglow.report.facts import Facts
from chipglow.report.page import environment, texts
from chipglow.report.rows import all_rows
from chipglow.report.summary import Summary, summary
from chipglow.report.tables import tables
from chipglow.text import json_schema


class FigureFile(NamedTuple):
    """A figure as written: file name without ending, heading, the paper's figure, texts, images."""

    name: str
    title: str
    paper: str
    caption: str
    alt: str
    columns: Sequence[Image]  # of panels, beside each other or stacked on a narrow screen
    legend: Image | None


class Failure(NamedTuple):
    """A part that could not be computed or drawn, and the reason."""

    title: str
    reason: str


_FIGURES: Final[Mapping[str, Callable[[Facts], Figure | None]]] = {
    "exposure": figures.exposure,
    "psf": figures.point_spread,
    "heated-chips": cut_figures.heated_chips,
    "heated-tool": cut_figures.heated_tool,
    "chip": cut_figures.chip,
    "scene": figures.scene,
    "measurement": figures.measurement,
    "rake-profiles": cut_figures.rake_profiles,
    "dual-spectrum": cut_figures.dual_spectrum,
    "band-curves": cut_figures.band_curves,
    "error-images": figures.error_images,
    "error-lines": figures.error_lines,
    "attribution": attribution.maps,
    "attribution-lines": attribution.profiles,
    "corrected": corrected.images,
    "corrected-lines": corrected.curves,
    "over-time": figures.over_time,
    "psf-sensitivity": figures.psf_sensitivity,
    "forces": cut_figures.forces,
    "chip-thickness": cut_figures.chip_thickness,
}
"""The figure of the answer, all figures in the order of the paper, then further ones."""


_OF_A_CUT: Final = cut_figures.__name__, corrected.__name__


def write_report(
    analysis: Analysis,
    folder: Path,
    title: str,
    study_text: str,
    provenance: Mapping[str, str],
    remarks: Sequence[str] = (),
    study: Any = None,
) -> Path:
    """Write the results of an analysis into a folder.

    The numbers and arrays are written first. A part of the page that fails is shown there with
    its reason; the other parts are not affected.

    Parameters
    ----------
    analysis : Analysis
        The analysis, of a cut or any scene.
    folder : Path
        An existing folder, such as a temporary one that is moved into place at the end.
    title : str
        Title of the page.
    study_text : str
        The study's YAML, written as ``study.yaml``, to which the report leads.
    provenance : mapping
        Origin, time, version, seed and the like, in the order of display.
    remarks : sequence of str
        Assumptions and warnings to consider before quoting a number, one sentence each.
    study : chipglow.study.Study, optional
        The study; the paper's values are shown if it is the paper's.

    Returns
    -------
    Path
        ``report.html``; the folder also holds ``figures/``, ``summary.json`` and its schema,
        ``results.nc`` and ``study.yaml``.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    facts = Facts(analysis, study)
    rows = all_rows(facts)
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    _write_arrays(analysis.data, provenance, folder / "results.nc")
    attributed = attribution.contributions(facts)
    _write_numbers(summary(rows, analysis, provenance, attributed), folder)
    (folder / "figures").mkdir()
    values = {
        "title": title,
        "provenance": provenance,
        "remarks": remarks,
        "answer": answer(facts, rows["errors"]),
        "changes": changes(facts, rows["errors"]),
        "attribution": list(attribution.sentences(facts)),
        "corrections": list(
            corrected.sentences(facts, {row.key: row for row in rows["corrected"]})
        ),
        "note": facts.text(texts()["note"]),
        "camera_settings": facts.settings,
        "figures": dict(_figures(facts, folder / "figures")),
        **tables(facts, rows),
        "scene": study.scene if study else None,
        "software": paper.SOFTWARE,
        "citation": paper.CITATION,
        "version": __version__,
    }
    path = folder / "report.html"
    page = environment().get_template("report.html").render({**facts.context, **values})
    path.write_text(page, encoding="utf-8")
    return path


def _write_arrays(data: xr.Dataset, provenance: Mapping[str, str], path: Path) -> None:
    written = with_errors(data).assign_attrs(
        {f"provenance_{name.replace(' ', '_')}": text for name, text in provenance.items()}
    )
    write_dataset(written, path)


def _write_numbers(numbers: Summary, folder: Path) -> None:
    text = numbers.model_dump_json(indent=2, exclude_defaults=True)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    (folder / "summary.schema.json").write_text(json_schema(Summary), encoding="utf-8")


def _attempt(title: str, make: Callable[[], Any]) -> Any:
    """Return a part of the page, or its failure with the reason."""
    try:
        return make()
    except Exception as error:
        return Failure(title, f"{type(error).__name__}: {error}")


def _figures(facts: Facts, folder: Path) -> Iterator[tuple[str, FigureFile | Failure]]:
    for name, draw in _FIGURES.items():
        if facts.analysis.cut is None and draw.__module__ in _OF_A_CUT:
            continue
        title = facts.text(texts()["figures"][name]["title"])
        figure = _attempt(title, partial(_figure, facts, name, title, draw, folder))
        if figure is not None:
            yield name, figure


def _figure(
    facts: Facts, name: str, title: str, draw: Callable[[Facts], Figure | None], folder: Path
) -> FigureFile | None:
    with drawing.style():
        figure = draw(facts)
        if figure is None:
            return None
        number, more = paper.FIGURES.get(name, ("", "")) if facts.is_compared else ("", "")
        file = f"{number.lower().replace(' ', '-')}-{name}".lstrip("-")
        drawing.label_panels(figure)
        png, _ = drawing.save(figure, folder, file)
        columns, legend = drawing.panels(figure, png)
    caption, alt = (facts.text(texts()["figures"][name][key]) for key in ("caption", "alt"))
    return FigureFile(file, title, number, f"{caption} {more}".strip(), alt, columns, legend)
