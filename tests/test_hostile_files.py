"""Files that declare more than fits, or that are damaged: one line, at once."""

import os
import signal
import subprocess
import sys
import time
import weakref
from collections import namedtuple
from importlib import import_module

import h5py
import numpy as np
import pytest
from command import refused
from test_io import a_file

from chipglow.camera import Camera
from chipglow.io import open_scene, read_measurement
from chipglow.io.cameras import read_recording
from chipglow.scene import Raster
from chipglow.study import Study, check_cost
from chipglow.text import MemoryLimitError, check_bounds, check_memory, parse_yaml

commands = import_module("chipglow.cli.app")  # the package has a function of this name
posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX")

BILLION = 10**9


def bomb(path, **shapes):
    """A file of some kB that declares variables of these shapes, of which nothing is stored."""
    with h5py.File(path, "w") as file:
        for name, shape in shapes.items():
            file.create_dataset(name, shape, np.float32, chunks=True, compression="gzip")
    return path


@pytest.mark.parametrize(
    "shapes",
    [
        {"temperature": (2, 50_000, 50_000)},
        {"temperature": (2, 4, 4), "force_time": (BILLION,)},
        {"temperature": (2, 4, 4), "time": (BILLION,)},
        {"temperature": (2, 4, 4), "x": (100_000,), "y": (100_000,)},
    ],
)
@pytest.mark.parametrize("command", ["show", "error"])
def test_a_scene_that_declares_more_than_the_memory_is_refused(
    tmp_path, monkeypatch, shapes, command
):
    monkeypatch.setenv("CHIPGLOW_MEMORY", "8 GB")
    path = bomb(tmp_path / "scene.nc", **shapes)
    options = ["--out", tmp_path / "out"] if command == "error" else []
    refused([command, path, *options], "scene.nc", "GB of memory, the limit is 8 GB")


def test_a_measurement_counts_as_a_whole_and_a_scene_by_frame(tmp_path, monkeypatch):
    # 40 frames of 1 MB in four copies are 160 MB; a frame of the scene is 4 MB.
    path = bomb(tmp_path / "images.nc", radiance=(40, 500, 500))
    monkeypatch.setenv("CHIPGLOW_MEMORY", "100 MB")
    check_bounds(path, by_frame=True)
    with pytest.raises(MemoryLimitError, match=r"0\.16 GB of memory, the limit is 0\.1 GB"):
        check_bounds(path)
    with pytest.raises(ValueError, match=r"images\.nc: .*the limit is 0\.1 GB"):
        read_measurement(path)


def test_the_limit_is_the_memory_available_unless_stated(monkeypatch):
    monkeypatch.delenv("CHIPGLOW_MEMORY", raising=False)
    check_memory("a number", 8.0)
    with pytest.raises(MemoryLimitError, match="all: needs about"):
        check_memory("all", 1e18)
    monkeypatch.setenv("CHIPGLOW_MEMORY", "2000000 TB")
    check_memory("all", 1e18)
    monkeypatch.setenv("CHIPGLOW_MEMORY", "much")
    with pytest.raises(ValueError, match="CHIPGLOW_MEMORY: 'much', expected a size such as 64 GB"):
        check_memory("a number", 8.0)


@pytest.mark.parametrize("kind", ["groups", "links", "levels"])
def test_very_many_groups_links_and_levels_are_refused(kind, tmp_path):
    with h5py.File(tmp_path / "many.nc", "w") as file:
        group = file
        for number in range(1001):
            if kind == "links":
                file[f"g{number}"] = file  # one object by many names
            else:
                made = group.create_group(f"g{number}")
                group = made if kind == "levels" else file
    with pytest.raises(MemoryLimitError, match="has over 1000 groups and variables"):
        check_bounds(tmp_path / "many.nc")


def test_references_are_refused(tmp_path):
    with h5py.File(tmp_path / "references.nc", "w") as file:
        file["temperature"] = np.zeros((2, 3, 4), np.float32)
        file["time"] = np.array([file["temperature"].ref] * 2, h5py.ref_dtype)
    refused(["show", tmp_path / "references.nc"], "'time' has values of another kind")


