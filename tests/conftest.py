"""Shared by the tests: profiles of Hypothesis, the quick study, the registry of flow laws."""

import os
import subprocess
import sys
import time
from typing import NamedTuple

import pytest
from hypothesis import settings

from chipglow.cutting import FLOW_LAWS

MOST_SECONDS = 1200

# The same examples on every machine; --hypothesis-profile=search draws new ones. The first example
# of a test may compile, so that no example has a time limit.
settings.register_profile("fixed", derandomize=True, database=None, deadline=None)
settings.register_profile("search", derandomize=False, deadline=None, print_blob=True)
settings.load_profile("fixed")


class QuickStudy(NamedTuple):
    """Folder of the results, folder of the cache, and what the command printed."""

    results: object
    cache: object
    printed: str


@pytest.fixture(scope="session")
def quick_study(tmp_path_factory, worker_id):
    """What ``chipglow reproduce --quick`` writes, as a user runs it: once for all processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base if worker_id == "master" else base.parent) / "quick-study"
    done = folder / "printed.txt"
    try:
        folder.mkdir()
    except FileExistsError:
        wait_for(done)
    else:
        printed = reproduce_quick(folder)
        (folder / "printing").write_text(printed, encoding="utf-8")
        (folder / "printing").rename(done)
    return QuickStudy(folder / "run", folder / "cache", done.read_text(encoding="utf-8"))


def reproduce_quick(folder):
    """Run the command with its cache and its results in a folder; what it prints."""
    command = [sys.executable, "-c", "from chipglow.cli import main; main()"]
    run = subprocess.run(
        [*command, "reproduce", "--quick", "--out", str(folder / "run")],
        env={**os.environ, "CHIPGLOW_CACHE": str(folder / "cache")},
        capture_output=True,
        text=True,
        timeout=MOST_SECONDS,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


def wait_for(file):
    """Wait until another process has made a file."""
    end = time.monotonic() + MOST_SECONDS
    while not file.exists():
        assert time.monotonic() < end, f"{file} did not come from another process"
        time.sleep(0.2)


@pytest.fixture
def own_laws():
    """Forget the laws that a test registers."""
    before = dict(FLOW_LAWS._own)
    yield
    FLOW_LAWS._own.clear()
    FLOW_LAWS._own.update(before)
