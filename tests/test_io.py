"""Files: what comes back, what is refused, and that nothing half-written stays."""

import errno
import gc
import shutil
import subprocess
import sys
from dataclasses import fields as fields_of
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from command import full_disk
from hypothesis import HealthCheck, given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from tolerances import DOUBLE

from chipglow.camera.measurement import Measurement
from chipglow.io import (
    SceneWriter,
    atomic_folder,
    atomic_path,
    open_scene,
    read_measurement,
    unfinished_scenes,
    write_dataset,
    write_measurement,
    write_scene,
)
from chipglow.io.digest import HDF5Sink
from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Frame, Raster, SceneError, ToolGeometry

RASTER = Raster(left=-420e-6, top=460e-6, spacing=0.6667e-6, rows=18, columns=27)
RELATIVE = {
    "material_x": 2.0**-18,
    "material_y": 2.0**-18,
    "plastic_strain": 2.0**-14,
    "plastic_strain_rate": 2.0**-12,
    "velocity_x": 2.0**-11,
    "velocity_y": 2.0**-11,
}


def a_frame(time=0.0, seed=1, raster=RASTER, **changed):
    generator = np.random.default_rng(seed)

    def field(lowest, highest):
        return generator.uniform(lowest, highest, raster.shape).astype(np.float32)

    values = {
        "temperature": field(290.0, 1500.0),
        "plastic_strain": field(0.0, 6.0),
        "plastic_strain_rate": field(0.0, 1e5),
        "velocity_x": field(-5.0, 5.0),
        "velocity_y": field(-5.0, 5.0),
        "material": generator.integers(0, 3, raster.shape).astype(np.uint8),
        "material_x": field(-2e-3, 0.0),
        "material_y": field(-5e-4, 5e-4),
    }
    return Frame(time=time, **{**values, **changed})


def a_file(folder, count=3, name="scene.nc", **options):
    path = folder / name
    with SceneWriter(path, RASTER, ToolGeometry(), {"study": "one"}, **options) as writer:
        for index in range(count):
            writer.append(a_frame(index * 0.2e-6, seed=index))
        writer.forces([0.0, 1e-6], [4.0e5, 4.5e5], [1.5e5, 2.0e5], [3e-4, np.nan])
    return path


def write_frame(path, frame, **options):
    with SceneWriter(path, RASTER, **options) as writer:
        writer.append(frame)


def assert_as_kept(found, expected):
    assert found.time == expected.time
    for name in (one.name for one in fields_of(Frame) if one.name not in ("time", "splines")):
        one, other = getattr(found, name), getattr(expected, name)
        assert (one is None) == (other is None), name
        if one is not None:
            assert one.dtype == other.dtype
            np.testing.assert_allclose(one, other, rtol=RELATIVE.get(name, 0.0), err_msg=name)


def leftovers(folder):
    return sorted(path.name for path in folder.iterdir())


def test_scene_comes_back(tmp_path):
    scene = open_scene(a_file(tmp_path))
    np.testing.assert_allclose(scene.raster.extent, RASTER.extent, rtol=DOUBLE)
    assert scene.raster.shape == RASTER.shape
    assert scene.tool == ToolGeometry()
    assert scene.data.attrs["study"] == "one"
    np.testing.assert_array_equal(scene.times, np.arange(3) * 0.2e-6)
    for index, frame in enumerate(scene.frames()):
        assert_as_kept(frame, a_frame(index * 0.2e-6, seed=index))
    np.testing.assert_array_equal(scene.data["force_time"], [0.0, 1e-6])
    np.testing.assert_array_equal(scene.data["cutting_force"], [4.0e5, 4.5e5])
    np.testing.assert_array_equal(scene.data["thrust_force"], [1.5e5, 2.0e5])
    assert scene.data["thrust_force"].attrs["units"] == "N/m"
    assert leftovers(tmp_path) == ["scene.nc"]


def test_a_scalar_in_degrees_is_not_rounded_to_steps(tmp_path):
    share = 273.15 + np.linspace(0.0, 0.4402, RASTER.rows * RASTER.columns).reshape(RASTER.shape)
    write_frame(tmp_path / "scene.nc", a_frame(temperature=share.astype(np.float32)))
    found = open_scene(tmp_path / "scene.nc").celsius()
    # Half of the spacing of float32 at 273 K.
    np.testing.assert_allclose(found, share - 273.15, atol=1.7e-5)


