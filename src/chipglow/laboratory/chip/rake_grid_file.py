"""Analysis grids on the rake face in files."""

from pathlib import Path

import xarray as xr

from chipglow.io.table_file import write_table_or_dataset
from chipglow.laboratory.chip.budget_columns import known_uncertainty
from chipglow.laboratory.chip.rake_grid import RakeGrid
from chipglow.laboratory.frame_file import columns_and_rows
from chipglow.scene.tool_attributes import tool_attributes
from chipglow.uncertainty import to_xarray


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
        as `chipglow.uncertainty.from_xarray` reads them, and the tool as a scene has it. A file
        that is there is replaced at the end.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    write_table_or_dataset(path, *columns_and_rows(grid.to_frame()), lambda: _dataset(grid))


def _dataset(grid: RakeGrid) -> xr.Dataset:
    dimensions = ("time", "depth", "along")
    data = to_xarray(grid.estimate, "mean", dimensions, "K")
    data["mean"].attrs["long_name"] = "radiance temperature"
    return (
        data.assign(
            standard_uncertainty=(dimensions, known_uncertainty(grid.estimate), {"units": "K"}),
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
