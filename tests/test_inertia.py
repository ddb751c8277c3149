"""Kinetic energy and momentum of the scaled mass: what is found, and when a warning is due."""

from dataclasses import replace

import numpy as np
import pytest
from analytic_chip import AnalyticChip
from tolerances import DOUBLE

from chipglow.chip import Inertia, inertia
from chipglow.cli.progress import say_of_cut
from chipglow.cli.screen import begin
from chipglow.cutting import AISI_1045, CuttingConditions, CuttingSimulation, Numerics
from chipglow.scene import ENERGY_UNITS, Scene
from chipglow.scene.scene import FORCE_UNITS

CHIP = AnalyticChip(frames=3)


def scene_with(momentum_flow=None, **energies):
    """The analytic chip's scene with an energy balance."""
    data = CHIP.scene().data
    time = data["force_time"].values
    for name in ENERGY_UNITS:
        values = energies.get(name, np.zeros(time.size))
        data = data.assign({name: ("force_time", values, {"units": "J/m"})})
    if momentum_flow is not None:
        data = data.assign_attrs(momentum_flow=momentum_flow, mass_scaling=100.0)
    return Scene(data)


def test_kinetic_fraction_is_the_greatest_after_the_build_up():
    time = CHIP.forces()[0]
    work = 1e3 * time / time[-1] + 1e-9
    kinetic = -0.002 * work
    kinetic[3] = 500.0  # the shock of the entry
    kinetic[time.size // 2] = 0.007 * work[time.size // 2]
    found = inertia(scene_with(drive_work=work, kinetic_energy=kinetic))
    assert found.kinetic_fraction == pytest.approx(0.007, rel=DOUBLE)
    assert np.isnan(found.force_fraction)


def test_force_fraction_is_momentum_over_mean_force():
    found = inertia(scene_with(4.5e3, drive_work=np.linspace(1.0, 2.0, CHIP.forces()[0].size)))
    # The chip's force is 450 N/mm but for the rise, noise and a swing of 30 N/mm over some periods.
    assert found.force_fraction == pytest.approx(0.01, rel=0.02)
    assert found.mass_scaling == 100.0


def test_a_scene_without_forces_or_account():
    bare = CHIP.scene()
    assert inertia(Scene(bare.data.drop_vars(list(FORCE_UNITS)))) is None
    found = inertia(bare)
    assert np.isnan([found.kinetic_fraction, found.force_fraction, found.mass_scaling]).all()
    assert found.warning == ""


def test_before_the_tool_touches_nothing_is_known():
    nothing = np.zeros(CHIP.forces()[0].size)
    data = scene_with(1.0, drive_work=nothing).data
    found = inertia(Scene(data.assign(cutting_force=data["cutting_force"] * 0)))
    assert np.isnan([found.kinetic_fraction, found.force_fraction]).all()


@pytest.mark.parametrize("speed", [50.0, 100.0, 250.0, 400.0])
def test_the_mass_is_scaled_by_the_speed_to_half_a_per_cent_of_the_force(speed):
    simulation = CuttingSimulation(CuttingConditions(speed=speed / 60))
    # Measured at 200 m/min, this feed and -7 deg: 719 N/mm (reference/orthogonal-cutting.yaml).
    assert simulation.momentum_flow < 0.006 * 719e3
    slow = simulation.mass_scaling == 1000.0
    assert slow or simulation.momentum_flow > 0.004 * 719e3
    assert CuttingSimulation(numerics=Numerics(mass_scaling=37.0)).mass_scaling == 37.0


def test_momentum_flow_of_the_papers_cut():
    simulation = CuttingSimulation(CuttingConditions(), numerics=Numerics(mass_scaling=100.0))
    # 785 000 kg/m³ × (4.16667 m/s)² × 0.3 mm: 13.6 MPa on 0.3 mm.
    assert AISI_1045.density_at(293.15) == 7850.0
    # Half of the last digit.
    assert simulation.momentum_flow == pytest.approx(4088.5, abs=0.05)
    faster = replace(simulation, numerics=Numerics(mass_scaling=50.0))
    assert faster.momentum_flow == simulation.momentum_flow / 2


@pytest.mark.parametrize(
    ("kinetic", "force", "words"),
    [
        (0.0099, 0.0099, []),
        (0.0101, 0.005, ["kinetic energy reaches 1.0% of the work", "mass_scaling, now 100"]),
        (0.005, 0.05, ["momentum is worth 5.0% of the cutting force", "up to 1%"]),
        (0.02, 0.05, ["reaches 2.0% of the work and its momentum is worth 5.0%"]),
    ],
)
def test_a_warning_over_one_per_cent(kinetic, force, words, capsys):
    fraction = Inertia(kinetic, force, 100.0)
    assert bool(fraction.warning) == bool(words)
    begin()
    say_of_cut(fraction, ["The feed is 2 cells [small]."])
    said = capsys.readouterr().err
    assert f"kinetic energy at most {kinetic:.2%} of the work" in said
    assert f"momentum flux {force:.2%} of the mean cutting force" in said
    assert "Warning: The feed is 2 cells [small]." in said
    assert said.count("Warning") == 1 + bool(words)
    assert all(word in fraction.warning and word in said for word in words)
