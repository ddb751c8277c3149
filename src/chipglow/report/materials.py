"""Pictures of materials: flow stress over strain; heat and elasticity over temperature."""

from collections.abc import Sequence
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
    """Flow stress of every set; conductivity, heat capacity and elastic moduli.

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
        grid = figure.add_gridspec(rows, 3)
        for row, (name, workpiece) in enumerate(sets.items()):
            _flow_stress_panel(figure.add_subplot(grid[row, :]), name, workpiece)
        below = [figure.add_subplot(grid[-1, column]) for column in range(3)]
        _temperature_panels(below, next(iter(sets.values())))
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


def _temperature_panels(panels: Sequence[Axes], workpiece: WorkpieceMaterial) -> None:
    """Conductivity, heat capacity and elastic moduli over the temperature."""
    celsius = np.linspace(0.0, workpiece.melting_temperature - KELVIN, 300)
    kelvins = celsius + KELVIN
    left, middle, right = panels
    left.plot(celsius, workpiece.conductivity.at(kelvins), color=BLUE)
    left.set_ylabel("conductivity / W/(m K)")
    middle.plot(celsius, workpiece.heat_capacity.at(kelvins), color=VERMILLION)
    middle.set_ylabel("heat capacity / J/(kg K)")
    right.plot(celsius, workpiece.bulk_modulus_at(kelvins) / 1e9, color=GREEN, label="bulk")
    right.plot(celsius, workpiece.shear_modulus_at(kelvins) / 1e9, color=BLUE, label="shear")
    right.set_ylabel("modulus / GPa")
    right.legend()
    for axes in panels:
        axes.set_xlabel("temperature / °C")
        axes.set_ylim(bottom=0.0)
