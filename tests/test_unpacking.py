"""Numbers that NetCDF, HDF5 and Zarr pack or declare missing: right, whatever the format."""

from contextlib import ExitStack

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from chipglow.io.sources import SourceError
from chipglow.io.sources.grids.arrays import open_arrays
from chipglow.io.sources.grids.unpacking import unpack

nan = np.nan


def i1(*values):
    return np.array(values, np.int8)


def i2(*values):
    return np.array(values, np.int16)


def u1(*values):
    return np.array(values, np.uint8)


def f4(*values):
    return np.array(values, np.float32)


PREFILLED_FLOAT = 9.969209968386869e36

CASES = [
    # numbers in the file, attributes, what they stand for
    (i2(0, 10), {}, [0, 10]),
    (i2(0, 10), {"scale_factor": 0.5}, [0, 5]),
    (i2(0, 10), {"add_offset": 300.0}, [300, 310]),
    (i2(0, 10), {"scale_factor": f4(0.5)[0], "add_offset": f4(300)[0]}, [300, 305]),
    (i2(-1, 10), {"_FillValue": i2(-1)[0]}, [nan, 10]),
    (i2(-1, 10), {"_FillValue": -1}, [nan, 10]),
    (i2(-1, 10), {"_FillValue": i2(-1)[0], "scale_factor": 0.5}, [nan, 5]),
    (i2(-1, -2, 3), {"missing_value": i2(-1, -2)}, [nan, nan, 3]),
    (i2(-999, 3), {"missing_value": -999.0}, [nan, 3]),
    (i2(-999, 3), {"missing_value": -99999}, [-999, 3]),
    (u1(255, 3), {"missing_value": -9999}, [255, 3]),
    (u1(255, 3), {"missing_value": "none"}, [255, 3]),
    (f4(nan, 3), {"_FillValue": nan}, [nan, 3]),
    (f4(-999.9, 3), {"_FillValue": -999.9}, [nan, 3]),
    (f4(PREFILLED_FLOAT, 3), {}, [nan, 3]),
    (f4(PREFILLED_FLOAT, 3), {"_FillValue": f4(-1)[0]}, [nan, 3]),
    (i2(-32767, 3), {"prefilled": True}, [nan, 3]),
    (i2(-32767, 3), {}, [-32767, 3]),
    (i2(-32767, 3), {"prefilled": True, "_FillValue": i2(-1)[0]}, [-32767, 3]),
    (i2(-32767, 3).astype(">i2"), {"prefilled": True}, [nan, 3]),
    (np.array([65535, 3], np.uint16), {"prefilled": True}, [65535, 3]),
    (i1(-1, 3), {"_Unsigned": "true"}, [255, 3]),
    (i1(-1, 3), {"_Unsigned": "True"}, [255, 3]),
    (i1(-1, 3), {"_Unsigned": "false"}, [-1, 3]),
    (u1(255, 3), {"_Unsigned": "false"}, [-1, 3]),
    (i1(-1, 3), {"_Unsigned": "true", "scale_factor": 0.5, "add_offset": 10.0}, [137.5, 11.5]),
    (i1(-1, 3), {"_Unsigned": "true", "_FillValue": i1(-1)[0]}, [nan, 3]),
    (i1(-1, 3), {"_Unsigned": "true", "_FillValue": u1(255)[0]}, [nan, 3]),
    (i1(-1, 3), {"_Unsigned": "true", "_FillValue": 255}, [nan, 3]),
    (i1(-1, 3), {"_Unsigned": "true", "_FillValue": -1}, [nan, 3]),
    (i2(-1, 3).astype(">i2"), {"_Unsigned": "true"}, [65535, 3]),
    (f4(-1, 3), {"_Unsigned": "true"}, [-1, 3]),
    (i2(1, 5, 9), {"valid_min": i2(2)[0]}, [nan, 5, 9]),
    (i2(1, 5, 9), {"valid_max": i2(8)[0]}, [1, 5, nan]),
    (i2(1, 5, 9), {"valid_range": i2(2, 8)}, [nan, 5, nan]),
    (i2(1, 5, 9), {"valid_range": [2, 8], "scale_factor": 10.0}, [nan, 50, nan]),
    (i2(1, 5, 9), {"valid_range": np.array([20.0, 80.0]), "scale_factor": 10.0}, [nan, 50, nan]),
    (f4(0.1, 0.5), {"valid_min": 0.1}, [0.1, 0.5]),
    (i1(-1, 3), {"_Unsigned": "true", "valid_range": i1(0, -2)}, [nan, 3]),
    (i1(-1, 3), {"_Unsigned": "true", "valid_max": u1(254)[0]}, [nan, 3]),
    (i1(-6, 3), {"_Unsigned": "true", "valid_range": [0, 250]}, [250, 3]),
    (i2(5, 9), {"valid_min": i2(2)[0], "missing_value": i2(9)[0], "units": "K"}, [5, nan]),
]


@pytest.mark.parametrize(("raw", "attributes", "expected"), CASES)
def test_packed_numbers(raw, attributes, expected):
    # Numbers of 32 bits and scales in them are rounded to 6e-8.
    np.testing.assert_allclose(unpack(raw, attributes), expected, rtol=1e-6)


# The same numbers through each format, as its usual writer keeps the attributes.

