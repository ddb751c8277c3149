"""Every program of benchmarks/ on as little as its arguments allow: it prints its table."""

import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from math import isfinite
from pathlib import Path

import numba
import pytest
from analytic_chip import AnalyticChip

from chipglow.io import write_scene

FOLDER = Path(__file__).parents[1] / "benchmarks"
COARSEST = "40"  # um: eight cells in the depth of the computed region
STUDIES = {"reflections.py": ("chip.yaml", "scene: chip.nc")}
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?|\bnan\b|\binf\b")

# What each program is called with, and rows of its table with the numbers that each holds at least.
PROGRAMS = {
    "correction.py": (
        "--scenes 1 --cuts 0 --pixels 20 --processes 1 --rows rows.csv",
        {"rake face": 12, "band": 12, "outline found": 3},
    ),
    "peers/cuqipy_posterior.py": ("--samples 5", {"difference of means": 1, "smallest": 2}),
    "correction_speed.py": ("--sides 16 20", {"16 x 16": 11, "20 x 20": 11, "exponent": 5}),
    "correction_ranks.py": (
        "--simulations 3 --pixels 8",
        {"| middle of the chip": 4, "| rake face": 4},
    ),
    "app_latency.py": (
        "--turns 1 --controls Seed --frames 3 --boxes 1 --pause 0.1",
        {
            "Seed": 5,
            "all": 4,
            "opened, with the process": 2,
            "memory": 1,
            "recording of 3 frames": 7,
            "cursor, median": 6,
            "  empty page": 6,
            "mean on the image": 2,
            "row of the table": 2,
        },
    ),
    "region_latency.py": (
        "--rows 48 --columns 60 --repeats 1",
        {"point": 5, "box of 40 x 40": 7, "whole image": 5},
    ),
    "calibration.py": (
        "--repeats 2",
        {"| none |": 5, "| none, sakuma": 5, "| 15 counts": 6, "| 3 points": 6},
    ),
    "camera_pass.py": (
        "--rounds 1 --sub-frames 4",
        {
            **dict.fromkeys(("given: ", "in memory: ", "stored: "), 3),
            **dict.fromkeys(("new image: ", "image: ", "counts: "), 2),
        },
    ),
    "convergence.py": (f"{COARSEST} --length 1", {f"| {COARSEST} |": 10}),
    "dot_target.py": ("--count 1", {" 300 ": 6}),
    "experiments.py": (
        f"--cell {COARSEST} --length 0.6 paper",
        {"paper  cutting force": 1, "paper  thickness": 1, "paper  contact": 1, "paper  250": 7},
    ),
    "faults/faults.py": (
        "--cases 1",
        {**dict.fromkeys(("| killed |", "| full |", "| damaged |"), 5), "| all | 8 ": 5},
    ),
    "fuzz/fuzz.py": (
        "--cases 20 --only .npz .yaml .message",
        {**dict.fromkeys(("| grid.npz |", "| study.yaml |", "| 0.message |"), 7), "| all |": 6},
    ),
    "knife_edge.py": (
        "--repeats 1 diffraction Gaussian,",
        {"diffraction, noise 0.03": 3, "Gaussian, clipped at 90 %": 4, "| diffraction": 5},
    ),
    "movies.py": (
        "--pictures 1 --maps jet --codecs uncompressed GIF",
        {"| jet | uncompressed": 6, "| jet | none | no": 3, "| jet | 12 | yes": 4, "0 cases": 1},
    ),
    "optics.py": ("--samples 128", {"| clear |": 1, "| obscuration 0.35, aberrations": 2}),
    "rasterise.py": (
        "--file --coarse 40 --fine 60",
        {"| rasterise, 5 fields": 5, "| VTK's probe": 5, "read ": 2},
    ),
    "reflections.py": (
        "--draws 2 --angles 45 --study chip.yaml",
        {"45 ": 6, "as cut ": 8, "as warm as the chip": 8},
    ),
    "solver_speed.py": ("--rounds 1 --sides 40 --threads 1", {"chipglow ": 5}),
    "stability.py": ("--seeds 1", {"| normal | 9.9 ": 6, "| noise | 10 ": 6}),
    "sweeps.py": ("--tasks 4 --points 6 --kills 1", {"| 1 |": 4, "| 2 |": 4, "| 6 | ": 6}),
    "titanium.py": (
        f"--cell {COARSEST} 88.9-0.1",
        {"Ff / Fc at 88.9": 7, "thickness / feed at 88.9": 7, "88.9             0.1        0 ": 9},
    ),
    "trials.py": ("--trials 4", {"| whole image |": 2, "| rake face |": 2, "| both places |": 2}),
    "verification.py": ("momentum", {"| A free, spinning block": 4}),
}
NEEDED = {
    "correction.py": ("skimage",),
    "peers/cuqipy_posterior.py": ("cuqi",),
    "correction_speed.py": ("skimage",),
    "app_latency.py": ("panel", "playwright"),
    "region_latency.py": ("panel",),
    "fuzz/fuzz.py": ("hypothesis", "lasso", "panel", "pyvista", "tifffile", "zarr"),
    "movies.py": ("av",),
    "rasterise.py": ("pyvista",),
    "sweeps.py": ("distributed",),
}
# Programs that fork, spawn processes or drive a browser run in a process of their own.
OWN_PROCESS = ("app_latency.py", "faults/faults.py", "fuzz/fuzz.py", "sweeps.py")


