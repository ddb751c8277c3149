"""Pictures of materials: flow stress over strain, heat properties over temperature."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.cutting import MaterialFile, WorkpieceMaterial
from chipglow.report.drawing import BLUE, GREEN, KELVIN, VERMILLION, new_figure, style

_TEMPERATURES: Final = ((20.0, BLUE), (400.0, GREEN), (800.0, VERMILLION))
_RATES: Final = ((1.0, ":"), (1e3, "--"), (1e5, "-"))
_STRAINS: Final = np.linspace(0.0, 2.0, 81)


def material_figure(material: MaterialFile) -> Figure:
    """Flow stress of every set, and conductivity and heat capacity.

    Parameters
    ----------
    material : MaterialFile
        A workpiece's material; a tool's has nothing that varies.

    Raises
    ------
    ValueError
        If it is a tool's.
    """
    if not material.workpieces:
        raise ValueError(f"{material.name} is a tool's material, expected a workpiece's to draw")
    sets = material.workpieces
    rows = len(sets) + 1
    with style():
        figure = new_figure(2.6 * rows)
        grid = figure.add_gridspec(rows, 2)
        for row, (name, workpiece) in enumerate(sets.items()):
            _flow_stress_panel(figure.add_subplot(grid[row, :]), name, workpiece)
        _heat_panels(figure.add_subplot(grid[-1, 0]), figure.add_subplot(grid[-1, 1]), sets)
        figure.suptitle(f"{material.name}: {material.description}")
    return figure


def _flow_stress_panel(axes: Axes, name: str, workpiece: WorkpieceMaterial) -> None:
    for celsius, colour in _TEMPERATURES:
        if celsius + KELVIN >= workpiece.melting_temperature:
            continue
        for rate, line in _RATES:
            stress = workpiece.flow_stress.at(_STRAINS, rate, celsius + KELVIN) / 1e6
            label = f"{celsius:g} °C, {rate:.0e} 1/s"
            axes.plot(_STRAINS, stress, color=colour, linestyle=line, label=label)
    axes.set_title(f"Flow stress {name}, undamaged")
    axes.set_xlabel("plastic strain")
    axes.set_ylabel("flow stress / MPa")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _heat_panels(left: Axes, right: Axes, sets: Mapping[str, WorkpieceMaterial]) -> None:
    workpiece = next(iter(sets.values()))
    celsius = np.linspace(0.0, workpiece.melting_temperature - KELVIN, 300)
    left.plot(celsius, workpiece.conductivity.at(celsius + KELVIN), color=BLUE)
    left.set_ylabel("conductivity / W/(m K)")
    right.plot(celsius, workpiece.heat_capacity.at(celsius + KELVIN), color=VERMILLION)
    right.set_ylabel("heat capacity / J/(kg K)")
    for axes in (left, right):
        axes.set_xlabel("temperature / °C")
        axes.set_ylim(bottom=0.0)
