"""Text of frames on a grid in a notebook."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipglow.scene.raster import Raster


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
