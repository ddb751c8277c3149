"""Materials of the cut: flow stress, damage, elasticity and heat."""

from dataclasses import dataclass
from math import isfinite
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

TABLE_COLDEST: Final = 200.0
TABLE_HOTTEST: Final = 3000.0

TRIAXIALITIES: Final = (-1.5, 1.5)
"""Triaxialities at which the strain to failure is held: beyond, it was never measured."""


def _check_positive(name: str, value: float) -> None:
    if not (isfinite(value) and value > 0):
        raise ValueError(f"{name}: expected over 0, got {value!r}")


@dataclass(frozen=True)
class JohnsonCook:
    """Flow stress of Johnson and Cook (1983).

    σ = (A + B εⁿ)(1 + C ln(ε̇/ε̇₀))(1 − θᵐ), with θ = (T − T₀)/(T_melt − T₀), 0 below T₀, and
    ε̇/ε̇₀ at least 1.

    Parameters
    ----------
    yield_stress, hardening : float
        A and B in Pa.
    hardening_exponent, rate_sensitivity, thermal_exponent : float
        n, C and m.
    melting_temperature, reference_temperature : float
        T_melt and T₀ in K.
    reference_rate : float
        ε̇₀ in 1/s.
    """

    yield_stress: float
    hardening: float
    hardening_exponent: float
    rate_sensitivity: float
    thermal_exponent: float
    melting_temperature: float
    reference_temperature: float = 293.0
    reference_rate: float = 1.0

    def __post_init__(self) -> None:
        for name in ("yield_stress", "hardening_exponent", "thermal_exponent", "reference_rate"):
            _check_positive(f"Johnson-Cook {name}", getattr(self, name))
        for name in ("hardening", "rate_sensitivity"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"Johnson-Cook {name}: expected 0 or more")
        if not self.reference_temperature < self.melting_temperature < TABLE_HOTTEST:
            raise ValueError(
                f"Johnson-Cook melting_temperature: expected {self.reference_temperature:g} K to "
                f"{TABLE_HOTTEST:g} K, got {self.melting_temperature!r} K"
            )


@dataclass(frozen=True)
class DamageSoftening:
    """Loss of flow stress by damage that grows as Johnson and Cook (1985) say.

    Damage D is the sum of plastic strain over the strain to failure,
    ε_f = (D₁ + D₂ exp(D₃ σ*))(1 + D₄ ln(ε̇/ε̇₀))(1 + D₅ θ), with the triaxiality
    σ* = mean stress / equivalent stress and θ as in `JohnsonCook`. The flow stress is multiplied
    by 1 − loss · s, where s rises linearly from 0 at a damage of `onset` to 1 at a damage of 1.

    Parameters
    ----------
    d1, d2, d3, d4, d5 : float
        Constants of the strain to failure; only `d1` over 0 means that it is constant.
    onset : float
        Damage at which the flow stress begins to fall, 0 to less than 1.
    loss : float
        Share of the flow stress that is lost in the end, 0 to less than 1.
    """

    d1: float
    d2: float
    d3: float
    d4: float
    d5: float
    onset: float
    loss: float

    def __post_init__(self) -> None:
        if not all(isfinite(d) for d in (self.d1, self.d2, self.d3, self.d4, self.d5)):
            raise ValueError("damage: d1 to d5 must be finite")
        ends = [self.d1 + self.d2 * np.exp(self.d3 * end) for end in TRIAXIALITIES]
        if min(ends) <= 0:
            raise ValueError(
                f"damage: d1 + d2 exp(d3 triaxiality) falls to {min(ends):.3g}, expected over 0 "
                f"from {TRIAXIALITIES[0]:g} to {TRIAXIALITIES[1]:g}"
            )
        if self.d4 < 0 or self.d5 <= -1:
            raise ValueError(
                f"damage: expected d4 of 0 or more and d5 over -1, got {self.d4!r}, {self.d5!r}"
            )
        if not 0 <= self.onset < 1:
            raise ValueError(f"damage onset: expected 0 to less than 1, got {self.onset!r}")
        if not 0 <= self.loss < 1:
            raise ValueError(f"damage loss: expected 0 to less than 1, got {self.loss!r}")


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
            _check_positive("temperature table: value", value)

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
    flow_stress : JohnsonCook
        Law of the flow stress.
    softening : DamageSoftening
        Loss of flow stress with damage.
    conductivity, heat_capacity : TemperatureTable
        In W/(m K) and J/(kg K).
    taylor_quinney : float
        Share of the plastic work that becomes heat.
    """

    name: str
    density: float
    young_modulus: float
    poisson_ratio: float
    flow_stress: JohnsonCook
    softening: DamageSoftening
    conductivity: TemperatureTable
    heat_capacity: TemperatureTable
    taylor_quinney: float = 0.9

    def __post_init__(self) -> None:
        _check_positive("workpiece density", self.density)
        _check_positive("workpiece young_modulus", self.young_modulus)
        if not 0 <= self.poisson_ratio <= 0.49:
            raise ValueError(f"poisson_ratio: expected 0 to 0.49, got {self.poisson_ratio!r}")
        if not 0 <= self.taylor_quinney <= 1:
            raise ValueError(f"taylor_quinney: expected 0 to 1, got {self.taylor_quinney!r}")

    @property
    def shear_modulus(self) -> float:
        """In Pa."""
        return self.young_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def bulk_modulus(self) -> float:
        """In Pa."""
        return self.young_modulus / (3 * (1 - 2 * self.poisson_ratio))


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
            _check_positive(f"tool {name}", getattr(self, name))

    @property
    def effusivity(self) -> float:
        """√(kρc) in W s^½/(m² K)."""
        return float(np.sqrt(self.conductivity * self.density * self.heat_capacity))
