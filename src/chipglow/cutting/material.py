"""Materials of the cut: mechanics and heat."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.cutting.damage import BAND_CELLS, BAND_LENGTHS, FittedDamage, JohnsonCookDamage
from chipglow.cutting.flow_stress import FLOW_LAWS, FlowStress
from chipglow.quantities import Parameter, Part, zero_to_one
from chipglow.quantities.units import (
    CONDUCTIVITY,
    DENSITY,
    HEAT_CAPACITY,
    LENGTH,
    STRESS,
    VISCOSITY,
)

TABLE_COLDEST: Final = 200.0
"""Temperature in K of the first row of sampled properties, the coldest that a workpiece may have.
"""

TABLE_HOTTEST: Final = 3000.0
"""Temperature in K of their last row, at which no metal that is cut is solid."""

ROOM_TEMPERATURE: Final = 293.15
"""Temperature in K (20 °C) at which moduli and density of the points count."""


@dataclass(frozen=True)
class TemperatureTable:
    """A property that depends on temperature: linear between the points, constant beyond."""

    temperatures: tuple[float, ...]
    """In K, ascending."""
    values: tuple[float, ...]
    """In SI units."""

    def __post_init__(self) -> None:
        if len(self.temperatures) != len(self.values) or not self.values:
            raise ValueError("temperature table: needs one value per temperature")
        if any(np.diff(self.temperatures) <= 0):
            raise ValueError("temperature table: temperatures must ascend")

    def at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return values at temperatures in K, of the same shape."""
        given = np.asarray(temperature, np.float64)
        return np.asarray(np.interp(given, self.temperatures, self.values), np.float64)

    def sampled(self) -> NDArray[np.float64]:
        """Return values at every kelvin from 200 K to 3000 K, for kernels."""
        return self.at(_KELVINS)


def _numbers(part: Any) -> list[str]:
    """Return the names of the fields of a part that are numbers or tables of numbers."""
    kinds = (float, int, TemperatureTable, RateTable)
    every = [one.name for one in fields(part)] if part is not None else []
    return [name for name in every if isinstance(getattr(part, name), kinds)]


def _times(quantity: Any, factor: float) -> Any:
    if isinstance(quantity, float | int):
        return quantity * factor
    return replace(quantity, values=tuple(factor * one for one in quantity.values))


_KELVINS: Final = np.arange(TABLE_COLDEST, TABLE_HOTTEST + 1.0)


def _at(quantity: float | TemperatureTable, temperature: ArrayLike) -> NDArray[np.float64]:
    if isinstance(quantity, TemperatureTable):
        return quantity.at(temperature)
    return np.full(np.shape(temperature), quantity, dtype=np.float64)


@dataclass(frozen=True)
class RateTable:
    """A number over the plastic strain rate: linear over its logarithm, constant beyond."""

    rates: tuple[float, ...]
    """In 1/s, ascending, over 0."""
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.rates) != len(self.values) or not self.values:
            raise ValueError("rate table: needs one value per rate")
        if any(np.diff(self.rates, prepend=0.0) <= 0):
            raise ValueError("rate table: rates must be positive and ascend")


@dataclass(frozen=True)
class NonlocalViscosity(Part):
    """Viscous stress by the plastic strain rate over its mean around the point.

    The flow stress is σ + 3 η (ε̇ − ⟨ε̇⟩), where ⟨ε̇⟩ is the mean of the rate with Gaussian weights
    of the standard deviation ℓ. For rates that vary over much more than ℓ this is
    σ − (3/2) η ℓ² ∇²ε̇: plasticity that dissipates by gradients of the rate, as in Gurtin and Anand
    (2005), J. Mech. Phys. Solids 53, 1624. Even flow costs nothing, whatever its rate; a band
    cannot become much narrower than ℓ, however the material softens. Softening by failure has the
    thickness of its layer from it as well, 2 ℓ: see `JohnsonCookDamage`.
    """

    viscosity: Annotated[float, Parameter("η, of shear.", VISCOSITY)]
    length: Annotated[float, Parameter("ℓ.", LENGTH)]


