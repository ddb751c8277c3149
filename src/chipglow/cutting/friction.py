"""Friction that falls with the temperature, for kernels."""

from numba import njit


@njit
def friction_coefficient(coefficient, exponent, melting_temperature, temperature):  # type: ignore[no-untyped-def]
    """Coulomb's coefficient at a temperature: see `Friction`.

    With an infinite melting temperature it is `coefficient`, to the last bit.
    """
    return coefficient * max(1.0 - (temperature / melting_temperature) ** exponent, 0.0)
