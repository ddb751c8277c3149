"""A grey image of the chip, as a camera for visible light might show it."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Frame, Material, Raster
from chipglow.surface import Emissivity, Texture

_GRAIN: Final = 9e-6
_SEED: Final = 8
_STEEL: Final = Emissivity(0.62, 0.07)
_VOID: Final = 0.28
_SHEARED: Final = (1.5, 5.0)
_DARKEST: Final = 0.45


def visible_picture(frame: Frame, raster: Raster) -> NDArray[np.float64]:
    """Return grey values from 0 to 1, shape (y, x), for orientation only."""
    x, y = frame.material_x, frame.material_y
    if x is None or y is None:
        x, y = (grid.astype(np.float32) for grid in np.meshgrid(raster.x, raster.y))
    generator = np.random.default_rng(_SEED)
    steel = Texture.random(_STEEL, _GRAIN, generator, restore_standard_deviation=True).at(x, y)
    low, high = _SHEARED
    sheared = np.clip((frame.needed("plastic_strain") - low) / (high - low), 0.0, 1.0)
    grey = steel * (1.0 - _DARKEST * sheared)
    grey = np.where(frame.material == Material.WORKPIECE, grey, _VOID)
    return np.asarray(np.where(frame.material == Material.TOOL, 0.0, grey), np.float64)
