"""What several files of tests share: the quick study, computed once, and the registry of laws."""

import subprocess
import sys
from typing import NamedTuple

import pytest

from chipglow.cutting.flow_stress import LAWS


class QuickStudy(NamedTuple):
    """Folder of the results, folder of the cache, and what the command printed."""

    results: object
    cache: object
    printed: str


@pytest.fixture(scope="session")
def quick_study(tmp_path_factory):
    """What ``chipglow reproduce --quick`` writes, as a user runs it."""
    folder = tmp_path_factory.mktemp("reproduce")
    command = [sys.executable, "-c", "from chipglow.cli import main; main()"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHIPGLOW_CACHE", str(folder / "cache"))
        run = subprocess.run(
            [*command, "reproduce", "--quick", "--out", str(folder / "run")],
            capture_output=True,
            text=True,
            timeout=1200,
        )
    assert run.returncode == 0, run.stderr
    return QuickStudy(folder / "run", folder / "cache", run.stdout)


@pytest.hookimpl(tryfirst=True)  # before the groups are read
def pytest_collection_modifyitems(items):
    """Tests of the quick study run in one process: it is computed once."""
    for item in items:
        if "quick_study" in item.fixturenames:
            item.add_marker(pytest.mark.xdist_group("quick study"))


@pytest.fixture
def own_laws():
    """Forget the laws that a test registers."""
    before = dict(LAWS)
    yield
    LAWS.clear()
    LAWS.update(before)
