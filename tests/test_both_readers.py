"""``import`` and ``convert`` read one file alike: the same temperatures at the same places."""

from itertools import permutations, product

import h5py
import numpy as np
import pytest
import scipy.io
import xarray as xr
from command import run

from chipglow.io import prospect, read_measurement, read_scene
from chipglow.io.cameras.formats import find_format, read_here
from chipglow.io.cameras.stacks import Stated
from chipglow.io.importing import Import
from chipglow.io.sources import SourceError, Units
from chipglow.io.sources.grids.grid import GridSource
from chipglow.laboratory.recordings import load_measurement
from chipglow.quantities.units import parse_unit
from chipglow.scene import Raster

FAR_BELOW = 1e-12
"""In m and s: a ten-millionth of a pixel, a billionth of the time between frames."""

PITCH = 10e-6
ROWS, COLUMNS, FRAMES = 6, 8, 3
X = 5e-6 + PITCH * np.arange(COLUMNS)
Y = 25e-6 - PITCH * np.arange(ROWS)
TIMES = 1e-3 * np.arange(FRAMES)
# 32 bits near 600 K, and coordinates that are rounded in 32 bits.
CLOSE = {"rtol": 0, "atol": 2e-4}


def truth():
    """Temperatures in K at X, Y and TIMES, no two alike; the upper row first."""
    return 300.0 + 1e6 * X + 3e6 * (Y[:, None] + 30e-6) + 1e3 * TIMES[:, None, None]


def a_dataset(order=("time", "y", "x"), reverse=(), values=None, **attributes):
    values = truth() if values is None else values
    array = xr.DataArray(
        values,
        {"time": ("time", TIMES, {"units": "s"}),
         "y": ("y", Y, {"units": "m"}), "x": ("x", X, {"units": "m"})},
        ("time", "y", "x"),
        attrs={"units": "K", **attributes},
    )  # fmt: skip
    array = array.isel({axis: slice(None, None, -1) for axis in reverse}).transpose(*order)
    return array.to_dataset(name="temperature")


def convert(path, **stated):
    """Temperatures, and left, top and pitch in m, as ``convert`` reads them."""
    recording = read_here(path, find_format(path), None, Stated(**stated))
    assert recording.quantity == "temperature"
    return recording


def imported(path, **options):
    """Temperatures on the file's own samples and their raster, as ``import`` reads them."""
    source = GridSource(str(path), **options)
    looked = prospect(Import(source))
    frames = list(source.frames(looked.raster))
    return np.stack([frame.fields["temperature"] for frame in frames]), looked.raster


def check_both(path, expected=None, **options):
    expected = truth() if expected is None else expected
    recording = convert(path)
    np.testing.assert_allclose(recording.signal, expected, **CLOSE)
    kelvins, raster = imported(path, **options)
    np.testing.assert_allclose(kelvins, expected, **CLOSE)
    assert recording.pitch == pytest.approx(raster.spacing)
    assert recording.position == pytest.approx((raster.left, raster.top), abs=FAR_BELOW)
    assert (raster.left, raster.top) == pytest.approx((0.0, 30e-6), abs=FAR_BELOW)
    np.testing.assert_allclose(recording.times, TIMES, atol=FAR_BELOW)


# Orientation


def netcdf4(data, folder):
    data.to_netcdf(folder / "a.nc", engine="h5netcdf")
    return folder / "a.nc"


def netcdf3(data, folder):
    data.to_netcdf(folder / "a.nc", engine="scipy")
    return folder / "a.nc"


def hdf5(data, folder):
    """Names of dimensions as labels, and coordinates without dimension scales."""
    with h5py.File(folder / "a.h5", "w") as file:
        for name, variable in data.variables.items():
            file[f"run/{name}"] = variable.values
            file[f"run/{name}"].attrs["units"] = variable.attrs["units"]
        for number, dim in enumerate(data["temperature"].dims):
            file["run/temperature"].dims[number].label = dim
    return folder / "a.h5"


