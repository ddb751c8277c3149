"""An emissivity model: a rectangle of the surface is painted, the rest is bare."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from chipglow.quantities import Parameter
from chipglow.quantities.units import LENGTH, POSITION
from chipglow.scene import Material
from chipglow.surface import SURFACES, EmissivityField, Surface


@SURFACES.part
@dataclass(frozen=True)
class PaintedSurface(Surface):
    """A painted rectangle on a bare surface, which stays where it is."""

    kind: ClassVar[str] = "painted"
    example: ClassVar[str] = "{kind: painted, bare: 0.2, left: 0 um, top: 0 um, width: 90 um}"
    bare: Annotated[float, Parameter("Emissivity beside the paint.", least=0.0, most=1.0)]
    width: Annotated[float, Parameter("Sides of the paint.", LENGTH, over=0.0)]
    left: Annotated[float, Parameter("Left edge of the paint.", POSITION)] = 0.0
    top: Annotated[float, Parameter("Upper edge of the paint.", POSITION)] = 0.0
    paint: Annotated[float, Parameter("Emissivity of the paint.", least=0.0, most=1.0)] = 0.95

    def prepare(self, scene, band=None, reflected=None) -> EmissivityField:
        """Lay the paint on the samples of a scene: emissivities of shape (y, x), 0 in the void."""
        across = np.abs(scene.raster.x - self.left - self.width / 2) <= self.width / 2
        down = np.abs(self.top - scene.raster.y - self.width / 2) <= self.width / 2
        values = np.where(np.outer(down, across), self.paint, self.bare).astype(np.float32)
        return EmissivityField(
            lambda frame: np.where(frame.material == Material.VOID, np.float32(0.0), values),
            fields=frozenset(),
        )
