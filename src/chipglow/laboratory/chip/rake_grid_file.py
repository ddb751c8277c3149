"""Analysis grids on the rake face in files."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.io.table_file import celsius_text, number_text, write_table_or_dataset
from chipglow.laboratory.chip.rake_grid import RakeGrid
from chipglow.scene.tool_attributes import tool_attributes

_COLUMNS: Final = (
    "time_us",
    "depth_um",
    "along_um",
    "mean_degC",
    "deviation_K",
    "usable_pixels",
    "tool_uncertainty_K",
)


def write_rake_grid(grid: RakeGrid, path: Path) -> None:
    """Write an analysis grid to a file.

    Parameters
    ----------
    grid : RakeGrid
        What to write.
    path : Path
        ``.csv``: a line for each square of each frame, with its units in the names of the columns;
        what is left out has no mean, and a tool whose place is known no uncertainty. ``.nc``:
        NetCDF-4 in SI units with the dimensions (time, depth, along), and the tool as a scene tells
        it. A file that is there is replaced at the end.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    write_table_or_dataset(path, _COLUMNS, _rows(grid), lambda: _dataset(grid))


def _rows(grid: RakeGrid) -> Iterator[tuple[Any, ...]]:
    uncertainty = _uncertainty(grid)
    for frame, time in enumerate(grid.times):
        for m, depth in enumerate(grid.depth):
            for n, along in enumerate(grid.along):
                place = (f"{1e6 * time:.10g}", f"{1e6 * depth:.10g}", f"{1e6 * along:.10g}")
                mean, deviation = grid.mean[frame, m, n], grid.deviation[frame, m, n]
                values = (celsius_text(mean), number_text(deviation))
                of_tool = number_text(uncertainty[frame, m, n])
                yield (*place, *values, int(grid.count[frame, m, n]), of_tool)


def _uncertainty(grid: RakeGrid) -> NDArray[np.float64]:
    """Standard uncertainty from the tool's place in K; NaN if none is told."""
    return grid.tool_uncertainty if grid.from_tool else np.full(grid.mean.shape, np.nan)


def _dataset(grid: RakeGrid) -> xr.Dataset:
    dimensions = ("time", "depth", "along")
    return xr.Dataset(
        {
            "mean": (dimensions, grid.mean, {"units": "K", "long_name": "radiance temperature"}),
            "deviation": (dimensions, grid.deviation, {"units": "K"}),
            "tool_uncertainty": (dimensions, _uncertainty(grid), {"units": "K"}),
            "count": (dimensions, grid.count, {"units": "1"}),
        },
        coords={
            "time": ("time", grid.times, {"units": "s"}),
            "depth": ("depth", grid.depth, {"units": "m"}),
            "along": ("along", grid.along, {"units": "m"}),
        },
        attrs={"size": grid.size, **tool_attributes(grid.tool)},
    )
