"""Figure of an uncertainty budget: the contributions of the inputs to each reading."""

from itertools import cycle
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from chipglow.drawing import drawing, scales

if TYPE_CHECKING:
    from chipglow.study.budgets import StudyBudget

_SHOWN_INPUTS: Final = 6
"""Inputs of the largest contributions that are shown."""

_HEIGHT: Final = 0.22
"""Height of a bar in inches."""


def draw_budget(result: "StudyBudget") -> Figure:
    """Draw the largest contributions to each reading, coloured by group, and their total."""
    frame, summary = result.to_frame(), result.summary().set_index("reading")
    colour_of = dict(zip(result.group_names, cycle(scales.COLOURS)))
    groups = [one for one in colour_of if one in set(frame.group)]
    count = min(frame.input.nunique(), _SHOWN_INPUTS) + 1
    with drawing.style():
        figure = drawing.new_figure(len(result.readings) * (count * _HEIGHT + 0.75) + 0.4)
        panels = figure.subplots(len(result.readings), 1, squeeze=False, sharex=True)[:, 0]
        for panel, (reading, part) in zip(
            panels, frame.groupby("reading", sort=False), strict=True
        ):
            part = part.nlargest(_SHOWN_INPUTS, "contribution_K")
            positions = np.arange(len(part))
            colours = [colour_of[group] for group in part.group]
            panel.barh(positions, part.contribution_K, color=colours)
            one = summary.loc[reading]
            panel.barh(len(part), one.standard_uncertainty_K, color="black")
            panel.set_yticks(range(len(part) + 1), [*map(_label, part.input), "all together"])
            panel.invert_yaxis()
            panel.set_title(
                f"{reading}: error {_number(one.error_K)} K, 95 % of readings within "
                f"{_number(one.low_K)} to {_number(one.high_K)} K"
            )
        panels[-1].set_xlabel("standard uncertainty / K")
        handles = [Patch(color=colour_of[group]) for group in groups]
        figure.legend(handles, groups, loc="outside lower center", ncols=len(groups))
    return figure


def _label(name: str) -> str:
    """Return the name of an input without its section."""
    return ", ".join(one.partition(".")[2] or one for one in name.split(", ")).replace("_", " ")


def _number(value: float) -> str:
    return f"{value:.0f}".replace("-", "−")
