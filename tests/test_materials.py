import json
from dataclasses import asdict, replace

import numpy as np
import pytest
import yaml
from command import chipglow
from tolerances import DOUBLE

from chipglow.cutting import (
    AISI_1045,
    FittedDamage,
    HyperbolicTangent,
    JohnsonCook,
    MaterialError,
    RateTable,
    material_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.cutting.damage import Damage, strain_to_failure
from chipglow.cutting.library import FOLDER, read_material
from chipglow.study import Study, load_study
from chipglow.study.running import scene_inputs

NO_SOURCE = "  source: an assumption, the usual one for metals; not measured for this steel\n"
RATES = "[[1 1/s, 0.6], [1000 1/s, 0.9]]"
SETS = [
    f"{name}/{chosen}"
    for name in material_names("workpiece")
    for chosen in material_file(name).workpieces
]


@pytest.mark.parametrize(
    ("name", "strain", "rate", "temperature", "by_hand"),
    [
        # 1153.9 MPa × (1 + 0.0134 × 9.21034) × (1 − (1013 − 293) / 1440), half way to melting
        ("aisi-1045/jaspers-dautzenberg", 1.0, 1e4, 1013.0, 648.156e6),
        # 1220 MPa × (1 + 0.059 × 6.90776); ε = 1 leaves A + B, T₀ leaves the thermal factor 1
        ("al-7075-t6/brar", 1.0, 1e3, 293.0, 1717.22e6),
        # 1281.1 MPa × (1 + 0.028 × ln 1e9 = 20.7233) × (1 − (1085.5 − 298) / 1575)
        ("ti-6al-4v/lee-lin", 1.0, 1e4, 1085.5, 1012.23e6),
    ],
)
def test_flow_stress_by_hand(name, strain, rate, temperature, by_hand):
    law = workpiece(name).flow_stress
    # Six digits of the hand calculation.
    assert law.at(strain, rate, temperature) == pytest.approx(by_hand, rel=1e-5)


@pytest.mark.parametrize("name", SETS)
def test_workpieces_are_physical(name):
    material = workpiece(name)
    law = material.flow_stress
    assert 2000 < material.density_at(293.15) < 10000
    # Solid metals expand by 8 millionths a kelvin to, hot aluminium, 33 millionths.
    growth = -np.diff(np.log(material.density_at(np.arange(294.0, 1800.0)))) / 3
    assert (growth >= 0).all() and (growth < 33e-6).all()
    assert growth[:80].mean() > 8e-6
    assert 100e6 < law.at(1e-6, 1.0, 293.0) < 2e9
    if isinstance(law, JohnsonCook):
        assert 850 < law.melting_temperature < 2000
        assert 250 <= law.reference_temperature < 310
    hot = np.linspace(300.0, min(material.melting_temperature, 2000.0), 50)
    shear, bulk = material.shear_modulus_at(hot), material.bulk_modulus_at(hot)
    # G of aluminium and steel; K of all is one and a half to four times their G, more when hot.
    assert np.all((shear > 20e9) & (shear < 90e9))
    assert np.all((bulk / shear > 1.5) & (bulk / shear < 4))
    assert np.all(np.diff(shear) <= 0) and np.all(np.diff(bulk) <= 0)
    assert np.all((material.conductivity.at(hot) > 5) & (material.conductivity.at(hot) < 200))
    assert np.all((material.heat_capacity.at(hot) > 400) & (material.heat_capacity.at(hot) < 1200))
    damage = Damage.of(material.damage, 10e-6)
    for triaxiality in (-5.0, -1.5, 0.0, 1.5, 5.0):
        for temperature in (293.0, hot[-1]):
            assert strain_to_failure(triaxiality, 1e5, temperature, damage) > 0


@pytest.mark.parametrize("name", material_names("tool"))
def test_tools_are_physical(name):
    tool = tool_material(name)
    assert 3000 < tool.density < 16000
    assert 10 < tool.conductivity < 130
    assert 200 < tool.heat_capacity < 1000


@pytest.mark.parametrize("name", material_names())
def test_every_number_has_unit_and_source(name):
    file = material_file(name)
    assert file.properties and file.name and file.description
    assert all(len(number.source) > 10 for number in file.properties)
    assert (file.tool is None) == bool(file.workpieces)


def test_the_rooms_data_are_files_of_the_package():
    assert len(list(FOLDER.rglob("*.yaml"))) == len(material_names()) == 8


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cheese", "'cheese' is unknown, expected one of aisi-1045, aisi-4140"),
        ("aisi-1045/cheese", "aisi-1045: 'cheese' is not a set, expected one of segmented"),
        ("aisi-1045/", "aisi-1045: '' is not a set"),
        ("carbide", "carbide: kind: 'tool', expected workpiece"),
        ("../materials/aisi-1045", "'..' is unknown"),
    ],
)
def test_unknown_names(name, message):
    with pytest.raises(MaterialError) as raised:
        workpiece(name)
    assert message in str(raised.value)


