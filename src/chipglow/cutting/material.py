"""Materials of the cut: mechanics and heat."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.flow_stress import FlowStress
from chipglow.cutting.laws import check_positive

TABLE_COLDEST: Final = 200.0
TABLE_HOTTEST: Final = 3000.0
ROOM_TEMPERATURE: Final = 293.15


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
        return self.at(_KELVINS)


_KELVINS: Final = np.arange(TABLE_COLDEST, TABLE_HOTTEST + 1.0)


def _values(quantity: float | TemperatureTable) -> tuple[float, ...]:
    return quantity.values if isinstance(quantity, TemperatureTable) else (quantity,)


def _at(quantity: float | TemperatureTable, temperature: ArrayLike) -> NDArray[np.float64]:
    if isinstance(quantity, TemperatureTable):
        return quantity.at(temperature)
    return np.full(np.shape(temperature), quantity, dtype=np.float64)


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
    density : float or TemperatureTable
        In kg/m³: constant, or over the temperature, which is thermal expansion.
    young_modulus : float or TemperatureTable
        In Pa: constant, or over the temperature.
    poisson_ratio : float or TemperatureTable
        0 to 0.49: constant, or over the temperature.
    flow_stress : FlowStress
        Law of the flow stress.
    damage : JohnsonCookDamage or None
        Failure, or None for a material that does not fail.
    conductivity, heat_capacity : TemperatureTable
        In W/(m K) and J/(kg K).
    taylor_quinney : float or RateTable
        Share of the plastic work that becomes heat: constant, or over the plastic strain rate.
    fitted_damage : FittedDamage, optional
        How well the damage is known, where measured cuts determined it.
    """

    name: str
    density: float | TemperatureTable
    young_modulus: float | TemperatureTable
    poisson_ratio: float | TemperatureTable
    flow_stress: FlowStress
    damage: JohnsonCookDamage | None
    conductivity: TemperatureTable
    heat_capacity: TemperatureTable
    taylor_quinney: float | RateTable = 0.9
    fitted_damage: FittedDamage | None = None

    def __post_init__(self) -> None:
        for value in _values(self.density):
            check_positive("workpiece density", value)
        for value in _values(self.young_modulus):
            check_positive("workpiece young_modulus", value)
        for value in _values(self.poisson_ratio):
            if not 0 <= value <= 0.49:
                raise ValueError(f"poisson_ratio: expected 0 to 0.49, got {value!r}")
        share = self.taylor_quinney
        if not isinstance(share, RateTable) and not 0 <= share <= 1:
            raise ValueError(f"taylor_quinney: expected 0 to 1, got {share!r}")

    def density_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Densities without stress in kg/m³ at temperatures in K, of the same shape."""
        return _at(self.density, temperature)

    def shear_modulus_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Shear moduli in Pa at temperatures in K, of the same shape."""
        young, poisson = self._elastic_at(temperature)
        return np.asarray(young / (2 * (1 + poisson)))

    def bulk_modulus_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Bulk moduli in Pa at temperatures in K, of the same shape."""
        young, poisson = self._elastic_at(temperature)
        return np.asarray(young / (3 * (1 - 2 * poisson)))

    def elastic_ratios(self) -> NDArray[np.float64]:
        """Moduli and volume without stress over those at room temperature, for kernels.

        Returns
        -------
        ndarray
            Shear modulus, bulk modulus and volume without stress as shares of their values at
            `ROOM_TEMPERATURE`, and the rise of the last to the next row, at every kelvin as
            `TemperatureTable.sampled` has it, shape (n, 4); one row if all are constant.
        """
        tables = (self.young_modulus, self.poisson_ratio, self.density)
        vary = any(isinstance(each, TemperatureTable) for each in tables)
        kelvins = _KELVINS if vary else _KELVINS[:1]
        moduli = (self.shear_modulus_at, self.bulk_modulus_at)
        ratios = [each(kelvins) / each(ROOM_TEMPERATURE) for each in moduli]
        volume = self.density_at(ROOM_TEMPERATURE) / self.density_at(kelvins)
        rise = np.diff(volume, append=volume[-1])
        return np.stack([*ratios, volume, rise], axis=-1)

    def drawn(self, generator: np.random.Generator) -> "WorkpieceMaterial":
        """The material with a damage that the cuts it was fitted to allow as well.

        Parameters
        ----------
        generator : numpy.random.Generator
            What draws.

        Raises
        ------
        ValueError
            If the damage was not fitted.
        """
        if self.damage is None or self.fitted_damage is None:
            raise ValueError(f"{self.name}: its damage was not fitted, nothing to draw from")
        return replace(self, damage=self.fitted_damage.draw(self.damage, generator))

    def sound_speed(self) -> float:
        """Speed of longitudinal waves in m/s at the temperature where it is highest."""
        stiffness = self.bulk_modulus_at(_KELVINS) + 4 / 3 * self.shear_modulus_at(_KELVINS)
        return float(np.sqrt((stiffness / self.density_at(_KELVINS)).max()))

    def _elastic_at(self, temperature: ArrayLike) -> tuple[NDArray[np.float64], ...]:
        return tuple(_at(each, temperature) for each in (self.young_modulus, self.poisson_ratio))

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
