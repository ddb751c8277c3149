"""A file reads nothing but itself: every reader of HDF5 refuses data in other files."""

import h5py
import numpy as np
import pytest
import xarray as xr
from pointing import POINTING, point_elsewhere
from test_io import a_file, a_measurement

from chipglow.app.opening import open_uploaded
from chipglow.camera import MeasuredPSF
from chipglow.io import open_scene, read_measurement, write_dataset, write_measurement
from chipglow.io.sources import SourceError
from chipglow.io.sources.mesh_vtk import VtkReader

pytestmark = pytest.mark.parametrize("kind", POINTING)


def test_a_scene(tmp_path, kind):
    path = a_file(tmp_path)
    point_elsewhere(path, "temperature", kind)
    with pytest.raises(ValueError, match=r"scene\.nc: .*'temperature' is in another file"):
        open_scene(path)


def test_an_upload(tmp_path, kind):
    path = a_file(tmp_path)
    point_elsewhere(path, "plastic_strain", kind)
    with pytest.raises(ValueError, match=r"mine\.nc: .*'plastic_strain' is in another file"):
        open_uploaded(path, "mine.nc")


def test_a_measurement(tmp_path, kind):
    path = tmp_path / "m.nc"
    write_measurement(a_measurement(), path)
    point_elsewhere(path, "radiance", kind)
    with pytest.raises(ValueError, match=r"m\.nc: .*'radiance' is in another file"):
        read_measurement(path)


def test_a_point_spread_function(tmp_path, kind):
    path = tmp_path / "psf.nc"
    kernel = xr.DataArray(np.ones((3, 3)) / 9, dims=("y", "x"), attrs={"spacing": 1e-6})
    write_dataset(xr.Dataset({"kernel": kernel}), path)
    MeasuredPSF.from_file(path)
    point_elsewhere(path, "kernel", kind)
    with pytest.raises(ValueError, match=r"psf\.nc is not a kernel: 'kernel' is in another file"):
        MeasuredPSF.from_file(path)


def test_a_mesh(tmp_path, kind):
    path = tmp_path / "mesh.vtkhdf"
    with h5py.File(path, "w") as file:
        file["VTKHDF/Points"] = np.ones((4, 3))
    point_elsewhere(path, "VTKHDF/Points", kind)
    with pytest.raises(SourceError, match=r"mesh\.vtkhdf: 'VTKHDF/Points' is in another file"):
        VtkReader([path])
