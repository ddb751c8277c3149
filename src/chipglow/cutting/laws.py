"""The flow-stress laws that come with chipglow."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Final

import numpy as np
from numba import njit

from chipglow.cutting.flow_stress import FlowStress, flow_stress_law
from chipglow.cutting.lanes import INLINE, exponential, logarithm

MELTING_LIMIT = 3000.0
"""No metal that is cut melts above, in K."""

_POSITIVE: Final = ("yield_stress", "hardening_exponent", "thermal_exponent", "reference_rate")
_NOT_NEGATIVE: Final = ("hardening", "rate_sensitivity")


@njit(**INLINE)
def homologous(temperature, law):  # type: ignore[no-untyped-def]
    """θ = (T − T₀) / (T_melt − T₀), from 0 to 0.99."""
    share = (temperature - law.reference_temperature) / (
        law.melting_temperature - law.reference_temperature
    )
    # A liquid's strength is not zero: 1 % is left, so that points never lose all stiffness.
    return min(max(share, 0.0), 0.99)


@njit(**INLINE)
def _thermal(temperature, law):  # type: ignore[no-untyped-def]
    """1 − θᵐ."""
    heat = homologous(temperature, law)
    m = law.thermal_exponent
    return 1.0 - (heat if m == 1.0 else exponential(m * logarithm(max(heat, 1e-30))))


@njit(**INLINE)
def _johnson_cook(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    held = max(strain, 1e-12)
    n, c = law.hardening_exponent, law.rate_sensitivity
    hardened = law.hardening * exponential(n * logarithm(held))
    ratio = rate / law.reference_rate
    fast = 1.0 + c * logarithm(max(ratio, 1.0))
    thermal = _thermal(temperature, law)
    base = (law.yield_stress + hardened) * thermal
    return base * fast, hardened * n / held * fast * thermal, base * c if ratio > 1.0 else 0.0


@flow_stress_law("johnson-cook", _johnson_cook)
@dataclass(frozen=True)
class JohnsonCook(FlowStress):
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
        _check_numbers("Johnson-Cook", self, _POSITIVE, _NOT_NEGATIVE)
        check_melting("Johnson-Cook", self.reference_temperature, self.melting_temperature)

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Flow stress in Pa."""
        return _johnson_cook(strain, rate, temperature, law)[0]


@flow_stress_law("tanh")
@dataclass(frozen=True)
class HyperbolicTangent(FlowStress):
    """Johnson and Cook's law with strain softening: the TANH law of Calamaz et al. (2008).

    σ = (A + B εⁿ / exp(εᵃ))(1 + C ln(ε̇/ε̇₀))(1 − θᵐ)(D + (1 − D) tanhˢ(1 / (ε + S)ᶜ)), with
    D = 1 − (T/T_melt)ᵈ, S = (T/T_melt)ᵇ and T in K: the hotter the material, the more it loses
    beyond some strain. With s = 1 it is Calamaz et al.'s, Int. J. Mach. Tools Manuf. 48, 275;
    the exponent s is that of Sima and Özel (2010), Int. J. Mach. Tools Manuf. 50, 943.

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
    hardening_limit, recovery_temperature, recovery_strain, softening_temperature : float
        a, b, c and d.
    sharpness : float
        s.
    """

    yield_stress: float
    hardening: float
    hardening_exponent: float
    rate_sensitivity: float
    thermal_exponent: float
    melting_temperature: float
    reference_temperature: float
    reference_rate: float
    hardening_limit: float
    recovery_temperature: float
    recovery_strain: float
    softening_temperature: float
    sharpness: float = 1.0

    def __post_init__(self) -> None:
        own = ("hardening_limit", "recovery_temperature", "softening_temperature")
        positive = (*_POSITIVE, "recovery_strain", "sharpness")
        _check_numbers("TANH", self, positive, (*_NOT_NEGATIVE, *own))
        check_melting("TANH", self.reference_temperature, self.melting_temperature)

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Flow stress in Pa."""
        hardened = law.hardening * strain**law.hardening_exponent
        hardened = hardened * np.exp(-(strain**law.hardening_limit))
        fast = 1.0 + law.rate_sensitivity * np.log(max(rate / law.reference_rate, 1.0))
        warm = min(max(temperature / law.melting_temperature, 0.0), 1.0)
        residual = 1.0 - warm**law.softening_temperature
        recovery = strain + warm**law.recovery_temperature
        kept = np.tanh(recovery ** (-law.recovery_strain)) ** law.sharpness
        strength = (law.yield_stress + hardened) * fast * _thermal(temperature, law)
        return strength * (residual + (1.0 - residual) * kept)


@flow_stress_law("marusich-ortiz")
@dataclass(frozen=True)
class MarusichOrtiz(FlowStress):
    """Power law of Marusich and Ortiz (1995), Int. J. Numer. Methods Eng. 38, 3675.

    σ = σ₀ (1 − α (T − T₀)) (1 + ε/ε₀)^(1/n) (1 + ε̇/ε̇₀)^(1/m): it hardens by powers and loses
    strength linearly with temperature, down to 1 % of it. (Equation as widely cited; the paper was
    not seen.)

    Parameters
    ----------
    yield_stress : float
        σ₀ in Pa.
    reference_strain, reference_rate, reference_temperature : float
        ε₀, ε̇₀ in 1/s and T₀ in K.
    hardening_exponent, rate_exponent : float
        n and m.
    thermal_softening : float
        α in 1/K.
    """

    yield_stress: float
    reference_strain: float
    reference_rate: float
    reference_temperature: float
    hardening_exponent: float
    rate_exponent: float
    thermal_softening: float

    def __post_init__(self) -> None:
        positive = (
            "yield_stress", "reference_strain", "reference_rate", "reference_temperature",
            "hardening_exponent", "rate_exponent",
        )  # fmt: skip
        _check_numbers("Marusich-Ortiz", self, positive, ("thermal_softening",))

    @property
    def melting_temperature(self) -> float:
        """Temperature in K at which the line meets zero."""
        if self.thermal_softening == 0:
            return MELTING_LIMIT
        return min(self.reference_temperature + 1.0 / self.thermal_softening, MELTING_LIMIT)

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Flow stress in Pa."""
        heat = law.thermal_softening * (temperature - law.reference_temperature)
        hard = (1.0 + strain / law.reference_strain) ** (1.0 / law.hardening_exponent)
        fast = (1.0 + rate / law.reference_rate) ** (1.0 / law.rate_exponent)
        return law.yield_stress * max(1.0 - heat, 0.01) * hard * fast


