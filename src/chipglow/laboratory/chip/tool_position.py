"""Uncertainty of the position of a tool, and of readings relative to it."""

import hashlib
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from chipglow.camera import Measurement
from chipglow.laboratory.chip.band_ridge import ThermalImage
from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import ANGLE, LENGTH, POSITION
from chipglow.scene import Tool
from chipglow.uncertainty import Cause, Component, Estimate

TOOL: Final = "tool"
"""Name of the component of uncertainty that the place of a tool makes."""

TOOL_BUDGET: Final = ("tool along", "tool across", "tool angle")
"""Its lines in a budget."""


def tool_of(measurement: Measurement, given: Tool | None = None) -> Tool:
    """Return the given tool, or else the measurement's own."""
    tool = measurement.tool if given is None else given
    if tool is None:
        raise ValueError(
            "tool: the measurement contains no tool; pass a tool, or 'found' to detect the rake "
            "face in the image"
        )
    return tool


@dataclass(frozen=True)
class ToolUncertainty(Part):
    """Standard uncertainties of the place of a tool, independent of each other."""

    along: Annotated[
        float, Parameter("Uncertainty of the tip along the rake face.", LENGTH, least=0.0)
    ]
    across: Annotated[
        float,
        Parameter("Uncertainty of the rake face across itself, at `pivot`.", LENGTH, least=0.0),
    ]
    angle: Annotated[float, Parameter("Uncertainty of the rake angle.", ANGLE, least=0.0)] = 0.0
    pivot: Annotated[
        float,
        Parameter(
            "Distance up the straight face at which place and angle are independent.", POSITION
        ),
    ] = 0.0

    def displacements(self, tool: Tool, points: Array) -> Array:
        """Return the moves of points fixed to the tool by each standard uncertainty, in m."""
        direction, normal = np.array(tool.rake_direction), np.array(tool.rake_normal)
        offset = points - tool.rake_point(self.pivot)
        up, out = offset @ direction, offset @ normal
        turned = out[..., None] * direction - up[..., None] * normal
        moves = (self.along * direction, self.across * normal, self.angle * turned)
        return np.stack([np.broadcast_to(move, points.shape) for move in moves])

    def applied(self, tool: Tool, estimate: Estimate, effects: Array) -> Estimate:
        """Return the estimate with the component ``tool``, by each standard uncertainty's effects.

        `effects` has the shape (3, ...); where a value is not known, they are not either.
        """
        known = np.where(np.isfinite(estimate.values), effects, np.nan)
        identity = hashlib.sha256(repr((tool, self)).encode()).hexdigest()[:16]
        cause = Cause(TOOL, identity, len(TOOL_BUDGET), parts=TOOL_BUDGET)
        own = Component(cause, known.reshape(len(TOOL_BUDGET), -1).T.copy())
        return replace(estimate, components=(*estimate.components, own))


def contribution(image: ThermalImage, points: Array, displacement: Array) -> Array:
    """Return the change of the temperature by a displacement (JCGM 100, 5.1.3, note 2)."""
    places = [points + side * displacement for side in (-1, 0, 1)]
    behind, here, ahead = map(image.read, places)
    no_behind, _, no_ahead = (~image.raster.covers(image.raster.index(one)) for one in places)
    one_side = np.where(no_ahead, here - behind, ahead - here)
    return np.where(no_ahead ^ no_behind, one_side, (ahead - behind) / 2)
