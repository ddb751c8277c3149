"""Which frame of a scene or a measurement to show."""

import numpy as np
from numpy.typing import NDArray


def shown_frame(
    times: NDArray[np.float64], time: float | None, whose: str = "measurement", option: str = ""
) -> int:
    """Return the index of the frame nearest to a time, by default the middle one."""
    if time is None:
        return (len(times) - 1) // 2
    slack = 1e-9 + (float(np.diff(times).min()) / 2 if len(times) > 1 else 0.0)
    if not times[0] - slack <= time <= times[-1] + slack:
        shown, first, last = (f"{1e6 * one:.7g} us" for one in (time, times[0], times[-1]))
        raise ValueError(f"{option}{shown} is not in the {whose}, expected {first} to {last}")
    return int(np.abs(times - time).argmin())
