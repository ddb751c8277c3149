"""Explicit finite elements for a bar that strikes a wall: a peer that shares no code.

Four-node quadrilaterals with 2 × 2 integration points, plane strain or axisymmetric; the pressure
is constant in an element (mean dilatation), the deviator comes from the logarithm of the elastic
left Cauchy-Green tensor, with radial return in it (Simo 1992). The material point solver has a
regular grid, no mesh, and integrates a rate of stress. The wall is y = 0, without friction.
"""

from collections import namedtuple
from math import exp, log, sqrt

import numpy as np
from numba import njit

COURANT = 0.5
U = np.array([-1.0, 1.0, 1.0, -1.0])
V = np.array([-1.0, -1.0, 1.0, 1.0])
AT_U, AT_V = U[:, None] / sqrt(3), V[:, None] / sqrt(3)
VALUE = (1 + AT_U * U) * (1 + AT_V * V) / 4
BY_U, BY_V = U * (1 + AT_V * V) / 4, V * (1 + AT_U * U) / 4
"""Shape functions at the integration points (points, nodes), and their derivatives."""


Steel = namedtuple(
    "Steel",
    "shear_modulus bulk_modulus density heat_capacity taylor_quinney yield_stress hardening "
    "hardening_exponent rate_sensitivity thermal_exponent melting_temperature "
    "reference_temperature",
)
"""Elastic constants (Pa), density, heat capacity, and Johnson and Cook's constants (SI)."""

Struck = namedtuple("Struck", "nodes strain temperature")
"""A bar after its impact: nodes (columns, rows, 2) in m; fields (elements, 4)."""


@njit(cache=True)
def flow_stress(strain, rate, temperature, s):
    heat = (temperature - s.reference_temperature) / (
        s.melting_temperature - s.reference_temperature
    )
    hard = s.yield_stress + s.hardening * strain**s.hardening_exponent
    fast = 1.0 + s.rate_sensitivity * log(max(rate, 1.0))
    return hard * fast * (1.0 - max(heat, 0.0) ** s.thermal_exponent)


@njit(cache=True)
def plastic_increment(trial, strain, temperature, step, s):
    """Root of trial − 3GΔ = flow stress: Newton's method between bounds."""
    if trial <= flow_stress(strain, 0.0, temperature, s):
        return 0.0
    stiffness = 3 * s.shear_modulus
    low, high = 0.0, trial / stiffness
    guess = max((trial - flow_stress(strain, 0.0, temperature, s)) / stiffness, 1e-15)
    for _ in range(60):
        law = flow_stress(strain + guess, guess / step, temperature, s)
        excess = trial - stiffness * guess - law
        if abs(excess) < 1e-9 * trial:
            break
        if excess > 0.0:
            low = guess
        else:
            high = guess
        hard = s.yield_stress + s.hardening * (strain + guess) ** s.hardening_exponent
        slope = (hard - s.yield_stress) * s.hardening_exponent / ((strain + guess) * hard)
        slope += s.rate_sensitivity / guess if guess > step else 0.0
        guess += excess / (stiffness + slope * law)
        if not low < guess < high:
            guess = 0.5 * (low + high)
    return guess


@njit(cache=True)
def gradients(x, k, axial, slopes):
    """Volume of an integration point; `slopes` (4, 3) becomes dN/dx, dN/dy and N/r."""
    xu = xv = yu = yv = radius = 0.0
    for a in range(4):
        xu += BY_U[k, a] * x[a, 0]
        xv += BY_V[k, a] * x[a, 0]
        yu += BY_U[k, a] * x[a, 1]
        yv += BY_V[k, a] * x[a, 1]
        radius += VALUE[k, a] * x[a, 0]
    jacobian = xu * yv - xv * yu
    for a in range(4):
        slopes[a, 0] = (BY_U[k, a] * yv - BY_V[k, a] * yu) / jacobian
        slopes[a, 1] = (BY_V[k, a] * xu - BY_U[k, a] * xv) / jacobian
        slopes[a, 2] = VALUE[k, a] / radius if axial else 0.0
    return jacobian * radius if axial else jacobian


@njit(cache=True)
def elastic_deviator(xx, yy, zz, xy):
    """Deviator of the logarithmic elastic strain (xx, yy, zz, xy) of b."""
    middle, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = sqrt(half * half + xy * xy)
    first, second = 0.5 * log(middle + radius), 0.5 * log(middle - radius)
    third = 0.5 * log(zz)
    mean = (first + second + third) / 3.0
    cosine, sine = (half / radius, xy / radius) if radius > 1e-14 else (1.0, 0.0)
    level, swing = 0.5 * (first + second) - mean, 0.5 * (first - second)
    return level + swing * cosine, level - swing * cosine, third - mean, swing * sine


@njit(cache=True)
def isochoric(xx, yy, zz, xy):
    """b with a deviatoric logarithmic elastic strain."""
    level, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    swing = sqrt(half * half + xy * xy)
    cosine, sine = (half / swing, xy / swing) if swing > 1e-14 else (1.0, 0.0)
    first, second = exp(2 * (level + swing)), exp(2 * (level - swing))
    mean, turn = 0.5 * (first + second), 0.5 * (first - second)
    return mean + turn * cosine, mean - turn * cosine, exp(2 * zz), turn * sine


