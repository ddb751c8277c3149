"""Plastic flow and friction without a gradient: adiabatic shear, a block on the rake face."""

from dataclasses import replace
from math import sqrt

import numpy as np
from scipy.integrate import solve_ivp
from solver import DENSITY, ELASTIC, UNBROKEN, Block

from cases import Case, Check
from cases.motion import convergence
from chipglow.drawing.scales import BLUE, GREEN, VERMILLION
from chipglow.scene import ToolGeometry

RATE = 1e5
SHEAR = 1.0
SIDE = 80e-6


def perfectly_plastic(yield_stress):
    """AISI 1045 with a flow stress (Pa) that nothing changes, and no heat."""
    law = replace(
        UNBROKEN.flow_stress, yield_stress=yield_stress, hardening=0.0, rate_sensitivity=0.0
    )
    return replace(UNBROKEN, flow_stress=law, taylor_quinney=0.0)


def johnson_cook(law, strain, rate, temperature):
    """Flow stress in Pa: the formula, apart from the solver's kernels."""
    heat = (temperature - law.reference_temperature) / (
        law.melting_temperature - law.reference_temperature
    )
    hard = law.yield_stress + law.hardening * strain**law.hardening_exponent
    fast = 1 + law.rate_sensitivity * np.log(rate / law.reference_rate)
    return hard * fast * (1 - heat**law.thermal_exponent)


def integrated_shear():
    """Total equivalent strain, plastic strain, temperature (K) and shear stress (Pa).

    The temperature rises as dT/dε = 0.9 σ(ε, ε̇, T) / (ρ c(T)); the elastic strain is σ/(3G).
    """
    rate, law = RATE / sqrt(3), UNBROKEN.flow_stress

    def heating(strain, state):
        capacity = DENSITY * UNBROKEN.heat_capacity.at(state[0])
        stress = johnson_cook(law, strain, rate, state[0])
        return [UNBROKEN.taylor_quinney * stress / capacity]

    plastic = np.linspace(0.0, SHEAR / sqrt(3), 2001)
    temperature = solve_ivp(heating, plastic[[0, -1]], [293.0], t_eval=plastic, rtol=1e-9).y[0]
    stress = johnson_cook(law, plastic, rate, temperature)
    elastic = stress / (3 * UNBROKEN.shear_modulus_at(temperature))
    return plastic + elastic, plastic, temperature, stress / sqrt(3)


def sheared_block(step_strain, samples=50):
    """Shear strain, and plastic strain, temperature (K) and shear stress (Pa) of its middle."""
    # So heavy that nothing slows it: the shear stays as it was set.
    block = Block((60e-6, 60e-6), material=UNBROKEN, mass=1e9, time_step=step_strain / RATE)
    block.set_velocity(lambda x, y: RATE * y + 0 * x, lambda x, y: 0 * x * y)
    stride = round(SHEAR / step_strain / samples)
    rows = []
    for _ in range(samples):
        block.advance(stride)
        p = block.points
        middle = np.abs(p["material_y"] - 30e-6) < 10e-6
        middle &= np.abs(p["material_x"] - 30e-6) < 10e-6
        fields = (p["strain"], p["temperature"], block.deviator()[2])
        rows.append([each[middle].mean() for each in fields])
    return np.linspace(SHEAR / samples, SHEAR, samples), *np.array(rows).T


