"""Heat that chip, workpiece and tool lose through their free surface."""

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.constants import Stefan_Boltzmann

from chipglow.cutting.conditions import Numerics, Surroundings
from chipglow.cutting.heat import SMALLEST_FRACTION

_SIGMA = float(Stefan_Boltzmann)
_OUTSIDE, _INSIDE = 0.1, 0.7
"""Filled fractions between which the surface lies: that of a surface runs over three cells, that
of the inside is uneven. So the two sides of a contact together are inside."""


class HeatLoss(NamedTuple):
    """Losses of a free surface within left, right, bottom and top (m): see `Surroundings`."""

    convection: float
    emissivity: float
    ambient: float
    left: float
    right: float
    bottom: float
    top: float

    @classmethod
    def of(cls, surroundings: Surroundings, numerics: Numerics) -> "HeatLoss":
        """Return losses in the computed region, whose own border is no free surface."""
        edge = 2 * numerics.cell
        return cls(
            surroundings.convection,
            surroundings.emissivity,
            surroundings.temperature,
            left=-numerics.upstream,
            right=numerics.downstream - edge,
            bottom=-numerics.depth,
            top=numerics.height - edge,
        )


@njit
def heat_flux(temperature, loss):  # type: ignore[no-untyped-def]
    """Return the heat in W/m² that a surface loses at a temperature in K."""
    radiated = _SIGMA * (temperature**4 - loss.ambient**4)
    return loss.convection * (temperature - loss.ambient) + loss.emissivity * radiated


@njit(cache=True)
def free_surface(nodes, fraction, grid, i, j):  # type: ignore[no-untyped-def]
    """Return the free surface of chip and tool per width (m) at the four nodes from (i, j) on.

    The gradient of the filled fraction, integrated over an area, is the length of the boundary in
    it (coarea formula).
    """
    a, b = _filled(nodes, fraction, i, j), _filled(nodes, fraction, i + 1, j)
    c, d = _filled(nodes, fraction, i, j + 1), _filled(nodes, fraction, i + 1, j + 1)
    x, y = 0.5 * (b + d - a - c), 0.5 * (c + d - a - b)
    return np.sqrt(x * x + y * y) * grid.cell


@njit
def _filled(nodes, fraction, i, j):  # type: ignore[no-untyped-def]
    inside = (nodes[i, j, 2] + fraction[i, j] - _OUTSIDE) / (_INSIDE - _OUTSIDE)
    return min(max(inside, 0.0), 1.0)


@njit(cache=True)
def lose_heat(nodes, increment, temperature, fraction, tool_heat, loss, grid, duration):  # type: ignore[no-untyped-def]
    """Take the heat that the free surface loses in `duration` (s); return it in J/m.

    `nodes` is that of `conduct`; `increment` (K) of the chip and `temperature` (K) of the tool
    change, both (columns, rows).
    """
    lost = 0.0
    first = max(int(np.ceil((loss.left - grid.left) / grid.cell)), 0)
    last = min(int((loss.right - grid.left) / grid.cell), grid.columns - 1)
    low = max(int(np.ceil((loss.bottom - grid.bottom) / grid.cell)), 0)
    high = min(int((loss.top - grid.bottom) / grid.cell), grid.rows - 1)
    for i in range(first, last):
        for j in range(low, high):
            surface = free_surface(nodes, fraction, grid, i, j)
            if surface > 0.0:
                lost += _lose(
                    nodes, increment, temperature, fraction, tool_heat, loss, grid, i, j,
                    surface * duration,
                )  # fmt: skip
    return lost


@njit
def _lose(  # type: ignore[no-untyped-def]
    nodes, increment, temperature, fraction, tool_heat, loss, grid, i, j, surface_time
):
    """Share a piece of surface, times its time, among what is at its four nodes."""
    total = 0.0
    for k in range(i, i + 2):
        for m in range(j, j + 2):
            total += nodes[k, m, 2] + fraction[k, m]
    lost = 0.0
    for k in range(i, i + 2):
        for m in range(j, j + 2):
            if nodes[k, m, 0] > 0.0:
                heat = heat_flux(nodes[k, m, 1], loss) * surface_time * nodes[k, m, 2] / total
                increment[k, m] -= heat / nodes[k, m, 0]
                lost += heat
            if fraction[k, m] > 0.0:
                heat = heat_flux(temperature[k, m], loss) * surface_time * fraction[k, m] / total
                store = tool_heat.capacity * grid.cell**2 * max(fraction[k, m], SMALLEST_FRACTION)
                temperature[k, m] -= heat / store
                lost += heat
    return lost