def _write(path, old, new, steel="aisi-4140"):
    text = (FOLDER / "workpieces" / f"{steel}.yaml").read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("212 GPa", "212", "young_modulus: 212 has no unit, expected a stress such as 553.1 MPa"),
        ("value: 0.3\n", "value: 0.6\n", "poisson_ratio: 0.6, expected 0 to 0.49"),
        (
            "value: 0.3\n",
            "value: [[20 degC, 0.3], [100 degC, 0.6]]\n",
            "poisson_ratio: 0.6, expected 0 to 0.49",
        ),
        ("[400 degC, 184 GPa]", "[400 degC]", "young_modulus: ['400 degC'], expected [temperature"),
        ("[400 degC, 184 GPa]", "[100 degC, 184 GPa]", "young_modulus: temperature table: temp"),
        (NO_SOURCE, "", "taylor_quinney.source: is missing, expected text"),
        ("    hardening: 580 MPa\n", "", "flow_stress.pantale.hardening: is missing"),
        ("d3: -2.12", "d3: steep", "damage.d3: 'steep', expected a number"),
        ("d2: 3.44", "d2: -3.44", "damage: d1 + d2 exp(d3 triaxiality) falls to"),
        ("[200 degC, 42.3", "[200, 42.3", "conductivity: 200 has no unit, expected a temperature"),
        ("  loss: 0.5\n", "  loss: 0.5\n  loss: 0.8\n", "duplicate key 'loss'"),
        ("value: 0.9\n", f"value: {RATES}\n".replace("1/s", "K"), "'1 K' is not a strain rate"),
        (
            "value: 0.9\n",
            f"value: {RATES}\n".replace("1000", "0.1"),
            "rates must be positive and ascend",
        ),
        (
            "  pantale:\n",
            "  pantale:\n    law: cheese\n",
            "law: 'cheese', expected one of johnson-cook",
        ),
        ("  pantale:\n", "  pantale:\n    law: tanh\n", "pantale.hardening_limit: is missing"),
        ("  pantale:\n", "  pantale:\n    damage: mine\n", "pantale.damage: 'mine', must be none"),
        ("kind: workpiece", "kind: !!python/object:os.system x", "expected YAML"),
        ("numbers: [d1,", "numbers: [onset,", "fitted_damage: numbers: 'onset', expected one of"),
        ("numbers: [d1, d2,", "numbers: [d1,", "relative_covariance: expected 4 rows of 4 numbers"),
        ("numbers: [d1,", "numbers: [1,", "fitted_damage.numbers.0: 1, expected text"),
    ],
)
def test_faults_name_file_field_value_and_expectation(tmp_path, old, new, message):
    steel = "aisi-1045" if old.startswith("numbers") else "aisi-4140"
    path = _write(tmp_path / "steel.yaml", old, new, steel)
    with pytest.raises(MaterialError) as raised:
        read_material(path)
    assert str(raised.value).startswith("steel.yaml: ")
    assert message in str(raised.value)


