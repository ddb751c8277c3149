"""Grids of other programs: what is read is what was there, and what is wrong is one clear error."""

import pickle
import struct
import tracemalloc
import zipfile
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import xarray as xr
from hypothesis import given, settings, strategies as st
from PIL import Image
from refusals import refused_on
from tolerances import SINGLE

from chipglow.io.sources import Placement, Units
from chipglow.io.sources.conventions import SI_UNITS
from chipglow.io.sources.grids.grid import GridSource
from chipglow.quantities.units import (
    CELSIUS,
    HEAT_TRANSFER,
    SPEED,
    TEMPERATURE,
    TEMPERATURE_DIFFERENCE,
    Unit,
    parse_unit,
)
from chipglow.scene import Raster
from chipglow.scene.regrid import regrid, taps

SPACING = (2e-6, 3e-6)
LEFT, TOP = -4e-6, 9e-6
FRAMES, ROWS, COLUMNS = 4, 6, 7
X = LEFT + SPACING[0] * (np.arange(COLUMNS) + 0.5)
Y = TOP - SPACING[1] * (np.arange(ROWS) + 0.5)
TIMES = 1e-6 * np.arange(FRAMES)
FIT = Raster(LEFT, TOP, 1e-6, 18, 14)
INNER = Raster(X[0], Y[0], 0.5e-6, 30, 24)
# Fields are kept in 32 bits: a unit in the last place of 1000 K.
ROUNDING = 1.3e-4


def linear(x, y, time=0.0):
    return 700.0 + 1e7 * x - 2e7 * y[:, None] + 1e7 * time


def a_stack():
    return np.stack([linear(X, Y, time) for time in TIMES]).astype(np.float32)


def check_linear(frame, atol=ROUNDING):
    expected = linear(INNER.x, INNER.y, frame.time)
    np.testing.assert_allclose(frame.fields["temperature"], expected, atol=atol)


def a_source(files, **changed):
    given = {"spacing": SPACING[0], "row_spacing": SPACING[1], "interval": 1e-6}
    files = files if isinstance(files, dict) else str(files)
    return GridSource(files, **{**given, "left": LEFT, "top": TOP, **changed})


def npz_fortran(folder, values):
    np.savez(folder / "all.npz", T=np.asfortranarray(values))
    return folder / "all.npz", {}


def hdf5(folder, values):
    with h5py.File(folder / "all.h5", "w") as file:
        file.create_dataset("fields/T", data=values, chunks=(3, 2, 7), compression="gzip")
    return folder / "all.h5", {}


def matlab73(folder, values):
    with h5py.File(folder / "all.mat", "w", userblock_size=512) as file:
        file["T"] = values.transpose(1, 2, 0).T  # as MATLAB stores its columns
        file["T"].attrs["MATLAB_class"] = np.bytes_("single")
    return folder / "all.mat", {"axes": ("y", "x", "time")}


def tiff_of_libtiff(folder, values):
    pytest.importorskip("tifffile")
    pictures = [Image.fromarray(frame) for frame in values]
    others = {"save_all": True, "append_images": pictures[1:], "compression": "tiff_lzw"}
    pictures[0].save(folder / "T.tif", **others)
    return folder / "T.tif", {}


def csv_semicolons(folder, values):
    for number, frame in enumerate(values):
        path = folder / f"T_{number * 7}.csv"
        np.savetxt(path, frame, delimiter=";", fmt="%.9g")
        path.write_text(path.read_text().replace(".", ","))
    return folder / "T_*.csv", {}


FORMATS = [npz_fortran, hdf5, matlab73, tiff_of_libtiff, csv_semicolons]
"""Those of test_import_formats.py are further ones."""


@pytest.mark.parametrize("write", FORMATS, ids=lambda write: write.__name__)
def test_every_format_gives_back_what_was_written(tmp_path, write):
    path, options = write(tmp_path, a_stack())
    source = pickle.loads(pickle.dumps(a_source(path, **options)))
    survey = source.survey()
    # In s: times of 1e-6 s are rounded to 1e-22 s.
    np.testing.assert_allclose(survey.times, TIMES, atol=1e-15)
    np.testing.assert_allclose(
        survey.extent, (LEFT, X[-1] + 1e-6, Y[-1] - 1.5e-6, TOP), rtol=SINGLE
    )
    assert list(survey.found) == ["temperature"]
    assert survey.spacing == pytest.approx(SPACING[0])
    frames = list(source.frames(INNER))
    assert [frame.time for frame in frames] == pytest.approx(list(TIMES))
    for frame in frames:
        check_linear(frame)
        assert (frame.material == 1).all()
    (last,) = source.frames(INNER, start=3)
    np.testing.assert_array_equal(last.fields["temperature"], frames[3].fields["temperature"])


