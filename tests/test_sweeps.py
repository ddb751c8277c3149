"""Sweeps: each point equals its own run, and what was computed stays."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import chipglow
from drawn import in_a_notebook

from chipglow.analysis import headlines
from chipglow.io import write_scene
from chipglow.io.atomic import exclusive
from chipglow.quantities import changed
from chipglow.scene import Raster, Scene
from chipglow.study import Study, Sweep, errors, study_text, sweep
from chipglow.study.sweeps import _key, axis
from chipglow.study.workers import _TASKS_PER_WORKER, local_client, on_client

EXPOSURES, PITCHES = ("2 us", "4 us"), ("3 um", "6 um", "9 um")
GRID = {"camera.integration_time": EXPOSURES, "camera.pitch": PITCHES}
PLACE = "hot, pixel"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A hot band that moves, and a point that it crosses."""
    raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=80, columns=80)
    times = 1e-6 * np.arange(8)
    frames = [600 + 500 * np.exp(-(((raster.x - 4.0 * t) / 10e-6) ** 2)) for t in times]
    temperature = np.stack([np.broadcast_to(one, raster.shape) for one in frames])
    path = tmp_path_factory.mktemp("sweep") / "band.nc"
    write_scene(Scene.from_fields(raster, times, {"temperature": temperature}), path)
    return Study(
        scene=str(path),
        surface={"kind": "uniform", "emissivity": 0.6},
        camera={
            "psf": {"kind": "gaussian", "fwhm": "8 um"},
            "integration_time": "2 us",
            "lower_limit": None,
        },
        analysis={"exposures": 3, "phases": 2, "points": {"hot": ("10 um", "0 um")}},
    )


@pytest.fixture(scope="module")
def grid(study, tmp_path_factory):
    return sweep(study, GRID, tmp_path_factory.mktemp("grid") / "out", at=("hot",), workers=0)


def contents(one):
    return {path.name: path.read_bytes() for path in (one.folder / "points").iterdir()}


def test_each_point_of_a_grid_is_its_own_run(study, grid):
    data = grid.to_xarray()
    assert data.error.dims == ("camera.integration_time", "camera.pitch", "reading")
    np.testing.assert_array_equal(data["camera.pitch"], [3e-6, 6e-6, 9e-6])
    for exposure, pitch in (("2 us", "3 um"), ("4 us", "9 um")):
        changes = {"camera.integration_time": exposure, "camera.pitch": pitch}
        one = headlines(errors(changed(study, changes)).data)[PLACE]
        at = {"camera.integration_time": float(exposure[0]) * 1e-6, "reading": PLACE}
        point = data.sel(at).sel({"camera.pitch": float(pitch[0]) * 1e-6}, method="nearest")
        assert float(point.error) == one.error.mean
        assert float(point.uncertainty) == one.error.expanded_uncertainty
        assert float(point.psf_portion) == one.psf_portion.mean
        assert float(point.true_error) == one.true_error.mean


def test_points_that_exist_are_kept_and_missing_ones_are_computed_again(study, grid, tmp_path):
    first = sweep(study, {"camera.pitch": PITCHES[:2]}, tmp_path / "out", at=("hot",), workers=0)
    files = sorted((first.folder / "points").iterdir())
    before = [path.stat().st_mtime_ns for path in files]
    again = sweep(study, {"camera.pitch": PITCHES}, tmp_path / "out", at=("hot",), workers=0)
    assert [path.stat().st_mtime_ns for path in files] == before
    whole = contents(again)
    assert len(whole) == 3 and not again.missing and not again.failed
    files[0].unlink()
    opened = Sweep.open(tmp_path / "out")
    assert len(opened.missing) == 1
    assert np.isnan(opened.to_xarray().error).sum() == 1
    again = sweep(study, {"camera.pitch": PITCHES}, tmp_path / "out", at=("hot",), workers=0)
    assert contents(again) == whole


def test_workers_give_the_same_bits(study, grid, tmp_path):
    distributed = sweep(study, GRID, tmp_path / "out", at=("hot",), workers=2)
    assert contents(distributed) == contents(grid)


def test_a_change_of_the_scene_or_the_seed_is_another_point(study, tmp_path):
    other = tmp_path / "other.nc"
    changes = [
        {},
        {"title": "another"},
        {"seed": 3},
        {"camera.pitch": "5 um"},
        {"analysis.phases": 3},
    ]
    keys = [_key(changed(study, one), ()) for one in changes]
    assert keys[0] == keys[1]
    assert len(set(keys)) == 4
    other.write_bytes(Path(study.scene).read_bytes())
    copied = changed(study, {"scene": str(other)})
    assert _key(copied, ()) == keys[0]
    other.write_bytes(b"another scene")
    os.utime(other, ns=(0, 0))
    assert _key(copied, ()) != keys[0]


