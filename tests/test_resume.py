"""A cut that is stopped, killed or goes wrong, and one that goes on from what it left."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from command import run
from PIL import Image
from test_io import a_frame
from test_preview import assert_same_frames

from chipglow.cutting import (
    CuttingConditions,
    CuttingSimulation,
    Numerics,
    OutputWindow,
    SolverError,
)
from chipglow.io import SceneWriter, open_scene, unfinished_scenes
from chipglow.io.atomic import uninterrupted
from chipglow.io.digest import HDF5Sink
from chipglow.scene import Raster
from chipglow.study import cut, is_cut, kept_progress, load_study, running

STUDY = """
cutting:
  cutting_length: 0.1 mm
  numerics: {cell: 40 um}
  window: {start: 0.02 mm, end: 0.1 mm, interval: 0.5 us}
  field_of_view: {left: -100 um, top: 200 um, spacing: 5 um, rows: 36, columns: 27}
"""
SIMULATION = CuttingSimulation(
    CuttingConditions(cutting_length=0.1e-3),
    numerics=Numerics(cell=20e-6, upstream=0.3e-3, downstream=0.3e-3, depth=0.2e-3, height=0.5e-3),
)
WINDOW = OutputWindow(start=0.02e-3, end=0.1e-3, interval=1e-6, later_bands=0)
RASTER = Raster(left=-100e-6, top=200e-6, spacing=5e-6, rows=36, columns=27)

COMMAND = """
import sys
from chipglow.cli import main
from chipglow.study import running
running.CHECKPOINT_INTERVAL = running._CHEAP = 0.0
sys.argv = ["chipglow", "cut", "study.yaml", "--out", "scene.nc", *sys.argv[1:]]
main()
"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder for the cache beside the study; checkpoints after every interval."""
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(STUDY)
    monkeypatch.setattr(running, "CHECKPOINT_INTERVAL", 0.0)
    monkeypatch.setattr(running, "_CHEAP", 0.0)
    return tmp_path / "cache"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The scene of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("unbroken")
    (folder / "study.yaml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHIPGLOW_CACHE", str(folder))
        return open_scene(cut(load_study(folder / "study.yaml")))


def assert_same_scene(path, expected):
    found = open_scene(path).data.load()
    assert found.identical(expected.data.load())


def simulate(on_checkpoint=None, resume=None):
    frames = []
    history = SIMULATION.run(WINDOW, RASTER, frames.append, None, resume, on_checkpoint)
    return frames, history


def test_a_run_goes_on_from_any_checkpoint_with_the_same_bits():
    checkpoints = []
    frames, history = simulate(lambda checkpoint: checkpoints.append(deepcopy(checkpoint)))
    for checkpoint in (checkpoints[0], checkpoints[len(checkpoints) // 2], checkpoints[-1]):
        rest, again = simulate(resume=checkpoint)
        assert len(rest) == sum(frame.time > checkpoint.time for frame in frames)
        assert_same_frames(rest, frames[len(frames) - len(rest) :])
        for name in ("time", "cutting", "thrust"):
            np.testing.assert_array_equal(getattr(again, name), getattr(history, name))
        for name, values in vars(history.energy).items():
            np.testing.assert_array_equal(getattr(again.energy, name), values)


def test_a_checkpoint_of_another_simulation_is_refused():
    checkpoints = []
    simulate(lambda checkpoint: checkpoints.append(deepcopy(checkpoint)))
    finer = replace(SIMULATION, numerics=replace(SIMULATION.numerics, cell=15e-6))
    with pytest.raises(ValueError, match=r"checkpoint: 'velocity' .* expected"):
        finer.run(WINDOW, RASTER, lambda _: None, resume=checkpoints[3])
    shorter = replace(WINDOW, end=0.03e-3)
    with pytest.raises(ValueError, match=r"checkpoint: .* intervals, expected up to"):
        SIMULATION.run(shorter, RASTER, lambda _: None, resume=checkpoints[-1])
    unknown = replace(checkpoints[0], arrays={**checkpoints[0].arrays, "more": np.zeros(1)})
    with pytest.raises(ValueError, match=r"checkpoint: has .*more.*, expected"):
        simulate(resume=unknown)


def start(*options):
    return subprocess.Popen(
        [sys.executable, "-c", COMMAND, *options], stderr=subprocess.PIPE, text=True
    )


def killed_run(study, rng, *options):
    """Run until it has got further than before, and some random time more; then SIGKILL."""
    before = kept_progress(study)
    with start(*options) as process:
        while not any(left > before for left in progress_of_all(study)):
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 0.05))
        process.send_signal(signal.SIGKILL)
        process.communicate()
    assert process.returncode == -signal.SIGKILL