def test_16_bit_tiff_and_attributes_of_packing(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    kelvins = np.round(a_stack()).astype(np.uint16)
    tifffile.imwrite(tmp_path / "T.tif", kelvins, imagej=True)
    (frame, *_) = a_source(tmp_path / "T.tif").frames(FIT)
    assert frame.fields["temperature"][0, 0] == kelvins[0, 0, 0]
    with h5py.File(tmp_path / "T.h5", "w") as file:
        packed = file.create_dataset("T", data=np.array([[[0, 10], [20, -1]]], np.int16))
        packed.attrs.update(scale_factor=0.5, add_offset=300.0, _FillValue=np.int16(-1))
    source = GridSource(str(tmp_path / "T.h5"), spacing=1e-6)
    (frame,) = source.frames(Raster(0.0, 0.0, 1e-6, 2, 2))
    np.testing.assert_array_equal(frame.fields["temperature"], [[300.0, 305.0], [310.0, np.nan]])
    np.testing.assert_array_equal(frame.material, [[1, 1], [1, 0]])


def test_coarser_samples_are_means_over_their_area(tmp_path):
    np.save(tmp_path / "T.npy", a_stack())
    coarse = Raster(LEFT, TOP, 3.5e-6, 5, 4)
    (frame, *_) = a_source(tmp_path / "T.npy").frames(coarse)
    fine = linear(np.repeat(X, 8), np.repeat(Y, 12))  # samples of 0.25 um
    expected = fine[:70, :].reshape(5, 14, 4, 14).mean(axis=(1, 3))
    np.testing.assert_allclose(frame.fields["temperature"], expected, atol=ROUNDING)


def test_interpolation_is_of_second_order():
    def error(count):
        centres = (np.arange(count) + 0.5) / count
        raster = Raster(0.1, 0.9, 0.8 / 400, 400, 400)
        values = np.sin(7 * centres) * np.cos(5 * centres[::-1, None])
        places = (
            taps(centres, raster.spacing, raster.x),
            taps(centres, raster.spacing, 1 - raster.y),
        )
        found, _ = regrid(
            values[None].astype(np.float32), np.ones((count, count), np.uint8), *places
        )
        return np.abs(found[0] - np.sin(7 * raster.x) * np.cos(5 * raster.y[:, None])).max()

    assert 3.5 < error(32) / error(64) < 4.5


@settings(max_examples=40)
@given(
    st.integers(2, 9), st.integers(2, 9), st.floats(0.2, 5.0), st.floats(-3.0, 3.0),
    st.integers(0, 2**32),
)  # fmt: skip
def test_samples_stay_within_the_range_of_their_material(rows, columns, spacing, left, seed):
    generator = np.random.default_rng(seed)
    material = generator.integers(0, 3, (rows, columns)).astype(np.uint8)
    values = np.where(material == 1, 500.0, 100.0) + generator.uniform(-50, 50, material.shape)
    raster = Raster(left, 1.0, spacing, 7, 8)
    across = taps(np.arange(columns, dtype=float), spacing, raster.x)
    down = taps(np.arange(rows, dtype=float), spacing, -raster.y)
    found, kinds = regrid(values[None].astype(np.float32), material, across, down)
    assert np.isnan(found[0][kinds == 0]).all()
    # The range of the values, but for float32.
    assert (np.abs(found[0][kinds == 1] - 500.0) <= 50.01).all()
    assert (np.abs(found[0][kinds == 2] - 100.0) <= 50.01).all()  # likewise


def test_outside_is_void_and_holes_stay_holes(tmp_path):
    stack = a_stack()
    stack[0, 2] = np.nan
    stack[1, :, 4] = -999.0
    np.save(tmp_path / "T.npy", stack)
    wide = Raster(LEFT - 2e-6, TOP + 3e-6, 1e-6, 24, 18)
    source = a_source(tmp_path / "T.npy", void_value=-999.0)
    for index, frame in enumerate(source.frames(wide)):
        expected = np.zeros(wide.shape)
        expected[3:21, 2:16] = 1
        if index == 0:
            expected[9:12] = 0
        if index == 1:
            expected[:, 10:12] = 0
        np.testing.assert_array_equal(frame.material, expected)
        np.testing.assert_array_equal(np.isnan(frame.fields["temperature"]), expected == 0)


def test_material_from_a_field(tmp_path):
    material = np.ones((FRAMES, ROWS, COLUMNS))
    material[:, :3] = 2
    np.savez(tmp_path / "all.npz", temperature=a_stack(), material=material)
    (frame, *_) = a_source(tmp_path / "all.npz").frames(FIT)
    assert set(frame.fields) == {"temperature"}
    np.testing.assert_array_equal(frame.material[:9], 2)
    np.testing.assert_array_equal(frame.material[9:], 1)
    np.savez(tmp_path / "all.npz", temperature=a_stack(), material=material + 2)
    refused(a_source(tmp_path / "all.npz"), "material is 4 in frame 0")


@pytest.mark.parametrize("axes", [("x", "time", "y"), ("y", "x", "time"), ("time", "x", "y")])
@pytest.mark.parametrize("top_first", [True, False])
def test_axes_in_any_order_and_either_way_up(tmp_path, axes, top_first):
    stack = a_stack() if top_first else a_stack()[:, ::-1]
    np.save(tmp_path / "T.npy", stack.transpose([("time", "y", "x").index(axis) for axis in axes]))
    source = a_source(tmp_path / "T.npy", axes=axes, top_first=top_first)
    for frame in source.frames(INNER):
        check_linear(frame)


def test_axes_and_directions_from_the_file(tmp_path):
    xr.Dataset(
        {"PEEQ": (("x", "time", "y"), a_stack().transpose(2, 0, 1)[::-1, :, ::-1] / 1000)},
        {"time": TIMES, "x": X[::-1], "y": Y[::-1]},
    ).to_netcdf(tmp_path / "all.nc", engine="h5netcdf")
    source = GridSource(str(tmp_path / "all.nc"))
    assert source.survey().found["plastic_strain"].endswith("PEEQ")
    for frame in source.frames(INNER):
        expected = linear(INNER.x, INNER.y, frame.time) / 1000
        np.testing.assert_allclose(frame.fields["plastic_strain"], expected, rtol=SINGLE)


def test_placement_turns_positions_and_vectors(tmp_path):
    ones = np.ones((1, ROWS, COLUMNS), np.float32)
    fields = {"T": a_stack()[:1], "V1": 2 * ones, "V2": 3 * ones}
    np.savez(tmp_path / "all.npz", **fields)
    # The scene's x is the file's -y, its y the file's x; its origin is in (1, 2) um.
    placement = Placement("-y", "x", 2e-6, 1e-6)
    source = a_source(tmp_path / "all.npz", placement=placement)
    left, right, bottom, top = source.survey().extent
    assert (left, right) == pytest.approx((2e-6 - TOP, 2e-6 - (Y[-1] - 1.5e-6)))
    assert (bottom, top) == pytest.approx((LEFT - 1e-6, X[-1] + 1e-6 - 1e-6))
    raster = Raster(2e-6 - Y[0], X[-1] - 1e-6, 0.5e-6, 24, 30)
    (frame,) = source.frames(raster)
    expected = linear(raster.y + 1e-6, 2e-6 - raster.x).T
    np.testing.assert_allclose(frame.fields["temperature"], expected, atol=ROUNDING)
    np.testing.assert_array_equal(frame.fields["velocity_x"], np.full(raster.shape, -3.0))
    np.testing.assert_array_equal(frame.fields["velocity_y"], np.full(raster.shape, 2.0))


def test_units_from_the_file_are_honoured_and_said(tmp_path):
    with h5py.File(tmp_path / "all.h5", "w") as file:
        file["temp"] = a_stack() - 273.15
        file["temp"].attrs["units"] = "degC"
        file["x"], file["y"], file["time"] = X * 1e3, Y * 1e6, TIMES * 1e6
        for name, unit in {"x": "mm", "y": "um", "time": "microseconds since 2020-01-01"}.items():
            file[name].attrs["units"] = unit
    source = GridSource(str(tmp_path / "all.h5"))
    assert "temp is in 'degC'." in source.survey().notes.remarks
    assert not any("degC" in text for text in source.survey().notes.assumed)
    np.testing.assert_allclose(source.survey().times, TIMES)
    (frame, *_) = source.frames(INNER)
    check_linear(frame, atol=3e-4)
    given = GridSource(str(tmp_path / "all.h5"), units=Units(temperature=Unit(1.0, 100.0)))
    (other, *_) = given.frames(INNER)
    moved = other.fields["temperature"] - frame.fields["temperature"]
    # Float32 of both temperatures: 3e-5 K each.
    np.testing.assert_allclose(moved, 100.0 - 273.15, atol=1e-4)
    assert "temp is in 'degC'; the given unit is used instead." in given.survey().notes.warnings


def test_units_given_where_the_file_says_none(tmp_path):
    np.save(tmp_path / "T.npy", a_stack() - 273.15)
    source = a_source(tmp_path / "T.npy", units=Units(temperature=CELSIUS))
    (frame, *_) = source.frames(INNER)
    check_linear(frame, atol=3e-4)
    assert any(
        "K: the file states no unit" in t for t in a_source(source.files).survey().notes.assumed
    )


@pytest.mark.parametrize(
    ("field", "text", "unit"),
    [
        ("temperature", "°C", Unit(1.0, 273.15)),
        ("temperature", "Celsius", Unit(1.0, 273.15)),
        ("x", "µm", Unit(1e-6)),
        ("velocity_x", "m s-1", Unit(1.0)),
        ("velocity_x", "m/min", Unit(1 / 60)),
        ("plastic_strain_rate", "s^-1", Unit(1.0)),
        ("plastic_strain", "%", Unit(0.01)),
        ("time", "milliseconds since 1970-01-01 00:00", Unit(1e-3)),
    ],
)
def test_units_as_others_write_them(field, text, unit):
    found = parse_unit(text, SI_UNITS[field], field)
    assert found.scale == pytest.approx(unit.scale)
    assert found.offset == pytest.approx(unit.offset)


@pytest.mark.parametrize(
    ("quantity", "text", "value"),
    [
        (TEMPERATURE, "20 celsius", 293.15),
        (TEMPERATURE_DIFFERENCE, "20 celsius", 20.0),
        (TEMPERATURE_DIFFERENCE, "9 degF", 5.0),
        (HEAT_TRANSFER, "50 W m-2 K-1", 50.0),
        (SPEED, "250 m min^-1", 250 / 60),
    ],
)
def test_units_that_people_write_are_read_as_those_of_files(quantity, text, value):
    assert quantity.parse(text) == value


@pytest.mark.parametrize("text", ["bar", "degrees_north", "m**9**9**9**9", "", "__import__('os')"])
def test_unknown_units_are_refused(tmp_path, text):
    with h5py.File(tmp_path / "all.h5", "w") as file:
        file["T"] = a_stack()
        file["T"].attrs["units"] = text
    refused(a_source(tmp_path / "all.h5"), "unknown unit", "all.h5: T")


def test_fields_in_files_of_their_own(tmp_path):
    np.save(tmp_path / "a.npy", a_stack())
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["one"], file["two"] = a_stack() / 100, a_stack()
    files = {"temperature": str(tmp_path / "a.npy"), "plastic_strain": str(tmp_path / "b.h5")}
    source = a_source(files, names={"plastic_strain": "one"})
    (frame, *_) = source.frames(INNER)
    strain, temperature = frame.fields["plastic_strain"], frame.fields["temperature"]
    np.testing.assert_allclose(strain, temperature / 100, rtol=SINGLE)
    np.save(tmp_path / "a.npy", a_stack()[:, :-1])
    refused(source, "b.h5: one: has [4, 6, 7] samples along time, y, x, expected [4, 5, 7]")


def test_what_is_not_named_is_said(tmp_path):
    np.save(tmp_path / "result.npy", a_stack())
    survey = a_source(tmp_path / "result.npy", interval=None).survey()
    assert any("The only array 'result'" in text for text in survey.notes.assumed)
    assert "The files contain no times: frames are 1 s apart." in survey.notes.assumed
    assert "The axes of result are time, y, x." in survey.notes.assumed
    np.savez(tmp_path / "two.npz", one=a_stack(), two=a_stack())
    refused(a_source(tmp_path / "two.npz"), "it has one, two")
    refused(a_source(tmp_path / "two.npz", names={"temperature": "three"}), "'three'")
    refused(a_source(tmp_path / "result.npy", spacing=None), "spacing")


def test_only_a_block_of_frames_is_in_memory(tmp_path):
    with h5py.File(tmp_path / "all.h5", "w") as file:
        file.create_dataset("T", shape=(400, 300, 300), dtype="f4", chunks=(2, 300, 300))
        file["T"][:4] = 300.0
    source = a_source(tmp_path / "all.h5")
    tracemalloc.start()
    for _ in source.frames(Raster(0.0, 0.0, 10e-6, 40, 40)):
        pass
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20e6  # the file has 144 MB


# Bad input


refused = partial(refused_on, FIT, 50e6)


def test_missing_files(tmp_path):
    with pytest.raises(FileNotFoundError):
        a_source(tmp_path / "T.npy").survey()
    with pytest.raises(FileNotFoundError, match="no file has such a name"):
        a_source(tmp_path / "T_*.npy").survey()
    (tmp_path / "T.xyz").write_text("1")
    refused(a_source(tmp_path / "T.xyz"), "unknown ending '.xyz'")


def npy_header(shape, kind="<f4"):
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize("shape", [(1, 10**6, 10**6), (10**12, 5, 5), (2**62, 2**62, 4)])
def test_npy_that_claims_too_much(tmp_path, shape):
    (tmp_path / "T.npy").write_bytes(npy_header(shape) + bytes(1000))
    refused(a_source(tmp_path / "T.npy"), "T.npy")
    with zipfile.ZipFile(tmp_path / "T.npz", "w") as archive:
        archive.writestr("T.npy", npy_header(shape) + bytes(1000))
    refused(a_source(tmp_path / "T.npz"), "T.npz")


def a_trap(folder):
    class Trap:
        def __reduce__(self):
            return (Path.touch, (folder / "ran",))

    return Trap()


def test_pickles_are_not_loaded(tmp_path):
    trap = a_trap(tmp_path)
    np.save(tmp_path / "T.npy", np.full((2, 2), trap), allow_pickle=True)
    np.savez(tmp_path / "T.npz", T=np.full((2, 2), trap))
    (tmp_path / "P.npy").write_bytes(pickle.dumps(trap))
    for name in ("T.npy", "T.npz", "P.npy"):
        refused(a_source(tmp_path / name), name)
    assert not (tmp_path / "ran").exists()


def test_zarr_codec_that_unpickles_is_refused(tmp_path):
    zarr = pytest.importorskip("zarr")
    group = zarr.open_group(tmp_path / "a.zarr", mode="w", zarr_format=2)
    array = group.create_array("T", shape=(1, 2, 2), chunks=(1, 2, 2), dtype="f4", compressors=None)
    array[:] = 1.0
    header = tmp_path / "a.zarr" / "T" / ".zarray"
    text = header.read_text()
    assert '"filters": null' in text
    header.write_text(text.replace('"filters": null', '"filters": [{"id": "pickle"}]'))
    (tmp_path / "a.zarr" / "T" / "0.0.0").write_bytes(pickle.dumps(a_trap(tmp_path)))
    refused(a_source(tmp_path / "a.zarr"), "'pickle'")
    assert not (tmp_path / "ran").exists()


def test_bomb_in_an_archive(tmp_path):
    # 3 GB of zeros in 3 MB would be slow to make; 300 MB show the same: no more is unpacked than
    # a frame has, and here a frame has too much.
    with (
        zipfile.ZipFile(tmp_path / "T.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("T.npy", "w") as stream,
    ):
        stream.write(npy_header((1, 15_000, 15_000), "|u1"))
        for _ in range(15_000):
            stream.write(bytes(15_000))
    refused(a_source(tmp_path / "T.npz"), "2.25e+08 samples at once, expected up to 1e+08")


@pytest.mark.parametrize(
    ("shape", "chunks"),
    [
        ((10, 10**7, 10**7), (1, 100, 100)),
        ((3, 10**9, 10), None),
        ((200, 2000, 2000), (200, 2000, 2000)),
    ],
)
def test_hdf5_that_claims_too_much(tmp_path, shape, chunks):
    with h5py.File(tmp_path / "T.h5", "w") as file:
        file.create_dataset("T", shape, "f4", chunks=chunks)
    refused(a_source(tmp_path / "T.h5"), "T.h5: T", "expected")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1," * 10**7 + "1\n", "a line has over 4000000 letters"),
        ("300,301\n302,hot\n", "T.csv, line 2, column 2: 'hot' is not a number"),
        ("300,301\n302,303,304\n", "T.csv, line 1: has 2 cells, expected 3"),
    ],
    ids=["long", "text", "ragged"],
)
def test_csv_that_is_no_matrix(tmp_path, text, said):
    (tmp_path / "T.csv").write_text(text)
    refused(a_source(tmp_path / "T.csv"), said)