def test_a_scene_without_suffix_counts_by_its_content(study, tmp_path):
    first, second = tmp_path / "scene", tmp_path / "again"
    first.write_bytes(Path(study.scene).read_bytes())
    plain = changed(study, {"scene": str(first)})
    key = _key(plain, ())
    assert key == _key(study, ())
    second.write_bytes(b"another" + first.read_bytes())
    # A file of the same name, size and time.
    status = first.stat()
    content = bytearray(first.read_bytes())
    content[len(content) // 2] ^= 1
    first.write_bytes(content)
    os.utime(first, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert first.stat().st_size == status.st_size
    assert len({key, _key(plain, ()), _key(changed(study, {"scene": str(second)}), ())}) == 3


def test_a_changed_scene_is_computed_again(study, tmp_path):
    scene, vary = tmp_path / "scene", {"camera.pitch": PITCHES[:1]}
    raster = Raster(left=-40e-6, top=40e-6, spacing=1e-6, rows=80, columns=80)
    plain = changed(study, {"scene": str(scene)})
    found = []
    for kelvins in (700.0, 900.0):
        temperature = np.full((8, *raster.shape), kelvins)
        write_scene(
            Scene.from_fields(raster, 1e-6 * np.arange(8), {"temperature": temperature}), scene
        )
        result = sweep(plain, vary, tmp_path / "out", at=("hot",), workers=0)
        found.append(float(result.to_xarray().reference.squeeze()))
    assert found[1] - found[0] > 100.0


def test_another_sweep_in_a_running_ones_folder_is_refused(study, tmp_path):
    out, vary = tmp_path / "out", {"camera.pitch": PITCHES[:1]}
    first = sweep(study, vary, out, at=("hot",), workers=0)
    stated = (out / "sweep.json").read_text()
    # The folder is held as by a sweep in another process, whose end releases it.
    refusal = "out: another sweep is running there; wait for its end"
    with exclusive(out / "points", ""), pytest.raises(ValueError, match=refusal):
        sweep(study, {"camera.pitch": PITCHES[1:]}, out, at=("hot",), workers=0)
    assert (out / "sweep.json").read_text() == stated
    second = sweep(study, {"camera.pitch": PITCHES[1:]}, out, at=("hot",), workers=0)
    # Each sweep has its own points, whichever was the last in the folder.
    assert [one["camera.pitch"] for one in first.settings] == [3e-6]
    assert len(second.keys) == 2 and not second.missing and not first.missing


@pytest.mark.parametrize(
    "content",
    [
        b"", b'{"readings": {"hot, pixel": {"refe', b"[]", b"null", b"7", b"{}", b"\xff\xfe\x00",
        b'{"readings": []}', b'{"readings": {"hot, pixel": {}}}', b'{"failed": 3}',
        b'{"readings": {"hot, pixel": {"reference": 1.0}}}',
    ],
)  # fmt: skip
def test_a_damaged_point_is_missing_and_computed_again(study, tmp_path, content):
    vary = {"camera.pitch": PITCHES[:1]}
    whole = contents(sweep(study, vary, tmp_path / "out", at=("hot",), workers=0))
    (file,) = (tmp_path / "out" / "points").iterdir()
    file.write_bytes(content)
    assert Sweep.open(tmp_path / "out").missing == (0,)
    assert contents(sweep(study, vary, tmp_path / "out", at=("hot",), workers=0)) == whole


@pytest.mark.parametrize("content", ["", '{"axes": {', "[]", "{}"])
def test_a_damaged_description_is_named(grid, tmp_path, content):
    (tmp_path / "sweep.json").write_text(content)
    with pytest.raises(ValueError, match=r"sweep\.json: is damaged; run the sweep again"):
        Sweep.open(tmp_path)


def test_workers_that_die_while_they_start_are_one_line(monkeypatch, tmp_path):
    def dies(*arguments, **options):
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr("distributed.LocalCluster", dies)
    match = r"did not start .*; the computed points are kept"
    with (
        pytest.raises(ConnectionError, match=match),
        local_client(None, 2, 2, tmp_path / "workers"),
    ):
        pass


def test_a_point_that_fails_is_stated_and_the_others_are_computed(study, tmp_path):
    vary = {"camera.integration_time": ("2 us", "40 us", "2 s")}
    result = sweep(study, vary, tmp_path / "out", at=("hot",), workers=0)
    assert list(result.failed) == [1, 2]
    assert "lasts 8 us" in result.failed[1] and "integration_time" in result.failed[2]
    assert np.isfinite(result.to_xarray().error.values).tolist() == [[True], [False], [False]]
    assert list(result.to_frame().point) == [0]


@pytest.mark.parametrize(
    ("vary", "more", "text"),
    [
        ({"camera.pich": ("5 um",)}, {}, "pich"),
        ({"camera.pitch": ("5",)}, {}, "has no unit"),
        ({}, {}, "at least one setting"),
        ({"camera.pitch": "5 um:6 us:3"}, {}, "same unit"),
        ({"camera.pitch": ("5 um", "6 um")}, {"method": "random"}, "unknown"),
    ],
)
def test_impossible_sweeps_write_nothing(study, tmp_path, vary, more, text):
    with pytest.raises(ValueError, match=text):
        sweep(study, vary, tmp_path / "out", workers=0, **more)
    assert not (tmp_path / "out").exists()


def test_a_folder_with_other_files_is_refused(study, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="contains no sweep"):
        sweep(study, GRID, tmp_path, workers=0)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("2us,5 us", ["2us", "5 us"]),
        ("6um:20um:8", [f"{n} um" for n in range(6, 21, 2)]),
        ("1:4:4", [1, 2, 3, 4]),
        ("0.2:0.4:3", [0.2, pytest.approx(0.3), 0.4]),
        ("optics,detector", ["optics", "detector"]),
        (("3 um", None), ["3 um", None]),
    ],
)
def test_values_of_an_axis(text, values):
    assert axis(text) == values


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_samples_fill_their_ranges_and_follow_from_the_seed(study, tmp_path, method):
    vary = {"camera.pitch": "3 um:9 um", "camera.integration_time": "2 us:4 us"}
    options = {"method": method, "samples": 4, "workers": 0, "at": ("hot",)}
    one, same, other = (
        sweep(study, vary, tmp_path / str(number), seed=seed, **options)
        for number, seed in enumerate((1, 1, 2))
    )
    assert one.settings == same.settings != other.settings
    # Both methods put one sample into each quarter of a range.
    for path, low, high in (("camera.pitch", 3e-6, 9e-6), ("camera.integration_time", 2e-6, 4e-6)):
        values = np.array([point[path] for point in one.settings])
        quarters = np.floor(4 * (values - low) / (high - low)).astype(int)
        assert sorted(quarters) == [0, 1, 2, 3]
    assert one.to_xarray().error.dims == ("point", "reading")


