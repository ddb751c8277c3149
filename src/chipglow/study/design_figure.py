"""Figure of a choice of settings: bias and uncertainty of each setting."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.drawing import drawing, scales
from chipglow.quantities import Quantity, value_text

if TYPE_CHECKING:
    from chipglow.study.designs import Design


def draw_design(result: "Design") -> Figure:
    """Draw every setting by bias and uncertainty, the Pareto front, and the best setting."""
    with drawing.style():
        figure = drawing.new_figure(4.2)
        _draw_settings(figure.subplots(), result)
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def plot_design(result: "Design", ax: Axes | None) -> Axes:
    """Draw the same on axes, with the legend in them."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        _draw_settings(axes, result)
        axes.legend()
    return axes


def _draw_settings(axes: Axes, result: "Design") -> None:
    bias, uncertainty = result.objectives.T
    excluded = [number in result.reasons for number in range(len(bias))]
    front = sorted(result.is_pareto.nonzero()[0].tolist(), key=lambda number: bias[number])
    marks: dict[str, tuple[Any, dict[str, Any]]] = {
        "beyond a limit": (excluded, {"marker": "x", "color": scales.GREY}),
        "other settings": ([not one for one in excluded], {"marker": "o", "color": scales.GREY}),
        "Pareto front": (front, {"marker": "o", "color": scales.BLUE, "linestyle": "-"}),
        f"own settings of the study{', excluded' * excluded[0]}": (
            [0],
            {"marker": "D", "color": "black"},
        ),
    }
    if result.best is not None:
        best = result.settings[result.best]
        texts = (setting_text(path, best[path], result.quantities) for path in best)
        name = f"best: {', '.join(texts)}"
        marks[name] = ([result.best], {"marker": "*", "color": scales.VERMILLION, "markersize": 14})
    for label, (chosen, style) in marks.items():
        x, y = bias[chosen], uncertainty[chosen]
        if np.isfinite(x).any():
            axes.plot(x, y, label=label, **{"linestyle": "none", **style})
    axes.set_xlabel("magnitude of the bias / K")
    axes.set_ylabel("expanded uncertainty (k = 2) / K")


def setting_text(path: str, value: object, quantities: Mapping[str, Quantity | None]) -> str:
    """Return a setting's name without its section, and its value in its unit."""
    return f"{path.partition('.')[2].replace('_', ' ')} {value_text(value, quantities[path])}"
