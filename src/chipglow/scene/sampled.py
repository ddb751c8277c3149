"""A frame of which some fields are known: what is read before it is completed to a scene's."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.scene.frame import FIELD_UNITS, MATERIAL_COORDINATE_UNITS

READABLE: Final = tuple(
    name for name in (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS) if name != "material"
)
"""Fields that a source may have, by the names of a scene."""


@dataclass(frozen=True)
class SampledFrame:
    """Fields of a source at one time, sampled on a raster."""

    time: float
    fields: Mapping[str, NDArray[np.float32]]
    """By the names of `READABLE` in SI units, shape (y, x); NaN where there is no material."""
    material: NDArray[np.uint8]
    quality: NDArray[np.uint8] | None = None
    """See `chipglow.scene.QUALITY`."""
