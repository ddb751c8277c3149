"""The recipe of a flow law: stress and slopes by hand, and a material file that names it."""

from math import exp
from pathlib import Path

import pytest
import yaml
from numba import njit
from voce import Voce

from chipglow.cutting import MaterialError, workpiece
from chipglow.cutting.flow_stress import stress_and_slopes

STEEL = Path(__file__).with_name("my-steel.yaml")
LAW = Voce(400e6, 900e6, 0.2, 0.02, 1.0, 1700.0)
SET = {
    "law": "voce", "yield_stress": "400 MPa", "saturation_stress": "0.9 GPa",
    "hardening_strain": 0.2, "rate_exponent": 0.02, "reference_rate": "1 1/s",
    "melting_temperature": "1700 K", "source": "made up for this example",
}  # fmt: skip


@njit
def slopes(strain, rate, temperature, law):
    return stress_and_slopes(strain, rate, temperature, law)


def written(folder, **changed):
    data = yaml.safe_load(STEEL.read_text(encoding="utf-8"))
    data["flow_stress"] = {"voce": SET | changed}
    (folder / "steel.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    return str(folder / "steel.yaml")


def test_the_stress_and_the_slopes_that_the_solver_takes_are_those_by_hand():
    fast_and_soft = 1e4**0.02 * (1 - 600 / 1700)
    expected = (900e6 - 500e6 * exp(-0.5)) * fast_and_soft
    stress, by_strain, by_log_rate = slopes(0.1, 1e4, 600.0, LAW.numbers())
    assert stress == pytest.approx(expected, rel=1e-12)
    # One-sided differences over 1e-6 of strain and rate.
    assert by_strain == pytest.approx(500e6 / 0.2 * exp(-0.5) * fast_and_soft, rel=1e-5)
    assert by_log_rate == pytest.approx(0.02 * expected, rel=1e-5)


def test_a_materials_file_names_it(tmp_path):
    assert workpiece(written(tmp_path)).flow_stress == LAW


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("hardening_strain", -1, "hardening_strain: -1, expected more than 0"),
        ("yield_stress", 400, "yield_stress: 400 has no unit, expected a stress such as"),
        ("yield_stress", "1 GPa", "saturation_stress: is under the yield_stress"),
    ],
)
def test_a_wrong_number_is_one_line_with_its_limits(tmp_path, field, value, message):
    with pytest.raises(MaterialError, match=r"steel\.yaml: flow_stress\.voce.*" + message):
        workpiece(written(tmp_path, **{field: value}))
