"""The tables of the report's page, and the words that explain their columns."""

from collections.abc import Mapping, Sequence
from math import nan
from typing import Any, Final, NamedTuple

from chipglow.analysis.distribution import FEWEST, TOGETHER
from chipglow.report import paper
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import Row, spread_text
from chipglow.surface import Emissivity

_PARTS: Final = ("psf", "motion", "footprint", "rest")
_EMISSIVITY: Final = {
    "found": "Found",
    "deviation": "Standard deviation found",
    "textures": "Several textures",
}


class Term(NamedTuple):
    """A word of the report and its meaning."""

    name: str
    text: str


class Column(NamedTuple):
    """A column of a table: key of its cells, heading, and id of the word that explains it."""

    key: str
    name: str
    term: str = ""


class Line(NamedTuple):
    """A row of a table apart from the report's numbers; None if its cells have no unit."""

    cells: Mapping[str, str]
    unit: str | None
    link: str = ""


class Table(NamedTuple):
    """Rows and the columns that are shown; the first column holds no numbers."""

    rows: Sequence[Row | Line]
    columns: Sequence[Column]


def tables(facts: Facts, rows: Mapping[str, Sequence[Row]]) -> dict[str, Any]:
    """Return the names by which the page uses the tables, and the report's words as `terms`."""
    terms = {
        key: Term(*(facts.text(text) for text in pair)) for key, pair in texts()["terms"].items()
    }

    def table(rows: Sequence[Row | Line], *names: str) -> Table:
        return Table(rows, [_column(name, terms) for name in names])

    def numbers(rows: Sequence[Row]) -> Table:
        drawn = ("interval", "one-draw") if any(row.draws for row in rows) else ()
        return table(rows, "quantity", "mean", *drawn)

    parted = [row for row in rows["errors"] if row.parts]
    parts = [name for name in _PARTS if any(name in row.parts for row in parted)]
    published = [row for row in rows["cut"] if row.published]
    compared = ("paper",) if facts.is_compared else ()
    differs = ("differs",) if facts.is_compared else ()
    return {
        "terms": terms,
        "rows": rows,
        "contributions": table(parted, "quantity", "reference", "error", *parts),
        "scatter": _scatter(rows["errors"]),
        "comparison": table(
            [*rows["errors"], *published],
            *("quantity", *compared, "mean", "interval", "one-draw", *differs),
        ),
        "emissivity": table(_emissivities(facts), "feature", *compared, "input", *_EMISSIVITY),
        "settings": table(_settings(facts), "setting", "paper", "here"),
        "numbers": {
            "cut": numbers([row for row in rows["cut"] if not row.published]),
            "chip": numbers(rows["chip"]),
            "camera": numbers(rows["camera"]),
        },
    }


def _column(name: str, terms: Mapping[str, Term]) -> Column:
    """Return a column; its heading leads to the word that explains it."""
    if name in _EMISSIVITY:
        return Column(name, _EMISSIVITY[name], "found")
    term = "psf-contribution" if name == "psf" else name
    if term in terms:
        return Column(name, terms[term].name, term)
    return Column(name, name.capitalize())


def _scatter(errors: Sequence[Row]) -> Table:
    """Return the causes of the scatter of each error; no rows for a single draw."""
    rows = [row for row in errors if row.draws and row.draws.draws > 1 and "_error_" in row.key]
    columns = [Column("quantity", "Quantity")]
    for name, part in rows[0].draws.parts.items() if rows and rows[0].draws else ():
        title, term = (
            ("interactions", "together") if name == TOGETHER else (name, "causes-of-scatter")
        )
        columns.append(Column(name, f"{title} ({part.draws})", term))
    return Table(rows, columns)


def _settings(facts: Facts) -> list[Line]:
    if not facts.is_compared or facts.study is None or facts.study.scene is not None:
        return []
    names = ("setting", "paper", "here")
    return [
        Line(dict(zip(names, row, strict=True)), None) for row in paper.table_2(facts.study.cutting)
    ]


def _emissivities(facts: Facts) -> list[Line]:
    cut, lines = facts.analysis.cut, []
    for row in (row for heated in (cut.heated if cut else ()) for row in heated.rows):
        published, means = paper.TABLE_1.get(row.feature), row.means
        uncertainty = float(row.found.estimate.standard_uncertainty)
        several = (nan, nan)
        if means.size >= FEWEST:
            several = float(means.mean()), float(means.std(ddof=1))
        cells = {
            "feature": row.feature,
            "paper": _emissivity_text(published) if published else "–",
            "input": _emissivity_text(row.true),
            "found": spread_text(row.found.mean, uncertainty, "", 3),
            "deviation": f"{row.found.standard_deviation:.3f}",
            "textures": spread_text(several[0], several[1], "", 3),
        }
        lines.append(Line(cells, ""))
    return lines


def _emissivity_text(emissivity: Emissivity) -> str:
    return spread_text(emissivity.mean, emissivity.standard_deviation, "", 2)