@posix
def test_special_files_are_refused_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("study.yaml", "chip.nc"):
        os.mkfifo(name)
    (tmp_path / "store.zarr").mkdir()
    os.mkfifo("store.zarr/zarr.json")
    (tmp_path / "own.yaml").write_text("scene: chip.nc")
    for command in (
        "run study.yaml --out new", "run own.yaml --out new", "show chip.nc", "rake chip.nc",
        "import store.zarr --out new.nc", "app chip.nc --no-browser", "psf study.yaml",
        "convert chip.* --out new.nc", "sweep study.yaml --vary seed=1,2 --out new",
    ):  # fmt: skip
        refused(command.split(), "is a pipe, expected a regular file")
    for command in ("show /dev/zero", "error /dev/null --out new", "materials /dev/null"):
        refused(command.split(), "is a device, expected a regular file")
    with pytest.raises(ValueError, match=r"chip\.nc: is a pipe"):
        open_scene("chip.nc")
    with pytest.raises(ValueError, match=r"chip\.nc: is a pipe"):
        read_measurement("chip.nc")
    with pytest.raises(ValueError, match=r"chip\.nc: is a pipe"):
        read_recording("chip.nc")


# The last bytes are the digest, the splines or fields, and the metadata of HDF5.
@pytest.mark.parametrize("zeroed", [20, 300, 1000, 4000])
def test_a_file_whose_end_is_zeroed_is_refused(tmp_path, zeroed):
    path = a_file(tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[:-zeroed] + bytes(zeroed))
    refused(["show", path], str(path))
    with pytest.raises(ValueError, match=path.name):
        read_measurement(path)


def started(*arguments, prefix="", **environment):
    """Exit code, standard output and standard error of the command in a shell."""
    command = f"{sys.executable} -m chipglow {' '.join(arguments)} {prefix}"
    done = subprocess.run(
        command, shell=True, capture_output=True, text=True, env={**os.environ, **environment}
    )
    return done.returncode, done.stdout, done.stderr


@posix
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")  # noqa: PTH110
@pytest.mark.parametrize("arguments", ["--help", "--version", "materials --json"])
def test_a_full_standard_output_is_one_line(arguments):
    assert started(arguments, prefix="> /dev/full") == (
        1, "", "chipglow: standard output: No space left on device\n"
    )  # fmt: skip


@posix
@pytest.mark.parametrize("arguments", ["--version", "materials"])
def test_a_closed_standard_output_discards_what_is_printed(arguments):
    assert started(arguments, prefix=">&-") == (0, "", "")


@posix
def test_a_command_whose_output_cannot_be_printed_still_writes_its_file(tmp_path):
    code, _, _ = started("init", str(tmp_path / "study.yaml"), prefix="> /dev/full 2> /dev/full")
    assert code == 1
    assert (tmp_path / "study.yaml").stat().st_size > 1000


def test_without_compiled_code_no_command_begins(monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    refused(["materials"], "NUMBA_DISABLE_JIT is set")


@posix
@pytest.mark.parametrize(
    "command",
    ["run loop.yaml --out new", "show loop.nc", "error loop.nc --out new", "convert loop/a.tif"],
)
def test_a_loop_of_links_is_refused_by_name(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    for name in ("loop.yaml", "loop.nc", "loop"):
        (tmp_path / name).symlink_to(name)
    refused(command.split(), "loop", "is a loop of links")
    refused(["init", "loop.yaml", "--force"], "loop.yaml: is a loop of links")


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (MemoryError("Unable to allocate 298. GiB"), "not enough memory: Unable to allocate 298"),
        (MemoryError(), "not enough memory; choose fewer or coarser samples"),
        (RuntimeError("can't start new thread"), "the system starts no more threads"),
    ],
)
def test_a_lack_of_memory_or_threads_is_one_line_with_a_hint(tmp_path, monkeypatch, error, text):
    def fails(*_):
        raise error

    monkeypatch.setattr("chipglow.study.study_text", fails)
    refused(["init", tmp_path / "study.yaml"], text, code=1)


