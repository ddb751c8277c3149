"""Materials of the cut: mechanics and heat."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.cutting.damage import JohnsonCookDamage
from chipglow.cutting.flow_stress import FlowStress
from chipglow.cutting.laws import check_positive

TABLE_COLDEST: Final = 200.0
TABLE_HOTTEST: Final = 3000.0


@dataclass(frozen=True)
class TemperatureTable:
    """A property that depends on temperature: linear between the points, constant beyond.

    Parameters
    ----------
    temperatures : tuple of float
        In K, ascending.
    values : tuple of float
        The property in SI units, over 0.
    """

    temperatures: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.temperatures) != len(self.values) or not self.values:
            raise ValueError("temperature table: expected as many values as temperatures")
        if any(np.diff(self.temperatures) <= 0):
            raise ValueError("temperature table: temperatures must ascend")
        for value in self.values:
            check_positive("temperature table: value", value)

    def at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Values at temperatures in K, of the same shape."""
        return np.asarray(
            np.interp(np.asarray(temperature, dtype=np.float64), self.temperatures, self.values),
            dtype=np.float64,
        )

    def sampled(self) -> NDArray[np.float64]:
        """Values at every kelvin from 200 K to 3000 K, for kernels."""
        return self.at(np.arange(TABLE_COLDEST, TABLE_HOTTEST + 1.0))


@dataclass(frozen=True)
class RateTable:
    """A share that depends on the plastic strain rate.

    Linear over the logarithm of the rate between the points, constant beyond.

    Parameters
    ----------
    rates : tuple of float
        Plastic strain rates in 1/s, ascending, over 0.
    values : tuple of float
        The share at these rates, 0 to 1.
    """

    rates: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.rates) != len(self.values) or not self.values:
            raise ValueError("rate table: expected as many values as rates")
        for rate in self.rates:
            check_positive("rate table: rate", rate)
        if any(np.diff(self.rates) <= 0):
            raise ValueError("rate table: rates must ascend")
        for value in self.values:
            if not 0 <= value <= 1:
                raise ValueError(f"rate table: value: expected 0 to 1, got {value!r}")


@dataclass(frozen=True)
class WorkpieceMaterial:
    """What is cut.

    Parameters
    ----------
    name : str
        Name with the source of the numbers.
    density : float
        In kg/m³.
    young_modulus : float
        In Pa.
    poisson_ratio : float
        0 to 0.49.
    flow_stress : FlowStress
        Law of the flow stress.
    damage : JohnsonCookDamage or None
        Failure, or None for a material that does not fail.
    conductivity, heat_capacity : TemperatureTable
        In W/(m K) and J/(kg K).
    taylor_quinney : float or RateTable
        Share of the plastic work that becomes heat: constant, or over the plastic strain rate.
    """

    name: str
    density: float
    young_modulus: float
    poisson_ratio: float
    flow_stress: FlowStress
    damage: JohnsonCookDamage | None
    conductivity: TemperatureTable
    heat_capacity: TemperatureTable
    taylor_quinney: float | RateTable = 0.9

    def __post_init__(self) -> None:
        check_positive("workpiece density", self.density)
        check_positive("workpiece young_modulus", self.young_modulus)
        if not 0 <= self.poisson_ratio <= 0.49:
            raise ValueError(f"poisson_ratio: expected 0 to 0.49, got {self.poisson_ratio!r}")
        share = self.taylor_quinney
        if not isinstance(share, RateTable) and not 0 <= share <= 1:
            raise ValueError(f"taylor_quinney: expected 0 to 1, got {share!r}")

    @property
    def shear_modulus(self) -> float:
        """In Pa."""
        return self.young_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def bulk_modulus(self) -> float:
        """In Pa."""
        return self.young_modulus / (3 * (1 - 2 * self.poisson_ratio))

    @property
    def melting_temperature(self) -> float:
        """Of the flow-stress law in K; the end of the tables for a law that has none."""
        return float(getattr(self.flow_stress, "melting_temperature", TABLE_HOTTEST))


@dataclass(frozen=True)
class ToolMaterial:
    """What cuts: rigid, but it conducts heat.

    Parameters
    ----------
    name : str
        Name with the source of the numbers.
    density, conductivity, heat_capacity : float
        In kg/m³, W/(m K) and J/(kg K).
    """

    name: str
    density: float
    conductivity: float
    heat_capacity: float

    def __post_init__(self) -> None:
        for name in ("density", "conductivity", "heat_capacity"):
            check_positive(f"tool {name}", getattr(self, name))

    @property
    def effusivity(self) -> float:
        """√(kρc) in W s^½/(m² K)."""
        return float(np.sqrt(self.conductivity * self.density * self.heat_capacity))
