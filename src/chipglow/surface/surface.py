"""A surface, what modifies it, and its emissivity on a scene: what the camera needs of it."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Family, Part
from chipglow.radiometry import Band
from chipglow.scene import Frame, Scene

if TYPE_CHECKING:
    from chipglow.surface.feature import Features

SURFACES: Final = Family("surface")
"""Emissivity models by their kind; other packages add theirs in the group ``chipglow.surface``."""

MODIFIERS: Final = Family("modifier")
"""Modifiers by their kind; other packages add theirs in the group ``chipglow.modifier``."""

_SAME_BAND: Final = 0.01
"""Part of a wavelength by which the limits of a band may differ."""

Change: TypeAlias = Callable[[NDArray[np.float32], Frame], NDArray[Any]]
"""The emissivity of a frame's samples, shape (y, x), of that without the modifier."""


@dataclass(frozen=True, eq=False)
class EmissivityField:
    """The emissivity of one scene's samples, frame by frame; made by `Surface.prepare`."""

    unmodified: Callable[[Frame], NDArray[np.float32]]
    """Emissivity of every sample of a frame without `changes`, (y, x), 0 to 1; 0 in the void."""
    fields: frozenset[str] | None = None
    """Fields of a frame that are read besides temperature and material; by default all."""
    changes: tuple[Change, ...] = ()
    """Changes of the bare emissivity by modifiers, in order."""
    max_emissivity: float = 1.0
    """Over 1 if reflected light counts as emitted."""
    features: "Features | None" = None
    """The unmodified emissivity as textures of features, which the kernels of an exposure look up
    themselves; without them, `unmodified` is called for every frame."""

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Return the emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        return self.modified(self.unmodified(frame), frame)

    def modified(self, emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float32]:
        """Return a frame's emissivity with all `changes` of the unmodified one."""
        for change in self.changes:
            emissivity = np.asarray(change(emissivity, frame), np.float32)
        return emissivity


@dataclass(frozen=True)
class Origin:
    """Band and metal of the measurement that emissivities come from, as far as they are known."""

    band: tuple[float, float] | None = None
    """Limits in m."""
    metal: str = ""

    def warnings(self, band: Band, metal: str) -> Iterator[str]:
        """Yield a sentence if a camera's band or the metal differs."""
        seen = band.lower, band.upper
        if self.band is not None and not np.allclose(self.band, seen, rtol=_SAME_BAND, atol=0.0):
            measured, used = (
                f"{1e6 * low:.3g} µm to {1e6 * high:.3g} µm" for low, high in (self.band, seen)
            )
            yield f"Emissivities measured in {measured} are taken to hold in {used}."
        if self.metal and metal and _plain(self.metal) != _plain(metal):
            yield f"Emissivities measured on {self.metal} are taken to hold on {metal}."


UNKNOWN: Final = Origin()


def _plain(metal: str) -> str:
    return re.sub("[^a-z0-9]", "", metal.lower())


class Surface(Part, ABC):
    """A model of emissivity, before it is laid on a scene."""

    origin: ClassVar[Origin] = UNKNOWN

    @property
    def is_grey(self) -> bool:
        """Whether it looks the same to all cameras, whatever their band and surroundings."""
        return True

    @abstractmethod
    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        """Lay the surface on a scene; what depends on the whole scene is computed here.

        A surface that is not grey needs the camera's `band`, and reflects surroundings of the
        temperature `reflected` in K (None: dark ones). A ValueError if the scene lacks a field.
        """

    @property
    def effects(self) -> Mapping[str, str]:
        """Attributes of a measurement about the surface, by the names of its effects, in SI."""
        return {"emissivity": repr(self)}

    def modified(self, *modifiers: "Modifier") -> "Surface":
        """Return the surface under modifiers, the first next to it."""
        return ModifiedSurface(self, modifiers) if modifiers else self

    def redrawn(self, number: int) -> Self:
        """Return the surface with random draw `number`; itself for 0 or without randomness."""
        return self

    def without_texture(self) -> Self:
        """Return the surface with the mean of its texture; itself if it has none."""
        return self


class Modifier(Part, ABC):
    """A modification of a surface: oxide, angle, spectrum, reflections. A class adds `change`."""

    effect: ClassVar[str] = "modifier"
    """Name under which a measurement states it."""
    fields: ClassVar[tuple[str, ...]] = ()
    """Fields of a frame that it reads beside temperature and material."""
    is_grey: ClassVar[bool] = True
    """Whether it is the same to all cameras, whatever their band and surroundings."""
    max_emissivity: ClassVar[float] = 1.0

    @property
    def description(self) -> str:
        """Attributes of a measurement about it, in SI."""
        return repr(self)

    @abstractmethod
    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        """Return the change of the emissivity of a surface on a scene, in a band and surroundings.

        It takes the surface's emissivity, float32 of shape (y, x), which is 0 in the void and must
        stay so, and the frame.
        """

    def redrawn(self, number: int) -> Self:
        """Return the modifier with random draw `number`."""
        return self


def bare_surface(surface: Surface) -> Surface:
    """Return a surface without its modifiers."""
    return surface.bare if isinstance(surface, ModifiedSurface) else surface


@dataclass(frozen=True)
class ModifiedSurface(Surface):
    """A surface under modifiers, the first next to it; made by `Surface.modified`."""

    bare: Surface
    modifiers: tuple[Modifier, ...]

    @property
    def is_grey(self) -> bool:
        return self.bare.is_grey and all(one.is_grey for one in self.modifiers)

    @property
    def origin(self) -> Origin:  # type: ignore[override]
        """Band of the bare surface; any band if a modifier converts it."""
        spectral = any(one.effect == "spectral" for one in self.modifiers)
        return replace(self.bare.origin, band=None) if spectral else self.bare.origin

    @property
    def effects(self) -> Mapping[str, str]:
        return {**self.bare.effects, **{one.effect: one.description for one in self.modifiers}}

    def modified(self, *modifiers: Modifier) -> "ModifiedSurface":
        return replace(self, modifiers=(*self.modifiers, *modifiers))

    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        field, surface = self.bare.prepare(scene, band, reflected), self.bare
        for one in self.modifiers:
            field = replace(
                field,
                fields=None if field.fields is None else field.fields.union(one.fields),
                changes=(*field.changes, one.change(surface, scene, band, reflected)),
                max_emissivity=max(field.max_emissivity, one.max_emissivity),
            )
            surface = surface.modified(one)
        return field

    def redrawn(self, number: int) -> Self:
        bare = self.bare.redrawn(number)
        modifiers = tuple(one.redrawn(number) for one in self.modifiers)
        old, new = (self.bare, *self.modifiers), (bare, *modifiers)
        if all(one is other for one, other in zip(old, new, strict=True)):
            return self
        return replace(self, bare=bare, modifiers=modifiers)

    def without_texture(self) -> Self:
        bare = self.bare.without_texture()
        return self if bare is self.bare else replace(self, bare=bare)