def test_a_scene_packed_by_the_conventions_is_read(tmp_path):
    """As chipglow itself wrote temperatures up to its version of 2026, and others do."""
    scene = open_scene(a_file(tmp_path))
    packed = {
        "temperature": {"dtype": "i4", "scale_factor": 0.025, "add_offset": 200.0, "_FillValue": -1}
    }
    data = scene.data.load().drop_encoding()
    data.to_netcdf(tmp_path / "packed.nc", engine="h5netcdf", encoding=packed)
    for one, other in zip(open_scene(tmp_path / "packed.nc").frames(), scene.frames(), strict=True):
        # Half of a step of 0.025 K, and float32.
        np.testing.assert_allclose(one.temperature, other.temperature, atol=0.0126)


def test_the_fast_way_reads_what_xarray_reads(tmp_path):
    scene = open_scene(a_file(tmp_path))
    for name in (*FIELD_UNITS, "material_x", "material_y"):
        fast, general = getattr(scene.frame(2), name), scene.data[name][2].values
        # Scaled values once in float32, once in float64: a rounding of float32.
        np.testing.assert_allclose(fast, general, rtol=2e-7, atol=1e-12)


def test_frames_are_chunks_and_are_read_lazily(tmp_path):
    path = a_file(tmp_path)
    assert "velocity_x" in repr(open_scene(path).data)
    with h5py.File(path) as file:
        assert all(file[name].chunks == (1, *RASTER.shape) for name in FIELD_UNITS)
        # Every reader of NetCDF-4 has these.
        assert {file[name].compression for name in file} <= {"gzip", None}
    variable = open_scene(path).data["temperature"].variable
    assert not isinstance(variable._data, np.ndarray)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    temperature=arrays(np.float32, (2, 3), elements=st.floats(200.0, 6000.0, width=32)),
    strain=arrays(np.float32, (2, 3), elements=st.floats(0.0, 1e3, width=32)),
    speed=arrays(np.float32, (2, 3), elements=st.floats(-1e3, 1e3, width=32)),
    position=arrays(np.float32, (2, 3), elements=st.floats(-0.015625, 0.015625, width=32)),
)
def test_any_scene_comes_back(tmp_path, temperature, strain, speed, position):
    raster = Raster(0.0, 0.0, 1e-6, 2, 3)
    fields = {
        "temperature": temperature,
        "plastic_strain": strain,
        "plastic_strain_rate": strain * np.float32(1e4),
        **{"velocity_x": speed, "velocity_y": -speed},
        **{"material_x": position, "material_y": -position},
    }
    frame, path = a_frame(1e-6, raster=raster, **fields), tmp_path / "any.nc"
    with SceneWriter(path, raster) as writer:
        writer.append(frame)
    # Below float32's least normal value, 1e-38, rounding is no longer relative.
    assert_as_kept(open_scene(path).frame(0), frame)


