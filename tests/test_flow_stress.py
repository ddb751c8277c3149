"""Flow-stress laws, one's own among them, damage with a fracture energy, and their arithmetic."""

import os
import subprocess
import sys
from dataclasses import dataclass, replace
from math import exp
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
import pytest
import yaml
from hypothesis import given, strategies as st
from numba import njit
from solver import STEEL as AISI_1045_JC
from tolerances import DOUBLE

from chipglow.cutting import (
    AISI_1045,
    FLOW_LAWS,
    FlowStress,
    HyperbolicTangent,
    JohnsonCook,
    MarusichOrtiz,
    ZerilliArmstrong,
)
from chipglow.cutting.damage import BAND_CELLS, Damage, damage_growth, weakening
from chipglow.cutting.flow_stress import stress_and_slopes
from chipglow.cutting.lanes import exponential, logarithm
from chipglow.quantities import Parameter
from chipglow.quantities.units import STRESS

STEEL = AISI_1045_JC.flow_stress
TITANIUM = HyperbolicTangent(
    724.7e6, 683.1e6, 0.47, 0.035, 1.0, 1878.0, 298.0, 1.0, hardening_limit=2.0,
    recovery_temperature=5.0, recovery_strain=2.0, softening_temperature=1.0, sharpness=0.05,
)  # fmt: skip
CUBIC = ZerilliArmstrong(150e6, 1500e6, 0.006, 0.0002, 700e6, 0.2, 1.0, 2e3)


@njit
def slopes(strain, rate, temperature, law):
    return stress_and_slopes(strain, rate, temperature, law)


def test_a_name_is_taken_but_by_the_same_class(own_laws):
    # Not even by another class that is called the same.
    with pytest.raises(ValueError, match="flow_law: 'johnson-cook' is not a new kind"):
        FLOW_LAWS.part(type("JohnsonCook", (FlowStress,), {"kind": "johnson-cook"}))
    assert FLOW_LAWS.find("johnson-cook") is JohnsonCook

    def define(factor):
        @FLOW_LAWS.part
        @dataclass(frozen=True)
        class Constant(FlowStress):
            kind: ClassVar[str] = "constant"
            value: Annotated[float, Parameter("Of the stress.", STRESS)]

            @staticmethod
            def stress(strain, rate, temperature, law):
                return factor * law.value

        return Constant(1e9)

    # Again and again, as a notebook's cell is run: the last one counts, though all look alike.
    assert [define(factor).at(0.1, 1.0, 300.0) for factor in (1.0, 2.0)] == [1e9, 2e9]


def test_a_law_with_another_stress_has_its_own_slopes():
    """A law that derives from one with slopes of its own: not those of its parent."""

    class Doubled(JohnsonCook):
        @staticmethod
        def stress(strain, rate, temperature, law):
            return 2e9 * strain

    law = Doubled(*STEEL.numbers())
    stress, by_strain, by_rate = slopes(0.25, 1e4, 500.0, law.numbers())
    assert stress == law.at(0.25, 1e4, 500.0) == 0.5e9
    # A difference over a millionth of the strain: rounding of 1e-16 over 1e-6.
    assert by_strain == pytest.approx(2e9, rel=1e-9)
    assert by_rate == 0.0


