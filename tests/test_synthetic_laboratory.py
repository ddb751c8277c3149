"""Proof without a laboratory: the procedures find what is hidden, as often as they say.

A hundred repeats: `python benchmarks/synthetic_laboratory.py`.
"""

import csv
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest
import synthetic_laboratory
import yaml
from command import typed
from synthetic_laboratory import QUANTITIES, Evaluation, Laboratory, hits, kept, main

from chipglow.camera import MeasuredPSF

REPEATS = 7
TYPED = "--set flat_field.low=cold.hcc --set flat_field.high=hot.hcc --set bad_pixels=find"
DEVELOPED = f"{TYPED} --set calibration=calibration.yaml --set 'pitch=6 um'"
STACKED = f"{DEVELOPED} --set unit=counts --set 'interval=2 ms' --set saturation=4094"


@pytest.fixture(scope="module")
def results(shared_folder):
    """Folder with the program's results of `REPEATS` laboratories, and its table."""
    return shared_folder("laboratories", repeat_all)


def repeat_all(folder):
    with redirect_stdout(StringIO()) as printed:
        main(["--repeats", str(REPEATS), "--results", str(folder)])
    (folder / "table.txt").write_text(printed.getvalue(), encoding="utf-8")


@pytest.fixture(scope="module")
def rows(results):
    return [kept(seed, results) for seed in range(REPEATS)]


@pytest.fixture
def experiment(tmp_path, monkeypatch):
    """A folder with the files of a laboratory, and the laboratory."""
    laboratory = Laboratory(1)
    laboratory.perform(tmp_path)
    monkeypatch.chdir(tmp_path)
    return laboratory


@pytest.mark.slow
@pytest.mark.parametrize("name", QUANTITIES)
def test_the_truth_is_in_the_stated_interval(rows, name):
    """Of seven 95 % intervals, two or fewer miss with a probability of 0.996."""
    assert hits(rows, name) >= REPEATS - 2


@pytest.mark.slow
def test_the_program_prints_its_table(results, rows):
    printed = (results / "table.txt").read_text(encoding="utf-8").splitlines()
    for name, line in zip(QUANTITIES, printed[2:], strict=True):
        assert line.startswith(name)
        assert f"{hits(rows, name)} of {REPEATS}" in line


@pytest.mark.slow
def test_all_truths_together_are_in_their_intervals(rows):
    """Of 42, 40 are expected; of intervals half as wide 36 would with a probability of 0.006.

    The emissivities and the temperature share a thermocouple, and the width and the MTF an image.
    If three results always miss together the number varies by 2.4: 36 are 1.6 times as much less.
    """
    assert sum(hits(rows, name) for name in QUANTITIES) >= 36


@pytest.mark.slow
def test_the_intervals_are_narrow(rows):
    """Intervals that are much too wide would hold the truth as well.

    A thermocouple's 2 K are 1.5 % of the radiance at 390 degC and so of the emissivity; 1.5 % of
    the radiance at 500 degC are 2.7 K. For 95 % these are doubled; the rest adds little.
    """
    for row in rows:
        for name in ("emissivity of the body", "emissivity of the shear band"):
            reference, _, expanded = row[name]
            assert expanded < 0.05 * reference
        assert row["PSF, full width"][2] < 0.01 * row["PSF, full width"][0]
        assert row["blackbody"][2] < 2.0
        assert row["temperature of the shear band"][2] < 12.0


@pytest.mark.slow
def test_a_thermocouple_far_off_is_found_out(experiment, tmp_path):
    """The intervals do not hold just anything: ten standard uncertainties of it are too much."""
    notes = yaml.safe_load((tmp_path / "notes.yaml").read_text())
    notes["thermocouple_degC"] += 10 * synthetic_laboratory.THERMOCOUPLE
    (tmp_path / "notes.yaml").write_text(yaml.safe_dump(notes))
    found, reference = Evaluation(tmp_path).results(), experiment.reference()
    for name in ("emissivity of the body", "emissivity of the shear band"):
        assert found[name].value + found[name].expanded < reference[name]
    name = "temperature of the shear band"
    assert found[name].value - found[name].expanded > reference[name]
    # What has nothing to do with the thermocouple is as right as ever.
    assert abs(found["blackbody"].value - reference["blackbody"]) < found["blackbody"].expanded


def test_the_same_seed_makes_the_same_files(tmp_path):
    files = []
    for folder, seed in (("one", 0), ("again", 0), ("other", 1)):
        (tmp_path / folder).mkdir()
        Laboratory(seed).perform(tmp_path / folder)
        files.append({path.name: path.read_bytes() for path in (tmp_path / folder).iterdir()})
    assert files[0] == files[1]
    assert {"edge-1.tif", "chip-1.npy", "heated-1.hcc", "points.csv"} <= files[0].keys()
    assert files[0]["cold.hcc"] != files[2]["cold.hcc"]


@pytest.mark.slow
def test_the_commands_find_the_same_as_the_functions(experiment, tmp_path):
    """What a user types on the same files: the numbers are those of `Evaluation`."""
    typed(
        "calibrate points.csv --band '3.8-5.1 um' --common-uncertainty '0.4 K' "
        f"--integration-time '10 us' {TYPED} --out calibration.yaml"
    )
    heated = [f"heated-{number}" for number in (1, 2, 3, 4)]
    for name in heated:
        typed(f"convert {name}.hcc {DEVELOPED} --out {name}.nc")
    reading = yaml.safe_load((tmp_path / "notes.yaml").read_text())["thermocouple_degC"]
    spread = "--reference-uncertainty '2 K' --reflected-uncertainty '2 K'"
    files = "--regions regions.yaml --out emissivity.nc --table emissivity.csv"
    images = " ".join(f"{name}.nc" for name in heated)
    typed(f"emissivity {images} --reference {reading}degC {spread} {files}")
    chips = " ".join(f"chip-{number}.npy" for number in (1, 2, 3, 4))
    known = "--regions regions.yaml --emissivity emissivity.nc --calibration calibration.yaml"
    typed(f"temperature {chips} {known} {STACKED} --table temperature.csv")
    typed(f"psf edge-1.npy edge-2.npy {STACKED} --out psf.nc")
    found = Evaluation(tmp_path).results()
    emissivity = {row["region"]: row for row in read("emissivity.csv")}
    temperature = {row["region"]: row for row in read("temperature.csv")}
    for region in ("body", "shear band"):
        expected = found[f"emissivity of the {region}"]
        # Nine digits of the table.
        assert float(emissivity[region]["mean"]) == pytest.approx(expected.value, rel=1e-8)
        stated = float(emissivity[region]["expanded_uncertainty"])
        assert stated == pytest.approx(expected.expanded, rel=2e-8)  # likewise
    hot = temperature["shear band"]
    expected = found["temperature of the shear band"]
    # Nine digits of 800 K: 5e-7 K.
    assert float(hot["true_temperature_K"]) == pytest.approx(expected.value, abs=5e-6)
    # The file keeps degrees of freedom of both chances together, not of each.
    assert float(hot["expanded_uncertainty_K"]) == pytest.approx(expected.expanded, rel=0.01)
    kernel = MeasuredPSF.from_file("psf.nc")
    # Samples of the kernel: 0.4 % measured.
    assert kernel.fwhm == pytest.approx(found["PSF, full width"].value, rel=0.01)


def read(name):
    with Path(name).open(newline="") as file:
        return list(csv.DictReader(file))
