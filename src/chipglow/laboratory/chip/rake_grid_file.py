"""Analysis grids on the rake face in files."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import xarray as xr

from chipglow.io.table_file import celsius_text, number_text, write_table_or_dataset
from chipglow.laboratory.chip.budget_columns import budget_columns, budget_values
from chipglow.laboratory.chip.rake_grid import RAKE_BUDGET, RakeGrid
from chipglow.scene.tool_attributes import tool_attributes
from chipglow.uncertainty import to_xarray

_COLUMNS: Final = (
    "time_us",
    "depth_um",
    "along_um",
    "mean_degC",
    "deviation_K",
    "usable_pixels",
    *budget_columns(RAKE_BUDGET),
)


def write_rake_grid(grid: RakeGrid, path: Path) -> None:
    """Write an analysis grid to a file.

    Parameters
    ----------
    grid : RakeGrid
        What to write.
    path : Path
        ``.csv``: a line for each square of each frame, with its units in the names of the columns;
        what is left out has no mean, and what is not known of its uncertainty is empty. ``.nc``:
        NetCDF-4 in SI units with the dimensions (time, depth, along), ``mean`` with its components
        as `chipglow.uncertainty.from_xarray` reads them, and the tool as a scene tells it. A file
        that is there is replaced at the end.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    write_table_or_dataset(path, _COLUMNS, _rows(grid), lambda: _dataset(grid))


def _rows(grid: RakeGrid) -> Iterator[tuple[Any, ...]]:
    budget = budget_values(grid.estimate, RAKE_BUDGET)
    for frame, time in enumerate(grid.times):
        for m, depth in enumerate(grid.depth):
            for n, along in enumerate(grid.along):
                place = (f"{1e6 * time:.10g}", f"{1e6 * depth:.10g}", f"{1e6 * along:.10g}")
                mean, deviation = grid.mean[frame, m, n], grid.deviation[frame, m, n]
                values = (celsius_text(mean), number_text(deviation))
                parts = map(number_text, budget[frame, m, n])
                yield (*place, *values, int(grid.count[frame, m, n]), *parts)


def _dataset(grid: RakeGrid) -> xr.Dataset:
    dimensions = ("time", "depth", "along")
    data = to_xarray(grid.estimate, "mean", dimensions, "K")
    data["mean"].attrs["long_name"] = "radiance temperature"
    whole = budget_values(grid.estimate, ())[..., 0]
    return (
        data.assign(
            standard_uncertainty=(dimensions, whole, {"units": "K"}),
            deviation=(dimensions, grid.deviation, {"units": "K"}),
            count=(dimensions, grid.count, {"units": "1"}),
        )
        .assign_coords(
            time=("time", grid.times, {"units": "s"}),
            depth=("depth", grid.depth, {"units": "m"}),
            along=("along", grid.along, {"units": "m"}),
        )
        .assign_attrs(size=grid.size, **tool_attributes(grid.tool))
    )