@dataclass(frozen=True)
class WorkpieceMaterial(Part):
    """Material of the workpiece; a density over the temperature is thermal expansion."""

    name: Annotated[str, Parameter("Name, with the source of the numbers.")]
    density: Annotated[float | TemperatureTable, Parameter("Density.", DENSITY)]
    young_modulus: Annotated[
        float | TemperatureTable, Parameter("Young's modulus.", STRESS, over=0.0)
    ]
    poisson_ratio: Annotated[
        float | TemperatureTable, Parameter("Poisson's ratio.", least=0.0, most=0.49)
    ]
    flow_stress: Annotated[Annotated[FlowStress, FLOW_LAWS], Parameter("Flow-stress law.")]
    damage: Annotated[
        JohnsonCookDamage | None, Parameter("Damage; none for a material that does not fail.")
    ]
    conductivity: Annotated[TemperatureTable, Parameter("Conductivity.", CONDUCTIVITY)]
    heat_capacity: Annotated[TemperatureTable, Parameter("Heat.", HEAT_CAPACITY)]
    taylor_quinney: Annotated[float | RateTable, zero_to_one("Fraction of work that is heat.")] = (
        0.9
    )
    fitted_damage: Annotated[
        FittedDamage | None, Parameter("Uncertainty of fitted numbers of the damage.")
    ] = None
    nonlocal_viscosity: Annotated[
        NonlocalViscosity | None, Parameter("Without it, shear bands are as narrow as the cell.")
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, parameter in self.declared().items():
            for value in getattr(getattr(self, name), "values", ()):
                parameter.check(f"{type(self).__name__}.{name}", value)

    def density_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return densities without stress in kg/m³ at temperatures in K, of the same shape."""
        return _at(self.density, temperature)

    def shear_modulus_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return shear moduli in Pa at temperatures in K, of the same shape."""
        young, poisson = self._elastic_at(temperature)
        return np.asarray(young / (2 * (1 + poisson)))

    def bulk_modulus_at(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Return bulk moduli in Pa at temperatures in K, of the same shape."""
        young, poisson = self._elastic_at(temperature)
        return np.asarray(young / (3 * (1 - 2 * poisson)))

    def elastic_ratios(self) -> NDArray[np.float64]:
        """Return what kernels take for elasticity, shape (n, 4), a row for every kelvin.

        Shear modulus, bulk modulus and volume without stress over those at `ROOM_TEMPERATURE`, and
        the rise of the last to the next row; one row if all are constant.
        """
        tables = (self.young_modulus, self.poisson_ratio, self.density)
        vary = any(isinstance(each, TemperatureTable) for each in tables)
        kelvins = _KELVINS if vary else _KELVINS[:1]
        moduli = (self.shear_modulus_at, self.bulk_modulus_at)
        ratios = [each(kelvins) / each(ROOM_TEMPERATURE) for each in moduli]
        volume = self.density_at(ROOM_TEMPERATURE) / self.density_at(kelvins)
        rise = np.diff(volume, append=volume[-1])
        return np.stack([*ratios, volume, rise], axis=-1)

    def heat_fractions(self) -> NDArray[np.float64]:
        """Return `taylor_quinney` for kernels: strain rates and fractions, shape (2, n)."""
        table = self.taylor_quinney
        if not isinstance(table, RateTable):
            table = RateTable((1.0,), (table,))
        return np.array([table.rates, table.values], dtype=np.float64)

    def drawn(self, generator: np.random.Generator) -> "WorkpieceMaterial":
        """Return the material with a damage that the cuts it was fitted to allow as well."""
        if self.damage is None or self.fitted_damage is None:
            raise ValueError(f"{self.name}: its damage was not fitted, nothing to draw from")
        return replace(self, damage=self.fitted_damage.draw(self.damage, generator))

    def scaled(self, factors: Mapping[str, float]) -> "WorkpieceMaterial":
        """Return the material with some of its numbers multiplied by factors, by name.

        A name is looked for in the material, in its flow stress, then in its damage.
        """
        parts: dict[str, Any] = {"damage": self.damage, "flow_stress": self.flow_stress}
        owners = {name: key for key, part in parts.items() for name in _numbers(part)}
        owners |= dict.fromkeys(_numbers(self), "")
        own: dict[str, Any] = {}
        for name, factor in factors.items():
            if name not in owners:
                known = ", ".join(sorted(owners))
                raise ValueError(f"workpiece_factors: {name!r}, expected one of {known}")
            if key := owners[name]:
                part = own.get(key, parts[key])
                own[key] = replace(part, **{name: _times(getattr(part, name), factor)})
            else:
                own[name] = _times(getattr(self, name), factor)
        return replace(self, **own)

    def failing_layer(self, cell: float) -> float:
        """Return the thickness in m of the layer that a failure softens; `cell` in m."""
        if self.nonlocal_viscosity is None:
            return BAND_CELLS * cell
        return BAND_LENGTHS * self.nonlocal_viscosity.length

    def sound_speed(self) -> float:
        """Return the speed of longitudinal waves in m/s at the temperature where it is highest."""
        stiffness = self.bulk_modulus_at(_KELVINS) + 4 / 3 * self.shear_modulus_at(_KELVINS)
        return float(np.sqrt((stiffness / self.density_at(_KELVINS)).max()))

    def _elastic_at(self, temperature: ArrayLike) -> tuple[NDArray[np.float64], ...]:
        return tuple(_at(each, temperature) for each in (self.young_modulus, self.poisson_ratio))

    @property
    def melting_temperature(self) -> float:
        """Melting point in K of the flow-stress law, the damage, or the end of the tables."""
        of_damage = getattr(self.damage, "melting_temperature", TABLE_HOTTEST)
        return float(getattr(self.flow_stress, "melting_temperature", of_damage))


@dataclass(frozen=True)
class ToolMaterial(Part):
    """Material of the tool: rigid, but it conducts heat."""

    name: Annotated[str, Parameter("Name, with the source of the numbers.")]
    density: Annotated[float, Parameter("Density.", DENSITY)]
    conductivity: Annotated[float, Parameter("Conductivity.", CONDUCTIVITY)]
    heat_capacity: Annotated[float, Parameter("Heat capacity.", HEAT_CAPACITY)]

    @property
    def effusivity(self) -> float:
        """√(kρc) in W s^½/(m² K)."""
        return float(np.sqrt(self.conductivity * self.density * self.heat_capacity))
