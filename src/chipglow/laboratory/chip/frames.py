"""Which frames of a measurement to look at."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def frame_numbers(frames: Sequence[int] | None, count: int) -> NDArray[np.int64]:
    """Numbers of the chosen frames, shape (n,); of all for None."""
    numbers = np.arange(count) if frames is None else np.asarray(frames, dtype=np.int64)
    wrong = numbers[(numbers < 0) | (numbers >= count)]
    if wrong.size or numbers.size == 0:
        shown = int(wrong[0]) if wrong.size else "none"
        raise ValueError(f"measurement: frame {shown}, expected 0 to {count - 1}")
    return numbers