PACKED = {"scale_factor": 0.25, "add_offset": 300.0}
TABLE = {
    "fill": ("i2", {**PACKED, "_FillValue": -1}, {}),
    "unsigned": ("i1", {**PACKED, "_FillValue": -1}, {"_Unsigned": "true"}),
    "range": ("i2", PACKED, {"valid_range": np.array([0, 90], np.int16)}),
    "float": ("f4", {"_FillValue": nan}, {}),
    "double": ("f8", {"_FillValue": -5.0}, {}),
}
NUMBERS = np.array([[[0, 4, 8, 200], [12, 16, 20, 24], [28, 32, 36, 40]]])


def meant(name):
    _, encoding, _ = TABLE[name]
    values = NUMBERS * encoding.get("scale_factor", 1.0) + encoding.get("add_offset", 0.0)
    values = values.astype(np.float64)
    lost = name in ("fill", "range", "float", "double")
    values[0, 0, 3] = nan if lost else values[0, 0, 3]
    return values


def stored(name):
    """The raw numbers: of the last in the first row the fill value, or an invalid number."""
    kind, encoding, _ = TABLE[name]
    raw = NUMBERS.astype(np.int64)
    if name != "unsigned" and "_FillValue" in encoding:
        raw = raw.astype(np.float64)
        raw[0, 0, 3] = encoding["_FillValue"]
    return raw.astype(kind)


def dataset(name):
    _, encoding, attributes = TABLE[name]
    return xr.Dataset({"T": (("time", "y", "x"), stored(name), {**encoding, **attributes})})


def netcdf4(folder, name):
    dataset(name).to_netcdf(folder / "a.nc", engine="h5netcdf")
    return folder / "a.nc"


def netcdf3(folder, name):
    _, encoding, attributes = TABLE[name]
    with netcdf_file(folder / "a.nc", "w") as file:
        for dim, length in zip(("time", "y", "x"), NUMBERS.shape, strict=True):
            file.createDimension(dim, length)
        variable = file.createVariable("T", TABLE[name][0], ("time", "y", "x"))
        variable[:] = stored(name)
        for key, value in {**encoding, **attributes}.items():
            typed = np.array(value, TABLE[name][0]) if key == "_FillValue" else value
            setattr(variable, key, typed)
    return folder / "a.nc"


def hdf5(folder, name):
    _, encoding, attributes = TABLE[name]
    with h5py.File(folder / "a.h5", "w") as file:
        file["T"] = stored(name)
        file["T"].attrs.update({**encoding, **attributes})
    return folder / "a.h5"


def zarr_of_xarray(folder, name, version, consolidated):
    pytest.importorskip("zarr")
    path = folder / "a.zarr"
    dataset(name).to_zarr(path, zarr_format=version, consolidated=consolidated)
    return path


def zarr_2(folder, name):
    return zarr_of_xarray(folder, name, 2, False)


def zarr_2_consolidated(folder, name):
    return zarr_of_xarray(folder, name, 2, True)


def zarr_3(folder, name):
    return zarr_of_xarray(folder, name, 3, False)


@pytest.mark.filterwarnings("ignore:Consolidated metadata")
def zarr_3_consolidated(folder, name):
    return zarr_of_xarray(folder, name, 3, True)


FORMATS = (netcdf4, netcdf3, hdf5, zarr_2, zarr_2_consolidated, zarr_3, zarr_3_consolidated)


@pytest.mark.filterwarnings("ignore:Consolidated metadata")
@pytest.mark.parametrize("name", TABLE)
@pytest.mark.parametrize("write", FORMATS, ids=lambda write: write.__name__)
def test_every_format_states_the_same_packed_numbers(tmp_path, write, name):
    path = write(tmp_path, name)
    with ExitStack() as stack:
        array = open_arrays(str(path), stack)["T"]
        found = unpack(array.part(), array.attributes)
        part = unpack(array.part(np.s_[0:1, 1:3, 0:2]), array.attributes)
    np.testing.assert_array_equal(found, meant(name))
    np.testing.assert_array_equal(part, meant(name)[0:1, 1:3, 0:2])


DTYPES = ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8", ">i2", ">f4")


@pytest.mark.parametrize("version", [2, 3])
def test_zarr_of_all_types_with_and_without_names_of_axes(tmp_path, version):
    zarr = pytest.importorskip("zarr")
    values = np.arange(2.0, 26.0).reshape(2, 3, 4)
    group = zarr.open_group(tmp_path / "a.zarr", mode="w", zarr_format=version)
    kinds = [kind for kind in DTYPES if version == 2 or kind[0] != ">"]
    for kind in kinds:
        group.create_array(f"plain/{kind}", data=values.astype(kind))
    named = xr.Dataset({kind: (("time", "y", "x"), values.astype(kind)) for kind in kinds})
    named.to_zarr(tmp_path / "a.zarr", group="named", zarr_format=version, consolidated=False)
    with ExitStack() as stack:
        arrays = open_arrays(str(tmp_path / "a.zarr"), stack)
        assert len(arrays) == 2 * len(kinds)
        for name, array in arrays.items():
            np.testing.assert_array_equal(unpack(array.part(), array.attributes), values)
            assert array.dims == (("time", "y", "x") if name.startswith("named") else ())


def test_a_zipped_store_is_refused(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK\5\6" + bytes(18))
    with ExitStack() as stack, pytest.raises(SourceError, match=r"unknown ending '\.zip'"):
        open_arrays(str(tmp_path / "a.zip"), stack)
