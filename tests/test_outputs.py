"""What commands write: never over files that chipglow did not write, inputs or devices."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from test_io import a_file, leftovers
from typer.testing import CliRunner

from chipglow.cli import app
from chipglow.io import atomic, atomic_folder, atomic_path

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX")


def write(folder, text, *names, force=False):
    with atomic_folder(folder, force) as temporary:
        for name in ("summary.json", *names):
            (temporary / name).parent.mkdir(exist_ok=True)
            (temporary / name).write_text(text)


def contents(folder):
    return {name: (folder / name).read_text() for name in atomic._files(folder)}


@pytest.fixture(params=["exchange", "file by file"])
def results(tmp_path, request, monkeypatch):
    """Folder of earlier results, on a system that exchanges folders and on one that cannot."""
    if request.param == "file by file":
        monkeypatch.setattr(atomic, "_exchange", lambda new, path: False)
    write(tmp_path / "results", "first", "old.txt", "figures/old.png")
    return tmp_path / "results"


def test_later_results_replace_earlier_ones(results):
    write(results, "second", "new.txt", "figures/new.png")
    assert contents(results) == dict.fromkeys(
        ("summary.json", "new.txt", "figures/new.png"), "second"
    )
    with pytest.raises(KeyboardInterrupt), atomic_folder(results) as temporary:
        (temporary / "summary.json").write_text("third")
        raise KeyboardInterrupt
    assert contents(results)["summary.json"] == "second"
    assert leftovers(results.parent) == ["results"]


@pytest.mark.parametrize("name", ["notes.txt", "figures/mine.png", "raw/data.csv"])
def test_other_files_are_kept(results, name):
    (results / name).parent.mkdir(exist_ok=True)
    (results / name).write_text("precious")
    with pytest.raises(FileExistsError, match=f"results: holds {name}, which chipglow did not"):
        write(results, "second", "new.txt")
    assert contents(results)["old.txt"] == "first"
    write(results, "second", "new.txt", force=True)
    assert contents(results) == {name: "precious", "summary.json": "second", "new.txt": "second"}
    write(results, "third", force=True)
    assert contents(results) == {name: "precious", "summary.json": "third"}
    with pytest.raises(FileExistsError, match=f"holds {name}, which chipglow did not write"):
        write(results, "fourth", name, force=True)
    assert contents(results) == {name: "precious", "summary.json": "third"}


def test_a_folder_without_our_list_is_not_ours(tmp_path):
    (tmp_path / "summary.json").write_text("{}")
    with pytest.raises(FileExistsError, match=r"holds summary\.json, which chipglow did not write"):
        write(tmp_path, "first")
    (tmp_path / "summary.json").unlink()
    (tmp_path / ".DS_Store").touch()
    write(tmp_path, "first")
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match="file: is not a folder"):
        write(tmp_path / "file", "first")


def test_a_list_with_files_elsewhere_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr(atomic, "_exchange", lambda new, path: False)
    (tmp_path / "precious").touch()
    write(tmp_path / "results", "first")
    (tmp_path / "results" / atomic.MANIFEST).write_text("summary.json\n../precious\n")
    write(tmp_path / "results", "second")
    assert leftovers(tmp_path) == ["precious", "results"]


def test_results_in_the_current_folder_stay_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(".", "first")
    write(".", "second")
    assert leftovers(tmp_path) == [atomic.MANIFEST, "summary.json"]
    assert Path().samefile(tmp_path)


@posix
def test_a_link_stays_and_its_target_is_written(tmp_path):
    (tmp_path / "far").mkdir()
    for name in ("results", "file"):
        (tmp_path / name).symlink_to(tmp_path / "far" / name)
    for text in ("first", "second"):
        write(tmp_path / "results", text)
        with atomic_path(tmp_path / "file") as part:
            part.write_text(text)
        assert contents(tmp_path / "far") == {"results/summary.json": text, "file": text}
    assert (tmp_path / "results").is_symlink()
    assert (tmp_path / "file").is_symlink()
    (tmp_path / "nowhere").symlink_to(tmp_path / "missing" / "results")
    with pytest.raises(FileNotFoundError, match=r"nowhere: there is no folder .*missing"):
        write(tmp_path / "nowhere", "first")


@posix
def test_a_special_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="pipe: is a device or another special file"):  # noqa: SIM117
        with atomic_path(tmp_path / "pipe"):
            pass
    with pytest.raises(NotADirectoryError, match="pipe: is not a folder"):
        write(tmp_path / "pipe", "first")


@posix
def test_a_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # as it is for all but root
    with pytest.raises(PermissionError, match=r"a: the folder .* is not writable"):
        write(tmp_path / "a", "first")
    with pytest.raises(PermissionError, match=r"b: the folder .* is not writable"):  # noqa: SIM117
        with atomic_path(tmp_path / "b"):
            pass


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    """The files that commands read."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "cache"))
    a_file(tmp_path)
    (tmp_path / "study.yaml").write_text("scene: scene.nc\n")
    (tmp_path / "list.yaml").write_text("frames: [frames.npy]\n")
    np.save("frames.npy", np.zeros((2, 3, 4)))
    (tmp_path / "study-of-list.yaml").write_text("calibration: list.yaml\n")
    (tmp_path / "points.csv").write_text("temperature_degC,file\n400,frames.npy\n")
    (tmp_path / "series.pvd").write_text('<DataSet timestep="0" file="chip_0.vtu"/>\n')
    for name in ("chip_0.vtu", "frames_0.tif", "frames_1.tif", "calibration.yaml"):
        (tmp_path / name).write_text("")
    (tmp_path / "several").mkdir()
    (tmp_path / "several" / "frames_0.nc").write_text("")
    for name in ("linked.nc", "linked.gif"):
        (tmp_path / name).hardlink_to("scene.nc")
    return tmp_path


