"""What a surface owes the camera: an emissivity for every sample of every frame."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Final, Self

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Family, Parameter, Part
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Scene


class EmissivityStack(ABC):
    """Emissivities of one scene's samples for several surfaces, frame by frame."""

    @property
    def needs(self) -> Collection[str] | None:
        """Fields of a frame that it reads beside temperature and material; None: all there are."""
        return None

    @property
    def most(self) -> float:
        """Largest emissivity that is possible: 1, unless reflected light counts as emitted."""
        return 1.0

    @abstractmethod
    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample for every surface, shape (surface, y, x), from 0 on."""


class EmissivityField(ABC):
    """Emissivity of one scene's samples, frame by frame."""

    @property
    def needs(self) -> Collection[str] | None:
        """Fields of a frame that it reads beside temperature and material; None: all there are."""
        return None

    @property
    def most(self) -> float:
        """Largest emissivity that is possible: 1, unless reflected light counts as emitted."""
        return 1.0

    @abstractmethod
    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x), from 0 to 1; 0 in the void."""

    def beside(self, others: Sequence["EmissivityField"]) -> EmissivityStack:
        """Stack of this and other fields of the same scene, this one first.

        Parameters
        ----------
        others : sequence of EmissivityField
            The others, which may be none.
        """
        return _OneByOne((self, *others))


@dataclass(frozen=True)
class _OneByOne(EmissivityStack):
    """Fields that have nothing in common."""

    fields: tuple[EmissivityField, ...]

    @property
    def needs(self) -> Collection[str] | None:
        """See `EmissivityStack.needs`."""
        found: set[str] = set()
        for field in self.fields:
            if field.needs is None:
                return None
            found.update(field.needs)
        return found

    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """See `EmissivityStack.emissivities`."""
        return np.stack([field.emissivity(frame) for field in self.fields])

    @property
    def most(self) -> float:
        """See `EmissivityStack.most`."""
        return max(field.most for field in self.fields)


SURFACES: Final = Family("surface")
"""Emissivity models by their kind; other packages add theirs in the group ``chipglow.surface``."""


class SurfaceChoice(Part, ABC):
    """What a description says of a surface that is the only one."""

    @abstractmethod
    def surface(self) -> "Surface":
        """The surface.

        Raises
        ------
        ValueError
            If it is not possible.
        OSError
            If its file is not there.
        """


class Surface(SurfaceChoice):
    """A model of emissivity, before it is laid on a scene."""

    def surface(self) -> "Surface":
        """Return itself."""
        return self

    @abstractmethod
    def on(self, scene: Scene) -> EmissivityField:
        """Lay this surface on a scene; what depends on the whole scene is computed here."""

    @property
    def effects(self) -> Mapping[str, str]:
        """What a measurement of it states of it, by the names of its effects, in SI."""
        return {"emissivity": repr(self)}

    def in_band(self, band: Band, reflected: float | None) -> "Surface":
        """The surface as a camera sees it; itself where the camera does not matter.

        Parameters
        ----------
        band : Band
            The camera's spectral band.
        reflected : float, optional
            Temperature of the surroundings that the surface reflects in K; None: they are dark.
        """
        return self

    def redrawn(self, number: int) -> Self:
        """The surface with another draw of what is random in it; itself where nothing is.

        Parameters
        ----------
        number : int
            Which draw; 0 is this surface.
        """
        return self

    def without_texture(self) -> Self:
        """The surface with the mean of what is random in it; itself where nothing is."""
        return self


@dataclass(frozen=True)
class WrappedSurface(Surface):
    """Another surface, of which something more is seen.

    Parameters
    ----------
    bare : Surface
        The other one.
    """

    bare: Surface

    def in_band(self, band: Band, reflected: float | None) -> Self:
        """See `Surface.in_band`."""
        bare = self.bare.in_band(band, reflected)
        return self if bare is self.bare else replace(self, bare=bare)

    def redrawn(self, number: int) -> Self:
        """See `Surface.redrawn`."""
        bare = self.bare.redrawn(number)
        return self if bare is self.bare else replace(self, bare=bare)

    def without_texture(self) -> Self:
        """See `Surface.without_texture`."""
        bare = self.bare.without_texture()
        return self if bare is self.bare else replace(self, bare=bare)


@dataclass(frozen=True)
class UniformSurface(Surface, EmissivityField):
    """The same emissivity wherever there is material; a blackbody by default.

    Raises
    ------
    ValueError
        If the emissivity is not within 0 to 1.
    """

    value: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.value <= 1.0:
            raise ValueError(f"emissivity: expected 0 to 1, got {self.value!r}")

    def on(self, scene: Scene) -> EmissivityField:
        """Return itself: it is the same on every scene."""
        return self

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityField.needs`."""
        return ()

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        return np.where(frame.material == Material.VOID, 0.0, self.value).astype(np.float32)


@SURFACES.part
@dataclass(frozen=True)
class UniformEmissivity(SurfaceChoice):
    """Everywhere the same emissivity."""

    kind: ClassVar[str] = "uniform"
    example: ClassVar[str] = "{kind: uniform, emissivity: 0.5}  everywhere the same"
    emissivity: Annotated[float, Parameter("The emissivity.", least=0.0, most=1.0)]

    def surface(self) -> Surface:
        """The surface."""
        return UniformSurface(self.emissivity)