@pytest.fixture
def run(tmp_path, monkeypatch, capsys, shared_folder):
    """Function that runs a program in an empty folder and returns its output; one cache for all."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CHIPGLOW_CACHE", str(shared_folder("benchmarks", lambda folder: None)))
    threads = numba.get_num_threads()
    numba.set_num_threads(1)  # threads that wait cost time

    def printed(program, *arguments):
        path = str(FOLDER / program)
        if program in OWN_PROCESS:
            command = [sys.executable, path, *arguments]
            alone = {**os.environ, "NUMBA_NUM_THREADS": "1"}
            done = subprocess.run(command, capture_output=True, encoding="utf-8", env=alone)
            assert done.returncode == 0, done.stderr
            return done.stdout
        monkeypatch.setattr(sys, "argv", [path, *arguments])
        try:
            runpy.run_path(path, run_name="__main__")
        except SystemExit as end:
            assert not end.code
        return capsys.readouterr().out

    yield printed
    numba.set_num_threads(threads)


def numbers(row):
    return [float(text.replace("−", "-")) for text in NUMBER.findall(row)]


def test_every_program_is_run():
    scripts = (path for path in FOLDER.rglob("*.py") if "__main__" in path.read_text("utf-8"))
    # These have tests of their own.
    names = {*PROGRAMS, "calibrate_cutting.py", "synthetic_laboratory.py"}
    names.add("empty_page.py")  # app_latency.py runs it
    assert {path.relative_to(FOLDER).as_posix() for path in scripts} == names


@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS)
def test_a_program_prints_its_table(program, run):
    for package in NEEDED.get(program, ()):
        pytest.importorskip(package)
    if program == "app_latency.py" and not (
        os.environ.get("CHIPGLOW_CHROMIUM") or shutil.which("chromium")
    ):
        pytest.skip("needs Chromium, which is not installed")
    if program in ("faults/faults.py", "fuzz/fuzz.py") and sys.platform != "linux":
        pytest.skip("limits its forks as Linux does")
    if program in STUDIES:
        name, text = STUDIES[program]
        Path(name).write_text(text, encoding="utf-8")
        write_scene(AnalyticChip().scene(), "chip.nc")
    arguments, rows_of = PROGRAMS[program]
    printed = run(program, *shlex.split(arguments))
    for label, count in rows_of.items():
        rows = [line for line in printed.splitlines() if line.startswith(label)]
        assert rows, f"no row {label!r} in:\n{printed}"
        for row in rows:
            assert len(numbers(row)) >= count, row
            assert all(map(isfinite, numbers(row))), row
