"""Emissivity by the angle at which a surface is looked at: Fresnel's equations."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import cos, radians
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Family, Parameter, Part
from chipglow.quantities.units import ANGLE
from chipglow.scene import Frame, Scene
from chipglow.surface.surface import EmissivityField, Surface, WrappedSurface

DIRECTIONS: Final = Family("directional")
"""Laws of direction by their kind; other packages add theirs in ``chipglow.directional``."""


@dataclass(frozen=True, kw_only=True)
class Direction(Part, ABC):
    """How the emissivity depends on the angle between normal and line of sight.

    A class of a family that adds `emissivity`.
    """

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
        """Emissivity of the law's own surface by the cosine of the angle, from 0 to 1."""

    def ratio(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """Emissivity over that at normal incidence, by the cosine of the angle."""
        return np.asarray(self.emissivity(cosine) / self.emissivity(1.0), np.float64)


@DIRECTIONS.part
@dataclass(frozen=True, kw_only=True)
class Fresnel(Direction):
    """A smooth surface of a refractive index n + i k: one less the reflectance, unpolarised.

    Howell, Mengüç, Daun and Siegel, Thermal Radiation Heat Transfer, chapter 3. A metal has n and k
    that are large and alike (`HagenRubens`), a thick oxide a small k. Rough surfaces depend less on
    the angle.
    """

    kind: ClassVar[str] = "fresnel"
    example: ClassVar[str] = "{kind: fresnel, n: 4.6, k: 15, tilt: 10 deg}"
    n: Annotated[float, Parameter("Refractive index in the camera's band.", over=0.0)]
    k: Annotated[float, Parameter("Its extinction coefficient.", least=0.0)]

    def emissivity(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """See `Direction.emissivity`."""
        cosines = np.asarray(cosine, np.complex128)
        index = complex(self.n, self.k)
        inside = np.sqrt(index**2 - 1.0 + cosines**2)
        across = (cosines - inside) / (cosines + inside)
        along = (index**2 * cosines - inside) / (index**2 * cosines + inside)
        return np.asarray(1.0 - (np.abs(across) ** 2 + np.abs(along) ** 2) / 2, np.float64)


@dataclass(frozen=True)
class DirectionalSurface(WrappedSurface):
    """Another surface whose emissivity depends on the angle at which it is seen.

    Parameters
    ----------
    bare : Surface
        The emissivity at right angles.
    direction : Direction
        How it changes with the angle; an emissivity that would be over 1 is 1.

    Notes
    -----
    The scene's plane is seen at `Direction.tilt`, which does not move or shorten its picture. Where
    `ReflectingSurface` lies over it the chip's side has the slope of its shape, at right angles to
    the tilt: the cosine of the angle is the product of both.
    """

    direction: Direction

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        return {**self.bare.effects, "directional": repr(self.direction)}

    def on(self, scene: Scene) -> "DirectionalField":
        """Lay the surface on a scene."""
        return DirectionalField(self.bare.on(scene), self.direction)


@dataclass(frozen=True, eq=False)
class DirectionalField(EmissivityField):
    """A `DirectionalSurface` on one scene; made by `DirectionalSurface.on`."""

    bare: EmissivityField
    direction: Direction

    @property
    def needs(self) -> Collection[str] | None:
        """See `EmissivityField.needs`."""
        return self.bare.needs

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        ratio = np.float32(self.direction.ratio(cos(self.direction.tilt)))
        seen = np.minimum(self.bare.emissivity(frame) * ratio, 1.0)
        return np.asarray(seen, np.float32)


def slope_ratio(surface: Surface, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Emissivity of elements on a slope over that of the flat surface as the camera sees it.

    Parameters
    ----------
    surface : Surface
        The surface; one that is not directional has the same everywhere.
    cosine : ndarray
        Cosines of the slopes; elements that the camera does not see have 0 or less.
    """
    if not isinstance(surface, DirectionalSurface):
        return np.ones(cosine.shape)
    direction = surface.direction
    seen = np.clip(cosine, 0.0, 1.0) * cos(direction.tilt)
    return direction.ratio(seen) / direction.ratio(cos(direction.tilt))
