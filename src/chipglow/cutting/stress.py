"""Stress of a batch of points: hypo-elastic, radial return to the flow stress, damage.

A point carries the deviator that its elastic strain makes at room temperature. The deviator at the
point's own temperature is less by the ratio of the shear moduli.

Points are copied into rows of a buffer, one row a quantity, so that the compiler does the same
arithmetic on several points at once.
"""

import numpy as np
from numba import njit

from chipglow.cutting.damage import damage_growth, weakening
from chipglow.cutting.flow_stress import stress_and_slopes
from chipglow.cutting.lanes import FAST, INLINE, exponential
from chipglow.cutting.material import TABLE_COLDEST
from chipglow.scene.kernels import INNER

LANES = 128
"""Points of a batch: their rows stay in the fastest cache."""

SLOWEST_RATE = 1.0
"""Plastic flow slower than this (1/s) is taken to be as strong as at this rate."""

_ROW_LENGTH = LANES + 8
"""Doubles of a row of the buffer: eight between two rows keep them out of the same cache sets."""

_NEWTON_STEPS = 8
"""Most steps of Newton's method."""

_SMALL_CHANGE = 0.02
"""Change of the logarithm of an increment below which it counts as found: the step that follows
squares the error."""

_LARGEST_CHANGE = 3.0
"""Largest change of the logarithm of an increment in a step of Newton: a factor of 20."""

_SMALL_STRAIN = 0.01
"""Plastic strain below which hardening is too steep to predict an increment."""

_MOST_HELP = 0.95
"""Fraction of a point's strength that the flow around it takes off at most: it stays a solid."""

_ROWS = 22
"""Number of rows of the buffer."""

(
    DXX, DYY, DXY, STRAIN, DAMAGE, TEMPERATURE, INCREMENT, VOLUME,
    CXX, CXY, CYX, CYY, TRIAL, WEAK, BOUND, WORK, SOFT, TENSION, FREE, EXPANSION, FALL, MEAN,
) = range(0, _ROWS * _ROW_LENGTH, _ROW_LENGTH)  # fmt: skip
BUFFER = _ROWS * _ROW_LENGTH
STRESS = TRIAL
"""Rows of the buffer; in the end the trial stress has become the equivalent stress (Pa). `SOFT` is
the shear modulus over that at room temperature; the deviator is that at room temperature. `FREE` is
the volume without stress (m²), `EXPANSION` the elastic energy (J/m) that its change has given,
`FALL` that which went as the moduli fell with the temperature. `MEAN` is the mean plastic strain
rate around the point, then the stress (Pa) by which it lowers the flow stress."""

SHEAR, BULK, VOLUME_FREE, VOLUME_RISE = range(4)
"""Columns of `WorkpieceMaterial.elastic_ratios`."""


@njit(**FAST)
def plastic_increments(b, count, shear_modulus, time_step, viscosity, law, damage):  # type: ignore[no-untyped-def]
    """Find the plastic strains of a step that take trial stresses back to the flow stress.

    Solves trial − 3GΔ = weakening · σ(strain + Δ, Δ/dt, temperature) + 3η(Δ/dt − mean rate) for Δ
    by Newton's method over ln Δ; weakening, temperature and mean rate are taken at the
    beginning of the step. It starts at the Δ of the last step or else at the rate-independent Δ.
    """
    beyond = 0
    for k in range(count):
        b[WEAK + k] = weakening(b[DAMAGE + k], damage)
    for k in range(count):
        strain, trial = b[STRAIN + k], b[TRIAL + k]
        still, slope, _ = stress_and_slopes(strain, SLOWEST_RATE, b[TEMPERATURE + k], law)
        strength = b[WEAK + k] * still
        b[MEAN + k] = min(3.0 * viscosity * b[MEAN + k], _MOST_HELP * strength)
        excess = trial - strength + b[MEAN + k]
        beyond += 1 if excess > 0.0 else 0
        # Hardening is infinitely steep at no strain: no slope to rely on.
        firm = max(slope * b[WEAK + k], 0.0) if strain > _SMALL_STRAIN else 0.0
        viscous = 3.0 * viscosity / time_step
        bound = excess / (3.0 * shear_modulus * b[SOFT + k] + firm + viscous)
        guess = b[INCREMENT + k]
        begin = guess if guess > 2.0 * SLOWEST_RATE * time_step else bound
        b[INCREMENT + k] = max(min(begin, bound), 0.0)
        b[BOUND + k] = bound
    if beyond == 0:
        return False
    for _ in range(_NEWTON_STEPS):
        if _improve(b, count, shear_modulus, time_step, viscosity, law, damage) == 0:
            break
    return True


