"""When the exposures of an analysis begin."""

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Scene


def spread_starts(scene: Scene, duration: float, count: int) -> NDArray[np.float64]:
    """Beginnings of exposures spread over the longest part of the scene, each at a frame of it.

    Parameters
    ----------
    scene : Scene
        The scene. One of a single frame does not change: there is one exposure.
    duration : float
        How long an exposure lasts in s.
    count : int
        How many there shall be; fewer if the scene has not as many frames for them.

    Raises
    ------
    ValueError
        If no part of the scene is as long as an exposure.
    """
    times, spacing = scene.times[scene.longest_block], scene.frame_spacing
    if len(scene.times) == 1:
        return times
    last = times[-1] + spacing - duration
    if last < times[0] - 1e-6 * duration:
        raise ValueError(
            f"scene: it lasts {times[-1] + spacing - times[0]:.4g} s, "
            f"expected an exposure's {duration:.4g} s or more"
        )
    wanted = np.linspace(times[0], max(last, times[0]), count) if count > 1 else times[:1]
    nearest_frame = np.searchsorted(times, wanted + 1e-6 * spacing, side="right") - 1
    return np.asarray(np.unique(times[nearest_frame]), dtype=np.float64)


def other_starts(scene: Scene, duration: float) -> list[float]:
    """Beginnings of the scene's other parts that hold an exposure.

    Parameters
    ----------
    scene : Scene
        The scene.
    duration : float
        How long an exposure lasts in s.
    """
    starts = []
    for block in scene.blocks:
        first, last = scene.times[block[0]], scene.times[block[-1]]
        lasts = last - first + scene.frame_spacing
        if block != scene.longest_block and lasts >= duration * (1 - 1e-6):
            starts.append(float(first))
    return starts