def test_write_scene_keeps_all(tmp_path):
    scene = open_scene(a_file(tmp_path))
    write_scene(scene, tmp_path / "copy.nc")
    copy = open_scene(tmp_path / "copy.nc")
    assert copy.tool == scene.tool
    assert copy.data.attrs == scene.data.attrs
    np.testing.assert_array_equal(copy.data["thrust_force"], scene.data["thrust_force"])
    for one, other in zip(copy.frames(), scene.frames(), strict=True):
        for name in (*FIELD_UNITS, "material_x", "material_y"):
            # What was rounded once stays as it is.
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize(
    ("times", "changed", "message"),
    [
        ([0.0, 1e-6], {"temperature": 25.0}, "looks like °C"),
        ([0.0, 1e-6], {"plastic_strain": np.nan}, "not finite everywhere at 1e-06 s"),
        ([0.0, 1e-6], {"material_y": None}, r"'material_y' is missing at 1e-06 s, .*\(18, 27\)"),
        ([0.0, 1e-6], {"quality": 0.0}, "quality has type float32"),
        ([1e-6, 1e-6], {}, "frame at 1e-06 s, expected later than 1e-06 s"),
        ([], {}, "no frame was written"),
    ],
)
def test_the_writer_refuses_wrong_frames(tmp_path, times, changed, message):
    full = {
        name: value if value is None else np.full(RASTER.shape, value, dtype=np.float32)
        for name, value in changed.items()
    }
    with (
        pytest.raises(SceneError, match=message),
        SceneWriter(tmp_path / "scene.nc", RASTER) as writer,
    ):
        for number, time in enumerate(times):
            writer.append(a_frame(time, **(full if number else {})))
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("kept", [0.02, 0.5, 0.99])
def test_a_file_cut_short_is_named(tmp_path, kept):
    path = a_file(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(SceneError, match=r"scene\.nc: not a scene, or truncated"):
        open_scene(path)


def test_a_foreign_file_is_named(tmp_path):
    path = tmp_path / "foreign.nc"
    with pytest.raises(FileNotFoundError, match=r"foreign\.nc: there is no such file"):
        open_scene(path)
    path.write_text("not a scene")
    with pytest.raises(SceneError, match=r"foreign\.nc: not a scene, or truncated") as caught:
        open_scene(path)
    assert "\n" not in str(caught.value)
    xr.Dataset({"a": ("time", [1.0])}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(SceneError, match=r"foreign\.nc: scene: coordinate 'time' is missing"):
        open_scene(path)
    with h5py.File(path, "w") as file:
        file["a"] = np.zeros((3, 4))
    with pytest.raises(SceneError, match=r"foreign\.nc: "):
        open_scene(path)


def test_an_interrupted_writer_leaves_what_was_there(tmp_path):
    path = a_file(tmp_path)
    before = path.read_bytes()
    with pytest.raises(KeyboardInterrupt), SceneWriter(path, RASTER) as writer:
        writer.append(a_frame())
        assert len(leftovers(tmp_path)) == 2
        raise KeyboardInterrupt
    assert leftovers(tmp_path) == ["scene.nc"]
    assert path.read_bytes() == before


FULL_DISK = """
import resource, sys
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_io import RASTER, a_frame
from chipglow.io import SceneWriter
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
try:
    with SceneWriter(Path({folder!r}) / "scene.nc", RASTER) as writer:
        for index in range({count}):
            writer.append(a_frame(index * 1e-6))
except OSError as error:
    print(index, error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit on the size of files")
@pytest.mark.parametrize(("limit", "count"), [(20_000, 2000), (4_000, 1)])
def test_a_full_disk_is_one_clear_error(tmp_path, limit, count):
    program = FULL_DISK.format(
        tests=str(Path(__file__).parent), folder=str(tmp_path), limit=limit, count=count
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    index, message = done.stdout.split(maxsplit=1)
    # HDF5 writes late; but the writer does not go on to the end, unless that is near.
    assert int(index) <= count // 2
    assert message.strip().endswith(f"File too large: '{tmp_path / 'scene.nc'}'")
    assert leftovers(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit on the size of files")
def test_the_error_of_a_full_disk_keeps_no_view_of_what_was_written(tmp_path):
    data = bytearray(20_000)
    with HDF5Sink(tmp_path / "scene.h5") as sink, full_disk(10_000):
        sink.write(data)
        data.clear()  # a BufferError while there is a view
        with pytest.raises(OSError, match="File too large"):
            sink.check()


def test_a_full_disk_for_a_checkpoint_names_the_scene(tmp_path, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = a_file(tmp_path)
    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="No space") as raised, SceneWriter(path, RASTER) as writer:
        writer.append(a_frame())
        writer.checkpoint({}, 0.5)
    assert raised.value.filename == str(path)


@pytest.mark.parametrize(
    "names", [(), ("{part}",), ("{part}/figure.png",), ("source.nc", None, "{part}/copy.nc")]
)
def test_errors_of_writing_bear_the_name_that_was_asked_for(tmp_path, names):
    path = tmp_path / "results"
    with pytest.raises(OSError, match="No space") as raised, atomic_folder(path) as part:
        told = [name and name.format(part=part) for name in names]
        raise OSError(errno.ENOSPC, "No space left on device", *told)
    assert raised.value.filename == str(path)


def test_errors_of_other_files_keep_their_names(tmp_path):
    source = tmp_path / "source.nc"
    with pytest.raises(FileNotFoundError) as raised, atomic_path(tmp_path / "copy.nc") as part:
        shutil.copyfile(source, part)
    assert raised.value.filename == str(source)


def test_atomic_path_replaces_at_the_end(tmp_path):
    path = tmp_path / "figure.png"
    path.write_text("old")
    with atomic_path(path) as temporary:
        assert temporary.parent == path.parent
        assert temporary.suffix == ".png"
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert leftovers(tmp_path) == ["figure.png"]


def test_atomic_path_leaves_nothing_after_an_error(tmp_path):
    with pytest.raises(OSError, match="disk full"), atomic_path(tmp_path / "a.txt") as temporary:
        temporary.write_text("half")
        raise OSError("disk full")
    assert leftovers(tmp_path) == []
    with (
        pytest.raises(FileNotFoundError, match=r"there is no folder"),
        atomic_path(tmp_path / "nowhere" / "a.txt"),
    ):
        pass
    with pytest.raises(IsADirectoryError, match=r"is a folder"), atomic_path(tmp_path):
        pass


def a_measurement():
    band, raster = Band(3.8e-6, 5.1e-6), Raster(0.0, 5e-4, 6e-6, 4, 5)
    radiance = band.radiance(np.random.default_rng(7).uniform(500.0, 1200.0, (2, 4, 5)))
    described = band, [0.0, 1 / 600], raster, 573.15
    return Measurement.from_radiance(radiance, *described, attributes={"camera": "one"})


def a_measurement_file(folder):
    write_measurement(a_measurement(), folder / "m.nc")
    return folder / "m.nc"


def test_measurement_comes_back(tmp_path):
    measurement = a_measurement()
    write_measurement(measurement, tmp_path / "m.nc")
    found = read_measurement(tmp_path / "m.nc").data
    xr.testing.assert_identical(found, measurement.data)
    assert found["flags"].dtype == np.uint8
    assert leftovers(tmp_path) == ["m.nc"]


def test_memory_of_a_failed_write_is_freed(tmp_path, monkeypatch):
    """Else Python complains when it collects the garbage, and this test fails."""

    def full(*_):
        raise OSError(errno.ENOSPC, "full")

    monkeypatch.setattr("chipglow.io.measurement_file.write_hdf5", full)
    data = xr.Dataset({"radiance": (("time", "y", "x"), np.zeros((1, 2, 3)))})
    with pytest.raises(OSError, match="full") as failed:
        write_dataset(data, tmp_path / "a.nc")
    failed.value.itself = failed.value  # only the collection of cycles frees it
    del failed
    gc.collect()


def test_a_foreign_measurement_is_named(tmp_path):
    path = tmp_path / "m.nc"
    with pytest.raises(FileNotFoundError, match=r"m\.nc: there is no such file"):
        read_measurement(path)
    write_measurement(a_measurement(), path)
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(ValueError, match=r"m\.nc: not a measurement, or truncated"):
        read_measurement(path)
    scene = a_file(tmp_path)
    shutil.copy(scene, path)
    with pytest.raises(ValueError, match=r"m\.nc: .*'radiance_temperature' .* is missing"):
        read_measurement(path)


@pytest.mark.skipif(sys.platform == "win32", reason="files are not locked there")
def test_a_scene_is_held_till_it_is_in_its_place(tmp_path, monkeypatch):
    """Whoever looks for abandoned scenes just then must not find, and delete, this one."""
    path, move, found = tmp_path / "scene.nc", Path.replace, []

    def replace(part, target):
        found.append(unfinished_scenes(path))
        return move(part, target)

    monkeypatch.setattr(Path, "replace", replace)
    with SceneWriter(path, RASTER) as writer:
        writer.append(a_frame())
    assert found == [[]]


def test_other_fields_than_those_of_a_cut_come_back_and_survive_a_copy(tmp_path):
    flags = np.random.default_rng(5).integers(0, 256, RASTER.shape).astype(np.uint8)
    frame = a_frame(quality=flags, material_x=None, material_y=None)
    with SceneWriter(tmp_path / "one.nc", RASTER, fields=(*FIELD_UNITS, "quality")) as writer:
        writer.append(frame)
    write_scene(open_scene(tmp_path / "one.nc"), tmp_path / "two.nc")
    copy = open_scene(tmp_path / "two.nc")
    assert not copy.has_material_coordinates
    assert_as_kept(copy.frame(0), frame)