def test_a_set_names_its_law_and_whether_it_fails(tmp_path):
    data = yaml.safe_load((FOLDER / "workpieces" / "aisi-4140.yaml").read_text(encoding="utf-8"))
    softening = {
        "law": "tanh", "damage": "none", "hardening_limit": 1.1, "recovery_temperature": 0.4,
        "recovery_strain": 12, "softening_temperature": 1, "sharpness": 0.05,
    }  # fmt: skip
    data["flow_stress"]["mine"] = data["flow_stress"]["pantale"] | softening
    (tmp_path / "steel.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    sets = read_material(tmp_path / "steel.yaml").workpieces
    published, mine = sets["pantale"].flow_stress, sets["mine"].flow_stress
    assert isinstance(published, JohnsonCook) and sets["pantale"].damage is not None
    data["damage"] = "none"
    (tmp_path / "firm.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    file = read_material(tmp_path / "firm.yaml")
    assert file.workpieces["pantale"].damage is None
    assert not [number for number in file.properties if number.field.startswith("damage")]
    assert sets["mine"].damage is None
    assert mine == HyperbolicTangent(
        **asdict(published), hardening_limit=1.1, recovery_temperature=0.4, recovery_strain=12.0,
        softening_temperature=1.0, sharpness=0.05,
    )  # fmt: skip


def test_elastic_constants_over_the_temperature(tmp_path):
    path = tmp_path / "steel.yaml"
    rows = "value: [[300 K, 0.3], [500 K, 0.35]]\n"
    moving = workpiece(str(_write(path, "value: 0.3\n", rows)))
    # Half way in both tables: E = (199 + 184) / 2 GPa at 300 degC, nu held at 0.35 from 500 K on.
    assert moving.shear_modulus_at(573.15) == pytest.approx(191.5e9 / 2.7, rel=DOUBLE)
    assert moving.bulk_modulus_at(573.15) == pytest.approx(191.5e9 / 0.9, rel=DOUBLE)
    ratios = moving.elastic_ratios()
    assert ratios.shape == (2801, 4)
    cold = [moving.shear_modulus_at(293.15), moving.bulk_modulus_at(293.15)]
    hot = [moving.shear_modulus_at(700.0), moving.bulk_modulus_at(700.0)]
    assert ratios[500, :2] == pytest.approx(np.divide(hot, cold), rel=DOUBLE)
    # K is largest where Poisson's ratio has risen and E has not yet fallen much.
    kelvins = np.arange(200.0, 3001.0)
    stiffness = moving.bulk_modulus_at(kelvins) + 4 / 3 * moving.shear_modulus_at(kelvins)
    assert stiffness.argmax() == 300
    # Sound is fastest a little above, where the material is lighter.
    squares = stiffness / moving.density_at(kelvins)
    assert squares.argmax() >= 300 and squares.max() < 1.01 * squares[300]
    assert moving.sound_speed() ** 2 == pytest.approx(squares.max(), rel=DOUBLE)
    still = replace(moving, young_modulus=2e11, poisson_ratio=0.3, density=7850.0)
    assert still.elastic_ratios().tolist() == [[1.0, 1.0, 1.0, 0.0]]


def test_limits_hold_for_every_value_of_a_table():
    table = replace(AISI_1045.conductivity, values=(-1.0,) * len(AISI_1045.conductivity.values))
    with pytest.raises(ValueError, match=r"Material\.conductivity: -1 W/m/K, expected more than 0"):
        replace(AISI_1045, conductivity=table)
    with pytest.raises(ValueError, match=r"Material\.taylor_quinney: 1\.5, expected 0 to 1"):
        replace(AISI_1045, taylor_quinney=RateTable((1.0, 2.0), (0.5, 1.5)))


def test_heat_fraction_over_the_strain_rate(tmp_path):
    path = _write(tmp_path / "steel.yaml", "value: 0.9\n", f"value: {RATES}\n")
    file = read_material(path)
    assert workpiece(str(path)).taylor_quinney == RateTable((1.0, 1000.0), (0.6, 0.9))
    listed = [number.text for number in file.properties if number.field == "taylor_quinney"]
    assert listed == ["0.6 at 1 1/s", "0.9 at 1000 1/s"]
    assert "0.9 at 1000 1/s" in chipglow("materials", path).output
    study = Study(**{"cutting": {"workpiece": str(path)}})
    assert "0.6" in json.dumps(scene_inputs(study)["workpiece"]["taylor_quinney"])


def test_a_study_takes_a_file_beside_it(tmp_path):
    _write(tmp_path / "steel.yaml", "212 GPa", "200 GPa")
    for name in ("steel.yaml", "steel.yaml/pantale"):
        (tmp_path / "study.yaml").write_text(f"cutting: {{workpiece: {name}}}")
        cutting = load_study(tmp_path / "study.yaml").cutting
        assert cutting.simulation().workpiece.young_modulus.values[0] == 200e9


def test_the_cache_knows_a_materials_numbers(tmp_path):
    path = _write(tmp_path / "steel.yaml", "212 GPa", "200 GPa")
    study = Study(**{"cutting": {"workpiece": str(path)}})
    before = json.dumps(scene_inputs(study))
    path.write_text(path.read_text(encoding="utf-8").replace("name: AISI", "name: my"))
    assert json.dumps(scene_inputs(study)) == before
    _write(path, "212 GPa", "201 GPa")
    assert json.dumps(scene_inputs(study)) != before


def test_the_cache_tells_laws_of_the_same_numbers_apart(monkeypatch):
    class Mine(JohnsonCook):
        """Another law with the fields of Johnson and Cook's."""

    study = Study(**{"cutting": {"workpiece": "aisi-1045/jaspers-dautzenberg"}})
    simulation = study.cutting.simulation()
    before = scene_inputs(study)
    mine = Mine(**asdict(simulation.workpiece.flow_stress))
    simulation = replace(simulation, workpiece=replace(simulation.workpiece, flow_stress=mine))
    monkeypatch.setattr(type(study.cutting), "simulation", lambda self: simulation)
    assert json.dumps(scene_inputs(study)) != json.dumps(before)


def test_a_study_chooses_a_set():
    study = Study(**{"cutting": {"workpiece": "aisi-1045/ozel"}})
    ozel = study.cutting.simulation().workpiece
    assert isinstance(ozel.flow_stress, JohnsonCook)
    assert ozel.flow_stress.yield_stress == 451.6e6
    assert replace(ozel, name="", flow_stress=AISI_1045.flow_stress) == replace(AISI_1045, name="")


def test_command_lists_and_shows():
    listed = chipglow("materials").output
    assert all(name in listed for name in material_names())
    shown = chipglow("materials", "aisi-1045", COLUMNS="120")
    for text in ("flow_stress.ozel.hardening", "553.1 MPa", "27.32 W/(m K) at 900 degC", "Oxley"):
        assert text in shown.output


def test_command_draws(tmp_path):
    path = tmp_path / "steel.png"
    result = chipglow("materials", "al-7075-t6", "--plot", path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert result.output.count(str(path)) == 1
    for wrong in (("carbide", "--plot", path), ("cheese",), ("--plot", path)):
        chipglow("materials", *wrong, code=2)


NAMES = ("d1", "d2", "loss", "fracture_energy")
COVARIANCE = (
    (0.04, 0.04, 0.01, 0.0),
    (0.04, 0.04, 0.01, 0.0),
    (0.01, 0.01, 0.09, -0.06),
    (0.0, 0.0, -0.06, 0.25),
)


def test_draws_of_fitted_damage_have_its_covariance_and_follow_from_the_seed():
    fitted = FittedDamage(NAMES, COVARIANCE)
    small = replace(AISI_1045.damage, loss=0.01)  # far from the largest loss
    draws = [fitted.draw(small, np.random.default_rng(seed)) for seed in range(4000)]
    logs = np.log([[getattr(one, name) for name in NAMES] for one in draws])
    centre = np.log([getattr(small, name) for name in NAMES])
    # Standard error of a variance of 4000 draws: 2.2 %; of the means 0.008.
    assert np.cov(logs.T) == pytest.approx(np.array(COVARIANCE), abs=0.02)
    # Four standard errors.
    assert logs.mean(axis=0) == pytest.approx(centre, abs=0.03)
    assert np.ptp(logs[:, 0] - logs[:, 1]) < 1e-6  # d1 and d2 go together
    assert fitted.draw(small, np.random.default_rng(7)) == draws[7]


def test_a_drawn_steel_differs_in_its_damage_only():
    drawn = AISI_1045.drawn(np.random.default_rng(1))
    assert drawn.damage != AISI_1045.damage
    assert replace(drawn, damage=AISI_1045.damage) == AISI_1045
    assert drawn.damage.d4 == AISI_1045.damage.d4


def test_a_material_whose_damage_was_not_fitted_is_not_drawn():
    with pytest.raises(ValueError, match="was not fitted"):
        workpiece("al-7075-t6").drawn(np.random.default_rng(1))


def test_factors_scale_the_material_and_the_cut_in_the_cache():
    plain = Study().cutting
    factors = {"conductivity": 1.1, "hardening": 0.9, "density": 1.0}
    scaled = replace(plain, workpiece_factors=factors)
    one, other = plain.material(), scaled.material()
    np.testing.assert_allclose(
        other.conductivity.at([300.0, 900.0]), 1.1 * one.conductivity.at([300.0, 900.0])
    )
    assert other.flow_stress.hardening == 0.9 * one.flow_stress.hardening
    assert other.damage == one.damage
    inputs = [scene_inputs(Study(cutting=part)) for part in (plain, scaled)]
    assert inputs[0] != inputs[1]
    assert inputs[0] == scene_inputs(
        Study(cutting=replace(plain, workpiece_factors={"density": 1.0}))
    )


def test_an_unknown_factor_is_refused():
    with pytest.raises(ValueError, match=r"workpiece_factors: 'colour', expected one of .*density"):
        Study(cutting={"workpiece_factors": {"colour": 2.0}})