LIMITED = """
import importlib.metadata, mmap, resource, sys
from pathlib import Path
from chipglow.cli import main

def limit(kind, counted, more):
    status = Path("/proc/self/status").read_text(encoding="ascii")
    taken = 1024 * int(status.partition(f"{counted}:")[2].split()[0])
    resource.setrlimit(kind, (taken + more, -1))

def fail(_):
    %s

importlib.metadata.version = fail
sys.argv = ["chipglow", "--version"]
main()
"""
# The largest library takes 180 MB; 100 MB of a limit of 1 GB are left while 900 MB are mapped.
LIBRARY = "limit(resource.RLIMIT_AS, 'VmSize', 50_000_000); import llvmlite.binding"
FREED = "limit(resource.%s, '%s', 1_000_000_000); mmap.mmap(-1, %d, flags=mmap.MAP_PRIVATE).close()"
GLYPH = "; raise RuntimeError('failed to load glyph')"


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux, which reports the peak")
@pytest.mark.parametrize(
    ("failing", "said"),
    [
        (LIBRARY, "probably not enough memory (OSError: Could not find/load shared object file"),
        *(
            (
                FREED % (*counted, 900_000_000) + GLYPH,
                "probably not enough memory (RuntimeError: failed to load glyph); choose fewer",
            )
            for counted in (("RLIMIT_AS", "VmSize"), ("RLIMIT_DATA", "VmData"))
        ),
        (FREED % ("RLIMIT_AS", "VmSize", 400_000_000) + GLYPH, None),
    ],
)
def test_any_error_near_a_limit_of_memory_is_one_line(failing, said):
    done = subprocess.run(
        [sys.executable, "-c", LIMITED % failing], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    if said is None:  # far from the limit the error is a fault of the program
        assert "Traceback" in done.stderr
        assert "chipglow: " not in done.stderr
    else:
        assert done.stderr.startswith(f"chipglow: {said}")
        assert done.stderr.count("\n") == 1


DOUBLED = "a0: &a0 [x, x]\n" + "".join(
    f"a{level}: &a{level} [*a{level - 1}, *a{level - 1}]\n" for level in range(1, 40)
)
MERGED = "a0: &a0 {x: 1}\n" + "".join(
    f"a{level}: &a{level} {{<<: [*a{level - 1}, *a{level - 1}]}}\n" for level in range(1, 40)
)
HOSTILE_YAML = {
    "doubled": (DOUBLED, "has over 10000 keys and values"),
    "merged": (MERGED, "has over 10000 keys and values"),
    "itself": ("camera: &a {pitch: *a}", "line 1, column 20: contains itself"),
    "merged with itself": ("camera: &a {<<: *a}", "contains itself"),
    "deep": ("[" * 100_000, "has over 50 levels of sections"),
    "keys": ("\n".join(f"k{number}: 1" for number in range(80_000)), "has over 10000 keys"),
    "points": (f"analysis: {{points: [{'1, ' * 100_000}]}}", "has over 10000 keys"),
    "digits": (f"seed: {'9' * 400}", "line 1, column 7: the number is too large"),
    "tag": ('seed: !!int ""', "a value does not fit its tag"),
    "half a character": ('title: "\\uD800"', "has half a character"),
}


@pytest.mark.parametrize("kind", HOSTILE_YAML)
def test_hostile_yaml_is_one_line(kind, tmp_path):
    text, message = HOSTILE_YAML[kind]
    path = tmp_path / "study.yaml"
    path.write_text(text, encoding="utf-8")
    refused(["run", path, "--out", tmp_path / "out"], "study.yaml", message)


def test_an_error_quotes_no_pages_of_the_input(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(f"seed: [{'1, ' * 9000}]", encoding="utf-8")
    output = refused(["run", path, "--out", tmp_path / "out"], "seed: [1, 1", "a whole number")
    assert len(output) < 3000  # the longest message is of 2000 characters


def test_aliases_that_expand_to_little_are_read():
    parsed = parse_yaml("a: &a {x: 1, z: 3}\nb: &b {<<: *a, y: 2}\nc: {<<: [*b, *a], x: 4}\n")
    assert parsed["c"] == {"x": 4, "y": 2, "z": 3}
    assert parsed["b"] == {"x": 1, "y": 2, "z": 3}


# One study a limit: declared, and compared with this machine before the cut.
TOO_MUCH = {
    "camera: {pitch: 1e-23 m}": "camera.pitch: 1e-17 um, expected 0.01 um to 10000 um",
    "camera: {pitch: 0.01 um}": "camera.pitch: 0.01 um: needs about ",
    "cutting: {field_of_view: {spacing: 1e-20 m}}": "spacing: 1e-14 um, expected 0.000001 um",
    "cutting: {field_of_view: {rows: 99999, columns: 99999}}": "field_of_view.spacing: 2/3 um: ",
    "cutting: {field_of_view: {rows: 1000000000000}}": "rows: 1e+12, expected 1 to 100000",
    "cutting: {numerics: {cell: 0.5 um}, cutting_length: 90 mm}": "cutting.numerics.cell: 0.5 um: ",
    "analysis: {exposures: 1000000000000}": "analysis.exposures: 1e+12, expected 1 to 10000",
}


@pytest.mark.parametrize("study", TOO_MUCH)
def test_a_study_that_asks_for_more_than_the_machine_has_names_its_setting(
    study, tmp_path, monkeypatch
):
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("CHIPGLOW_MEMORY", "64 GB")
    path = tmp_path / "study.yaml"
    path.write_text(study)
    # No terminal is asked, and --yes agrees to a long cut only.
    refused(["run", path, "--out", tmp_path / "out", "--yes"], TOO_MUCH[study])
    assert not (tmp_path / "out").exists()


def test_the_memory_of_a_study_is_that_of_the_limit(monkeypatch, tmp_path):
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path))
    monkeypatch.setenv("CHIPGLOW_MEMORY", "2 GB")
    check_cost(Study())  # 1.6 GB
    monkeypatch.setenv("CHIPGLOW_MEMORY", "1 GB")
    with pytest.raises(MemoryLimitError, match=r"cutting\.field_of_view\.spacing: .*1\.6"):
        check_cost(Study())