@njit(cache=True)
def trial_strain(x, old, b, axial):
    """Deviator of the elastic strain after the nodes have come to x; `old` as of `gradients`."""
    fxx = fxy = fyx = fyy = fzz = 0.0
    for a in range(4):
        fxx += old[a, 0] * x[a, 0]
        fxy += old[a, 1] * x[a, 0]
        fyx += old[a, 0] * x[a, 1]
        fyy += old[a, 1] * x[a, 1]
        fzz += old[a, 2] * x[a, 0]
    stretch = fzz if axial else 1.0
    return elastic_deviator(
        fxx * fxx * b[0] + 2 * fxx * fxy * b[3] + fxy * fxy * b[1],
        fyx * fyx * b[0] + 2 * fyx * fyy * b[3] + fyy * fyy * b[1],
        stretch * stretch * b[2],
        fxx * fyx * b[0] + (fxx * fyy + fxy * fyx) * b[3] + fxy * fyy * b[1],
    )


@njit(cache=True)
def element_forces(
    forces, now, before, elements, elastic, strain, temperature, start, step, s, axial
):
    """Forces (nodes, 2) on the nodes, in N per m or rad; elastic, strain, temperature change."""
    forces[:] = 0.0
    x, y, slopes = np.empty((4, 2)), np.empty((4, 2)), np.empty((4, 3))
    for e in range(elements.shape[0]):
        for a in range(4):
            x[a], y[a] = now[elements[e, a]], before[elements[e, a]]
        volume = 0.0
        for k in range(4):
            volume += gradients(x, k, axial, slopes)
        pressure = s.bulk_modulus * (volume / start[e] - 1.0)
        for k in range(4):
            gradients(y, k, axial, slopes)
            b = elastic[e, k]
            xx, yy, zz, xy = trial_strain(x, slopes, b, axial)
            size = sqrt((xx * xx + yy * yy + zz * zz + 2 * xy * xy) * 2 / 3)
            trial = 3 * s.shear_modulus * size
            more = plastic_increment(trial, strain[e, k], temperature[e, k], step, s)
            if more > 0.0:
                left = 1.0 - more / size
                xx, yy, zz, xy = left * xx, left * yy, left * zz, left * xy
                work = more * trial * left
                strain[e, k] += more
                temperature[e, k] += s.taylor_quinney * work / (s.density * s.heat_capacity)
            b[0], b[1], b[2], b[3] = isochoric(xx, yy, zz, xy)
            part = gradients(x, k, axial, slopes)
            twice = 2 * s.shear_modulus
            sxx, syy, szz = twice * xx + pressure, twice * yy + pressure, twice * zz + pressure
            sxy = twice * xy
            for a in range(4):
                n = slopes[a]
                forces[elements[e, a], 0] -= part * (n[0] * sxx + n[1] * sxy + n[2] * szz)
                forces[elements[e, a], 1] -= part * (n[0] * sxy + n[1] * syy)


@njit(cache=True)
def shortest(nodes, elements):
    """Smallest area over longest side of an element."""
    least = 1e9
    for e in range(elements.shape[0]):
        x = nodes[elements[e]]
        side = 0.0
        for a in range(4):
            side = max(side, np.hypot(x[a, 0] - x[a - 1, 0], x[a, 1] - x[a - 1, 1]))
        p, q = x[2] - x[0], x[3] - x[1]
        least = min(least, 0.5 * abs(p[0] * q[1] - p[1] * q[0]) / side)
    return least


@njit(cache=True)
def strike(nodes, elements, masses, start, speed, duration, s, axial, held):
    """Let the bar fly against y = 0; nodes on x = 0 stay there."""
    count = elements.shape[0]
    elastic = np.zeros((count, 4, 4))
    elastic[:, :, :3] = 1.0
    strain = np.zeros((count, 4))
    temperature = np.full((count, 4), s.reference_temperature)
    axis = nodes[:, 0] == 0.0
    velocity, forces = np.zeros_like(nodes), np.zeros_like(nodes)
    velocity[:, 1] = -speed
    sound = sqrt((s.bulk_modulus + 4 / 3 * s.shear_modulus) / s.density)
    before, now, time, number = nodes.copy(), nodes.copy(), 0.0, 0
    step = last = COURANT * shortest(nodes, elements) / sound
    while time < duration:
        if number % 10 == 0:
            step = COURANT * shortest(now, elements) / sound
        element_forces(
            forces, now, before, elements, elastic, strain, temperature, start, last, s, axial
        )
        for i in range(now.shape[0]):
            velocity[i] += 0.5 * (step + last) * forces[i] / masses[i]
            if axis[i]:
                velocity[i, 0] = 0.0
            if held[i]:
                velocity[i, 1] = 0.0
            elif now[i, 1] + step * velocity[i, 1] < 0.0:
                velocity[i, 1] = -now[i, 1] / step
            before[i] = now[i]
            now[i] += step * velocity[i]
        last = step
        time += step
        number += 1
    return now, strain, temperature


def struck_bar(half_width, length, columns, rows, speed, duration, steel, axisymmetric, stays):
    """Strike a bar against a wall; half of it is meshed (its axis is x = 0)."""
    x, y = np.linspace(0, half_width, columns + 1), np.linspace(0, length, rows + 1)
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    corner = (np.arange(columns)[:, None] * (rows + 1) + np.arange(rows)).ravel()
    elements = np.stack([corner, corner + rows + 1, corner + rows + 2, corner + 1], axis=1)
    masses, start = np.zeros(len(nodes)), np.zeros(len(elements))
    for e, members in enumerate(elements):
        for k in range(4):
            volume = gradients(nodes[members], k, axisymmetric, np.empty((4, 3)))
            start[e] += volume
            masses[members] += steel.density * volume * VALUE[k]
    held = (nodes[:, 1] == 0.0) & stays
    now, strain, temperature = strike(
        nodes, elements, masses, start, speed, duration, steel, axisymmetric, held
    )
    return Struck(now.reshape(columns + 1, rows + 1, 2), strain, temperature)