def write_once(folder, number, lethal):
    """Write a file; at the first time a lethal number kills its process."""
    mark = folder / f"tried-{number}"
    if number in lethal and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    (folder / f"{number}-{os.getpid()}-{len(list(folder.glob(f'{number}-*')))}").touch()


def test_a_killed_worker_costs_no_task_that_was_counted(tmp_path):
    function, workers = partial(write_once, tmp_path), 2
    with local_client(None, workers, 40, tmp_path / "workers") as client:
        # The last task kills its worker when all others are done, half of them by that worker.
        done = sum(1 for _ in on_client(client, function, [(n, (39,)) for n in range(40)]))
    assert done == 40
    times = [len(list(tmp_path.glob(f"{number}-*"))) for number in range(40)]
    assert min(times) == 1
    # Finished tasks are repeated only until they are counted: no more than are submitted at a time.
    assert sum(times) - 40 < _TASKS_PER_WORKER * workers


SWEEPING = """
import ctypes, sys, os
from pathlib import Path
from chipglow.study.workers import _TASKS_PER_WORKER, local_client, on_client

def hold(folder, number):  # a computation that lets no other thread of its process run
    (folder / f"pid-{os.getpid()}").touch()
    ctypes.PyDLL(None).sleep(600)

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with local_client(None, 2, 2, folder / "workers") as client:
        list(on_client(client, hold, [(folder, 0), (folder, 1)]))
"""


def alive(pid):
    """Whether a process runs; one that has ended but was not waited for does not."""
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the kernel ends the workers on Linux")
def test_workers_end_with_a_killed_sweep_and_the_next_removes_their_files(tmp_path):
    script = tmp_path / "sweeping.py"
    script.write_text(SWEEPING)
    own = {**os.environ, "TMPDIR": str(tmp_path / "tmp")}
    (tmp_path / "tmp").mkdir()
    with subprocess.Popen([sys.executable, script, tmp_path], env=own) as process:
        try:
            until = time.monotonic() + 300  # the workers import for long on a busy machine
            while len(pids := [path.name[4:] for path in tmp_path.glob("pid-*")]) < 2:
                assert time.monotonic() < until
                assert process.poll() is None
                time.sleep(0.2)
        finally:
            process.kill()
    until = time.monotonic() + 60  # the kernel signals them at once
    while any(map(alive, pids)):
        assert time.monotonic() < until
        time.sleep(0.2)
    assert not list((tmp_path / "tmp").glob("dask*"))
    assert any((tmp_path / "workers").iterdir())
    with local_client(None, 1, 1, tmp_path / "workers") as client:
        assert list(on_client(client, time.sleep, [(0.0,)])) == [None]
    assert not (tmp_path / "workers").exists()


