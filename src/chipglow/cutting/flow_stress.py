"""Flow stress and the return to the yield surface, for kernels."""

from typing import NamedTuple

import numpy as np
from numba import njit

from chipglow.cutting.material import TRIAXIALITIES, WorkpieceMaterial

_ITERATIONS = 6
_SMALL_CHANGE = 0.02
_SMALL_STRAIN = 0.01


class Flow(NamedTuple):
    """Johnson-Cook flow stress and damage: see `JohnsonCook` and `DamageSoftening`."""

    yield_stress: float
    hardening: float
    hardening_exponent: float
    rate_sensitivity: float
    thermal_exponent: float
    melting_temperature: float
    reference_temperature: float
    reference_rate: float
    d1: float
    d2: float
    d3: float
    d4: float
    d5: float
    onset: float
    loss: float

    @classmethod
    def of(cls, material: WorkpieceMaterial) -> "Flow":
        """Numbers of a material."""
        law, softening = material.flow_stress, material.softening
        return cls(
            law.yield_stress,
            law.hardening,
            law.hardening_exponent,
            law.rate_sensitivity,
            law.thermal_exponent,
            law.melting_temperature,
            law.reference_temperature,
            law.reference_rate,
            softening.d1,
            softening.d2,
            softening.d3,
            softening.d4,
            softening.d5,
            softening.onset,
            softening.loss,
        )


@njit
def _heat(temperature, flow):  # type: ignore[no-untyped-def]
    """θ of Johnson and Cook."""
    heat = (temperature - flow.reference_temperature) / (
        flow.melting_temperature - flow.reference_temperature
    )
    # A liquid's strength is not nought: 1 % is left, so that points never lose all stiffness.
    return min(max(heat, 0.0), 0.99)


@njit
def weakening(damage, temperature, flow):  # type: ignore[no-untyped-def]
    """Factor on the flow stress from temperature and damage."""
    heat = _heat(temperature, flow)
    thermal = 1.0 - (heat if flow.thermal_exponent == 1.0 else heat**flow.thermal_exponent)
    share = (damage - flow.onset) / (1.0 - flow.onset)
    return thermal * (1.0 - flow.loss * min(max(share, 0.0), 1.0))


@njit
def strain_to_failure(triaxiality, rate, temperature, flow):  # type: ignore[no-untyped-def]
    """Strain to failure at a triaxiality, plastic strain rate (1/s) and temperature (K)."""
    held = min(max(triaxiality, TRIAXIALITIES[0]), TRIAXIALITIES[1])
    fast = 1.0 + flow.d4 * np.log(max(rate / flow.reference_rate, 1.0))
    return (
        (flow.d1 + flow.d2 * np.exp(flow.d3 * held))
        * fast
        * (1.0 + flow.d5 * _heat(temperature, flow))
    )


@njit
def flow_stress(strain, rate, temperature, damage, flow):  # type: ignore[no-untyped-def]
    """Flow stress in Pa at a plastic strain, its rate (1/s), temperature (K) and damage."""
    hard = flow.yield_stress + flow.hardening * strain**flow.hardening_exponent
    fast = 1.0 + flow.rate_sensitivity * np.log(max(rate / flow.reference_rate, 1.0))
    return hard * fast * weakening(damage, temperature, flow)


@njit
def plastic_increment(  # type: ignore[no-untyped-def]
    trial, strain, temperature, damage, guess, shear_modulus, time_step, flow
):
    """Plastic strain of a step that takes a trial equivalent stress back to the flow stress.

    Solves trial − 3GΔ = flow_stress(strain + Δ, Δ/dt, temperature, damage) by Newton's method over
    ln Δ. It starts at `guess`, the last step's Δ; without one (0), at the rate-independent Δ, which
    is the upper bound and from which it converges because the function is concave.
    """
    weak = weakening(damage, temperature, flow)
    if trial <= flow.yield_stress * weak:
        return 0.0
    stiffness = 3.0 * shear_modulus
    power = np.exp(flow.hardening_exponent * np.log(max(strain, 1e-12)))
    hard = (flow.yield_stress + flow.hardening * power) * weak
    if trial <= hard:
        return 0.0
    slope = 0.0
    if strain > _SMALL_STRAIN:
        slope = weak * flow.hardening * flow.hardening_exponent * power / strain
    bound = (trial - hard) / (stiffness + slope)
    slowest = time_step * flow.reference_rate
    increment = min(guess, bound) if guess > 2.0 * slowest else bound
    for _ in range(_ITERATIONS):
        if increment <= slowest:
            return min(slowest, bound)
        if strain <= _SMALL_STRAIN:
            power = (strain + increment) ** flow.hardening_exponent
            base = (flow.yield_stress + flow.hardening * power) * weak
            slope = weak * flow.hardening * flow.hardening_exponent * power / (strain + increment)
        else:
            base = hard + slope * increment
        fast = 1.0 + flow.rate_sensitivity * np.log(increment / slowest)
        excess = trial - stiffness * increment - base * fast
        fall = (stiffness + slope * fast) * increment + base * flow.rate_sensitivity
        change = excess / fall
        if abs(change) < _SMALL_CHANGE:
            # The exponential to second order; the next Newton step would be under 1e-4 of this.
            return increment * (1.0 + change * (1.0 + 0.5 * change))
        increment = min(increment * np.exp(max(change, -3.0)), bound)
    return increment
