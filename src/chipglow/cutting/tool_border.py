"""The tool beyond the computed region, so that its border conducts as if it had none.

Across the border every node has a row of cells, each longer than the last. They conduct along the
row only: heat that reaches a border far from the contact goes outward.
"""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.heat import SMALLEST_FRACTION

CELLS: Final = 24
GROWTH: Final = 1.25
"""The rows reach 840 cells of the grid out, 8.4 mm for cells of 10 µm."""


def border_nodes(fraction: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the nodes from which the tool goes on beyond the grid, (n, 2); a corner is twice.

    `fraction` is that of each node's square that the tool fills, shape (columns, rows).
    """
    columns, rows = fraction.shape
    i, j = np.arange(columns), np.arange(rows)
    sides = [(i, 0 * i), (i, 0 * i + rows - 1), (0 * j, j), (0 * j + columns - 1, j)]
    nodes: NDArray[np.int64] = np.concatenate([np.stack(side, axis=1) for side in sides])
    here: NDArray[np.bool_] = fraction[nodes[:, 0], nodes[:, 1]] > 0.0
    return nodes[here]


@njit(cache=True)
def conduct_beyond(temperature, far, border, fraction, tool_heat, grid, duration):  # type: ignore[no-untyped-def]
    """Conduct heat across the tool's border and beyond it for `duration` (s).

    `temperature` (columns, rows) and `far` (n, `CELLS`), both in K, change.
    """
    rate = tool_heat.conductivity * duration / (tool_heat.capacity * grid.cell**2)
    for k in range(border.shape[0]):
        i, j = border[k, 0], border[k, 1]
        filled = fraction[i, j]
        # Heat over capacity times a node's square; lengths and distances in cells of the grid.
        flow = rate * (temperature[i, j] - far[k, 0])
        temperature[i, j] -= filled * flow / max(filled, SMALLEST_FRACTION)
        length = 1.0
        for m in range(CELLS):
            out = 0.0
            if m + 1 < CELLS:
                out = rate * (far[k, m] - far[k, m + 1]) / (0.5 * length * (1.0 + GROWTH))
            far[k, m] += (flow - out) / length
            flow, length = out, length * GROWTH
