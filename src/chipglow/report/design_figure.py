"""Figure of a choice of settings: bias and uncertainty of each setting."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from chipglow.drawing import drawing, scales
from chipglow.quantities import Quantity, value_text
from chipglow.study import Design


def draw_design(result: Design, quantities: Mapping[str, Quantity | None]) -> Figure:
    """Draw every setting by bias and uncertainty, the Pareto front, and the best setting."""
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
        name = "best: " + ", ".join(setting_text(path, best[path], quantities) for path in best)
        marks[name] = ([result.best], {"marker": "*", "color": scales.VERMILLION, "markersize": 14})
    with drawing.style():
        figure = drawing.new_figure(4.2)
        panel = figure.subplots()
        for label, (chosen, style) in marks.items():
            x, y = bias[chosen], uncertainty[chosen]
            if np.isfinite(x).any():
                panel.plot(x, y, label=label, **{"linestyle": "none", **style})
        panel.set_xlabel("magnitude of the bias / K")
        panel.set_ylabel("expanded uncertainty (k = 2) / K")
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def setting_text(path: str, value: object, quantities: Mapping[str, Quantity | None]) -> str:
    """Return a setting's name without its section, and its value in its unit."""
    return f"{path.partition('.')[2].replace('_', ' ')} {value_text(value, quantities[path])}"
