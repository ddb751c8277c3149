"""Figure of a material: flow stress over strain; thermal and elastic properties, density."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.cutting.library import MaterialFile
from chipglow.cutting.material import WorkpieceMaterial
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREEN, VERMILLION
from chipglow.quantities import ZERO_CELSIUS

_TEMPERATURES: Final = ((20.0, BLUE), (400.0, GREEN), (800.0, VERMILLION))
"""Temperatures of the curves in °C."""

_RATES: Final = ((1.0, ":"), (1e3, "--"), (1e5, "-"))
"""Plastic strain rates of the curves in 1/s."""

_CURVE_POINTS: Final = 300
"""Temperatures of a curve of a property."""

_STRAINS: Final = np.linspace(0.0, 2.0, 81)
"""Plastic strains of the curves."""


def material_figure(material: MaterialFile) -> Figure:
    """Draw flow stress, heat properties, moduli and density of a workpiece's material."""
    if not material.workpieces:
        raise ValueError(f"{material.name} is a tool's material, expected a workpiece's to draw")
    sets = material.workpieces
    count = len(sets)
    with style():
        figure = new_figure(2.6 * (count + 1))
        (above,), (below,) = figure.subfigures(2, 1, squeeze=False, height_ratios=(count, 1))
        panels = above.subplots(count, squeeze=False)[:, 0]
        for axes, (name, workpiece) in zip(panels, sets.items(), strict=True):
            _flow_stress_panel(axes, name, workpiece)
        _temperature_panels(below.subplots(1, 4), next(iter(sets.values())))
        figure.suptitle(f"{material.name}: {material.description}")
    return figure


def _flow_stress_panel(axes: Axes, name: str, workpiece: WorkpieceMaterial) -> None:
    for celsius, colour in _TEMPERATURES:
        if celsius + ZERO_CELSIUS >= workpiece.melting_temperature:
            continue
        for rate, line in _RATES:
            stress = workpiece.flow_stress.at(_STRAINS, rate, celsius + ZERO_CELSIUS) / 1e6
            label = f"{celsius:g} °C, {rate:.0e} 1/s"
            axes.plot(_STRAINS, stress, color=colour, linestyle=line, label=label)
    axes.set_title(f"Flow stress {name}, undamaged")
    axes.set_xlabel("plastic strain")
    axes.set_ylabel("flow stress / MPa")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _temperature_panels(panels: Sequence[Axes], workpiece: WorkpieceMaterial) -> None:
    """Draw conductivity, heat capacity, elastic moduli and density over temperature."""
    celsius = np.linspace(0.0, workpiece.melting_temperature - ZERO_CELSIUS, _CURVE_POINTS)
    kelvins = celsius + ZERO_CELSIUS
    left, middle, right, last = panels
    left.plot(celsius, workpiece.conductivity.at(kelvins), color=BLUE)
    left.set_ylabel("conductivity / W/(m K)")
    middle.plot(celsius, workpiece.heat_capacity.at(kelvins), color=VERMILLION)
    middle.set_ylabel("heat capacity / J/(kg K)")
    right.plot(celsius, workpiece.bulk_modulus_at(kelvins) / 1e9, color=GREEN, label="bulk")
    right.plot(celsius, workpiece.shear_modulus_at(kelvins) / 1e9, color=BLUE, label="shear")
    right.set_ylabel("modulus / GPa")
    right.legend()
    for axes in (left, middle, right):
        axes.set_ylim(bottom=0.0)
    last.plot(celsius, workpiece.density_at(kelvins) / 1e3, color=VERMILLION)
    last.set_ylabel("density / (g/cm³)")
    for axes in panels:
        axes.set_xlabel("temperature / °C")