def zarr_store(version, data, folder):
    pytest.importorskip("zarr")
    data.to_zarr(folder / "a.zarr", zarr_format=version, consolidated=False)
    return folder / "a.zarr"


def zarr_2(data, folder):
    return zarr_store(2, data, folder)


def zarr_3(data, folder):
    return zarr_store(3, data, folder)


FORMATS = (netcdf4, netcdf3, hdf5, zarr_2, zarr_3)
ORDERS = tuple(permutations(("time", "y", "x")))
REVERSED = ((), ("y",), ("x",), ("y", "x"))


@pytest.mark.parametrize("write", FORMATS, ids=lambda write: write.__name__)
def test_any_order_and_direction_of_axes_comes_out_upright_in_both(tmp_path, write):
    for number, (order, reverse) in enumerate(product(ORDERS, REVERSED)):
        folder = tmp_path / str(number)
        folder.mkdir()
        check_both(write(a_dataset(order, reverse), folder))


def named(dims, **attributes):
    """The file with other names of dimensions, and attributes of their coordinates."""
    data = a_dataset(reverse=("y",)).rename(dict(zip(("time", "y", "x"), dims, strict=True)))
    for dim, stated in attributes.items():
        data[dim].attrs.update(stated)
    return data


AXES = {"yy": {"axis": "Y"}, "xx": {"axis": "X"}}
STANDARD = {
    "yy": {"standard_name": "projection_y_coordinate"},
    "xx": {"standard_name": "projection_x_coordinate"},
}
NAMES = [
    (named(("time", "row", "column")), ("time", "y", "x")),
    (named(("frame", "height", "width")), ("time", "y", "x")),
    (named(("frame", "height", "width")), ("x", "time", "y")),
    (named(("time", "yy", "xx"), **AXES), ("x", "y", "time")),
    (named(("time", "yy", "xx"), **STANDARD), ("y", "x", "time")),
    (named(("t", "Y", "X")), ("x", "y", "time")),
    (named(("step", "y", "x")), ("y", "x", "time")),
]


@pytest.mark.parametrize(("data", "order"), NAMES)
def test_axes_are_known_by_names_and_attributes(tmp_path, data, order):
    places = dict(zip(("time", "y", "x"), data["temperature"].dims, strict=True))
    path = netcdf4(data.transpose(*(places[axis] for axis in order)), tmp_path)
    check_both(path)


@pytest.mark.parametrize("dims", [("a", "x", "b"), ("x", "z"), ("time", "x"), ("y", "y2", "x2")])
def test_axes_that_would_be_a_guess_are_refused(tmp_path, dims):
    data = xr.Dataset({"temperature": (dims, truth()[: None if len(dims) == 3 else 1].squeeze())})
    path = netcdf4(data, tmp_path)
    for read in (lambda: convert(path, unit="K"), lambda: imported(path, spacing=PITCH)):
        with pytest.raises(SourceError, match="give its axes"):
            read()


@pytest.mark.usefixtures("read_here")
def test_a_given_pitch_leaves_the_direction_to_the_coordinate(tmp_path):
    path = netcdf4(a_dataset(reverse=("y", "x")), tmp_path)
    kelvins, _ = imported(path, spacing=PITCH)
    np.testing.assert_allclose(kelvins, truth(), **CLOSE)
    measured = load_measurement(path, ["pitch=20 um", "band=3-5 um"])
    # Temperatures are stored as float32.
    np.testing.assert_allclose(measured.radiance_temperature(), truth(), rtol=1e-6)
    assert measured.raster == Raster(0.0, ROWS * 20e-6, 20e-6, ROWS, COLUMNS)
    assert "pitch of 10 µm; the given one of 20 µm is used" in measured.data.attrs["remarks"]


