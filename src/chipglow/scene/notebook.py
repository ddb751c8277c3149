"""Text and picture of frames on a grid in a notebook."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chipglow.scene.raster import Raster
from chipglow.scene.tool import Tool

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def frames_text(
    times: NDArray[np.float64], raster: Raster, values: str, celsius: NDArray[Any]
) -> str:
    """Return number, shape, times in s and range of frames in °C in a line of text."""
    count, first, last = times.size, 1e6 * times[0], 1e6 * times[-1]
    known = celsius[np.isfinite(celsius)]
    parts = (
        f"{count} frame{'s' if count > 1 else ''} of {raster.rows} x {raster.columns} {values} of "
        f"{1e6 * raster.spacing:.4g} µm",
        f"{first:.6g} µs to {last:.6g} µs" if count > 1 else f"at {first:.6g} µs",
        f"{known.min():.4g} °C to {known.max():.4g} °C{' in the first' if count > 1 else ''}"
        if known.size
        else f"no temperature{' in the first' if count > 1 else ''}",
    )
    return "; ".join(parts)


def plot_image(
    celsius: NDArray[Any],
    raster: Raster,
    tool: Tool | None,
    label: str,
    time: float,
    ax: "Axes | None",
) -> "Axes":
    """Draw temperatures in °C with the tool's outline and a colour bar."""
    from chipglow.drawing import drawing

    axes = drawing.axes_or_new(ax, "compressed")
    limits = (np.nanmin(celsius), np.nanmax(celsius)) if np.isfinite(celsius).any() else (0.0, 1.0)
    picture = drawing.show_image(axes, celsius, raster, tool, "inferno", limits)
    axes.set_title(f"{1e6 * time:.6g} µs", loc="left")
    axes.figure.colorbar(picture, ax=axes, label=label)
    return axes
