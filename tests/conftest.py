"""Shared by the tests: profiles of Hypothesis, the quick study, the registry of flow laws."""

import gc
import os
import pickle
import subprocess
import sys
import time
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import settings
from numba import set_num_threads
from undrawn import leave_undrawn

from chipglow.cutting import FLOW_LAWS
from chipglow.io.sandbox import Sandbox, failure

MOST_SECONDS = 1200

# Each process of pytest-xdist has a core: another thread of BLAS would spin while it waits for one.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# The same examples on every machine, and so few; --hypothesis-profile=search draws more, and new
# ones. The first example of a test may compile, so that no example has a time limit.
settings.register_profile("fixed", max_examples=40, derandomize=True, database=None, deadline=None)
settings.register_profile("search", derandomize=False, deadline=None, print_blob=True)
settings.load_profile("fixed")


class QuickStudy(NamedTuple):
    """Folder of the results, folder of the cache, and what the command printed."""

    results: object
    cache: object
    printed: str


def pytest_collection_modifyitems(items):
    """Begin with what needs the pages or the quick study: what one process makes, and none awaits.

    The first process of pytest-xdist begins at the first test, the second in the middle.
    """
    makers = ("site", "quick_study")

    def place(item):
        names = getattr(item, "fixturenames", ())
        return next((place for place, name in enumerate(makers) if name in names), len(makers))

    items.sort(key=place)


def pytest_collection_finish():
    """Let garbage collection ignore modules and tests, which remain: a sixth of all the time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def one_thread(worker_id):
    """Kernels have one thread in each process of pytest-xdist: the others have the other cores."""
    if worker_id != "master":
        set_num_threads(1)


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory, worker_id):
    """Function that fills a folder of some name once for all processes, and returns it."""
    base = tmp_path_factory.getbasetemp()
    base = base if worker_id == "master" else base.parent

    def filled(name, fill):
        folder, done, failed = (base / f"{name}{end}" for end in ("", ".done", ".failed"))
        try:
            folder.mkdir()
        except FileExistsError:
            wait_for(done, failed)
            return folder
        try:
            fill(folder)
        except BaseException:
            failed.touch()
            raise
        done.touch()
        return folder

    return filled


def wait_for(done, failed):
    """Wait until another process has filled a folder."""
    end = time.monotonic() + MOST_SECONDS
    while not done.exists():
        assert not failed.exists(), f"{failed}: another process failed to make it"
        assert time.monotonic() < end, f"{done} did not come from another process"
        time.sleep(0.2)


@pytest.fixture(scope="session")
def quick_study(shared_folder):
    """What ``chipglow reproduce --quick`` writes, as a user runs it but with blank figures."""
    folder = shared_folder("quick-study", reproduce_quick)
    printed = (folder / "printed.txt").read_text(encoding="utf-8")
    return QuickStudy(folder / "run", folder / "cache", printed)


# Drawing its figures takes half of the time of the command; the tests of the report draw them.
UNDRAWN = """
from types import SimpleNamespace
from undrawn import leave_undrawn
from chipglow.cli import main
leave_undrawn(SimpleNamespace(setattr=setattr))
main()
"""


def reproduce_quick(folder):
    """Run the command with its cache, its results and what it prints in a folder."""
    own = {"CHIPGLOW_CACHE": str(folder / "cache"), "COLUMNS": "160", "NUMBA_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", UNDRAWN, "reproduce", "--quick", "--out", str(folder / "run")],
        cwd=Path(__file__).parent,
        env={**os.environ, **own},
        capture_output=True,
        text=True,
        timeout=MOST_SECONDS,
    )
    assert run.returncode == 0, run.stderr
    (folder / "printed.txt").write_text(run.stdout, encoding="utf-8")


@pytest.fixture
def undrawn(monkeypatch):
    leave_undrawn(monkeypatch)


@pytest.fixture
def few_draws(monkeypatch):
    """Budgets of studies from few draws, which differ only where the random inputs count."""
    budget = import_module("chipglow.uncertainty.budget")  # the package has a function so named
    for name, number in (("_MEAN_DRAWS", 16), ("_DRAWS", 8), ("_REDRAWS", 2)):
        monkeypatch.setattr(budget, name, number)


@pytest.fixture
def read_here(monkeypatch):
    run_readers_here(monkeypatch.setattr)


def run_readers_here(setter=setattr):
    """Run readers in this process, without the second that a subprocess takes to start."""

    @contextmanager
    def answers(sandbox, job):
        yield answered(sandbox.name, job)

    setter(Sandbox, "answers", answers)


def answered(name, job):
    """The answers of a reader, and its errors as they come from a subprocess."""
    try:
        yield from job()
    except Exception as error:
        raise failure(name, error) from error


@pytest.fixture
def own_laws():
    """Forget the laws that a test registers."""
    before = dict(FLOW_LAWS._own)
    yield
    FLOW_LAWS._own.clear()
    FLOW_LAWS._own.update(before)


@pytest.fixture(scope="session")
def chip_analysis(shared_folder):
    """The paper's camera on the analytic chip: eight draws in one segment."""
    return pickle.loads((shared_folder("chip-analysis", analyse_chip) / "analysis").read_bytes())


def analyse_chip(folder):
    from analytic_chip import AnalyticChip

    from chipglow.analysis import AttributionPlan, Plan, analyse
    from chipglow.camera import Camera
    from chipglow.surface import CHIP_1, CHIP_2

    analysis = analyse(
        AnalyticChip(frames=60).scene(),
        {"chip 1": CHIP_1, "chip 2": CHIP_2},
        Camera.paper(),
        Plan(exposures=3, phases=2, textures=3, psf_widths=(4e-6, 12e-6, 20e-6)),
        attribution=AttributionPlan(),
    )
    (folder / "analysis").write_bytes(pickle.dumps(analysis))
