"""Whether a grid resolves what is cut with it."""

from collections.abc import Mapping
from typing import Final

CELLS_NEEDED: Final = 5.0
"""Cells across a length from which its shape, and what happens along it, is resolved."""


def unresolved(lengths: Mapping[str, float], cell: float) -> tuple[str, ...]:
    """Sentences about lengths that a grid does not resolve.

    Parameters
    ----------
    lengths : mapping of str to float
        Lengths in m by their names; 0 and NaN are left out: a sharp edge has no radius.
    cell : float
        Side of a cell in m.

    Returns
    -------
    tuple of str
        One sentence for each length of less than `CELLS_NEEDED` cells.
    """
    return tuple(
        f"The {name}, {length * 1e6:.3g} um, is {_cells(length / cell)}, expected "
        f"{CELLS_NEEDED:g} or more: take a cell of {length / CELLS_NEEDED * 1e6:.2g} um."
        for name, length in lengths.items()
        if 0.0 < length < CELLS_NEEDED * cell * (1 - 1e-9)
    )


def _cells(count: float) -> str:
    text = f"{count:.2g}"
    return f"{text} cell" if text == "1" else f"{text} cells"