def of_scipy(name):
    path = Path(scipy.__file__).parent / "io" / name
    if not path.exists():
        pytest.skip("this SciPy comes without its tests")
    return str(path)


def test_a_file_that_matlab_wrote():
    """MATLAB 7.4, ``reshape(1:24, 2, 3, 4)``: rows, columns, time."""
    path = of_scipy("matlab/tests/data/test3dmatrix_7.4_GLNX86.mat")
    source = GridSource(path, axes=("y", "x", "time"), spacing=1.0)
    frames = list(source.frames(Raster(0.0, 0.0, 1.0, 2, 3)))
    expected = np.arange(1, 25).reshape(2, 3, 4, order="F")
    found = np.stack([frame.fields["temperature"] for frame in frames], axis=2)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "name", ["bad_miuint32", "corrupted_zlib_data", "debigged_m4", "malformed1"]
)
def test_damaged_files_of_matlab(name):
    path = of_scipy(f"matlab/tests/data/{name}.mat")
    refused(GridSource(path, spacing=1.0), f"{name}.mat")


def test_csv_frames_of_different_size(tmp_path):
    (tmp_path / "T_1.csv").write_text("300 301\n302 303\n")
    (tmp_path / "T_2.csv").write_text("300 301\n302 303\n304 305\n")
    refused(a_source(tmp_path / "T_*.csv"), "T_2.csv", "(2, 2)", "(3, 2)")


