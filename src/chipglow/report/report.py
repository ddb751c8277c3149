"""The report: page, figures, numbers, arrays and the study as run, in one folder."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final

import xarray as xr
from matplotlib.figure import Figure

from chipglow import __version__
from chipglow.analysis import Analysis, with_errors
from chipglow.analysis.distribution import TOGETHER
from chipglow.drawing import drawing
from chipglow.io import write_dataset
from chipglow.report import cut_figures, figures, paper
from chipglow.report.answer import answer
from chipglow.report.facts import Facts, texts
from chipglow.report.page import (
    Failure,
    FigureFile,
    Line,
    Pairs,
    Part,
    Remarks,
    Section,
    Table,
    Term,
    Terms,
    Text,
    page,
)
from chipglow.report.player import exposure_player
from chipglow.report.rows import (
    Row,
    camera_rows,
    cause_rows,
    chip_rows,
    cut_rows,
    draws_text,
    error_rows,
    part_rows,
    spread_text,
)
from chipglow.report.steady_tool import tool_rows, tool_table
from chipglow.report.summary import summary
from chipglow.study import Study
from chipglow.text import json_schema

_FIGURES: Final[Mapping[str, Callable[[Facts], Figure | None]]] = {
    "psf": figures.point_spread,
    "heated-chips": cut_figures.heated_chips,
    "heated-tool": cut_figures.heated_tool,
    "scene": figures.scene,
    "measurement": figures.measurement,
    "rake-profiles": cut_figures.rake_profiles,
    "dual-spectrum": cut_figures.dual_spectrum,
    "band-curves": cut_figures.band_curves,
    "error-images": figures.error_images,
    "error-lines": figures.error_lines,
    "over-time": figures.over_time,
    "psf-sensitivity": figures.psf_sensitivity,
    "forces": cut_figures.forces,
    "chip-thickness": cut_figures.chip_thickness,
}
"""All figures in the order of the paper, then further ones."""

_ELSEWHERE: Final = ("psf-sensitivity", "over-time", "forces", "chip-thickness")
"""Figures beside the numbers that they explain; the others follow the table of the errors."""


def write_report(
    analysis: Analysis,
    folder: Path,
    title: str,
    study_text: str,
    provenance: Mapping[str, str],
    remarks: Sequence[str] = (),
    study: Study | None = None,
    steady: Analysis | None = None,
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
        The study's YAML, written as ``study.yaml`` and shown in the report.
    provenance : mapping
        Origin, time, version, seed and the like, in the order of display.
    remarks : sequence of str
        Assumptions and warnings to consider before quoting a number, one sentence each.
    study : Study, optional
        The study; the paper's values are shown if it is the paper's.
    steady : Analysis, optional
        Analysis of the same study with a steady tool, for comparison.

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
    report = _Report(analysis, title, study_text, provenance, remarks, study, steady)
    (folder / "study.yaml").write_text(study_text, encoding="utf-8")
    _write_arrays(analysis.data, provenance, folder / "results.nc")
    report.write_numbers(folder)
    (folder / "figures").mkdir()
    path = folder / "report.html"
    path.write_text(page(title, report.sections(folder / "figures")), encoding="utf-8")
    return path


def _write_arrays(data: xr.Dataset, provenance: Mapping[str, str], path: Path) -> None:
    written = with_errors(data).assign_attrs(
        {f"provenance_{name.replace(' ', '_')}": text for name, text in provenance.items()}
    )
    write_dataset(written, path)


@dataclass(frozen=True)
class _Report:
    """What `write_report` is given, its rows and the sections of the page."""

    analysis: Analysis
    title: str
    study_text: str
    provenance: Mapping[str, str]
    remarks: Sequence[str]
    study: Study | None
    steady: Analysis | None

    @cached_property
    def facts(self) -> Facts:
        """Values for the texts."""
        return Facts(self.analysis, self.study)

    @cached_property
    def errors(self) -> list[Row]:
        """Rows of the errors."""
        return error_rows(self.facts)

    @cached_property
    def cut(self) -> list[Row]:
        """Rows of the cut."""
        return cut_rows(self.facts)

    @cached_property
    def chip(self) -> list[Row]:
        """Rows of the chip."""
        return chip_rows(self.facts)

    @cached_property
    def camera(self) -> list[Row]:
        """Rows of the camera."""
        return camera_rows(self.facts)

    @cached_property
    def tool(self) -> list[Any]:
        """Rows of the comparison with a steady tool."""
        return tool_rows(self.analysis, self.steady) if self.steady else []

    def write_numbers(self, folder: Path) -> None:
        """Write ``summary.json`` and its schema."""
        rows = [*self.errors, *self.cut]
        numbers = summary(
            rows,
            cause_rows(self.errors),
            part_rows(self.facts, self.errors),
            self.chip,
            self.camera,
            self.tool,
            provenance=dict(self.provenance),
            missing=list(self.analysis.missing),
            failed=dict(self.analysis.failed),
        )
        text = numbers.model_dump_json(indent=2, exclude_defaults=True)
        (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
        schema = json_schema(type(numbers))
        (folder / "summary.schema.json").write_text(schema, encoding="utf-8")

    def sections(self, folder: Path) -> list[Section]:
        """Return the sections of the page; figures are drawn into a folder."""
        drawn = dict(self._draw(folder))
        beside = {name: [drawn.pop(name)] if name in drawn else [] for name in _ELSEWHERE}
        player = self._attempt("Images of the exposures", lambda: exposure_player(self.facts))
        failed = [Failure(title, reason) for title, reason in self.analysis.failed.items()]
        first = [answer(self.facts, self.errors), player, *failed, Remarks(self.remarks)]
        heading = "Comparison with the paper" if self.facts.is_compared else "The errors"
        return [
            Section("answer", "The answer", [Part("", "", first)]),
            Section("causes", "Causes of the errors", list(self._causes(beside))),
            Section("comparison", heading, [Part("", "", [self._comparison(), *drawn.values()])]),
            Section("tables", "Tables", list(self._tables(beside))),
            Section("repeat", "How to repeat it", list(self._repeat())),
        ]

    def _attempt(self, title: str, make: Callable[[], Any]) -> Any:
        """Return a part of the page, or its failure with the reason."""
        try:
            return make()
        except Exception as error:
            return Failure(title, f"{type(error).__name__}: {error}")

    def _draw(self, folder: Path) -> Iterator[tuple[str, FigureFile | Failure]]:
        for name, draw in _FIGURES.items():
            if self.analysis.cut is None and draw.__module__ == cut_figures.__name__:
                continue
            title = self.facts.text(texts()["figures"][name]["title"])
            block = self._attempt(title, partial(self._figure, name, title, draw, folder))
            if block is not None:
                yield name, block

    def _figure(
        self, name: str, title: str, draw: Callable[[Facts], Figure | None], folder: Path
    ) -> FigureFile | None:
        with drawing.style():
            figure = draw(self.facts)
            if figure is None:
                return None
            published = paper.FIGURES.get(name) if self.facts.is_compared else None
            number = published.number if published else ""
            file = f"{number.lower().replace(' ', '-')}-{name}".lstrip("-")
            png, _ = drawing.save(figure, folder, file)
        caption, alt = (
            self.facts.text(texts()["figures"][name][key]) for key in ("caption", "alt")
        )
        caption = f"{caption} {published.text}" if published else caption
        return FigureFile(file, title, number, caption, alt, png)

    def _causes(self, beside: Mapping[str, Sequence[Any]]) -> Iterator[Part]:
        explained = Terms([row.term for row in self.errors if row.explanation])
        yield Part("", "", [self._parts(), explained])
        scatter = [self._scatter(), *beside["over-time"], *beside["psf-sensitivity"]]
        yield Part("scatter", "Sources of scatter", scatter)
        if self.tool:
            table = tool_table(self.analysis, self.tool, self.study)
            yield Part("steady-tool", "Tool at steady-state temperature", [table])

    def _parts(self) -> Table:
        """Return the contributions to each error."""
        rows = part_rows(self.facts, self.errors)
        references = {row.key: row.reference_text for row in self.errors}
        names = [
            name
            for name in ("psf", "motion", "footprint", "rest")
            if any(name in row.parts for row in rows)
        ]
        words = ("psf-contribution" if name == "psf" else name for name in names)
        heads = [Term("", "Quantity"), *map(self._head, ("reference", "error", *words))]
        lines = [
            Line(
                (
                    row.quantity,
                    references[row.key],
                    draws_text(row.error),
                    *(draws_text(row.parts.get(name)) for name in names),
                ),
                "°C",
                row.link,
            )
            for row in rows
        ]
        text = "Contributions to each error: mean ± standard deviation over the draws."
        return Table(text, heads, lines)

    def _scatter(self) -> Table | Text:
        """Return the causes of the scatter of each error."""
        rows = [row for row in cause_rows(self.errors) if row.key.endswith("_error_degC")]
        if not rows:
            return Text("There is only one draw, so the scatter is not known.")
        *names, together = (f"{name} ({count})" for name, count, _, _ in rows[0].causes)
        together = together.replace(TOGETHER, "interactions")
        heads = [Term("", "Quantity"), *(Term("causes-of-scatter", name) for name in names)]
        heads.append(Term("together", together))
        lines = [Line((row.quantity, *row.cells), row.unit, row.link) for row in rows]
        text = (
            "Scatter of the errors due to each cause alone, as a standard deviation with its "
            "fraction of the sum of squares. The headings state the number of values."
        )
        return Table(text, heads, lines)

    def _comparison(self) -> Table:
        """Return all errors and, if the study is the paper's, the published values."""
        compared = self.facts.is_compared
        rows = [*self.errors, *(row for row in self.cut if row.published)]
        heads = [Term("", "Quantity"), *([Term("", "Paper")] if compared else [])]
        heads += map(self._head, ("mean", "interval", "one-draw"))
        heads += [self._head("differs")] if compared else []
        lines = []
        for row in rows:
            cells = [row.quantity, *([row.paper_text] if compared else [])]
            cells += [row.here_text, row.interval_text, row.one_draw_text]
            cells += [row.differs_text] if compared else []
            where = f"Paper: {row.published.where}" if row.published else ""
            lines.append(Line(cells, row.unit or "1", row.term.key, where))
        return Table(self.facts.text(texts()["definition"]), heads, lines)

    def _tables(self, beside: Mapping[str, Sequence[Any]]) -> Iterator[Part]:
        compared = self.facts.is_compared
        if heated := self._emissivity():
            title = "Table 1: emissivity of heated chips and tool" if compared else "Emissivity"
            yield Part("table-1" if compared else "emissivity", title, [heated])
        if compared and self.study and self.study.scene is None:
            lines = [Line(row) for row in paper.table_2(self.study)]
            heads = [Term("", head) for head in ("Setting", "Paper", "Here")]
            table = Table(paper.TABLE_2_TEXT, heads, lines)
            yield Part("table-2", "Table 2: settings of the simulation", [table])
        for key, title, rows, figure in (
            ("cut", "The cut", [row for row in self.cut if not row.published], "forces"),
            ("chip", "The chip", self.chip, "chip-thickness"),
            ("camera", "The camera", self.camera, ""),
        ):
            if rows:
                yield Part(key, title, [self._numbers(rows), *beside.get(figure, [])])
        if self.analysis.missing:
            missing = [Text(sentence) for sentence in self.analysis.missing]
            yield Part("missing", "Not available", missing)

    def _numbers(self, rows: Sequence[Row]) -> Table:
        drawn = any(row.draws for row in rows)
        heads = [Term("", "Quantity"), self._head("mean")]
        heads += map(self._head, ("interval", "one-draw")) if drawn else ()
        lines = []
        for row in rows:
            cells = [row.quantity, row.here_text]
            cells += [row.interval_text, row.one_draw_text] if drawn else []
            lines.append(Line(cells, row.unit or "1", row.term.key))
        return Table("", heads, lines)

    def _emissivity(self) -> Table | None:
        """Return the emissivities of the heated objects: published, put in and found."""
        rows = (
            [row for one in self.analysis.cut.heated for row in one.rows]
            if self.analysis.cut
            else []
        )
        compared = self.facts.is_compared
        if not rows:
            return None
        lines = []
        for row in rows:
            cells = [row.feature]
            published = paper.TABLE_1.get(row.feature)
            if compared:
                cells.append(
                    spread_text(published.mean, published.standard_deviation, "", 2).strip()
                    if published
                    else "–"
                )
            several = row.means.size > 1
            cells += [
                spread_text(row.true.mean, row.true.standard_deviation, "", 2),
                spread_text(row.found.mean, float(row.found.estimate.standard_uncertainty), "", 3),
                f"{row.found.standard_deviation:.3f}",
                spread_text(float(row.means.mean()), float(row.means.std(ddof=1)), "", 3)
                if several
                else "–",
            ]
            lines.append(Line(cells, "1"))
        found = self._head("found")
        heads = [Term("", "Feature"), *([Term("", "Paper")] if compared else []), Term("", "Input")]
        names = ("Found", "Standard deviation found", "Several textures")
        heads += [found._replace(name=name) for name in names]
        text = "Emissivity of isothermal objects as mean ± standard deviation: input and result."
        return Table(f"{text} {paper.TABLE_1_TEXT}" if compared else text, heads, lines)

    def _repeat(self) -> Iterator[Part]:
        text = (
            "With the same versions, the study below (study.yaml in the folder of this page) gives "
            "the same numbers:"
        )
        yield Part("command", "The command", [Text(text, self._command)])
        used = [*self.cut, *self.chip, *self.camera, *self.tool]
        terms = [*self._terms(), *(row.term for row in used)]
        yield Part("terms", "Glossary and methods", [Terms(terms)])
        yield Part("study", "The study as run", [Text(code=self.study_text)])
        yield Part("versions", "Versions", [Pairs(list(self.provenance.items()))])
        if self.analysis.cut is not None:
            own = f"This program: chipglow {__version__}. State the version and attach the study."
            yield Part("cite", "How to cite", [Text(own), Text(f"The method: {paper.CITATION}")])

    @property
    def _command(self) -> str:
        if self.steady:
            quick = self.facts.is_compared and self.study == Study.quick()
            return f"chipglow reproduce{' --quick' if quick else ''} --steady-tool --out results"
        if self.analysis.cut is None:
            return "chipglow error scene.nc --study study.yaml --out results"
        return "chipglow run study.yaml --out results"

    def _terms(self) -> Iterator[Term]:
        """Yield the words of this report."""
        for key in texts()["terms"]:
            if key == "differs" and not self.facts.is_compared:
                continue
            if key in ("motion", "footprint", "found") and self.analysis.cut is None:
                continue
            yield self._head(key)

    def _head(self, key: str) -> Term:
        return Term(key, *(self.facts.text(text) for text in texts()["terms"][key]))
