"""Splines of a scene's frames in a NetCDF-4 file: see `chipglow.scene.splines`."""

from collections.abc import Callable, Mapping
from typing import Any, Final, TypeAlias

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from chipglow.io.packing import COMPRESSION
from chipglow.scene import FIELD_UNITS, MATERIAL_COORDINATE_UNITS, SceneError
from chipglow.scene.scene import raster_of
from chipglow.scene.splines import FILLED_SPLINE, SPLINE_FIELDS, Lattice, SplineFrame

SPLINES: Final = "splines"
LIMITS: Final = "spline_limits"
CHUNKED: Final = (SPLINES, LIMITS)
"""The variables that grow with the frames, a chunk for each."""

OWN: Final = (*CHUNKED, "in_tool", "node_x", "node_y")
"""All variables that are not of the scene as such."""

# Halves of these are the errors of a sample, a weighted mean of nine coefficients: 1 mK; 3e-5 of
# strain and 2 1/s of its rate, which change the emissivity by under 7e-5 and 4e-5 for the largest
# difference of Table 1, 0.45 of 0.85; 1 mm/s; 4 nm, 2e-4 of the grain of a texture.
STEPS: Final[Mapping[str, float]] = {
    "temperature": 2.0**-9,
    "plastic_strain": 2.0**-14,
    "plastic_strain_rate": 4.0,
    "velocity_x": 2.0**-9,
    "velocity_y": 2.0**-9,
    "material_x": 2.0**-27,
    "material_y": 2.0**-27,
    "filled": 2.0**-13,
    "tool_temperature": 2.0**-9,
}
"""To what multiples the coefficients of each spline are rounded."""

_STEP: Final = np.array([STEPS[name] for name in SPLINE_FIELDS], np.float32)[:, None, None]
Read: TypeAlias = Callable[[str, int], NDArray[Any]]
"""Reads one field of one frame."""


def create(file: h5netcdf.File, lattice: Lattice) -> None:
    """Create the variables that hold splines, and those that state where their nodes are."""
    fields, rows, columns = lattice.shape
    file.dimensions.update(spline=fields, node_y=rows, node_x=columns)
    file.dimensions.update(limited=FILLED_SPLINE, side=2)
    for name, values in (
        ("node_x", lattice.left + lattice.cell * np.arange(columns)),
        ("node_y", lattice.top - lattice.cell * np.arange(rows)),
    ):
        file.create_variable(name, (name,), data=values, **COMPRESSION).attrs["units"] = "m"
    file.create_variable(
        "in_tool", ("y", "x"), data=lattice.in_tool.astype(np.uint8), **COMPRESSION
    )
    for name, dimensions, shape, attributes in (
        (SPLINES, ("spline", "node_y", "node_x"), lattice.shape, {
            "long_name": "coefficients of quadratic B-splines",
            "fields": " ".join(SPLINE_FIELDS),
            "ambient": lattice.ambient,
        }),
        (LIMITS, ("limited", "side"), (FILLED_SPLINE, 2), {
            "long_name": "smallest and largest value of a sample of the workpiece",
        }),
    ):  # fmt: skip
        file.create_variable(
            name, ("time", *dimensions), np.float32, chunks=(1, *shape), **COMPRESSION
        ).attrs.update(attributes)


def rounded(frame: SplineFrame) -> dict[str, NDArray[np.float32]]:
    """Return what the file keeps of a frame, by variable."""
    check(frame)
    return {SPLINES: np.rint(frame.nodes / _STEP) * _STEP, LIMITS: frame.limits}


def check(frame: SplineFrame) -> None:
    """Refuse splines that are not numbers."""
    if not (np.isfinite(frame.nodes).all() and np.isfinite(frame.limits).all()):
        raise SceneError(f"scene: a spline at {frame.time:.9g} s is not finite everywhere")


def stored_lattice(file: h5py.File, data: xr.Dataset) -> Lattice | None:
    """Return where the nodes of a file's splines are; None if it has none."""
    if SPLINES not in file:
        return None
    x, y, splines = file["node_x"][:], file["node_y"][:], file[SPLINES]
    if splines.attrs["fields"] != " ".join(SPLINE_FIELDS):
        raise SceneError(f"splines of {splines.attrs['fields']}, expected {SPLINE_FIELDS}")
    return Lattice(
        raster=raster_of(data),
        left=float(x[0]),
        top=float(y[0]),
        cell=float((x[-1] - x[0]) / (x.size - 1)),
        rows=y.size,
        columns=x.size,
        in_tool=file["in_tool"][:].astype(bool),
        ambient=float(splines.attrs["ambient"].item()),
    )


class SampledVariable(BackendArray):
    """A field as xarray sees it: samples, evaluated when they are asked for."""

    def __init__(self, read: Read, name: str, shape: tuple[int, int, int]) -> None:
        self._read, self._name = read, name
        self.shape = shape
        self.dtype = np.dtype(np.uint8 if name == "material" else np.float32)

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.BASIC, self._part
        )

    def _part(self, key: tuple[Any, ...]) -> NDArray[Any]:
        frames, *within = key
        if isinstance(frames, slice):
            chosen = range(*frames.indices(self.shape[0]))
            parts = [self._read(self._name, index)[tuple(within)] for index in chosen]
            empty = np.empty(self.shape, self.dtype)[(slice(0, 0), *within)]
            return np.stack(parts) if parts else empty
        return np.asarray(self._read(self._name, frames)[tuple(within)])


def with_samples(data: xr.Dataset, read: Read, long_names: Mapping[str, str]) -> xr.Dataset:
    """Return the dataset of a file of splines with the fields themselves instead."""
    shape = (data.sizes["time"], data.sizes["y"], data.sizes["x"])
    fields = {
        name: (
            ("time", "y", "x"),
            indexing.LazilyIndexedArray(SampledVariable(read, name, shape)),
            {"units": unit, "long_name": long_names[name]},
        )
        for name, unit in (*FIELD_UNITS.items(), *MATERIAL_COORDINATE_UNITS.items())
    }
    return data.drop_vars(list(OWN), errors="ignore").assign(fields)
