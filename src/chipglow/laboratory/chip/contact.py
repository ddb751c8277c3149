"""The contact of chip and tool: how far up the rake face the chip touches it."""

from math import nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Frame, Material, Raster, Tool
from chipglow.scene.lines import nearest

_LONGEST_GAP: Final = 12e-6

BESIDE: Final = 15e-6
"""Distance from the rake face in m within which `contact_temperatures` takes means."""


class NoContactError(ValueError):
    """The chip does not touch the rake face."""


def contact_length(
    raster: Raster, workpiece: NDArray[np.bool_], tool: Tool, touching: float
) -> float:
    """Length over which the chip touches the rake face."""
    step = raster.spacing / 2
    along = np.arange(0.0, np.hypot(raster.rows, raster.columns) * raster.spacing, step)
    foot = tool.rake_point(along)
    touches = np.zeros(along.size, dtype=np.bool_)
    for height in np.arange(raster.spacing / 4, touching + step, step):
        places = foot + height * np.array(tool.rake_normal)
        touches |= nearest(workpiece, raster, places) == 1
    contacts = along[touches]
    if contacts.size == 0 or contacts[0] > _LONGEST_GAP:
        return 0.0
    gaps = np.diff(contacts) > _LONGEST_GAP
    last = int(gaps.argmax()) if gaps.any() else contacts.size - 1
    return float(contacts[last])


def contact_temperatures(
    frame: Frame, raster: Raster, tool: Tool, length: float
) -> tuple[float, float]:
    """Mean temperatures within `BESIDE` of the rake face, along the contact."""
    x, y = np.meshgrid(raster.x, raster.y)
    distance = tool.signed_distance(x, y)
    along, _ = tool.face_coordinates(np.stack([x, y], axis=-1))
    beside = (np.abs(distance) < BESIDE) & (along > 0) & (along < length)
    chip, inside = (
        frame.temperature[beside & where]
        for where in (frame.material == Material.WORKPIECE, distance < 0)
    )
    return float(chip.mean()) if chip.size else nan, float(inside.mean()) if inside.size else nan
