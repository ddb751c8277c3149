"""A surface whose emissivity follows its temperature, or the phase that the temperature makes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Frame, Material, Scene
from chipglow.surface.surface import EmissivityField, Surface


@dataclass(frozen=True)
class TemperatureSurface(Surface, EmissivityField):
    """Emissivity as a table over the true temperature.

    Parameters
    ----------
    temperatures : tuple of float
        Temperatures in K, ascending, shape (n,).
    emissivities : tuple of float
        Emissivity at each of them; linear between, constant beyond the ends.

    Raises
    ------
    ValueError
        If the table has under two rows, its temperatures do not ascend, or an emissivity is not
        within 0 to 1.

    Examples
    --------
    Solid up to the solidus, liquid from the liquidus on:

    >>> metal = TemperatureSurface((1658.0, 1723.0), (0.4, 0.25))
    """

    temperatures: tuple[float, ...]
    emissivities: tuple[float, ...]

    def __post_init__(self) -> None:
        if not len(self.temperatures) == len(self.emissivities) > 1:
            raise ValueError(
                f"emissivity: {len(self.temperatures)} temperatures and {len(self.emissivities)} "
                "emissivities, expected as many of both, 2 or more"
            )
        if not (np.isfinite(self.temperatures).all() and min(np.diff(self.temperatures)) > 0):
            raise ValueError(
                f"emissivity: temperatures are {self.temperatures!r} K, expected ascending ones"
            )
        for value in self.emissivities:
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"emissivity: expected 0 to 1, got {value!r}")

    def on(self, scene: Scene) -> EmissivityField:
        """Return itself: it is the same on every scene."""
        return self

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        values = np.interp(frame.temperature, self.temperatures, self.emissivities)
        return np.where(frame.material == Material.VOID, 0.0, values).astype(np.float32)