def progress_of_all(study):
    """How far the runs are, also those that go on."""
    folder = running.scene_path(running.scene_inputs(study)).parent
    for path in folder.glob(".scene-*.npz"):
        try:
            with np.load(path) as stored:
                yield float(stored["scene.progress"])
        except FileNotFoundError:  # the run went on past the one before and deleted it
            continue


def use_own_kernels(folder, monkeypatch):
    """Copy compiled kernels: what another process compiles now can differ in the last bits."""
    compiled = os.environ.get("NUMBA_CACHE_DIR")
    if compiled is not None:
        unfinished = shutil.ignore_patterns("*.tmp.*")
        shutil.copytree(compiled, folder, ignore=unfinished, dirs_exist_ok=True)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))


@pytest.mark.slow
def test_a_cut_that_is_killed_again_and_again_ends_with_the_same_bits(cache, tmp_path, monkeypatch):
    use_own_kernels(tmp_path / "kernels", monkeypatch)
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "unbroken"))
    with start() as process:
        _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    unbroken = open_scene((tmp_path / "scene.nc").rename(tmp_path / "unbroken.nc"))
    monkeypatch.setenv("CHIPGLOW_CACHE", str(cache))
    study, rng = load_study("study.yaml"), np.random.default_rng(1)
    killed_run(study, rng)
    reached = [kept_progress(study)]
    assert not is_cut(study)
    killed_run(study, rng, "--resume")
    reached.append(kept_progress(study))
    assert len(unfinished_scenes(running.scene_path(running.scene_inputs(study)))) <= 2
    assert 0 < reached[0] < reached[1]
    with start("--resume") as process:
        _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert f"Resuming the cut at {reached[1]:.0%}" in errors
    assert_same_scene("scene.nc", unbroken)
    assert [path.suffix for path in cache.iterdir()] == [".nc"]


class StopError(Exception):
    pass


def stop_after(intervals, error, monkeypatch):
    """Raise an error in the hand-over of a checkpoint."""
    whole = CuttingSimulation.run

    def run(simulation, window, raster, on_frame, on_progress, resume, on_checkpoint, preview):
        seen = []

        def count(checkpoint):
            on_checkpoint(checkpoint)
            seen.append(checkpoint.time)
            if len(seen) == intervals:
                raise error

        return whole(simulation, window, raster, on_frame, on_progress, resume, count, preview)

    monkeypatch.setattr(CuttingSimulation, "run", run)


def stopped(study, intervals):
    """Cut until a checkpoint is handed over, and fail there."""
    with pytest.MonkeyPatch.context() as patch, pytest.raises(StopError):
        stop_after(intervals, StopError(), patch)
        cut(study)


def test_a_cut_that_is_stopped_goes_on_only_if_told_to(cache, unbroken):
    study = load_study("study.yaml")
    stopped(study, 9)
    kept = kept_progress(study)
    assert kept == pytest.approx(9 / 48)
    stopped(study, 3)  # a new run that got less far deletes nothing
    assert kept_progress(study) == kept
    seen = []
    path = cut(study, lambda _, fraction: seen.append(fraction))
    assert seen[1] < kept
    assert_same_scene(path, unbroken)
    assert list(cache.iterdir()) == [path]
    path.unlink()
    stopped(study, 30)
    seen.clear()
    assert_same_scene(cut(study, lambda _, fraction: seen.append(fraction), resume=True), unbroken)
    assert seen[1] == pytest.approx(31 / 48)
    assert list(cache.iterdir()) == [path]


def test_a_broken_checkpoint_is_as_none(cache, unbroken):
    study = load_study("study.yaml")
    stopped(study, 30)
    (left,) = unfinished_scenes(running.scene_path(running.scene_inputs(study)))
    os.truncate(left.checkpoint, 1000)
    assert kept_progress(study) == 0
    path = cut(study, resume=True)
    assert_same_scene(path, unbroken)
    assert list(cache.iterdir()) == [path]


def test_after_ctrl_c_the_last_state_is_named(cache, monkeypatch):
    stop_after(5, KeyboardInterrupt(), monkeypatch)
    said = run("cut", "study.yaml", "--out", "scene.nc", code=130)
    lines = [line for line in said.splitlines() if line.startswith("chipglow: ")]
    assert len(lines) == 1
    assert re.search(r"the state at 2\.50 us is kept in .*: --resume continues from", lines[0])


def test_the_movie_of_a_cut_that_goes_on_shows_what_is_still_to_come(cache, unbroken, monkeypatch):
    command = ["cut", "study.yaml", "--out", "scene.nc", "--preview", "rest.gif"]
    with monkeypatch.context() as patch:
        stop_after(30, KeyboardInterrupt(), patch)
        run(*command, code=130)
    assert {path.name for path in cache.parent.iterdir()} == {"study.yaml", "cache"}
    run(*command, "--resume")
    with Image.open("rest.gif") as movie:
        assert movie.n_frames == 48 - 30
    assert_same_scene("scene.nc", unbroken)