def test_a_law_of_another_package_is_found_by_its_entry_point(tmp_path):
    """In a process of its own: a package with a law and a material that names it."""
    recipes = Path(__file__).parents[1] / "examples" / "recipes"
    (tmp_path / "voce.py").write_bytes((recipes / "voce.py").read_bytes())
    material = yaml.safe_load((recipes / "my-steel.yaml").read_text(encoding="utf-8"))
    numbers = {
        "yield_stress": "400 MPa", "saturation_stress": "900 MPa", "hardening_strain": 0.2,
        "rate_exponent": 0.02, "reference_rate": "1 1/s", "melting_temperature": "1700 K",
    }  # fmt: skip
    material["flow_stress"] = {"mine": {"law": "voce", "source": "made up", **numbers}}
    (tmp_path / "steel.yaml").write_text(yaml.safe_dump(material), encoding="utf-8")
    (tmp_path / "steels.py").write_text(
        "from pathlib import Path\nMINE = Path(__file__).with_name('steel.yaml')\n"
    )
    metadata = tmp_path / "mine-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(
        "[chipglow.flow_law]\nvoce = voce:Voce\n[chipglow.material]\nmy-steel = steels:MINE\n"
    )
    program = (
        "from chipglow.cutting import material_names, workpiece\n"
        "law = workpiece('my-steel').flow_stress\n"
        "print(type(law).__module__, 'my-steel' in material_names('workpiece'))\n"
        "print(float(law.at(0.1, 1e4, 600.0)))"
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        env={**os.environ, "PYTHONPATH": path},
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    module, stress = done.stdout.splitlines()
    assert module == "voce True"
    by_hand = (900e6 - 500e6 * exp(-0.5)) * 1e4**0.02 * (1 - 600 / 1700)
    assert float(stress) == pytest.approx(by_hand, rel=DOUBLE)


def test_tanh_by_hand():
    law = HyperbolicTangent(
        1000e6, 500e6, 0.5, 0.01, 1.0, 2000.0, 300.0, 1.0, hardening_limit=2.0,
        recovery_temperature=2.0, recovery_strain=3.0, softening_temperature=0.5, sharpness=2.0,
    )  # fmt: skip
    # At strain 0.64, 1e4 /s, 1000 K: (1000 + 500 x 0.8 / exp 0.4096 = 1265.566) MPa x (1 + 0.01 x
    # 9.21034 = 1.0921034) x (1 - 700/1700 = 0.5882353); D = 1 - sqrt 0.5 = 0.2928932, S = 1/4,
    # tanh(1/0.89^3) = 0.8892860, squared 0.7908296, D + (1 - D) x 0.7908296 = 0.8520942.
    assert law.at(0.64, 1e4, 1000.0) == pytest.approx(692.767e6, rel=2e-6)


@given(
    strain=st.floats(1e-3, 5.0),
    rate=st.floats(1.1, 1e8),
    temperature=st.floats(250.0, 1700.0),
    law=st.sampled_from([STEEL, TITANIUM, CUBIC]),
)
def test_slopes_are_those_of_the_stress(strain, rate, temperature, law):
    """Central differences, over a tenth of a thousandth of strain and rate."""
    step = 1e-4
    numbers = law.numbers()
    stress, by_strain, by_rate = slopes(strain, rate, temperature, numbers)
    strains, rates = (value * np.array([1 - step, 1 + step]) for value in (strain, rate))
    # Fused operations may differ where the compiler inlines: some units in the last place.
    assert stress == pytest.approx(law.at(strain, rate, temperature), rel=1e-14)
    # Truncation is of the order of the square of the step, one-sided differences 1e-6 of the
    # stress, rounding 1e-16/1e-6 of it.
    near = {"rel": 1e-5, "abs": 2e-6 * stress}
    central = np.diff(law.at(strains, rate, temperature))[0] / (2 * step)
    assert by_strain * strain == pytest.approx(central, **near)
    central = np.diff(law.at(strain, rates, temperature))[0] / (2 * step)
    assert by_rate == pytest.approx(central, **near)


def test_marusich_ortiz_by_hand():
    law = MarusichOrtiz(400e6, 0.01, 1e3, 300.0, 5.0, 20.0, 1e-3)
    # 400 MPa × (1 − 0.001 × 400) × (1 + 0.31/0.01)^(1/5) × (1 + 1e6/1e3)^(1/20)
    # = 240 MPa × 2 × 1.412608
    assert law.at(0.31, 1e6, 700.0) == pytest.approx(678.052e6, rel=1e-5)
    # 1 % is left from 1290 K on; the line itself would end at 1300 K.
    assert law.at(0.31, 1e6, 1500.0) == pytest.approx(678.052e6 / 60, rel=1e-5)
    assert law.melting_temperature == 1300.0
    assert replace(law, thermal_softening=0.0).melting_temperature == 3000.0
    with pytest.raises(ValueError, match=r"MarusichOrtiz\.rate_exponent: -1, expected more than 0"):
        replace(law, rate_exponent=-1)


def test_zerilli_armstrong_by_hand():
    law = ZerilliArmstrong(100e6, 1000e6, 0.005, 2e-4, 700e6, 0.5)
    # 100 + 1000 exp(-0.005 x 500 + 2e-4 x 500 x ln 1e4) + 700 x sqrt 0.25
    # = 100 + 1000 exp(-2.5 + 0.921034) + 350 = 450 + 206.188 MPa
    assert law.at(0.25, 1e4, 500.0) == pytest.approx(656.188e6, rel=1e-6)
    # Hot and slow what is left is 100 + 350 MPa, and exp(-15) of 1000 MPa.
    assert law.at(0.25, 1.0, 3000.0) == pytest.approx(450.000306e6, rel=1e-8)
    # A drag of 2 kPa s in shear adds 3 x 2e3 x 1e4 Pa.
    assert replace(law, drag=2e3).at(0.25, 1e4, 500.0) == pytest.approx(716.188e6, rel=1e-6)


def test_the_rate_does_not_matter_below_the_reference():
    stress, _, by_rate = slopes(0.1, 0.5, 500.0, STEEL.numbers())
    assert by_rate == 0.0
    assert stress == pytest.approx(STEEL.at(0.1, 1.0, 500.0), rel=DOUBLE)


@given(st.floats(2.3e-308, 1.7e308))
def test_logarithm(x):
    exact = np.log(x)
    # The logarithm of numbers near 1 is near zero: there the absolute part counts.
    assert abs(logarithm(x) - exact) <= 4e-15 + 2 * np.spacing(abs(exact))


@given(st.floats(-699.9, 699.9))
def test_exponential(x):
    # A polynomial: about 20 roundings of 1.1e-16.
    assert exponential(x) == pytest.approx(np.exp(x), rel=2e-15)


@pytest.mark.parametrize("cell", [5e-6, 40e-6])
@pytest.mark.parametrize("loss", [0.5, 0.999])
def test_softening_takes_the_fracture_energy_whatever_the_cell(cell, loss):
    """A layer of two cells at a constant undamaged stress, from failure to full softening."""
    energy, undamaged = 15e3, 1e9
    assert AISI_1045.damage is not None
    layer = BAND_CELLS * cell
    law = Damage.of(replace(AISI_1045.damage, fracture_energy=energy, loss=loss), layer)
    slip = 2 * energy / undamaged
    increment = slip / layer / 4000
    damage, taken, steps = 1.0, 0.0, 0
    while damage < 2.0:
        stress = undamaged * weakening(damage, law)
        taken += stress * increment * layer
        damage += damage_growth(damage, increment, 1e5, 0.0, stress, 900.0, law)
        steps += 1
    # All the strength takes G, as Hillerborg has it; the end is reached after a slip of 2G/stress.
    # One step in 4000 too many is the error.
    assert taken == pytest.approx((2 - loss) * energy, rel=1e-3)
    # One step too many, by rounding.
    assert steps == pytest.approx(4000, abs=1)
    assert weakening(damage, law) == pytest.approx(1 - loss, rel=DOUBLE)


def test_nothing_softens_before_the_strain_to_failure():
    harm = AISI_1045.damage
    law = Damage.of(harm, 10e-6)
    # At room temperature, the reference rate and no mean stress the strain to failure is D1 + D2.
    assert harm is not None
    half = damage_growth(0.0, (harm.d1 + harm.d2) / 2, 1.0, 0.0, 1e9, 293.0, law)
    assert half == pytest.approx(0.5, rel=DOUBLE)
    assert weakening(half, law) == weakening(1.0, law) == 1.0
    assert weakening(1.5, law) == pytest.approx(1 - harm.loss / 2, rel=DOUBLE)
