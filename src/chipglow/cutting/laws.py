"""The flow-stress laws that come with chipglow."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numba import njit

from chipglow.cutting.flow_stress import FLOW_LAWS, FlowStress
from chipglow.cutting.lanes import INLINE, exponential, logarithm
from chipglow.quantities import Parameter
from chipglow.quantities.units import KELVINS, PER_KELVIN, STRAIN_RATE, STRESS, VISCOSITY

_DRAG = replace(VISCOSITY, positive=False)  # may be 0

MELTING_LIMIT = 3000.0
"""No metal that is cut melts above, in K."""

_LEAST_STRENGTH = 0.01
"""Fraction of the cold strength that a liquid keeps, so that points never lose all stiffness."""

_COLDEST = 1e-30
"""Homologous temperature of which the logarithm is taken at 0: no power of it is felt."""

_LEAST_STRAIN = 1e-12
"""Smallest plastic strain of which the logarithm is taken."""


@njit(**INLINE)
def homologous(temperature, law):  # type: ignore[no-untyped-def]
    """Return θ = (T − T₀) / (T_melt − T₀), from 0 to 0.99."""
    theta = (temperature - law.reference_temperature) / (
        law.melting_temperature - law.reference_temperature
    )
    return min(max(theta, 0.0), 1.0 - _LEAST_STRENGTH)


@njit(**INLINE)
def _thermal(temperature, law):  # type: ignore[no-untyped-def]
    """Return 1 − θᵐ."""
    heat = homologous(temperature, law)
    m = law.thermal_exponent
    return 1.0 - (heat if m == 1.0 else exponential(m * logarithm(max(heat, _COLDEST))))


@njit(**INLINE)
def _johnson_cook(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    held = max(strain, _LEAST_STRAIN)
    n, c = law.hardening_exponent, law.rate_sensitivity
    hardened = law.hardening * exponential(n * logarithm(held))
    ratio = rate / law.reference_rate
    fast = 1.0 + c * logarithm(max(ratio, 1.0))
    thermal = _thermal(temperature, law)
    base = (law.yield_stress + hardened) * thermal
    return base * fast, hardened * n / held * fast * thermal, base * c if ratio > 1.0 else 0.0


@FLOW_LAWS.part
@dataclass(frozen=True)
class JohnsonCook(FlowStress):
    """Flow stress of Johnson and Cook (1983).

    σ = (A + B εⁿ)(1 + C ln(ε̇/ε̇₀))(1 − θᵐ), with θ = (T − T₀)/(T_melt − T₀), 0 below T₀, and
    ε̇/ε̇₀ at least 1.
    """

    kind = "johnson-cook"
    yield_stress: Annotated[float, Parameter("A.", STRESS, over=0.0)]
    hardening: Annotated[float, Parameter("B.", STRESS, least=0.0)]
    hardening_exponent: Annotated[float, Parameter("n.", over=0.0)]
    rate_sensitivity: Annotated[float, Parameter("C.", least=0.0)]
    thermal_exponent: Annotated[float, Parameter("m.", over=0.0)]
    melting_temperature: Annotated[float, Parameter("T_melt.", KELVINS)]
    reference_temperature: Annotated[float, Parameter("T₀.", KELVINS)]
    reference_rate: Annotated[float, Parameter("ε̇₀.", STRAIN_RATE, over=0.0)]

    stress_and_slopes = staticmethod(_johnson_cook)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_melting(type(self), self.reference_temperature, self.melting_temperature)


@FLOW_LAWS.part
@dataclass(frozen=True)
class HyperbolicTangent(JohnsonCook):
    """Johnson and Cook's law with strain softening: the TANH law of Calamaz et al. (2008).

    σ = (A + B εⁿ / exp(εᵃ))(1 + C ln(ε̇/ε̇₀))(1 − θᵐ)(D + (1 − D) tanhˢ(1 / (ε + S)ᶜ)), with
    D = 1 − (T/T_melt)ᵈ, S = (T/T_melt)ᵇ and T in K: the hotter the material, the more it loses
    beyond some strain. With s = 1 it is Calamaz et al.'s, Int. J. Mach. Tools Manuf. 48, 275;
    the exponent s is by Sima and Özel (2010), Int. J. Mach. Tools Manuf. 50, 943.
    """

    kind = "tanh"
    hardening_limit: Annotated[float, Parameter("a.", least=0.0)]
    recovery_temperature: Annotated[float, Parameter("b.", least=0.0)]
    recovery_strain: Annotated[float, Parameter("c.", over=0.0)]
    softening_temperature: Annotated[float, Parameter("d.", least=0.0)]
    sharpness: Annotated[float, Parameter("s.", over=0.0)] = 1.0

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Return the flow stress in Pa."""
        hardened = law.hardening * strain**law.hardening_exponent
        hardened = hardened * np.exp(-(strain**law.hardening_limit))
        fast = 1.0 + law.rate_sensitivity * np.log(max(rate / law.reference_rate, 1.0))
        warm = min(max(temperature / law.melting_temperature, 0.0), 1.0)
        residual = 1.0 - warm**law.softening_temperature
        recovery = strain + warm**law.recovery_temperature
        kept = np.tanh(recovery ** (-law.recovery_strain)) ** law.sharpness
        strength = (law.yield_stress + hardened) * fast * _thermal(temperature, law)
        return strength * (residual + (1.0 - residual) * kept)