@pytest.mark.usefixtures("read_here")
def test_a_turned_image_or_a_tip_replaces_the_position_in_the_file(tmp_path):
    path = netcdf4(a_dataset(), tmp_path)
    settings = ["band=3-5 um"]
    assert load_measurement(path, settings).raster.top == pytest.approx(30e-6)
    assert load_measurement(path, [*settings, "tip=2,3"]).raster.left == pytest.approx(-20e-6)
    turned = load_measurement(path, [*settings, "quarter_turns=1"])
    assert turned.raster.extent == pytest.approx((0.0, ROWS * PITCH, 0.0, COLUMNS * PITCH))


# Formats without coordinates


def npy(values, folder):
    np.save(folder / "a.npy", values)
    return folder / "a.npy"


def npz(values, folder):
    np.savez(folder / "a.npz", temperature=values)
    return folder / "a.npz"


def matlab(values, folder):
    scipy.io.savemat(folder / "a.mat", {"temperature": values[0]})
    return folder / "a.mat"


def tiff(values, folder):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(folder / "a.tif", values, photometric="minisblack")
    return folder / "a.tif"


def csv(values, folder):
    np.savetxt(folder / "a.csv", values[0], delimiter=",", fmt="%.6f")
    return folder / "a.csv"


@pytest.mark.parametrize("write", [npy, npz, matlab, tiff, csv], ids=lambda write: write.__name__)
def test_one_image_without_coordinates_is_the_same_in_both(tmp_path, write):
    path = write(truth().astype(np.float32), tmp_path)
    recording = convert(path, unit="K", interval=1e-3)
    kelvins, _ = imported(path, spacing=PITCH, interval=1e-3)
    np.testing.assert_allclose(recording.signal, kelvins, **CLOSE)
    np.testing.assert_allclose(kelvins, truth()[: len(kelvins)], **CLOSE)
    assert "Row 0 is the upper edge." in recording.notes.assumed


def test_both_commands_write_the_same_temperatures_at_the_same_places(tmp_path):
    path = netcdf4(a_dataset(("x", "time", "y"), ("y",)), tmp_path)
    measured, scene = tmp_path / "measured.nc", tmp_path / "scene.nc"
    run("convert", path, "--set", "band=3-5 um", "--out", measured)
    run("import", path, "--set", "completion.motion=none", "--out", scene)
    seen, fields = read_measurement(measured), xr.open_dataset(scene)
    for axis in ("x", "y"):
        np.testing.assert_allclose(seen.data[axis], fields[axis], atol=FAR_BELOW)
    # Radiance of 32 bits, and its inverse: 1e-6 of 400 K.
    np.testing.assert_allclose(seen.radiance_temperature(), fields["temperature"], atol=2e-3)
    fields.close()


# Units, scales, packing

CELSIUS = truth() - 273.15
UNITS = {
    "K": truth(), "kelvin": truth(), "degC": CELSIUS, "celsius": CELSIUS, "°C": CELSIUS,
    "degF": CELSIUS * 1.8 + 32, "cK": truth() * 100, "dK": truth() * 10, "mK": truth() * 1000,
    "0.01 K": truth() * 100, "0.04 K": truth() * 25, "0.1 degC": CELSIUS * 10,
    "1e-2 degC": CELSIUS * 100,
}  # fmt: skip


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_the_same_stated_in_the_file_or_by_the_user(tmp_path, unit):
    stated = netcdf4(a_dataset(values=UNITS[unit], units=unit), tmp_path)
    check_both(stated)
    silent = a_dataset(values=UNITS[unit])
    del silent["temperature"].attrs["units"]
    path = zarr_3(silent, tmp_path)
    np.testing.assert_allclose(convert(path, unit=unit).signal, truth(), **CLOSE)
    given = Units(temperature=parse_unit(unit, "K", "temperature"))
    np.testing.assert_allclose(imported(path, units=given)[0], truth(), **CLOSE)


