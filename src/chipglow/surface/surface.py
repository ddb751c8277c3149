"""What a surface owes the camera: an emissivity for every sample of every frame."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Frame, Material, Scene


class EmissivityField(ABC):
    """Emissivity of one scene's samples, frame by frame."""

    @abstractmethod
    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x), from 0 to 1; 0 where undefined."""


class Surface(ABC):
    """A model of emissivity, before it is laid on a scene."""

    @abstractmethod
    def on(self, scene: Scene) -> EmissivityField:
        """Lay this surface on a scene; what depends on the whole scene is computed here."""


@dataclass(frozen=True)
class UniformSurface(Surface, EmissivityField):
    """The same emissivity wherever there is material; a black body by default.

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

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        return np.where(frame.material == Material.VOID, 0.0, self.value).astype(np.float32)
