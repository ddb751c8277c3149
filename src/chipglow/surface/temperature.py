"""A surface whose emissivity follows its temperature, or the phase that the temperature makes."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Parameter
from chipglow.quantities.units import TEMPERATURE, Temperature
from chipglow.scene import Frame, Material, Scene
from chipglow.surface.surface import SURFACES, EmissivityField, Surface, SurfaceChoice

_Row = tuple[Temperature, float]


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

    @property
    def needs(self) -> tuple[str, ...]:
        """See `EmissivityField.needs`."""
        return ()

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        values = np.interp(frame.temperature, self.temperatures, self.emissivities)
        return np.where(frame.material == Material.VOID, 0.0, values).astype(np.float32)


@SURFACES.part
@dataclass(frozen=True)
class TemperatureTable(SurfaceChoice):
    """A table over the true temperature."""

    kind: ClassVar[str] = "temperature"
    example: ClassVar[str] = (
        "{kind: temperature, table: [[20 degC, 0.2], [1400 degC, 0.4]]}  linear between"
    )
    table: Annotated[
        tuple[_Row, ...],
        Parameter("Temperature and emissivity, a pair a row; linear between."),
    ]

    def surface(self) -> Surface:
        """The surface."""
        temperatures, emissivities = zip(*self.table, strict=True) if self.table else ((), ())
        return TemperatureSurface(temperatures, emissivities)


@SURFACES.part
@dataclass(frozen=True)
class PhaseEmissivity(SurfaceChoice):
    """Solid or liquid, by the true temperature."""

    kind: ClassVar[str] = "phase"
    example: ClassVar[str] = (
        "{kind: phase, solid: 0.4, liquid: 0.25, solidus: 1658 K, liquidus: 1723 K}"
    )
    solid: Annotated[float, Parameter("Emissivity up to the solidus.", least=0.0, most=1.0)]
    liquid: Annotated[
        float,
        Parameter("Emissivity from the liquidus on; between them linear.", least=0.0, most=1.0),
    ]
    solidus: Annotated[
        float, Parameter("Temperature at which melting begins.", TEMPERATURE, over=0.0)
    ]
    liquidus: Annotated[
        float, Parameter("Temperature at which all is melted.", TEMPERATURE, over=0.0)
    ]

    def surface(self) -> Surface:
        """The surface."""
        return TemperatureSurface((self.solidus, self.liquidus), (self.solid, self.liquid))