@FLOW_LAWS.part
@dataclass(frozen=True)
class MarusichOrtiz(FlowStress):
    """Power law of Marusich and Ortiz (1995), Int. J. Numer. Methods Eng. 38, 3675.

    σ = σ₀ (1 − α (T − T₀)) (1 + ε/ε₀)^(1/n) (1 + ε̇/ε̇₀)^(1/m): it hardens by powers and loses
    strength linearly with temperature, down to 1 % of it. (Equation as widely cited; the paper was
    not seen.)
    """

    kind = "marusich-ortiz"
    yield_stress: Annotated[float, Parameter("σ₀.", STRESS, over=0.0)]
    reference_strain: Annotated[float, Parameter("ε₀.", over=0.0)]
    reference_rate: Annotated[float, Parameter("ε̇₀.", STRAIN_RATE, over=0.0)]
    reference_temperature: Annotated[float, Parameter("T₀.", KELVINS)]
    hardening_exponent: Annotated[float, Parameter("n.", over=0.0)]
    rate_exponent: Annotated[float, Parameter("m.", over=0.0)]
    thermal_softening: Annotated[float, Parameter("α.", PER_KELVIN, least=0.0)]

    @property
    def melting_temperature(self) -> float:
        """Temperature in K at which the line meets zero."""
        if self.thermal_softening == 0:
            return MELTING_LIMIT
        return min(self.reference_temperature + 1.0 / self.thermal_softening, MELTING_LIMIT)

    @staticmethod
    def stress(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
        """Return the flow stress in Pa."""
        heat = law.thermal_softening * (temperature - law.reference_temperature)
        hard = (1.0 + strain / law.reference_strain) ** (1.0 / law.hardening_exponent)
        fast = (1.0 + rate / law.reference_rate) ** (1.0 / law.rate_exponent)
        return law.yield_stress * max(1.0 - heat, _LEAST_STRENGTH) * hard * fast


@njit(**INLINE)
def _zerilli_armstrong(strain, rate, temperature, law):  # type: ignore[no-untyped-def]
    held = max(strain, _LEAST_STRAIN)
    n, by_rate = law.hardening_exponent, law.rate_hardening * temperature
    hardened = law.hardening * exponential(n * logarithm(held))
    faster = by_rate * logarithm(rate / law.reference_rate)
    thermal = law.thermal_stress * exponential(faster - law.thermal_softening * temperature)
    drag = 3.0 * law.drag * rate
    stress = law.athermal_stress + thermal + hardened + drag
    return stress, hardened * n / held, thermal * by_rate + drag


@FLOW_LAWS.part
@dataclass(frozen=True)
class ZerilliArmstrong(FlowStress):
    """Flow stress of Zerilli and Armstrong (1987), J. Appl. Phys. 61, 1816, for bcc metals.

    σ = C₀ + C₁ exp(−C₃ T + C₄ T ln(ε̇/ε̇₀)) + C₅ εⁿ + 3 η ε̇, T in K: strength falls exponentially
    with temperature to what hardening and C₀ leave; there is no melting point. The drag of shear η
    is an addition for rates above 10⁴ 1/s (Campbell and Ferguson 1970, Philos. Mag. 21, 63).
    (Equations as widely cited; neither paper was seen.)
    """

    kind = "zerilli-armstrong"
    athermal_stress: Annotated[float, Parameter("C₀.", STRESS, over=0.0)]
    thermal_stress: Annotated[float, Parameter("C₁.", STRESS, least=0.0)]
    thermal_softening: Annotated[float, Parameter("C₃.", PER_KELVIN, least=0.0)]
    rate_hardening: Annotated[float, Parameter("C₄.", PER_KELVIN, least=0.0)]
    hardening: Annotated[float, Parameter("C₅.", STRESS, least=0.0)]
    hardening_exponent: Annotated[float, Parameter("n.", over=0.0)]
    reference_rate: Annotated[float, Parameter("ε̇₀.", STRAIN_RATE, over=0.0)] = 1.0
    drag: Annotated[float, Parameter("η, of shear.", _DRAG, least=0.0)] = 0.0

    stress_and_slopes = staticmethod(_zerilli_armstrong)


def check_melting(part: type, reference: float, melting: float) -> None:
    """Raise ValueError unless a melting temperature is over the reference temperature (K)."""
    if not reference < melting < MELTING_LIMIT:
        raise ValueError(
            f"{part.__name__}.melting_temperature: {melting:g} K, expected {reference:g} K to "
            f"{MELTING_LIMIT:g} K"
        )