@pytest.mark.parametrize(
    ("command", "refused"),
    [
        ("cut study.yaml --out study.yaml", "study.yaml: is also an input (study.yaml)"),
        ("cut study.yaml --out scene.nc", "scene.nc: is also an input (scene.nc)"),
        ("cut study.yaml --out new.nc --preview linked.gif", "linked.gif: is also an input"),
        ("measure scene.nc --study study.yaml --out linked.nc", "linked.nc: is also an input"),
        ("import list.yaml --out frames.npy", "frames.npy: is also an input (frames.npy)"),
        ("rake scene.nc --out scene.nc", "scene.nc: is also an input"),
        ("compare scene.nc linked.nc --out . --force", ".: holds the input scene.nc"),
        ("run study.yaml --out . --force", ".: holds the input study.yaml, expected another"),
        ("run study.yaml --out .", ".: holds "),
        ("error scene.nc --out study.yaml", "is a file"),
        ("cut study.yaml --out nowhere/new.nc", "nowhere/new.nc: there is no folder nowhere"),
        (
            "convert frames.npy --set calibration=calibration.yaml --out calibration.yaml",
            "calibration.yaml: is also an input (calibration.yaml)",
        ),
        ("convert frames.npy --set bad_pixels=frames_0.tif --out frames_0.tif", "also an input"),
        ("convert frames.npy --set flat_field.low=frames_0.tif --out frames_0.tif", "an input"),
        ("convert frames_*.tif --out frames_1.tif", "frames_1.tif: is also an input"),
        ("convert study-of-list.yaml --out frames.npy", "frames.npy: is also an input"),
        (
            "convert frames_0.tif frames_1.tif --set a=several/frames_0.nc --out several --force",
            "several/frames_0.nc: is also an input",
        ),
        ("import series.pvd --out chip_0.vtu", "chip_0.vtu: is also an input (chip_0.vtu)"),
        (
            "calibrate points.csv --band 3-5um --out frames.npy",
            "frames.npy: is also an input (frames.npy)",
        ),
        (
            "calibrate points.csv --band 3-5um --out new.png --plot ./new.png",
            "--plot: new.png is also the output of --out, expected another name",
        ),
        (
            "compare scene.nc linked.nc --out new --plot new/plot.png",
            "--plot: new/plot.png is also the output of --out",
        ),
    ],
)
def test_outputs_are_checked_before_a_command_begins(inputs, command, refused):
    before = {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()}
    result = CliRunner().invoke(app, command.split())
    assert result.exit_code == 2, result.output
    assert refused in " ".join(re.sub("[│╭╮╰╯─]", "", result.stderr).split())
    after = {path: path.read_bytes() for path in inputs.rglob("*") if path.is_file()}
    assert after == before


