"""Results as tables on the terminal."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from string import Formatter
from typing import TYPE_CHECKING, Any, Final, TypeAlias

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table

    from chipglow.uncertainty import Estimate

Cell: TypeAlias = str | Callable[[Mapping[str, Any]], str]
"""A template of a frame's columns such as ``{mean_degC:.1f}``, or what makes a text of a row."""


def screen_table(
    frame: "pd.DataFrame",
    cells: Mapping[str, Cell],
    title: str | None = None,
    unbroken: Collection[str] = (),
) -> "Table":
    """A frame of a result as a table.

    Parameters
    ----------
    frame : DataFrame
        A row for each line.
    cells : mapping
        By the heads of the columns what stands in them. A template's format is Python's, or ``u``
        for two digits that count. Where there is no number a dash stands, and nothing after ±.
    title : str, optional
        Above the table.
    unbroken : collection of str
        Heads of columns that a narrow terminal must not break. It breaks no number.
    """
    from rich.table import Table

    rows = [[_text(cell, row) for cell in cells.values()] for row in frame.to_dict("records")]
    table = Table(box=None, title=title, title_justify="left")
    for number, (head, cell) in enumerate(cells.items()):
        is_number = callable(cell) or ":" in cell
        table.add_column(
            head,
            justify="right" if is_number else "left",
            no_wrap=head in unbroken,
            overflow="fold",
            min_width=max((len(row[number]) for row in rows), default=0) if is_number else None,
        )
    for row in rows:
        table.add_row(*row)
    return table


def budget_frame(estimate: "Estimate") -> "pd.DataFrame":
    """What makes values in K uncertain: over all values, root mean square and the greatest.

    Parameters
    ----------
    estimate : Estimate
        The values; NaN where there is none.
    """
    import numpy as np
    import pandas as pd

    known = np.isfinite(estimate.values)
    parts = {name: estimate.contribution(name)[known] for name in estimate.names}
    if estimate.components:
        parts["u"] = estimate.standard_uncertainty[known]
    rows = [
        {"part": name, "rms_K": np.sqrt((kelvins**2).mean()), "greatest_K": kelvins.max()}
        for name, kelvins in parts.items()
    ]
    return pd.DataFrame(rows)


BUDGET_CELLS: Final[Mapping[str, Cell]] = {
    "parts of u / K": "{part}",
    "root mean square": "{rms_K:u}",
    "greatest": "{greatest_K:u}",
}


def facts_table(rows: Iterable[tuple[str, str]]) -> "Table":
    """Names and what they are, side by side, without what could steer the terminal."""
    from rich.table import Table

    table = Table(box=None, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*map(_printable, row))
    return table


def part_cells(causes: Sequence[str]) -> dict[str, str]:
    """Cells of the parts of an uncertainty, which a frame has as ``…_uncertainty``."""
    return {cause: f"{{{cause}_uncertainty:u}}" for cause in causes}


class _Template(Formatter):
    def format_field(self, value: Any, format_spec: str) -> str:
        if value != value:
            return "–"
        if format_spec != "u":
            return str(super().format_field(value, format_spec))
        return f"{value:.0f}" if value >= 100 else f"{value:#.2g}".removesuffix(".")


def _text(cell: Cell, row: Mapping[str, Any]) -> str:
    text = cell(row) if callable(cell) else _Template().vformat(cell, (), row)
    return text.replace(" ± –", "")


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)