def test_a_scene_that_does_not_fit_the_disk_names_the_interval(monkeypatch, tmp_path):
    monkeypatch.setenv("CHIPGLOW_CACHE", str(tmp_path / "not" / "there"))
    usage = namedtuple("usage", "free")
    monkeypatch.setattr("chipglow.study.cost.disk_usage", lambda _: usage(1e6))
    with pytest.raises(ValueError, match=r"cutting\.window\.interval: 0\.2 us: .* 0\.001 GB left"):
        check_cost(Study())


def test_the_pixels_of_a_scene_are_compared_with_the_memory(monkeypatch):
    monkeypatch.setenv("CHIPGLOW_MEMORY", "1 GB")
    raster = Raster(0.0, 1e-3, 1e-6, 1000, 1000)
    with pytest.raises(MemoryLimitError, match=r"camera\.pitch: 0\.1 um makes 1e\+08 pixels"):
        Camera(pitch=1e-7).pixels(raster)


@pytest.mark.parametrize("vary", ["1um:2um:999999999999", ",".join(["1um"] * 400)])
def test_a_sweep_of_too_many_points_is_refused(vary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text("{}")
    options = [f"--vary=camera.{name}={vary}" for name in ("pitch", "psf.fwhm")]
    refused(["sweep", "study.yaml", *options, "--out", "sweep"], "expected")
    assert not (tmp_path / "sweep").exists()


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (OverflowError("int too large to convert to float"), "a number is too large: int"),
        (RecursionError("maximum depth"), "the input is nested too deeply"),
    ],
)
def test_what_no_limit_foresaw_is_one_line(error, text, tmp_path, monkeypatch):
    def fails(*_):
        raise error

    monkeypatch.setattr("chipglow.study.study_text", fails)
    refused(["init", tmp_path / "study.yaml"], text)


def test_ctrl_c_in_a_callback_of_a_library_counts(monkeypatch):
    """Python drops what a callback raises; the command would go on."""
    monkeypatch.setattr(sys, "unraisablehook", commands._ignored)
    former = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background

    class Thing:
        pass

    thing = Thing()
    watch = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    begin = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt):
            del thing
            time.sleep(60)  # the second Ctrl-C comes after 0.01 s, and ends this
    finally:
        signal.signal(signal.SIGINT, former)
    assert time.monotonic() - begin < 30  # s: half of the sleep, on a busy machine
    assert watch() is None


def test_ctrl_c_before_a_command_begins_is_one_line(monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, "tolerate_failures", lambda: None)
    monkeypatch.setattr(commands, "app", interrupted)
    numbers = {getattr(signal, name, signal.SIGTERM) for name in ("SIGTERM", "SIGHUP")}
    before = {number: signal.getsignal(number) for number in numbers}  # `main` sets them
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    try:
        with pytest.raises(SystemExit) as end:
            commands.main()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert end.value.code == 130
    assert capsys.readouterr().err == "chipglow: interrupted, nothing was written\n"
