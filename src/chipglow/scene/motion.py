"""Motion of the material in a scene: what can be found of it from fields alone."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, zoom

from chipglow.scene.nearest import extended

_FLOW_SAMPLES: Final = 320
"""Most samples across a picture of which the optical flow is computed: it takes seconds else."""


def strain_rate_along(
    strain: NDArray[np.float32],
    before: NDArray[np.float32],
    velocity: tuple[NDArray[np.float32], NDArray[np.float32]],
    interval: float,
    spacing: float,
) -> NDArray[np.float32]:
    """Return (strain(x) - before(x - v interval)) / interval in 1/s, shape (y, x), 0 or more.

    Strains are NaN without material, where the rate is NaN too; 0 where there was none before.
    """
    rows, columns = np.indices(strain.shape, dtype=np.float32)
    shift = np.float32(interval / spacing)
    origin = rows + velocity[1] * shift, columns - velocity[0] * shift
    there = np.isfinite(before)
    earlier = map_coordinates(extended(before, there), origin, order=3, mode="nearest")
    known = map_coordinates(there.astype(np.float32), origin, order=1, mode="constant") > 0.5
    rate = np.maximum((strain - earlier) / np.float32(interval), 0.0)
    rate[~known & np.isfinite(strain)] = 0.0
    return np.asarray(rate, np.float32)


def optical_flow(
    before: NDArray[np.float32], after: NDArray[np.float32], interval: float, spacing: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the velocity along x and up in m/s by which a pattern moved, shape (y, x) each.

    Total variation with the L1 norm (Zach, Pock and Bischof 2007) by scikit-image, on a picture of
    a few hundred samples. It sees only what has a pattern: a region without one takes on the
    motion of its surroundings.
    """
    from skimage import registration

    factor = min(_FLOW_SAMPLES / max(before.shape), 1.0)
    scale = np.float32(max(float(before.max()), float(after.max()), 1e-30))
    small = [zoom(pattern / scale, factor, order=1) for pattern in (before, after)]
    down, right = registration.optical_flow_tvl1(*small, dtype=np.float32)
    back = [_resized(flow, before.shape) for flow in (right, -down)]
    speed = np.float32(spacing * before.shape[1] / small[0].shape[1] / interval)
    return back[0] * speed, back[1] * speed


def _resized(values: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    factors = [new / old for new, old in zip(shape, values.shape, strict=True)]
    return np.asarray(zoom(values, factors, order=1, grid_mode=True, mode="nearest"), np.float32)