def adiabatic_shear(steps=(4e-3, 2e-3, 1e-3)):
    total, plastic, temperature, stress = integrated_shear()
    results = [sheared_block(step) for step in steps]
    expected = [float(np.interp(SHEAR / sqrt(3), total, value)) for value in (plastic, temperature)]
    errors = [abs(result[2][-1] - expected[1]) for result in results]
    # Kernels take the heat capacity of the whole kelvin below: half a kelvin low on average.
    capacity = UNBROKEN.heat_capacity.at([expected[1] - 0.5, expected[1]])
    lower_limit = (expected[1] - 293.0) * (1 - capacity[0] / capacity[1])

    def draw(figure):
        left, middle, right = figure.subplots(1, 3)
        shear, _, hot, dxy = results[-1]
        for axes, values, exact in ((left, dxy / 1e6, stress / 1e6), (middle, hot, temperature)):
            axes.plot(shear, values, ".", color=BLUE, label="solver")
            axes.plot(total * sqrt(3), exact, "k--", linewidth=0.9, label="integral")
            axes.set_xlabel("shear")
        left.set(ylabel="shear stress / MPa", ylim=(0, None))
        left.legend()
        middle.set_ylabel("temperature / K")
        right.axhline(lower_limit, color=GREEN, linewidth=0.9, label="whole kelvins")
        looks = {"unit": 1e-3, "order": 1, "size": "shear in a step / 10⁻³"}
        convergence(right, steps, [errors], "error of the temperature / K", **looks)

    rise = (expected[1] - 293.0, float(results[-1][2][-1]) - 293.0)
    checks = (
        Check("plastic strain at a shear of 1", "ordinary differential equation", expected[0],
              float(results[-1][1][-1]), 1e-3, "1000 steps, first order in the step"),
        Check("temperature rise at a shear of 1", "ordinary differential equation", *rise, 5e-3,
              "1000 steps, first order in the step; heat capacity from a table of whole kelvins",
              unit="K"),
    )  # fmt: skip
    return Case("shear", "Adiabatic shear", checks, draw)


def pressed_block(coefficient, material=ELASTIC):
    """Normal and tangential force in N/m of a block that slides up an upright face."""
    # The rake face turned upright, where the block meets it squarely, far above the edge.
    upright = ToolGeometry(rake_angle=0.0)
    tool = upright.surface._replace(x=SIDE + upright.edge_radius, y=-1.0)
    block = Block((SIDE, SIDE), material=material, tool=tool, friction=coefficient)
    block.set_velocity(lambda x, y: 1.0 + 0 * x * y, lambda x, y: 4.0 + 0 * x * y)
    block.advance(9)
    block.advance(1)
    return -block.force


def friction(coefficients=(0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)):
    soft = perfectly_plastic(30e6)
    limit = 30e6 / sqrt(3) * SIDE
    hard_forces = np.array([pressed_block(value) for value in coefficients])
    soft_forces = np.array([pressed_block(value, soft) for value in coefficients])
    largest = soft_forces[-1, 1]
    ratios = hard_forces[:, 1] / hard_forces[:, 0]

    def draw(figure):
        axes = figure.subplots()
        fine = np.linspace(0, 1, 200)
        for forces, colour, name in (
            (hard_forces, BLUE, "elastic"),
            (soft_forces, VERMILLION, "flow stress 30 MPa"),
        ):
            axes.plot(coefficients, forces[:, 1] / 1e3, "o", color=colour, label=name)
            least = np.minimum(fine * forces[0, 0], limit if forces is soft_forces else np.inf)
            axes.plot(fine, least / 1e3, "--", color="black", linewidth=0.9)
        axes.plot([], "--", color="black", linewidth=0.9, label="min(μ F, area · σ/√3)")
        axes.set(xlabel="coefficient of friction μ", ylabel="tangential force / (N/mm)")
        axes.legend()

    checks = (
        Check("tangential over normal force, less μ: largest of 9", "Coulomb", 0.0,
              float(np.abs(ratios - coefficients).max()), 1e-9,
              "rounding: the impulses are μ times the normal ones, point by point", absolute=True),
        Check("tangential force at μ = 1, flow stress 30 MPa", "area · σ/√3", limit / 1e3,
              largest / 1e3, 1e-9, "rounding: every point of the face is at the limit",
              unit="N/mm"),
    )  # fmt: skip
    return Case("friction", "A block on the rake face", checks, draw)
