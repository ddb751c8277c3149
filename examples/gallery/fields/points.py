"""Draws the pictures of the pages on grids and points: ``python docs/import_pictures.py``."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cbook import get_sample_data
from numpy.typing import NDArray

from chipglow.drawing.drawing import VOID, new_figure, style
from chipglow.io.sources.cloud import CloudSource
from chipglow.io.sources.grid import GridSource
from chipglow.scene import Raster

HERE = Path(__file__).parent
POINTS = HERE / "data" / "taichi-mpm99.npz"
CLOSE = (0.4, 0.62, 0.24, 0.38)


def main() -> None:
    """Draw both."""
    with style():
        draw_grid()
        draw_points()


def draw_grid() -> None:
    """Heights as they are in the file, and on samples eight times as far apart."""
    path = get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)
    source = GridSource(path, {"temperature": "elevation"}, spacing=(74.4, 92.7))
    left, right, bottom, top = source.survey().extent
    figure = new_figure(2.6)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, spacing in zip(panels, (74.4, 600.0), strict=True):
        rows, columns = int((top - bottom) / spacing), int((right - left) / spacing)
        raster = Raster(left, top, spacing, rows, columns)
        (frame,) = source.frames(raster)
        show(axes, frame.fields["temperature"], raster, 1e-3)
        axes.set_title(f"samples of {spacing:g} m")
        axes.set_xlabel("km")
    panels[0].set_ylabel("km")
    figure.savefig(HERE / "import-grid.png", dpi=150)


def draw_points() -> None:
    """Points as they are in the file, and the fields on the raster, whole and close."""
    source = CloudSource(str(POINTS))
    places, speeds = np.load(POINTS)["position"][2], np.load(POINTS)["velocity"][2]
    figure = new_figure(3.6)
    panels = figure.subplots(2, 2, width_ratios=(1.6, 1.0))
    whole = Raster(0.0, 0.4, 1e-3, 400, 1000)
    left, right, bottom, top = CLOSE
    close = Raster(left, top, 2e-4, round((top - bottom) / 2e-4), round((right - left) / 2e-4))
    for number, raster in enumerate((whole, close)):
        (frame,) = source.frames(raster, start=2)
        speed = np.hypot(frame.fields["velocity_x"], frame.fields["velocity_y"])
        upper, lower = panels[:, number]
        colours = np.hypot(*speeds.T)
        upper.scatter(*places.T, s=(0.1, 2.0)[number], c=colours, vmin=0, vmax=6, linewidths=0)
        show(lower, speed, raster, 1.0, vmin=0, vmax=6)
        upper.set(xlim=raster.extent[:2], ylim=raster.extent[2:], aspect="equal")
    figure.savefig(HERE / "import-points.png", dpi=150)


def show(
    axes: Axes, values: NDArray[np.float32], raster: Raster, scale: float, **limits: float
) -> None:
    """An image with lengths in the unit that the scale makes of m."""
    axes.set_facecolor(VOID)
    extent = tuple(scale * edge for edge in raster.extent)
    axes.imshow(values, extent=extent, interpolation="nearest", **limits)


if __name__ == "__main__":
    main()
