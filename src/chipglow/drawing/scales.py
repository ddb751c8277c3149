"""Colours of figures, the limits of their scales, and the frame that they show."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
GREEN: Final = "#009E73"
GREY: Final = "#6b7280"
VOID: Final = "#e5e7eb"
COLOURS: Final = (BLUE, VERMILLION, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of curves beside each other."""

HEAT: Final = "inferno"
PLAIN: Final = "cividis"
RATE: Final = "viridis"
SIGNED: Final = "RdBu_r"


def ends(
    image: NDArray[Any], low: float = 0.0, high: float = 100.0, least: float = 0.0
) -> tuple[float, float]:
    """Return the limits of an image's colours: two percentiles, at least `least` apart."""
    known = image[np.isfinite(image)]
    if known.size == 0:
        return 0.0, 1.0
    first, last = map(float, np.percentile(known, (low, high)))
    last = max(last, first + least)
    return first, last if last - first > 1e-6 * abs(last) else first + 1.0


def round_limit(values: NDArray[np.float64], percentile: float, step: float) -> float:
    """Return a percentile of the magnitudes, rounded up to a multiple of a step."""
    known = np.abs(values[np.isfinite(values)])
    if known.size == 0:
        return step
    return max(step, float(np.ceil(np.percentile(known, percentile) / step)) * step)


def shown_frame(
    times: NDArray[np.float64], time: float | None, whose: str = "measurement", option: str = ""
) -> int:
    """Return the index of the frame nearest to a time, by default the middle one."""
    if time is None:
        return (len(times) - 1) // 2
    # Half the time between frames, and 1 ns for the rounding of a stated time.
    slack = 1e-9 + (float(np.diff(times).min()) / 2 if len(times) > 1 else 0.0)
    if not times[0] - slack <= time <= times[-1] + slack:
        shown, first, last = (f"{1e6 * one:.7g} us" for one in (time, times[0], times[-1]))
        raise ValueError(f"{option}{shown} is not in the {whose}, expected {first} to {last}")
    return int(np.abs(times - time).argmin())
