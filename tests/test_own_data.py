"""A file reads nothing but itself: every reader of HDF5 refuses data in other files."""

from functools import partial

import h5py
import numpy as np
import pytest
from pointing import POINTING, point_elsewhere
from test_io import a_file, a_measurement_file

from chipglow.app.opening import open_uploaded
from chipglow.camera import MeasuredPSF
from chipglow.io import open_scene, read_measurement
from chipglow.io.sources.grids.grid import GridSource
from chipglow.io.sources.meshes.vtk import VtkReader


def an_array(folder, file, name, shape, **attributes):
    with h5py.File(folder / file, "w") as opened:
        opened[name] = np.ones(shape, np.float32)
        opened[name].attrs.update(attributes)
    return folder / file


CASES = {
    "scene.nc: .*'temperature'": (a_file, open_scene),
    "mine.nc: .*'plastic_strain'": (a_file, lambda path: open_uploaded(path, "mine.nc")),
    "m.nc: .*'radiance'": (a_measurement_file, read_measurement),
    "psf.nc is not a kernel: 'kernel'": (
        partial(an_array, file="psf.nc", name="kernel", shape=(3, 3), spacing=1e-6),
        MeasuredPSF.from_file,
    ),
    "T.h5: 'T'": (
        partial(an_array, file="T.h5", name="T", shape=(1, 6, 7)),
        lambda path: GridSource(str(path), spacing=1e-6).survey(),
    ),
    "mesh.vtkhdf: 'VTKHDF/Points'": (
        partial(an_array, file="mesh.vtkhdf", name="VTKHDF/Points", shape=(4, 3)),
        lambda path: VtkReader([path]),
    ),
}


@pytest.mark.parametrize("kind", POINTING)
@pytest.mark.parametrize("message", CASES)
def test_data_in_another_file_are_refused(tmp_path, message, kind):
    write, read = CASES[message]
    path = write(tmp_path)
    point_elsewhere(path, message.split("'")[1], kind)
    with pytest.raises(ValueError, match=f"{message} is in another file"):
        read(path)
