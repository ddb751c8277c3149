"""Surfaces with one emissivity everywhere: of one value, or by their temperature."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Array, Parameter, zero_to_one
from chipglow.quantities.units import TEMPERATURE, Temperature
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Scene
from chipglow.surface.surface import SURFACES, UNKNOWN, EmissivityField, Origin, Surface


class HomogeneousSurface(Surface):
    """A surface with the same law everywhere: a class that adds `at`."""

    @abstractmethod
    def at(self, temperature: NDArray[Any]) -> ArrayLike:
        """Return the emissivity at true temperatures in K."""

    def prepare(
        self, scene: Scene, band: Band | None = None, reflected: float | None = None
    ) -> EmissivityField:
        return EmissivityField(self._emissivity, frozenset())

    def _emissivity(self, frame: Frame) -> NDArray[np.float32]:
        values = self.at(frame.temperature)
        return np.where(frame.material == Material.VOID, 0.0, values).astype(np.float32)


@SURFACES.part
@dataclass(frozen=True)
class UniformSurface(HomogeneousSurface):
    """The same emissivity everywhere."""

    kind = "uniform"
    example = "{kind: uniform, emissivity: 0.5}  everywhere the same"
    emissivity: Annotated[float, zero_to_one("The emissivity.")]

    def at(self, temperature: NDArray[Any]) -> ArrayLike:
        return self.emissivity


@SURFACES.part
@dataclass(frozen=True)
class TemperatureSurface(HomogeneousSurface):
    """A table over the true temperature, linear between, constant beyond its ends.

    Two rows of one temperature are a jump.
    """

    kind = "temperature"
    example = "{kind: temperature, table: [[20 degC, 0.2], [1400 degC, 0.4]]}  linear between"
    table: Annotated[
        tuple[tuple[Temperature, float], ...],
        Parameter("Temperature and emissivity, a pair a row; linear between."),
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        temperatures, emissivities = self.columns
        if len(self.table) < 2:
            raise ValueError(f"table: {len(self.table)} rows, expected 2 or more")
        steps = np.diff(temperatures)
        jumps_once = (temperatures[2:] > temperatures[:-2]).all()
        if not (np.isfinite(temperatures).all() and steps.min() >= 0 and jumps_once):
            raise ValueError(
                f"table: temperatures are {temperatures} K, expected ascending ones, one of them "
                "twice for a jump"
            )
        if not (emissivities.min() >= 0 and emissivities.max() <= 1):
            raise ValueError(f"table: emissivities are {emissivities}, expected 0 to 1")

    @cached_property
    def columns(self) -> Array:
        """Temperatures in K and emissivities, shape (2, row)."""
        return np.array(self.table, np.float64).reshape(-1, 2).T

    def at(self, temperature: NDArray[Any]) -> ArrayLike:
        return np.asarray(np.interp(temperature, *self.columns))


@SURFACES.part
@dataclass(frozen=True)
class PhaseSurface(HomogeneousSurface):
    """Solid or liquid, by the true temperature."""

    kind = "phase"
    example = "{kind: phase, solid: 0.4, liquid: 0.25, solidus: 1658 K, liquidus: 1723 K}"
    solid: Annotated[float, zero_to_one("Emissivity up to the solidus.")]
    liquid: Annotated[float, zero_to_one("Emissivity from the liquidus on; between them linear.")]
    solidus: Annotated[float, Parameter("Temperature at which melting begins.", TEMPERATURE)]
    liquidus: Annotated[float, Parameter("Temperature at which all is melted.", TEMPERATURE)]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.liquidus > self.solidus:
            raise ValueError(
                f"liquidus: {self.liquidus:g} K, must exceed the solidus of {self.solidus:g} K"
            )

    def at(self, temperature: NDArray[Any]) -> ArrayLike:
        table = (self.solidus, self.liquidus), (self.solid, self.liquid)
        return np.asarray(np.interp(temperature, *table))


@dataclass(frozen=True)
class EmissivityTrend:
    """A measured emissivity: a straight line over the true temperature, and its uncertainty."""

    middle: float
    """Temperature in K at which `emissivity` holds."""
    emissivity: float
    slope: float = 0.0
    """Change of the emissivity with the temperature in 1/K."""
    common: tuple[tuple[float, float], ...] = ()
    """Signed effects of unit errors on emissivity and slope, of errors that other areas of the same
    measurement share, one by one."""
    own: tuple[tuple[float, float], ...] = ()
    """Effects of errors that are this area's own."""
    measured: tuple[float, float] = (0.0, np.inf)
    """Lowest and highest temperature in K at which it was measured."""

    def __str__(self) -> str:
        return f"{self.emissivity:.4g} at {self.middle:.4g} K, changing by {self.slope:.4g} 1/K"

    @property
    def covariance(self) -> Array:
        """Covariance of emissivity and slope, shape (2, 2)."""
        effects = np.array([*self.common, *self.own]).reshape(-1, 2)
        return np.asarray(effects.T @ effects, np.float64)

    def drawn(self, errors: Array, generator: np.random.Generator) -> "EmissivityTrend":
        """Return the line with these common errors of unit variance, and own ones drawn."""
        change = errors @ np.array(self.common).reshape(-1, 2)
        change += generator.standard_normal(len(self.own)) @ np.array(self.own).reshape(-1, 2)
        by_emissivity, by_slope = change.tolist()
        return replace(
            self, emissivity=self.emissivity + by_emissivity, slope=self.slope + by_slope
        )

    def at(self, temperature: Any) -> Array:
        """Return the emissivity at temperatures in K; not limited to 0 to 1."""
        away = np.asarray(temperature, np.float64) - self.middle
        return np.asarray(self.emissivity + self.slope * away, np.float64)


@dataclass(frozen=True)
class TrendSurface(HomogeneousSurface):
    """A measured emissivity, limited to 0 to 1; `draw` numbers its errors' draw, 0 is without."""

    trend: EmissivityTrend
    draw: int = 0
    origin: Origin = UNKNOWN  # type: ignore[misc]

    @property
    def effects(self) -> dict[str, str]:
        return {"emissivity": f"{self.trend}{draw_text(self.draw)}"}

    def redrawn(self, number: int) -> Self:
        return replace(self, draw=self.draw + number) if number else self

    def at(self, temperature: NDArray[Any]) -> ArrayLike:
        (line,) = drawn_trends((self.trend,), self.draw)
        return np.clip(line.at(temperature), 0.0, 1.0)


def draw_text(draw: int) -> str:
    """Return what a measurement states of the draw of lines."""
    return f", draw {draw} of their covariance" if draw else ""


def drawn_trends(trends: tuple[EmissivityTrend, ...], draw: int) -> tuple[EmissivityTrend, ...]:
    """Return lines of one draw: what they have in common is drawn once for all."""
    if draw == 0:
        return trends
    generator = np.random.default_rng(draw)
    errors = generator.standard_normal(max(len(one.common) for one in trends))
    return tuple(one.drawn(errors[: len(one.common)], generator) for one in trends)
