"""Times on the command line."""

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities.option import parse
from chipglow.quantities.units import INSTANT


def parse_instant(option: str, text: str) -> float:
    """Parse a time such as ``400 us``; may be 0."""
    return parse(option, INSTANT, text)


def frame_at(option: str, text: str, times: NDArray[np.float64]) -> int:
    """Return the index of the frame nearest to a time such as ``400 us``."""
    instant = parse_instant(option, text)
    slack = 0.5 * float(np.diff(times).min()) if times.size > 1 else 1e-6
    if not times[0] - slack <= instant <= times[-1] + slack:
        first, last = (f"{1e6 * time:.7g} us" for time in (times[0], times[-1]))
        raise ValueError(f"{option}: {text}, expected {first} to {last}")
    return int(np.abs(times - instant).argmin())