def test_coordinates_that_go_wrong(tmp_path):
    def with_coordinates(**changed):
        with h5py.File(tmp_path / "all.h5", "w") as file:
            file["T"] = a_stack()
            for name, values in {"x": X, "y": Y, "time": TIMES, **changed}.items():
                file[name] = values
        return GridSource(str(tmp_path / "all.h5"))

    (frame, *_) = with_coordinates().frames(INNER)
    assert (frame.material == 1).all()
    refused(
        with_coordinates(time=TIMES[[0, 2, 1, 3]]), "time: does not ascend, frame 2 is at 1e-06"
    )
    refused(with_coordinates(x=X[[0, 1, 2, 4, 3, 5, 6]]), "x: not monotonic, value 4")
    refused(with_coordinates(x=X**3), "all.h5: x", "one")
    refused(with_coordinates(x=np.geomspace(1, 2, COLUMNS)), "x: steps from", "expected even ones")
    refused(with_coordinates(y=np.where(Y > 0, Y, np.nan)), "y: value 3 is nan")
    refused(with_coordinates(x=X[:-1]), "x: has 6 values, expected 7")


def test_a_list_t_is_the_time_and_an_array_t_the_temperature(tmp_path):
    times = [0.0, 1e-6, 3e-6, 4e-6]
    np.savez(tmp_path / "timed.npz", t=times, temperature=a_stack())
    np.savez(tmp_path / "heat.npz", t=a_stack())
    timed, heat = (
        a_source(tmp_path / f"{name}.npz", interval=None).survey() for name in ("timed", "heat")
    )
    assert timed.times.tolist() == times
    assert timed.unused == ()
    assert heat.found == {"temperature": "t"}
    assert len(heat.times) == FRAMES