PACKING = [
    {"dtype": "i2", "scale_factor": 0.02, "add_offset": 200.0, "_FillValue": -32768},
    {"dtype": "u2", "scale_factor": 0.01, "_FillValue": 0},
    {"dtype": "u2", "scale_factor": 0.01, "add_offset": 20.0},
    {"dtype": "i2", "scale_factor": 0.01, "_Unsigned": "true", "_FillValue": -1},
    {"dtype": "i4", "scale_factor": 0.001},
    {"dtype": "f4"},
]


@pytest.mark.parametrize(
    ("unit", "packing", "write"), list(product(("K", "degC", "degF"), PACKING, FORMATS)),
    ids=lambda value: getattr(value, "__name__", None),
)  # fmt: skip
def test_packed_temperatures_are_the_same_in_both(tmp_path, unit, packing, write):
    scale, offset = (packing.get(name, own) for name, own in
                     (("scale_factor", None), ("add_offset", 0.0)))  # fmt: skip
    values, kind = UNITS[unit], packing["dtype"]
    if scale is not None:
        values = np.rint((values - offset) / scale).astype("u2" if "_Unsigned" in packing else kind)
    raw = values.view(kind) if "_Unsigned" in packing else values.astype(kind)
    if write is netcdf3 and kind == "u2":
        pytest.skip("NetCDF 3 has no unsigned numbers")
    attributes = {name: value for name, value in packing.items() if name != "dtype"}
    if "_FillValue" in attributes:
        attributes["_FillValue"] = np.array(attributes["_FillValue"]).astype(kind)[()]
    data = a_dataset(values=raw, units=unit)
    for name in ("scale_factor", "add_offset", "_Unsigned", "_FillValue"):
        if name in attributes:
            data["temperature"].attrs[name] = attributes[name]
    if write is hdf5:
        path = hdf5(data, tmp_path)
        with h5py.File(path, "a") as file:
            file["run/temperature"].attrs.update(attributes)
    else:
        path = write(data, tmp_path)
    recording, (kelvins, _) = convert(path), imported(path)
    np.testing.assert_allclose(recording.signal, kelvins, **CLOSE)
    # Half a step of packing, in kelvins.
    np.testing.assert_allclose(kelvins, truth(), rtol=0, atol=0.0101)


def test_a_scale_and_an_offset(tmp_path):
    path = npy(np.rint((CELSIUS + 40.0) / 0.04).astype(np.uint16), tmp_path)
    recording = convert(path, unit="degC", scale=0.04, offset=-40.0, interval=1e-3)
    # Half a step of 0.04 K, and 32 bits.
    np.testing.assert_allclose(recording.signal, truth(), rtol=0, atol=0.0201)
    units = Units(temperature=parse_unit("degC", "K", "temperature"))
    told = {"units": units, "scale": 0.04, "offset": -40.0}
    kelvins, _ = imported(path, spacing=PITCH, interval=1e-3, **told)
    np.testing.assert_allclose(kelvins, recording.signal, **CLOSE)


def test_a_unit_that_contradicts_the_file_wins_and_is_said(tmp_path):
    path = netcdf4(a_dataset(units="degC"), tmp_path)
    said = "temperature is in 'degC'; the given unit is used instead."
    recording = convert(path, unit="K")
    np.testing.assert_allclose(recording.signal, truth(), **CLOSE)
    assert said in recording.notes.warnings
    source = GridSource(str(path), units=Units(temperature=parse_unit("K", "K", "temperature")))
    assert said in prospect(Import(source)).notes.warnings
    np.testing.assert_allclose(next(source.frames(prospect(Import(source)).raster))
                               .fields["temperature"], truth()[0], **CLOSE)  # fmt: skip


def test_a_number_that_stands_for_nothing(tmp_path):
    values = truth().astype(np.float32)
    values[:, 2, 3] = 0.0
    path = npy(values, tmp_path)
    signal = convert(path, unit="K", interval=1.0, void_value=0.0).signal
    kelvins, _ = imported(path, spacing=PITCH, interval=1.0, void_value=0.0)
    np.testing.assert_array_equal(np.isnan(signal), np.isnan(kelvins))
    assert np.isnan(signal).sum() == FRAMES