@posix
@pytest.mark.parametrize(
    "command",
    [
        "run pipe.yaml --out new",
        "run of-pipe.yaml --out new",
        "error pipe.nc --out new",
        "show pipe.nc",
        "app pipe.nc",
        "convert frames.npy --set calibration=pipe.yaml",
        "convert pipe.*",
        "import pipe.nc",
    ],
)
def test_a_pipe_is_refused_by_name_before_it_is_opened(inputs, command):
    os.mkfifo("pipe.nc")
    os.mkfifo("pipe.yaml")
    Path("of-pipe.yaml").write_text("scene: pipe.nc\n")
    result = CliRunner().invoke(app, command.split())
    assert result.exit_code == 2, result.output
    assert re.search(
        r"chipglow: pipe\.(nc|yaml): is a pipe, expected a regular file", result.stderr
    )


@posix
def test_a_device_is_refused_by_name(inputs):
    result = CliRunner().invoke(app, ["run", "/dev/zero", "--out", "new"])
    assert (result.exit_code, result.stderr) == (
        2, "chipglow: /dev/zero: is a device, expected a regular file\n"
    )  # fmt: skip


WAITS = """
import signal, sys, time
from chipglow import cli
from chipglow.io import atomic_folder
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # not ignored, as under nohup
def command():
    with atomic_folder(sys.argv[1]) as part:
        (part / "summary.json").touch()
        print("begun", flush=True)
        time.sleep(60)
cli.app.app = command
sys.modules["chipglow.cli.app"].app = command
cli.main()
"""


def begun(path):
    process = subprocess.Popen(
        [sys.executable, "-c", WAITS, str(path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout.readline() == b"begun\n"
    return process


@posix
def test_what_killed_runs_leave_is_removed_by_the_next(tmp_path):
    killed, running = begun(tmp_path / "results"), begun(tmp_path / "results")
    with killed, running:
        killed.kill()
        killed.wait()
        assert len(leftovers(tmp_path)) == 2
        write(tmp_path / "results", "next")
        # That of the run that still works stays.
        (part,) = set(leftovers(tmp_path)) - {"results"}
        assert (tmp_path / part / "summary.json").exists()
        running.send_signal(signal.SIGHUP)
        running.wait()
        killed.stdout.close()
    assert leftovers(tmp_path) == ["results"]


@posix
def test_a_file_that_a_killed_run_left_is_removed_by_the_next_but_one_that_is_held_stays(tmp_path):
    (tmp_path / ".cut.01234567.part.gif").touch()
    with atomic_path(tmp_path / "cut.gif") as held:
        with atomic_path(tmp_path / "cut.gif"):
            assert held.exists()
        assert len(leftovers(tmp_path)) == 2
    assert leftovers(tmp_path) == ["cut.gif"]


KILLED = """
import os, sys, threading, time
from pathlib import Path
from chipglow.io import atomic_folder
print("begun", flush=True)
for count in range(10**6):
    with atomic_folder(sys.argv[1]) as part:
        for name in ("summary.json", "other"):
            (part / name).write_text(str(count))
"""


@posix
@pytest.mark.parametrize("delay", [0.05, 0.0613, 0.0871])
def test_a_kill_never_leaves_the_name_empty(tmp_path, delay):
    write(tmp_path / "results", "0", "other")
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "results")], stdout=subprocess.PIPE
    ) as process:
        process.stdout.readline()
        end = time.monotonic() + delay
        while time.monotonic() < end:
            assert (tmp_path / "results").is_dir()
        process.kill()
    found = contents(tmp_path / "results")
    assert set(found) == {"summary.json", "other"}
    assert sys.platform != "linux" or len(set(found.values())) == 1
    write(tmp_path / "results", "next", "other")
    assert leftovers(tmp_path) == ["results"]
