"""Results as tables on the terminal."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table

    from chipglow.uncertainty import Estimate

Columns: TypeAlias = Sequence[str] | Mapping[str, str]
"""Names of a frame's columns, or headings with the names; ``value ± uncertainty`` names two."""

_UNITS: Final = {"degC": "°C", "K": "K", "um": "µm", "us": "µs", "deg": "°"}
"""Units by the endings of the names of columns."""

_SHORT: Final = {
    "standard uncertainty": "u",
    "expanded uncertainty": "U 95 %",
    "coverage factor": "k",
    "standard deviation": "sd",
    "fwhm": "FWHM",
    "rms": "RMS",
    "mtf": "MTF",
    "bic": "BIC",
    "chi squared": "chi²",
    "E n": "E_n",
}
_PLUS_MINUS: Final = " ± "
_SPREADS: Final = ("uncertainty", "deviation")


def screen_table(
    frame: "pd.DataFrame",
    columns: Columns = (),
    title: str | None = None,
    unbroken: Collection[str] = (),
) -> "Table":
    """Return a frame as a table; heading, unit and digits follow from a column's name."""
    from rich.table import Table

    columns = columns or list(frame.columns)
    named = columns if isinstance(columns, Mapping) else {_heading(one): one for one in columns}
    table = Table(box=None, title=title, title_justify="left")
    rows, cells = frame.to_dict("records"), []
    for heading, column in named.items():
        texts = [_text(column, row) for row in rows]
        is_number = not all(isinstance(row[column.partition(_PLUS_MINUS)[0]], str) for row in rows)
        table.add_column(
            heading,
            justify="right" if is_number else "left",
            no_wrap=column in unbroken,
            overflow="fold",
            min_width=max(map(len, texts), default=0) if is_number else None,
        )
        cells.append(texts)
    for line in zip(*cells, strict=True):
        table.add_row(*line)
    return table


def facts_table(rows: Iterable[tuple[str, str]]) -> "Table":
    """Return names and texts side by side, without characters that control a terminal."""
    from rich.table import Table

    table = Table(box=None, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*map(_printable, row))
    return table


def budget_frame(estimate: "Estimate") -> "pd.DataFrame":
    """Return the parts of the uncertainty of values in K: root mean square and maximum."""
    import numpy as np
    import pandas as pd

    known = np.isfinite(estimate.values)
    parts = {name: estimate.contribution(name)[known] for name in estimate.names}
    if estimate.components:
        parts["u"] = estimate.standard_uncertainty[known]
    return pd.DataFrame(
        {
            "part": name,
            "rms_uncertainty_K": np.sqrt((kelvins**2).mean()),
            "greatest_uncertainty_K": kelvins.max(),
        }
        for name, kelvins in parts.items()
    )


def _heading(column: str) -> str:
    name = column.partition(_PLUS_MINUS)[0]
    stem, _, unit = name.rpartition("_")
    text = (stem if unit in _UNITS else name).replace("_", " ")
    for long, short in _SHORT.items():
        text = text.replace(long, short)
    return f"{text} / {_UNITS[unit]}" if unit in _UNITS else text


def _text(column: str, row: Mapping[str, Any]) -> str:
    from chipglow.quantities import quantity_text, rounded_text, uncertain_text

    name, _, uncertainty = column.partition(_PLUS_MINUS)
    value = row[name]
    if isinstance(value, tuple):
        return " to ".join(map(rounded_text, value)) or "–"
    if not isinstance(value, float):
        return str(value)
    if value != value:
        return "–"
    if uncertainty:
        return uncertain_text(value, row[uncertainty])
    if any(spread in name for spread in _SPREADS):
        # Two significant digits.
        return f"{value:.0f}" if value >= 100 else f"{value:#.2g}".removesuffix(".")
    return quantity_text(value, "", 1) if name.endswith("degC") else rounded_text(value)


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)
