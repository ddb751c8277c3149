import re
import shlex
import subprocess
import sys
from json import dumps, loads
from pathlib import Path
from shutil import copy

import numpy as np
import pytest
import typer
import yaml
from analytic_chip import AnalyticChip, replace_cut
from command import chipglow, full_disk, refused
from undrawn import leave_undrawn

from chipglow.camera import Camera, Measurement
from chipglow.cli import app
from chipglow.cutting import CuttingSimulation, SolverError
from chipglow.io import atomic_folder, open_scene, read_measurement, write_scene
from chipglow.io.digest import is_intact
from chipglow.laboratory.emissivity import (
    Heating,
    RegionEmissivities,
    determine_emissivity,
    write_emissivity,
)
from chipglow.radiometry import Band
from chipglow.report import QUICK
from chipglow.scene import Area, Raster
from chipglow.study import Study, cut, load_study
from chipglow.surface import UniformSurface

ROOT = Path(__file__).parents[1]
RASTER = AnalyticChip().raster
STUDY = f"""
title: A chip in closed form
cutting: {dumps({"field_of_view": AnalyticChip().field_of_view, "numerics": {"cell": "25 um"}})}
analysis: {{exposures: 3, phases: 1, textures: 1, psf_widths: [8 um, 12 um]}}
correction: false
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, undrawn, monkeypatch):
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "cache"))
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    (work / "study.yaml").write_text(STUDY)
    return work


@pytest.fixture(scope="module")
def chip_scene():
    return AnalyticChip().scene()


@pytest.fixture
def runs(monkeypatch, chip_scene):
    return replace_cut(monkeypatch, chip_scene)


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory, chip_scene):
    path = tmp_path_factory.mktemp("scene") / "scene.nc"
    write_scene(chip_scene, path)
    return path


@pytest.fixture
def scene(folder, scene_file):
    return Path(copy(scene_file, folder))


@pytest.fixture(scope="module")
def finished(tmp_path_factory, chip_scene):
    """Folder and output of ``chipglow run`` with the study."""
    work = tmp_path_factory.mktemp("run")
    (work / "study.yaml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHIPGLOW_CACHE", str(work.parent / "run-cache"))
        patch.chdir(work)
        leave_undrawn(patch)
        replace_cut(patch, chip_scene)
        return work, chipglow("run", "study.yaml", "--out", "results")


def test_the_version_is_shown():
    result = chipglow("--version")
    assert re.fullmatch(r"chipglow \d+\.\d+\.\d+\n", result.output)


@pytest.mark.parametrize(("command", "own"), [((), set()), (("rake",), {"pydantic"})])
def test_help_imports_none_of_the_heavy_libraries(command, own):
    """Typer itself imports pydantic for the options of a command."""
    code = (
        "import sys, chipglow\n"
        "before = set(sys.modules)\n"
        "from typer.testing import CliRunner\n"
        "from chipglow.cli import app\n"
        f"result = CliRunner().invoke(app, [*{command}, '--help'])\n"
        "assert '--json' in result.output, result.output\n"
        "print(*{name.split('.')[0] for name in set(sys.modules) - before})\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numba", "scipy", "xarray", "h5py", "matplotlib", "pandas", "pint", "pydantic"}
    assert not (heavy - own) & set(done.stdout.split())


def test_init_writes_the_papers_study_and_keeps_what_is_there(folder):
    chipglow("init", "paper.yaml")
    assert load_study("paper.yaml") == Study()
    chipglow("init", "paper.json", "--schema")
    assert loads((folder / "paper.json").read_text())["title"] == "Study"
    refused(("init", "study.yaml"), "study.yaml", "already exists", "--force")
    assert (folder / "study.yaml").read_text() == STUDY
    chipglow("init", "study.yaml", "--force")
    assert load_study("study.yaml") == Study()


def test_run_writes_a_report_and_prints_the_comparison(finished):
    work, result = finished
    assert "results/report.html" in result.output
    headings = ("quantity", "the paper", "this study", "single frame (95 %)", "differs")
    assert all(text in result.output for text in (*headings, "−42", "90"))
    assert "Warning: The edge radius, 20 um, is 0.8 cells, expected 1 or more" in result.stderr
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    last = result.stdout.splitlines()[-1]
    year, version = citation["date-released"].year, citation["version"]
    assert last.startswith(f"Cite as: The chipglow developers ({year}): chipglow {version}, ")
    paper = citation["references"][0]
    assert f"({paper['year']}): {paper['title']}. {paper['collection-title']}." in last
    names = {path.name for path in (work / "results").iterdir()}
    written = "report.html summary.json summary.schema.json results.nc study.yaml figures"
    assert names >= set(written.split())
    assert load_study(work / "results" / "study.yaml") == load_study(work / "study.yaml")
    assert sorted(path.name for path in work.iterdir()) == ["results", "study.yaml"]


@pytest.fixture
def earlier_results(folder, runs):
    """Results of an earlier run, of which the cache holds the scene."""
    cut(load_study("study.yaml"))
    with atomic_folder("results") as results:
        for name in ("summary.json", "report.html", "old.txt"):
            (results / name).write_text("earlier")
    return folder / "results"


def test_a_damaged_scene_in_the_cache_is_computed_again(folder, runs):
    path = cut(load_study("study.yaml"))
    whole = path.read_bytes()
    path.write_bytes(whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:])
    result = chipglow("cut", "study.yaml", "--out", "scene.nc")
    assert "cached scene of this cut is damaged; it is computed again" in " ".join(
        result.stderr.split()
    )
    assert len(runs) == 2
    assert open_scene("scene.nc").frame(1).temperature.shape == AnalyticChip().raster.shape
    assert is_intact(path)


def test_reproduce_runs_the_papers_study(folder, monkeypatch):
    seen = []

    def note(study, out, force, resume, agreed, remarks=()):
        seen.append((study, str(out), force, resume, agreed, list(remarks)))

    monkeypatch.setattr("chipglow.cli.results.write_results", note)
    chipglow("reproduce", "--steady-tool")
    chipglow("reproduce", "--quick", "--out", "quick", "--resume", "--yes")
    assert seen == [
        (Study().with_steady_tool(), "chipglow-paper", False, False, False, []),
        (Study.quick(), "quick", False, True, True, [QUICK]),
    ]
    # The paper's values stand beside those of any tool's temperature.
    assert seen[0][0].is_papers


COMMANDS = typer.main.get_command(app).commands
FIGURE = ".png, .pdf or .svg"
ENDINGS = {
    ("rake", "--out"): ".csv or .nc",
    ("shearband", "--out"): ".csv or .nc",
    ("psf", "--out"): ".nc",
    ("wavelengths", "--out"): ".csv",
    ("budget", "--out"): ".csv",
    ("design", "--out"): ".csv",
    ("band", "--out"): ".csv",
    ("register", "--out"): ".yaml or .yml",
    ("register", "--pairs"): ".csv",
    ("register", "--blink"): ".gif",
    ("cut", "--preview"): ".mp4 or .gif",
}
FILES = [
    (name, option.opts[0])
    for name, command in COMMANDS.items()
    for option in command.params
    if option.opts[0]
    in ("--out", "--plot", "--overlay", "--table", "--pairs", "--blink", "--preview")
    and option.metavar == "FILE"
]
QUANTITIES = [
    (name, option.opts[0])
    for name, command in COMMANDS.items()
    for option in command.params
    if option.metavar in ("TEMPERATURE", "KELVINS", "LENGTH", "TIME", "SPEED")
]


def required(name):
    """Values of everything that a command requires, of files that do not exist."""
    for parameter in COMMANDS[name].params:
        if parameter.required:
            option = parameter.opts[0]
            yield from ((option,) if option.startswith("--") else ())
            values = {"TEMPERATURE": "300 K", "KELVINS": "300 K", "LENGTH": "20 um"}
            yield values.get(parameter.metavar, "none.nc")


@pytest.mark.parametrize(("command", "option"), FILES)
def test_a_file_that_cannot_be_written_is_refused_before_anything_is_read(command, option):
    ending = FIGURE if option in ("--plot", "--overlay") else ENDINGS.get((command, option))
    if ending:
        message = f"{option}: a.txt, expected a file that ends in {ending}"
        refused((command, option, "a.txt"), message)
    name = f"no/a{(ending or '.nc').split()[0].strip(',').upper()}"
    refused((command, *required(command), option, name), "there is no folder no")


@pytest.mark.parametrize(("command", "option"), QUANTITIES)
def test_a_quantity_without_a_unit_is_refused(command, option):
    refused((command, *required(command), option, "3"), f"{option}: 3 has no unit")


def test_a_bad_study_is_refused_and_writes_nothing(folder, runs):
    (folder / "study.yaml").write_text("cutting: {feed: -0.3 mm}")
    refused(
        ("run", "study.yaml", "--out", "results"),
        "study.yaml: cutting.feed: -0.3 mm must be more than 0, expected a length",
    )
    refused(("run", "no.yaml", "--out", "results"), "no.yaml: No such file")
    assert [path.name for path in folder.iterdir()] == ["study.yaml"]


def test_cut_writes_the_scene_and_keeps_it_in_the_cache(folder, runs, tmp_path):
    result = chipglow("cut", "study.yaml", "--out", "scene.nc")
    assert len(open_scene(folder / "scene.nc").times) == AnalyticChip().frames
    assert result.stdout == "scene.nc\n"
    # The chip in closed form has no kinetic energy; the momentum flux is 0.45 % of √3 σ times feed.
    assert (
        "Scaled mass after the build-up: kinetic energy at most 0.00% of the work" in result.stderr
    )
    assert "momentum flux 0.83% of the mean cutting force" in result.stderr
    # The paper's edge and the length of the viscosity, 20 um, are smaller than the cell.
    assert result.stderr.count("Warning") == 2
    assert "Warning: The edge radius, 20 um, is 0.8 cells, expected 1 or more" in result.stderr
    listed = chipglow("cache", "list").output
    assert re.search(r"\d MB  scene-[0-9a-f]{32}\.nc", listed)
    assert re.search(r"1 scene, \d+\.\d MB in ", listed)
    with full_disk(50_000):
        refused(("cut", "study.yaml", "--out", "second.nc"), "chipglow: second.nc: File too large")
    assert len(runs) == 1
    assert sorted(path.name for path in folder.iterdir()) == ["scene.nc", "study.yaml"]
    assert re.search(r"\d MB freed", chipglow("cache", "clear").output)
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_scene_that_is_too_short_for_the_study_is_named(folder, scene):
    (folder / "study.yaml").write_text(
        "scene: scene.nc\ncamera: {integration_time: 1 ms, frame_rate: 600 Hz}\n"
    )
    refused(("run", "study.yaml", "--out", "results"), "scene.nc", "lasts 40 us", "1000 us")
    assert not (folder / "results").exists()


def test_measure_writes_frames_at_the_camera_rate(folder, scene):
    (folder / "study.yaml").write_text("camera: {frame_rate: 60 kHz}")
    result = chipglow("measure", "scene.nc", "--study", "study.yaml", "--out", "m.nc")
    measurement = read_measurement("m.nc")
    # In s: far below an exposure.
    np.testing.assert_allclose(measurement.times, [0.0, 1 / 60e3], atol=1e-12)
    assert measurement.data.attrs["surface"] == "chip 1"
    # The analytic chip goes on beyond the view, bands and all.
    assert " ".join(result.output.split()).count("Warning: The border of the scene: ") == 1


def test_measure_lays_a_measured_emissivity_map_on_the_scene(folder, scene, chip_scene):
    band, raster = Band(3.8e-6, 5.1e-6), Raster(RASTER.left, RASTER.top, 6e-6, 56, 70)
    fraction = np.where(raster.x < -100e-6, 0.3, 0.8) * np.ones((56, 1))
    image = Measurement.from_radiance(
        (fraction * band.radiance(800.0))[None], band, np.zeros(1), raster
    )
    found = determine_emissivity([image], Heating(800.0, reflected=200.0))
    everywhere = Area("all", "chip", np.ones(raster.shape, bool), whole=True)
    write_emissivity(RegionEmissivities((found,), ((found.of(everywhere),),)), "e.nc")
    study = (
        "surface: {maps: {seen: e.nc}}\nanalysis: {band_chip: seen}\n"
        "camera: {psf: none, lower_limit: none}"
    )
    (folder / "study.yaml").write_text(study)
    arguments = ("measure", "scene.nc", "--study", "study.yaml", "--out", "m.nc")
    refused((*arguments, "--chip", "gone"), "expected one of chip 1, chip 2, seen")
    chipglow(*arguments, "--chip", "seen")
    measured = read_measurement("m.nc")
    truth = Camera(psf=None, lower_limit=None).measure(chip_scene, UniformSurface(1.0), 0.0)
    solid = truth.radiance[0] > 0
    ratio = np.divide(measured.radiance[0], truth.radiance[0], out=np.zeros((56, 70)), where=solid)
    # The environment at 200 K adds nothing that counts; the map's edge is one pixel wide.
    np.testing.assert_allclose(ratio[solid & (raster.x < -106e-6)], 0.3, atol=2e-3)
    np.testing.assert_allclose(ratio[solid & (raster.x > -94e-6)], 0.8, atol=2e-3)
    (folder / "study.yaml").write_text(study.replace("seen: e.nc", "chip 1: e.nc"))
    refused(arguments, "surface: maps: 'chip 1' is the name of another chip too")


def test_measure_starts_when_told_with_the_chip_that_is_named(folder, scene):
    arguments = ("measure", "scene.nc", "--study", "study.yaml", "--out", "m.nc")
    for option, value, message in (
        ("--start", "35 us", "scene.nc: exposure: 35 us to"),
        ("--chip", "chip 3", "--chip: 'chip 3' is unknown, expected one of chip 1, chip 2"),
    ):
        refused((*arguments, option, value), message)
    assert sorted(path.name for path in folder.iterdir()) == ["scene.nc", "study.yaml"]
    chipglow(*arguments, "--start", "20 us", "--chip", "chip 2")
    measurement = read_measurement("m.nc")
    np.testing.assert_allclose(measurement.times, [20e-6])
    assert measurement.data.attrs["surface"] == "chip 2"


@pytest.mark.parametrize("command", ["cut", "run"])
def test_a_disk_that_fills_up_during_the_cut_leaves_nothing(command, folder, runs, tmp_path):
    with full_disk(100_000):
        refused((command, "study.yaml", "--out", "out"), "cache/scene-", "File too large")
    assert [path.name for path in folder.iterdir()] == ["study.yaml"]
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_disk_that_fills_up_during_the_report_keeps_the_earlier_results(folder, earlier_results):
    with full_disk(20_000):
        refused(("run", "study.yaml", "--out", "results"), "chipglow: results: File too large")
    assert (earlier_results / "report.html").read_text() == "earlier"
    assert len(list(earlier_results.iterdir())) == 4
    assert sorted(path.name for path in folder.iterdir()) == ["results", "study.yaml"]


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "interrupted, nothing was written"),
        (SolverError("cutting simulation: a point left the grid at 3 us"), 1, "left the grid"),
        (OSError(28, "No space left on device"), 2, "No space left on device"),
    ],
)
def test_what_stops_a_run_is_one_line_and_an_exit_code(error, code, message, folder, monkeypatch):
    def stop(*_):
        raise error

    monkeypatch.setattr(CuttingSimulation, "run", stop)
    refused(("run", "study.yaml", "--out", "results"), message, code=code)
    assert [path.name for path in folder.iterdir()] == ["study.yaml"]


def test_a_run_that_is_ended_from_outside_leaves_nothing(folder, tmp_path):
    code = (
        "import sys, time\n"
        "from chipglow.cli import main\n"
        "from chipglow.cutting import CuttingSimulation\n"
        "def run(*_):\n"
        "    print('cutting', flush=True)\n"
        "    time.sleep(60)\n"
        "CuttingSimulation.run = run\n"
        "sys.argv = ['chipglow', 'run', 'study.yaml', '--out', 'results']\n"
        "main()\n"
    )
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], text=True, **pipes) as process:
        assert process.stdout.readline() == "cutting\n"
        process.terminate()
        _, errors = process.communicate()
    assert process.returncode == 130
    assert "chipglow: interrupted, nothing was written" in errors
    assert [path.name for path in folder.iterdir()] == ["study.yaml"]
    assert list((tmp_path / "cache").iterdir()) == []


COMMANDS = typer.main.get_command(app).commands
EXAMPLES = {
    name: one.epilog.removeprefix(f"Example: chipglow {name}")
    for name, one in COMMANDS.items()
    if name != "cache"
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_help_of_a_command_ends_with_an_example_that_is_understood(name, tmp_path, monkeypatch):
    command, arguments = COMMANDS[name], shlex.split(EXAMPLES[name])
    assert command.epilog.startswith(f"Example: chipglow {name} ")
    monkeypatch.chdir(tmp_path)
    for word in arguments:
        if Path(word).suffix and not Path(word).exists() and "=" not in word:
            Path(word).touch()
    try:
        command.make_context(name, arguments)
    except typer.BadParameter as error:
        pytest.fail(error.format_message())
    except ValueError as error:  # an empty file, but not a wrong option
        assert "option" not in str(error)
