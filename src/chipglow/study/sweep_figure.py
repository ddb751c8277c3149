"""Figure of a sweep: curves over one setting, maps over two, points over each of more."""

from collections.abc import Mapping
from typing import Any, Final, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.drawing import drawing, scales
from chipglow.quantities import Quantity

_MAX_READINGS: Final = 6
"""Readings that are drawn."""

_DARK: Final = 0.6
"""Fraction of the limits from which a colour is so dark that text on it is white."""

_Quantities: TypeAlias = Mapping[str, Quantity | None]


def draw_sweep(data: xr.Dataset, quantities: _Quantities) -> Figure:
    """Draw the error of each reading over the settings.

    Parameters
    ----------
    data : xarray.Dataset
        A sweep, of `Sweep.to_xarray`.
    quantities : mapping
        Quantity of each setting by its path, whose unit the axis has; None without a unit.
    """
    axes_names = [str(name) for name in data.coords if name not in ("reading", "point")]
    names = list(data.reading.values[:_MAX_READINGS])
    is_map = data.error.dims[:-1] == tuple(axes_names) and len(axes_names) == 2
    with drawing.style():
        columns = 1 if is_map else len(axes_names)
        figure = drawing.new_figure(2.8 * len(names) + 0.3)
        grid = figure.subplots(len(names), columns, squeeze=False)
        for row, name in zip(grid, names, strict=True):
            one = data.sel(reading=name)
            if is_map:
                _draw_map(figure, row[0], one.error, data.error.values, quantities)
            else:
                for panel, setting in zip(row, axes_names, strict=True):
                    _draw_curve(panel, one, setting, quantities)
            row[0].set_title(str(name))
    return figure


def _draw_curve(panel: Axes, one: xr.Dataset, setting: str, quantities: _Quantities) -> None:
    """Draw every point over one setting and, in a grid, the mean over the other settings."""
    error, at = xr.broadcast(one.error, one[setting])
    at = at.transpose(*error.dims)
    positions, label = _axis(at.values.ravel(), setting, quantities)
    marks: Any = {"marker": "o", "markersize": 4, "linestyle": "none", "color": scales.BLUE}
    is_curve = error.ndim == 1 and "point" not in error.dims
    spread = one.uncertainty.values if is_curve else None
    panel.errorbar(positions, error.values.ravel(), spread, capsize=2, **marks)
    if setting in error.dims:
        mean = error.mean([dim for dim in error.dims if dim != setting])
        panel.plot(_axis(one[setting].values, setting, quantities)[0], mean, color=scales.BLUE)
    panel.axhline(0.0, color=scales.GREY, linewidth=0.6)
    panel.set(xlabel=label, ylabel="error / K")


def _draw_map(
    figure: Figure, panel: Axes, error: xr.DataArray, limits: Any, quantities: _Quantities
) -> None:
    down, across = map(str, error.dims)
    values = error.values
    limit = scales.round_limit(limits, 100.0, 5.0)
    picture = panel.imshow(
        values, cmap=scales.SIGNED, vmin=-limit, vmax=limit, origin="lower", aspect="auto"
    )
    for name, of_axis in ((across, panel.xaxis), (down, panel.yaxis)):
        positions, label = _axis(error[name].values, name, quantities)
        texts = [f"{one:.4g}" if isinstance(one, float) else str(one) for one in positions]
        of_axis.set_ticks(range(len(texts)), texts)
        of_axis.set_label_text(label)
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if abs(value) > _DARK * limit else "black"
            text = f"{value:.0f}".replace("-", "−")
            panel.text(column, row, text, ha="center", va="center", color=colour)
    figure.colorbar(picture, ax=panel, label="error / K", aspect=drawing.BAR_ASPECT)


def _axis(values: Any, setting: str, quantities: _Quantities) -> tuple[Any, str]:
    """Return positions on an axis in the unit of the setting, and its label."""
    name, quantity = setting.rpartition(".")[2].replace("_", " "), quantities[setting]
    if quantity is None or not np.issubdtype(values.dtype, np.number):
        return values.tolist(), name
    numbers = [float(quantity.text(one).partition(" ")[0]) for one in values.tolist()]
    return numbers, f"{name} / {quantity.unit.replace('u', 'µ', 1)}"