@njit(**FAST, **INNER)
def _improve(b, count, shear_modulus, time_step, viscosity, law, damage):  # type: ignore[no-untyped-def]
    """Do a step of Newton over the logarithm of the increment; return how many change much."""
    slowest = SLOWEST_RATE * time_step
    per_step = 1.0 / time_step
    far = 0
    for k in range(count):
        increment, bound, weak = b[INCREMENT + k], b[BOUND + k], b[WEAK + k]
        stiffness = 3.0 * shear_modulus * b[SOFT + k]
        moving = increment > slowest
        tried = increment if moving else slowest
        flowing, by_strain, by_rate = stress_and_slopes(
            b[STRAIN + k] + tried, tried * per_step, b[TEMPERATURE + k], law
        )
        viscous = 3.0 * viscosity * per_step * tried
        strength = weak * flowing + viscous - b[MEAN + k]
        excess = b[TRIAL + k] - stiffness * tried - strength
        fall = stiffness * tried + weak * (by_strain * tried + by_rate) + viscous
        change = excess / max(fall, 0.5 * stiffness * tried)
        plastic = bound > 0.0
        far += 1 if moving and plastic and abs(change) > _SMALL_CHANGE else 0
        better = tried * exponential(min(max(change, -_LARGEST_CHANGE), _LARGEST_CHANGE))
        # Below the slowest rate the trial stress determines the flow.
        better = better if moving else min(slowest, bound)
        largest = max(b[TRIAL + k], 0.0) / stiffness
        b[INCREMENT + k] = min(better, largest) if plastic else 0.0
    return far


@njit(**FAST, **INNER)
def _try(b, count, step):  # type: ignore[no-untyped-def]
    """Compute the trial deviator (Jaumann rate), its equivalent stress, and mean stress."""
    time_step = step.time_step
    two_g = 2.0 * step.shear_modulus * time_step
    for k in range(count):
        cxx, cxy, cyx, cyy = b[CXX + k], b[CXY + k], b[CYX + k], b[CYY + k]
        xx, yy, xy = b[DXX + k], b[DYY + k], b[DXY + k]
        spin = (cxy - cyx) * time_step
        third = (cxx + cyy) * (1.0 / 3.0)
        shear = xy + 0.5 * spin * (yy - xx) + 0.5 * two_g * (cxy + cyx)
        dxx = xx + spin * xy + two_g * (cxx - third)
        dyy = yy - spin * xy + two_g * (cyy - third)
        b[DXX + k], b[DYY + k], b[DXY + k] = dxx, dyy, shear
        square = dxx * dxx + dyy * dyy + dxx * dyy + shear * shear
        b[TRIAL + k] = b[SOFT + k] * np.sqrt(3.0 * square)
        # Till here the rows hold the fraction of the bulk modulus and the last step's free volume.
        bulk = step.bulk_modulus * b[TENSION + k]
        volume, free, before = b[VOLUME + k], b[FREE + k], b[EXPANSION + k]
        dilated = volume / free
        b[TENSION + k] = bulk * (dilated - 1.0)
        b[EXPANSION + k] = 0.5 * bulk * (free - before) * (1.0 - dilated * volume / before)
        b[WORK + k] = 0.0


@njit(**FAST, **INNER)
def _return(b, count, step, law, damage):  # type: ignore[no-untyped-def]
    """Bring the deviator back to the flow stress; strain, damage, and plastic work (J/m)."""
    per_step = 1.0 / step.time_step
    fails = 1.0 if damage.loss > 0.0 else 0.0
    for k in range(count):
        increment, trial, volume = b[INCREMENT + k], b[TRIAL + k], b[VOLUME + k]
        stress = trial - 3.0 * step.shear_modulus * b[SOFT + k] * increment
        some = max(stress, 1.0)
        scale = stress / max(trial, 1.0)
        scale = scale if increment > 0.0 else 1.0
        b[DXX + k] *= scale
        b[DYY + k] *= scale
        b[DXY + k] *= scale
        rate, mean = increment * per_step, b[TENSION + k]
        b[DAMAGE + k] += fails * damage_growth(
            b[DAMAGE + k], increment, rate, mean, some, b[TEMPERATURE + k], damage
        )
        b[STRAIN + k] += increment
        b[WORK + k] = stress * increment * volume
        b[TRIAL + k] = stress