# Refused by both


def without_unit(name, values):
    data = a_dataset().assign_coords({name: values})
    data[name].attrs = {}
    return data


def image(values):
    values = np.asarray(values, np.float64)
    return xr.Dataset({"temperature": (("y", "x"), values, {"units": "K"})})


UNEVEN = a_dataset().assign_coords(x=("x", X**2, {"units": "m"}))
REFUSED = [
    (a_dataset(values=truth() * 100), "temperature .* K, expected 200 to 6000 K; .* cK"),
    (a_dataset(values=truth() * 100, units="degC"), "expected 200 to 6000 K"),
    (a_dataset(values=np.rint(truth() * 10)), "look like tenths of kelvins"),
    (a_dataset(values=CELSIUS), "expected 200 to 6000 K"),
    (a_dataset(values=truth() - 320), "expected 200 to 6000 K"),
    (a_dataset(values=truth() + 6000), "expected 200 to 6000 K"),
    (a_dataset(values=np.full_like(truth(), np.nan)), "every value is missing"),
    (image(np.full((1, 5), 300.0)), r"\(1, 5\)"),
    (image(np.full((5, 1), 300.0)), r"\(5, 1\)"),
    (a_dataset(units="bar"), "unit"),
    (a_dataset().isel(time=[0, 2, 1]), "does not ascend"),
    (a_dataset().isel(x=[0, 2, 1, 3, 4, 5, 6, 7]), "x: neither ascends|x: not monotonic"),
    (a_dataset(valid_range=np.array([5000.0, 6000.0])), "every value is missing"),
]


