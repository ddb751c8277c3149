"""One frame of a scene: its fields, their units and what a sample shows."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Brief

FIELD_UNITS: Final[Mapping[str, str]] = {
    "temperature": "K",
    "plastic_strain": "1",
    "plastic_strain_rate": "1/s",
    "velocity_x": "m/s",
    "velocity_y": "m/s",
    "material": "1",
}
"""The fields of a cut, and their units. Temperature alone is enough for a scene."""

MATERIAL_COORDINATE_UNITS: Final[Mapping[str, str]] = {"material_x": "m", "material_y": "m"}
"""Where each point was before the cut: optional, both or none."""

READABLE: Final = tuple(
    name for name in (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS) if name != "material"
)
"""Fields that a source may have, by the names of a scene."""

QUALITY: Final = "quality"
"""Name of an optional field that says how far each sample of an imported scene can be trusted.

0 to 254: distance of the colour in a movie from the colour scale, in units of CIE L*a*b* (0 where
the source gives numbers); `FILLED`: the source shows nothing there, the value is its neighbours'.
"""

FILLED: Final = 255
"""Quality of a sample without a value in its source."""


class Material(IntEnum):
    """Content of a sample of the scene."""

    VOID = 0
    WORKPIECE = 1
    TOOL = 2


@dataclass(frozen=True, repr=False)
class Frame(Brief):
    """The fields of a scene at one time, each of shape (y, x); see `FIELD_UNITS`.

    Fields that a scene lacks, or that were not requested, are None. A scene without material is
    workpiece everywhere.
    """

    time: float
    temperature: NDArray[np.float32]
    material: NDArray[np.uint8]
    plastic_strain: NDArray[np.float32] | None = None
    plastic_strain_rate: NDArray[np.float32] | None = None
    velocity_x: NDArray[np.float32] | None = None
    velocity_y: NDArray[np.float32] | None = None
    material_x: NDArray[np.float32] | None = None
    material_y: NDArray[np.float32] | None = None
    quality: NDArray[np.uint8] | None = None

    def needed(self, name: str) -> NDArray[np.float32]:
        """Return a field of `FIELD_UNITS` or raise a SceneError."""
        values: NDArray[np.float32] | None = getattr(self, name)
        if values is None:
            raise SceneError(f"scene: has no {name}, which is required here")
        return values


@dataclass(frozen=True, repr=False)
class SampledFrame(Brief):
    """Fields of a source at one time, sampled on a raster."""

    time: float
    fields: Mapping[str, NDArray[np.float32]]
    """By the names of `READABLE` in SI units, shape (y, x); NaN where there is no material."""
    material: NDArray[np.uint8]
    quality: NDArray[np.uint8] | None = None
    """See `QUALITY`."""


class SceneError(ValueError):
    """Fields that break the contract of a scene."""