# Inlined before it is compiled: its arithmetic follows the rules of the kernel that calls it.
@njit(inline="always")
def elastic_energy(p, shear, bulk, step):  # type: ignore[no-untyped-def]
    """Return the energy in J/m that a point's shear and dilation hold, sheared and pressed.

    `shear` and `bulk` are the moduli over those at room temperature.
    """
    square = p.dxx * p.dxx + p.dyy * p.dyy + p.dxx * p.dyy + p.dxy * p.dxy
    dilation = p.volume / p.free_volume - 1.0
    sheared = 0.5 * shear * square / step.shear_modulus * p.volume
    pressed = 0.5 * bulk * step.bulk_modulus * dilation * dilation * p.free_volume
    return sheared, pressed


@njit(**INLINE, **INNER)
def _moduli_loss(p, warm, elastic, step):  # type: ignore[no-untyped-def]
    """Return the elastic energy (J/m) that a point lost since its last step, as its moduli fell.

    The energy is computed from the strain before this step.
    """
    before = kelvin_index(p.elastic_temperature, elastic.shape[0])
    if before == warm:
        return 0.0
    shear = elastic[before, SHEAR] - elastic[warm, SHEAR]
    bulk = elastic[before, BULK] - elastic[warm, BULK]
    sheared, pressed = elastic_energy(p, shear, bulk, step)
    return sheared + pressed


@njit(**FAST, **INNER)
def update_stresses(  # type: ignore[no-untyped-def]
    points, begin, end, step, law, damage, elastic, capacity, heat_fractions, b
):
    """Update the stress of up to `LANES` points.

    Leaves their equivalent and mean stress, the soft fraction of the shear modulus, plastic work
    and that of expansion in `b`. `elastic` is `WorkpieceMaterial.elastic_ratios`.
    """
    count = end - begin
    for k in range(count):
        p = points[begin + k]
        b[CXX + k], b[CXY + k], b[CYX + k], b[CYY + k] = p.cxx, p.cxy, p.cyx, p.cyy
        b[DXX + k], b[DYY + k], b[DXY + k] = p.dxx, p.dyy, p.dxy
        b[STRAIN + k], b[DAMAGE + k], b[TEMPERATURE + k] = p.strain, p.damage, p.temperature
        b[INCREMENT + k], b[VOLUME + k], b[MEAN + k] = p.increment, p.volume, p.mean_rate
        warm = kelvin_index(p.temperature, elastic.shape[0])
        b[SOFT + k], b[TENSION + k] = elastic[warm, SHEAR], elastic[warm, BULK]
        b[FALL + k] = _moduli_loss(p, warm, elastic, step)
        p.elastic_temperature = p.temperature
        # A kelvin of expansion is some megapascals of pressure: rows alone would be too coarse.
        past = min(max(0.0, p.temperature - TABLE_COLDEST - warm), 1.0)
        free = elastic[warm, VOLUME_FREE] + past * elastic[warm, VOLUME_RISE]
        b[EXPANSION + k], b[FREE + k] = p.free_volume, step.volume * free
        p.free_volume = b[FREE + k]
    _try(b, count, step)
    plastic = plastic_increments(
        b, count, step.shear_modulus, step.time_step, step.viscosity, law, damage
    )
    if plastic:
        _return(b, count, step, law, damage)
    for k in range(count):
        p = points[begin + k]
        p.dxx, p.dyy, p.dxy = b[DXX + k], b[DYY + k], b[DXY + k]
        p.increment = 0.0
        if plastic:
            p.increment = b[INCREMENT + k]
            p.strain, p.damage = b[STRAIN + k], b[DAMAGE + k]
            work = b[WORK + k]
            if work > 0.0:
                heat = heat_fraction(p.increment / step.time_step, heat_fractions) * work
                p.temperature += heat / (step.heat_mass * property_at(capacity, p.temperature))


@njit
def heat_fraction(rate, fractions):  # type: ignore[no-untyped-def]
    """Return the fraction of the plastic work that becomes heat at a plastic strain rate in 1/s."""
    last = fractions.shape[1] - 1
    if rate <= fractions[0, 0]:
        return fractions[1, 0]
    for i in range(last):
        low, high = fractions[0, i], fractions[0, i + 1]
        if rate < high:
            way = np.log(rate / low) / np.log(high / low)
            return fractions[1, i] + way * (fractions[1, i + 1] - fractions[1, i])
    return fractions[1, last]


@njit
def property_at(table, temperature):  # type: ignore[no-untyped-def]
    """Return the value of a sampled `TemperatureTable`."""
    return table[kelvin_index(temperature, table.size)]


@njit(**INLINE, **INNER)
def kelvin_index(temperature, size):  # type: ignore[no-untyped-def]
    """Return the row of a temperature in a table of `size` rows, one for each kelvin from 200 K."""
    return min(max(int(temperature - TABLE_COLDEST), 0), size - 1)
