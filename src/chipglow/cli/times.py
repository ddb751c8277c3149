"""Times on the command line."""

import numpy as np
from numpy.typing import NDArray

from chipglow.drawing.frames import shown_frame


def frame_at(
    option: str, time: float, times: NDArray[np.float64], whose: str = "measurement"
) -> int:
    """Return the index of the frame nearest to the time of an option."""
    try:
        return shown_frame(times, time, whose)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