SPOILT = [
    ("temperature", np.nan, "temperature is not finite"),
    ("temperature", 3200.0, "temperature out of 200 K to 3000 K"),
    ("temperature", 20.0, "temperature out of 200 K to 3000 K"),
    ("dxy", np.inf, "not finite|a point left the grid"),
    ("x", np.nan, "a point's position is not finite"),
    ("y", -1e-3, "a point left the workpiece's edge"),
]


@pytest.mark.parametrize(("name", "value", "what"), SPOILT)
def test_a_run_that_goes_wrong_says_what_where_and_when(name, value, what):
    def spoil(checkpoint):
        if checkpoint.time > 9.5e-6:
            points = checkpoint.arrays["points"]
            points[name][np.argmin(np.hypot(points["x"] + 100e-6, points["y"] + 90e-6))] = value

    with pytest.raises(SolverError, match=what) as failure:
        simulate(spoil)
    message = str(failure.value)
    assert "\n" not in message
    place = re.search(r"at (\d+\.\d+) us, x (\S+) um, y (\S+) um", message)
    when, x, y = (float(text) for text in place.groups())
    assert 10.0 <= when <= 11.1
    assert -200 <= x <= 50
    assert -1100 <= y <= 0


def test_a_run_that_goes_wrong_keeps_its_last_good_state_and_names_it(cache, monkeypatch):
    stop_after(20, SolverError("cutting simulation: wrong"), monkeypatch)
    with pytest.raises(SolverError, match=r"wrong; the state at 10\.00 us is kept in ") as failure:
        cut(load_study("study.yaml"))
    file = str(failure.value).rpartition(" is kept in ")[2]
    with np.load(file) as stored:
        assert stored["time"] == pytest.approx(10e-6)
        assert np.isfinite(stored["points"]["temperature"]).all()
    monkeypatch.setattr(running, "CHECKPOINT_INTERVAL", 3600.0)
    with pytest.raises(SolverError, match=r"wrong; the state at 10\.00 us is kept in ") as failure:
        cut(load_study("study.yaml"), resume=True)
    assert str(failure.value).endswith(file)


def test_a_checkpoint_before_the_first_frame_is_one_to_go_on_from(tmp_path):
    path, raster = tmp_path / "scene-x.nc", replace(RASTER, rows=4, columns=5)

    def write(resume, state):
        with SceneWriter(path, raster, resume=resume) as writer:
            writer.checkpoint(state, 0.5)
            raise StopError

    with pytest.raises(StopError):
        write(None, {"a": np.arange(3)})
    (left,) = unfinished_scenes(path)
    with SceneWriter(path, raster, resume=left) as writer:
        np.testing.assert_array_equal(left.state()["a"], np.arange(3))
        writer.append(a_frame(1e-6, raster=raster))
    left.remove()
    assert len(open_scene(path).times) == 1
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def ctrl_c():
    """Ctrl-C as in a terminal: a process that was started in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_while_hdf5_writes_comes_when_the_scene_is_there(cache, unbroken, monkeypatch):
    """HDF5 calls back into Python to write: an exception there could end the process."""
    write, sent = HDF5Sink.write, []

    def interrupted(file, data):
        if not sent:
            sent.append(data)
            signal.raise_signal(signal.SIGINT)
        return write(file, data)

    monkeypatch.setattr(HDF5Sink, "write", interrupted)
    study = load_study("study.yaml")
    with pytest.raises(KeyboardInterrupt):
        cut(study)
    assert sent
    assert_same_scene(cut(study), unbroken)
    assert len(list(cache.iterdir())) == 1


@pytest.mark.usefixtures("ctrl_c")
def test_held_signals_come_when_the_block_ends():
    seen = []
    with pytest.raises(KeyboardInterrupt), uninterrupted():
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            seen.append("inner")
        seen.append("outer")
    assert seen == ["inner", "outer"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt, match="first"), uninterrupted():
        signal.raise_signal(signal.SIGINT)
        raise KeyboardInterrupt("first")
    with pytest.raises(KeyboardInterrupt) as stop, uninterrupted():
        signal.raise_signal(signal.SIGINT)
        raise StopError
    assert isinstance(stop.value.__context__, StopError)


def test_signals_are_not_touched_beside_the_main_thread():
    def work():
        with uninterrupted():
            return "done"

    with ThreadPoolExecutor() as pool:
        assert pool.submit(work).result() == "done"
