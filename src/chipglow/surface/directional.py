"""Emissivity by the angle at which a surface is looked at: Fresnel's equations."""

from abc import abstractmethod
from dataclasses import dataclass
from math import cos, radians
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Family, Parameter
from chipglow.quantities.units import ANGLE
from chipglow.radiometry import Band
from chipglow.scene import Frame, Scene
from chipglow.surface.surface import Change, Modifier, Surface

DIRECTIONS: Final = Family("directional")
"""Laws of direction by their kind; other packages add theirs in ``chipglow.directional``."""


@dataclass(frozen=True, kw_only=True)
class Direction(Modifier):
    """An emissivity by the angle between normal and line of sight: a class that adds `emissivity`.

    The scene's plane is seen at `tilt`, which does not move or shorten its picture. The chip's side
    of a `SideShape` over it has the slope of its shape, at right angles to the tilt: the cosine of
    the angle is the product of both. An emissivity that would be over 1 is 1.
    """

    effect = "directional"
    tilt: Annotated[
        float,
        Parameter(
            "Angle of the camera's line of sight to the normal of the scene's plane, in the plane "
            "of that normal and the rake face.",
            ANGLE,
            least=0.0,
            most=radians(85.0),
        ),
    ] = 0.0

    @abstractmethod
    def emissivity(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """Return the emissivity of the law's own surface by the cosine of the angle, 0 to 1."""

    def ratio(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """Return the emissivity over that at normal incidence, by the cosine of the angle."""
        return np.asarray(self.emissivity(cosine) / self.emissivity(1.0), np.float64)

    def slope_ratio(self, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the emissivity of slopes, by their cosines, over that of the plane.

        Cosines of elements that the camera does not see are 0 or less.
        """
        return self.ratio(np.clip(cosine, 0.0, 1.0) * cos(self.tilt)) / self.ratio(cos(self.tilt))

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        ratio = np.float32(self.ratio(cos(self.tilt)))

        def at_tilt(emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float32]:
            seen: NDArray[np.float32] = np.minimum(emissivity * ratio, 1.0)
            return seen

        return at_tilt


@DIRECTIONS.part
@dataclass(frozen=True, kw_only=True)
class Fresnel(Direction):
    """A smooth surface of a refractive index n + i k: one minus the reflectance, unpolarised.

    Howell, Mengüç, Daun and Siegel, Thermal Radiation Heat Transfer, chapter 3. A metal has n and k
    that are large and similar (`HagenRubens`), a thick oxide a small k. Rough surfaces depend less
    on the angle.
    """

    kind = "fresnel"
    example = "{kind: fresnel, n: 4.6, k: 15, tilt: 10 deg}"
    n: Annotated[float, Parameter("Refractive index in the camera's band.", over=0.0)]
    k: Annotated[float, Parameter("Its extinction coefficient.", least=0.0)]

    def emissivity(self, cosine: ArrayLike) -> NDArray[np.float64]:
        cosines = np.asarray(cosine, np.complex128)
        index = complex(self.n, self.k)
        inside = np.sqrt(index**2 - 1.0 + cosines**2)
        across = (cosines - inside) / (cosines + inside)
        along = (index**2 * cosines - inside) / (index**2 * cosines + inside)
        return np.asarray(1.0 - (np.abs(across) ** 2 + np.abs(along) ** 2) / 2, np.float64)
