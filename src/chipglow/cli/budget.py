"""An uncertainty and its parts as a table, for the commands that print them."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

    from chipglow.uncertainty import Estimate


def budget_table(estimate: "Estimate") -> "Table":
    """What makes values in K uncertain: over all values, root mean square and the greatest.

    Parameters
    ----------
    estimate : Estimate
        The values; NaN where there is none.
    """
    import numpy as np
    from rich.table import Table

    table = Table("parts of u / K", "root mean square", "greatest", box=None)
    for column in table.columns[1:]:
        column.justify = "right"
    known = np.isfinite(estimate.values)
    lines = [(name, estimate.contribution(name)) for name in estimate.names]
    if estimate.components:
        lines.append(("u", estimate.standard_uncertainty))
    for name, kelvins in lines:
        mean = np.sqrt((kelvins[known] ** 2).mean())
        table.add_row(name, spread_text(mean), spread_text(kelvins[known].max()))
    return table


def spread_text(value: Any) -> str:
    """Two digits that count, or a dash where nothing is known."""
    if value != value:
        return "–"
    return f"{value:.0f}" if value >= 100 else f"{value:#.2g}".removesuffix(".")