def test_a_cluster_without_workers_ends_the_sweep(monkeypatch, tmp_path):
    monkeypatch.setattr("chipglow.study.workers._SILENCE", 0.5)
    with local_client(None, 1, 1, tmp_path / "workers") as client:
        client.cluster.scale(0)
        client.cluster.sync(client.cluster._correct_state)
        with pytest.raises(ConnectionError, match="every worker of the cluster is lost"):
            list(on_client(client, time.sleep, [(0.1,)]))


def test_the_figure_draws_each_point_over_each_setting(study, tmp_path):
    vary = {
        "camera.psf.fwhm": ("6 um", "12 um"),
        "camera.pitch": ("3 um", "9 um"),
        "camera.integration_time": ("2 us", "3 us", "4 us"),
    }
    result = sweep(study, vary, tmp_path / "out", at=("hot",), workers=0)
    data, figure = result.to_xarray(), result.plot()
    assert [panel.get_xlabel() for panel in figure.axes] == [
        "fwhm / µm", "pitch / µm", "integration time / µs",
    ]  # fmt: skip
    for panel, path in zip(figure.axes, vary, strict=True):
        drawn = set(zip(*(values.tolist() for values in panel.lines[0].get_data()), strict=True))
        expected = {
            (round(1e6 * float(one[path]), 6), float(one.error))
            for one in (
                data.isel(dict(zip((*vary, "reading"), (*index, 0), strict=True)))
                for index in np.ndindex(2, 2, 3)
            )
        }
        assert drawn == expected


@pytest.fixture
def command(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("study.yaml").write_text(study_text(study))
    return ("sweep", "study.yaml", "--at", "hot", "--workers", "0", "--out", "out")


def test_bands_are_varied_by_their_text(command):
    vary = ("--vary", "camera.band=3.8-5.1 um,1.5-1.7 um", "--vary", "camera.pitch=3 um,6 um")
    assert "1.5-1.7 um" in chipglow(*command, *vary).output
    data = Sweep.open("out").to_xarray()
    assert list(data["camera.band"].values) == ["3.8-5.1 um", "1.5-1.7 um"]
    assert np.isfinite(data.error).all()


def test_the_command_writes_table_arrays_and_figure(command):
    output = chipglow(*command, "--vary", "camera.integration_time=2us,4us").output
    assert "2 points: 2 computed, 0 failed." in output and "4 us" in output
    out = Path("out")
    written = "points sweep.json sweep.csv sweep.nc sweep.png"
    assert {path.name for path in out.iterdir()} == set(written.split())
    with xr.open_dataset(out / "sweep.nc", engine="h5netcdf") as data:
        stored = data.error.sel(reading=PLACE).values
    records = [json.loads(path.read_text()) for path in (out / "points").iterdir()]
    assert sorted(stored) == sorted(one["readings"][PLACE]["error"] for one in records)
    assert "PATH=VALUES" in chipglow(*command, "--vary", "pitch", code=2).stderr


def test_an_opened_sweep_is_drawn_in_its_units_and_shown_with_what_failed(study, tmp_path):
    vary = {"camera.integration_time": ("2 us", "3 us", "40 us")}
    sweep(study, vary, tmp_path / "out", at=("hot",), workers=0)
    opened = Sweep.open(tmp_path / "out")
    (axes,) = opened.plot().axes
    assert axes.get_xlabel() == "integration time / µs"
    np.testing.assert_allclose(list(axes.lines[0].get_xdata()), [2.0, 3.0, 40.0])
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), opened.to_xarray().error.values[:, 0])
    columns, rows, (failure,) = in_a_notebook(opened)
    assert columns == list(opened.to_frame().columns)
    assert [row[0] for row in rows] == ["0", "1"]
    assert failure == f"Point 2 failed: {opened.failed[2]}"


def test_a_sweep_without_a_computed_point_says_so(study, tmp_path):
    sweep(study, {"camera.pitch": PITCHES[:1]}, tmp_path / "out", at=("hot",), workers=0)
    for file in (tmp_path / "out" / "points").iterdir():
        file.unlink()
    opened = Sweep.open(tmp_path / "out")
    assert in_a_notebook(opened)[1:] == ([], ["1 of 1 points are not computed yet."])
    with pytest.raises(ValueError, match="no point is computed, so there is nothing to draw"):
        opened.plot()