@njit(**INLINE)
def _zerilli_armstrong(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    held = max(strain, 1e-12)
    n, by_rate = law.hardening_exponent, law.rate_hardening * temperature
    hardened = law.hardening * exponential(n * logarithm(held))
    faster = by_rate * logarithm(rate / law.reference_rate)
    thermal = law.thermal_stress * exponential(faster - law.thermal_softening * temperature)
    return law.athermal_stress + thermal + hardened, hardened * n / held, thermal * by_rate


@flow_stress_law("zerilli-armstrong", _zerilli_armstrong)
@dataclass(frozen=True)
class ZerilliArmstrong(FlowStress):
    """Flow stress of Zerilli and Armstrong (1987), J. Appl. Phys. 61, 1816, for bcc metals.

    σ = C₀ + C₁ exp(−C₃ T + C₄ T ln(ε̇/ε̇₀)) + C₅ εⁿ, T in K: strength falls exponentially with
    temperature to what hardening and C₀ leave, and does not know a melting point. (Equation as
    widely cited; the paper was not seen.)

    Parameters
    ----------
    athermal_stress, thermal_stress, hardening : float
        C₀, C₁ and C₅ in Pa.
    thermal_softening, rate_hardening : float
        C₃ and C₄ in 1/K.
    hardening_exponent : float
        n.
    reference_rate : float
        ε̇₀ in 1/s.
    """

    athermal_stress: float
    thermal_stress: float
    thermal_softening: float
    rate_hardening: float
    hardening: float
    hardening_exponent: float
    reference_rate: float = 1.0

    def __post_init__(self) -> None:
        positive = ("athermal_stress", "hardening_exponent", "reference_rate")
        others = ("thermal_stress", "thermal_softening", "rate_hardening", "hardening")
        _check_numbers("Zerilli-Armstrong", self, positive, others)

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Flow stress in Pa."""
        return _zerilli_armstrong(strain, rate, temperature, law)[0]


def _check_numbers(
    title: str, law: FlowStress, positive: Iterable[str], not_negative: Iterable[str]
) -> None:
    """Raise ValueError unless numbers of a law are finite and over 0, and others 0 or more."""
    for name in positive:
        check_positive(f"{title} {name}", getattr(law, name))
    for name in not_negative:
        value = getattr(law, name)
        if not 0 <= value < np.inf:
            raise ValueError(f"{title} {name}: expected 0 or more, got {value!r}")


def check_positive(name: str, value: float) -> None:
    """Raise ValueError unless a value is finite and over 0."""
    if not (isfinite(value) and value > 0):
        raise ValueError(f"{name}: expected over 0, got {value!r}")


def check_melting(name: str, reference: float, melting: float) -> None:
    """Raise ValueError unless a melting temperature is over the reference temperature (K)."""
    if not reference < melting < MELTING_LIMIT:
        raise ValueError(
            f"{name} melting_temperature: expected {reference:g} K to {MELTING_LIMIT:g} K, "
            f"got {melting!r} K"
        )
