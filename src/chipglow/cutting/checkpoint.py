"""The state of a simulation between two intervals, as arrays by name."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

_ARRAYS: Final = (
    "velocity",
    "tool_temperature",
    "tool_beyond",
    "friction_heat",
    "work",
    "held_at_start",
)
_NUMBERS: Final = ("count", "columns", "time", "carried", "lost_heat")


@dataclass(frozen=True)
class Checkpoint:
    """A simulation after some of its intervals: all that the next ones depend on."""

    arrays: Mapping[str, NDArray[Any]]
    """The state by name, in SI; ``records``: forces and energies of the intervals done."""
    progress: float
    """Fraction of the cut that is done, 0 to 1."""

    @property
    def time(self) -> float:
        """Time of the state in s."""
        return float(self.arrays["time"])


def capture(state: Any, records: NDArray[np.float64], progress: float) -> Checkpoint:
    """Return the state as it is, in its own arrays, which change when it goes on."""
    arrays = {name: np.asarray(getattr(state, name)) for name in (*_ARRAYS, *_NUMBERS)}
    arrays |= {"points": state.points[: state.count], "records": records}
    return Checkpoint(arrays, progress)


def restore(state: Any, checkpoint: Checkpoint, records: NDArray[np.float64]) -> int:
    """Set a fresh state, and the records, to a checkpoint; return how many intervals are done."""
    arrays = checkpoint.arrays
    names = {*_ARRAYS, *_NUMBERS, "points", "records"}
    if set(arrays) != names:
        raise ValueError(f"checkpoint: has {sorted(arrays)}, expected {sorted(names)}")
    fresh = capture(state, records, 0.0).arrays
    done, count = len(arrays["records"]), len(arrays["points"])
    for name, values in arrays.items():
        there = fresh[name]
        shape = values.shape if name in ("points", "records") else there.shape
        if values.dtype != there.dtype or values.shape != shape:
            raise ValueError(
                f"checkpoint: {name!r} is {values.dtype} of shape {values.shape}, "
                f"expected {there.dtype} of shape {there.shape}"
            )
    if count > state.points.size or done > len(records):
        raise ValueError(
            f"checkpoint: {count} points after {done} intervals, "
            f"expected up to {state.points.size} and {len(records)}"
        )
    for name in _ARRAYS:
        getattr(state, name)[...] = arrays[name]
    for name in _NUMBERS:
        setattr(state, name, arrays[name].item())
    state.points[:count] = arrays["points"]
    records[:done] = arrays["records"]
    state.choose_steps()
    return done