@pytest.mark.parametrize(("data", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_cannot_be_is_refused_by_both(tmp_path, data, said):
    path = netcdf4(data, tmp_path)
    options = {} if "x" in data.coords else {"spacing": PITCH}
    for read in (convert, lambda path: imported(path, **options)):
        with pytest.raises(SourceError, match=said):
            read(path)


PLACES = [
    (without_unit("x", np.arange(COLUMNS)), "x only counts along x"),
    (without_unit("y", np.arange(ROWS) + 1), "y only counts along y"),
    (without_unit("x", 1e6 * X), "extends over 70 and states no unit"),
    (a_dataset().assign_coords(x=("x", X, {"units": "pixel"})), "unknown unit 'pixel' of x"),
    (UNEVEN, "expected even ones"),
]


@pytest.mark.parametrize(("data", "said"), PLACES, ids=[said for _, said in PLACES])
def test_coordinates_that_state_no_places_are_not_used_and_said(tmp_path, data, said):
    path = netcdf4(data, tmp_path)
    with pytest.raises(SourceError, match="grid.spacing|" + said):
        imported(path)
    recording = convert(path)
    assert recording.pitch is None
    assert said in " ".join((*recording.notes.remarks, *recording.notes.warnings))
    np.testing.assert_allclose(recording.signal, truth(), **CLOSE)


def test_pixels_that_are_not_square_are_refused_by_convert_and_resampled_by_import(tmp_path):
    data = a_dataset().assign_coords(x=("x", 2 * X, {"units": "m"}))
    path = netcdf4(data, tmp_path)
    with pytest.raises(SourceError, match="pixels of 20 um x 10 um, expected square ones"):
        convert(path)
    assert imported(path)[1].shape == (ROWS, 2 * COLUMNS)


def test_times_that_only_count_are_not_times(tmp_path):
    data = a_dataset().assign_coords(time=np.arange(FRAMES))
    path = netcdf4(data, tmp_path)
    with pytest.raises(SourceError, match="give the interval between frames"):
        convert(path)
    notes = GridSource(str(path)).survey().notes
    assert "The files contain no times: frames are 1 s apart." in notes.assumed
    assert "time only counts along time: it is not used." in notes.remarks


# Series of files, mesh grids and origins


def series(data, folder, packing=None):
    """One file for each frame of several datasets."""
    for number, one in enumerate(data):
        encoding = {"temperature": packing(number)} if packing else None
        one.to_netcdf(folder / f"a_{number}.nc", engine="h5netcdf", encoding=encoding)
    return folder / "a_*.nc"


def own_scale(number):
    return {"dtype": "i2", "scale_factor": 0.01 * (number + 1), "add_offset": 450.0,
            "_FillValue": -32768}  # fmt: skip


EACH = [a_dataset(reverse=("y",)).isel(time=[number]) for number in range(FRAMES)]
SERIES = {
    "coordinates in each file": ([one.isel(time=0, drop=True) for one in EACH], None),
    "a frame and its time in each file": (EACH, None),
    "packed by a scale of their own": (EACH, own_scale),
    "several frames in each file": (
        [a_dataset(), a_dataset().assign_coords(
            time=("time", TIMES + TIMES[-1] + 1e-3, {"units": "s"})
        )],
        None,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("data", "packing"), SERIES.values(), ids=SERIES)
def test_a_series_of_files_is_upright_and_in_time(tmp_path, data, packing):
    path = series(data, tmp_path, packing)
    stated = {} if "time" in data[0].coords else {"interval": 1e-3}
    expected = np.concatenate([truth()] * 2) if len(data) == 2 else truth()
    # Packed numbers are rounded to 0.03 K.
    close = {"rtol": 0, "atol": 0.016} if packing else CLOSE
    recording = convert(path, **stated)
    np.testing.assert_allclose(recording.signal, expected, **close)
    np.testing.assert_allclose(recording.times, 1e-3 * np.arange(len(expected)), atol=FAR_BELOW)
    kelvins, raster = imported(path, **stated)
    np.testing.assert_allclose(kelvins, expected, **close)
    assert (raster.left, raster.top) == pytest.approx((0.0, 30e-6), abs=FAR_BELOW)


def test_files_of_a_series_at_other_places_are_refused(tmp_path):
    first, *others = EACH
    path = series([first.isel(y=slice(None, None, -1)), *others], tmp_path)
    for read in (convert, imported):
        with pytest.raises(SourceError, match="y: differs between frames"):
            read(path)


def mesh_grid(data):
    """Coordinates as matrices of all samples."""
    x, y = np.meshgrid(data["x"].values, data["y"].values)
    return xr.Dataset(
        {"temperature": (("j", "i"), data["temperature"].values[0], {"units": "K"})},
        {"x": (("j", "i"), x, {"units": "m"}), "y": (("j", "i"), y, {"units": "m"})},
    )


@pytest.mark.parametrize("reverse", REVERSED)
def test_coordinates_of_a_mesh_grid(tmp_path, reverse):
    path = netcdf4(mesh_grid(a_dataset(reverse=reverse)), tmp_path)
    recording, (kelvins, raster) = convert(path), imported(path)
    np.testing.assert_allclose(recording.signal, truth()[:1], **CLOSE)
    np.testing.assert_allclose(kelvins, truth()[:1], **CLOSE)
    assert recording.position == pytest.approx((raster.left, raster.top), abs=FAR_BELOW)


def test_coordinates_of_a_curved_grid_are_not_used_and_said(tmp_path):
    data = mesh_grid(a_dataset())
    data["y"] = data["y"] + 0.1 * data["x"]
    path = netcdf4(data, tmp_path)
    said = "y does not vary along y alone: it is not used as a coordinate."
    assert said in convert(path).notes.warnings
    with pytest.raises(SourceError, match=r"has no coordinate 'y', expected grid\.spacing"):
        imported(path)


def test_an_axis_of_one_band_is_left_out(tmp_path):
    path = netcdf4(a_dataset().expand_dims(band=1, axis=1), tmp_path)
    check_both(path)


ORIGINS = {"UL": (), "LL": ("y",), "UR": ("x",), "LR": ("y", "x")}


@pytest.mark.parametrize("origin", ORIGINS)
def test_the_origin_of_an_image_of_hdf5(tmp_path, origin):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["data"] = a_dataset(reverse=ORIGINS[origin])["temperature"].values[0] - 273.15
        file["data"].attrs.update(DISPLAY_ORIGIN=np.bytes_(origin), Unit="degC")
    recording = convert(tmp_path / "a.h5")
    np.testing.assert_allclose(recording.signal, truth()[:1], **CLOSE)
    assert sum("DISPLAY_ORIGIN" in text for text in recording.notes.remarks) == len(ORIGINS[origin])
    kelvins, _ = imported(tmp_path / "a.h5", spacing=PITCH)
    np.testing.assert_allclose(kelvins, truth()[:1], **CLOSE)


@pytest.mark.parametrize("kind", ["IMAGE_INDEXED", "IMAGE_TRUECOLOR"])
def test_colours_of_hdf5_are_refused_by_both(tmp_path, kind):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["data"] = truth()[0]
        file["data"].attrs["IMAGE_SUBCLASS"] = np.bytes_(kind)
    for read in (lambda path: convert(path, unit="K"), lambda path: imported(path, spacing=1e-5)):
        with pytest.raises(SourceError, match=f"colours .{kind}"):
            read(tmp_path / "a.h5")


def test_bounds_and_flags_are_not_images(tmp_path):
    data = a_dataset()
    data["time"].attrs["bounds"] = "time_bnds"
    data["time_bnds"] = (("time", "edge"), np.stack([TIMES, TIMES + 1e-4], axis=1))
    data["quality"] = (("time", "y", "x"), np.zeros(truth().shape, np.uint8))
    data["quality"].attrs["flag_values"] = np.array([0, 1], np.uint8)
    check_both(netcdf4(data, tmp_path))
    data["plastic_strain"] = data["temperature"] / 1000
    data["plastic_strain"].attrs = {}
    (tmp_path / "a.nc").unlink()
    path = netcdf4(data, tmp_path)
    check_both(path)
    assert any("among" in text for text in convert(path).notes.assumed)


@pytest.mark.usefixtures("read_here")
def test_a_flat_field_stored_in_another_direction_is_refused(tmp_path):
    counts = (truth() * 10).astype(np.uint16)
    data = a_dataset(reverse=("y",), values=counts, units="counts")
    path = netcdf4(data, tmp_path)
    np.save(tmp_path / "flat.npy", np.full((9, ROWS, COLUMNS), 3000, np.uint16))
    settings = [f"flat_field.low={tmp_path / 'flat.npy'}", "unit=counts", "interval=1 ms"]
    with pytest.raises(ValueError, match="is stored along y, x, the recording along -y, x"):
        load_measurement(path, settings)


@pytest.mark.usefixtures("read_here")
def test_an_image_of_metres_is_doubted_by_both(tmp_path):
    data = a_dataset().assign_coords(
        x=("x", 1e5 * X, {"units": "m"}), y=("y", 1e5 * Y, {"units": "m"})
    )
    path = netcdf4(data, tmp_path)
    doubt = "8 m large by {}; a chip is about 1 mm."
    assert any(doubt.format("units.length") in text
               for text in prospect(Import(GridSource(str(path)))).notes.assumed)  # fmt: skip
    measured = load_measurement(path, ["band=3-5 um"])
    assert doubt.format("pitch") in measured.data.attrs["assumed"]


def test_a_scene_in_memory_is_read_in_the_same_way(tmp_path):
    path = netcdf4(a_dataset(("x", "y", "time"), ("x",)), tmp_path)
    scene = read_scene(GridSource(str(path)))
    np.testing.assert_allclose(scene.data["temperature"], truth(), **CLOSE)
