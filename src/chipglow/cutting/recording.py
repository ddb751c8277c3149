"""Records of a cut: frames of a window and of later bands, energies, checkpoints."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import ceil, floor
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.conditions import OutputWindow
from chipglow.cutting.stress import BULK, SHEAR, elastic_energy, kelvin_index
from chipglow.quantities import ROUNDING, Array, Brief
from chipglow.scene import Frame, Raster

_SMOOTHING_TIME: Final = 5e-6
"""Time in s over which the force is smoothed, less than a tenth of a segment's."""

_VALLEY_DEPTH: Final = 0.05
"""Rise on both sides of a valley, as a fraction of the mean force."""

_APART: Final = 3
"""Intervals from one recorded part to the next, so that a scene shows a gap between them."""


@dataclass(frozen=True)
class Preview:
    """A coarse look at a cut while it is computed; nothing of the cut depends on it."""

    raster: Raster
    frames: int
    """About how many frames are spread evenly over the cut; the last is at its end."""
    on_frame: Callable[[Frame], None]

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise ValueError(f"preview frames: expected 1 or more, got {self.frames!r}")

    def shows(self, number: int, last: int) -> bool:
        """Return whether it shows one of the frames from 1 to `last`."""
        return (last - number) % max(last // self.frames, 1) == 0


class Valleys:
    """Valleys of a force that comes in value by value, an `interval` in s apart.

    A valley is the minimum of the force, smoothed over 5 µs, between two rises of 5 % of its mean.
    """

    def __init__(self, interval: float) -> None:
        self._length = max(1, round(_SMOOTHING_TIME / interval))
        self._values: list[float] = []
        self._total = 0.0
        self._rising = True
        self._extreme, self._at = 0.0, 0

    def add(self, force: float) -> float | None:
        """Take the next force; return the place of a valley that has just been left.

        The place is a number of values since the first.
        """
        self._values.append(force)
        self._total += force
        count = len(self._values)
        if count < self._length:
            return None
        smooth = sum(self._values[-self._length :]) / self._length
        least = _VALLEY_DEPTH * self._total / count
        if self._rising:
            if smooth >= self._extreme:
                self._extreme = smooth
            elif smooth < self._extreme - least:
                self._rising, self._extreme, self._at = False, smooth, count
            return None
        if smooth <= self._extreme:
            self._extreme, self._at = smooth, count
            return None
        if smooth <= self._extreme + least:
            return None
        self._rising, self._extreme = True, smooth
        return self._at - (self._length - 1) / 2


class Recorder:
    """The choice of intervals whose end is recorded as a frame."""

    def __init__(self, window: OutputWindow, speed: float, cutting_length: float) -> None:
        step = speed * window.interval
        self._window = window
        self.first = max(ceil(window.start / step - ROUNDING), 1)
        self._last_of_window = floor(window.end / step + ROUNDING)
        end = cutting_length if window.later_bands else window.end
        self.last = floor(end / step + ROUNDING)
        self._frames = max(1, round(window.band_duration / window.interval))
        self._valleys = Valleys(window.interval)
        self._valley: float | None = None
        self._starts: list[int] = []

    def wants(self, record: int, force: float) -> bool:
        """Return whether to record the end of interval `record` (from 1; ask in their order)."""
        self._look(record, force)
        if self.first <= record <= self._last_of_window:
            return True
        return any(start <= record < start + self._frames for start in self._starts)

    def replay(self, forces: Array) -> None:
        """Take the forces of intervals that are done, those before a checkpoint."""
        for i, force in enumerate(forces):
            self.wants(i + 1, float(force))

    def _look(self, record: int, force: float) -> None:
        """Choose when the band of the next segment is developed, if a valley was just left."""
        valley = self._valleys.add(force)
        if valley is None:
            return
        if self._valley is not None and len(self._starts) < self._window.later_bands:
            wanted = valley + self._window.band_delay * (valley - self._valley)
            start = max(ceil(wanted), record + 1, self._busy_until + _APART)
            if wanted > self._busy_until and start + self._frames - 1 <= self.last:
                self._starts.append(start)
        self._valley = valley

    @property
    def _busy_until(self) -> int:
        """The last interval that is known to be recorded."""
        return self._starts[-1] + self._frames - 1 if self._starts else self._last_of_window


@dataclass(frozen=True, repr=False)
class EnergyHistory(Brief):
    """Energy per width of cut since the start, in J/m, at the times of the force history.

    Each entry has the shape (n,).
    """

    drive_work: Array
    """Work of the driven boundary, and what material brought in less what it took out."""
    contact_work: Array
    """Work of the tool's normal force: a rigid tool at rest does next to none."""
    kinetic_energy: Array
    """Change of the energy of motion, of the scaled mass."""
    elastic_energy: Array
    plastic_work: Array
    """Plastic work, whose Taylor-Quinney fraction becomes heat."""
    friction_work: Array
    sharing_loss: Array
    """Elastic energy lost because the points of a cell share one dilation."""
    expansion_work: Array
    """Elastic energy that material got from heat when it was warmed under pressure."""
    moduli_loss: Array
    """Elastic energy that was lost as the moduli fell with the temperature."""
    lost_heat: Array
    """Heat that free surfaces lost: plastic or friction work before, so no mechanical entry."""

    @property
    def closing_error(self) -> Array:
        """Fraction of the work that the balance does not account for: what the grid dissipates."""
        held = self.kinetic_energy + self.elastic_energy
        used = self.plastic_work + self.friction_work + self.sharing_loss + self.moduli_loss
        done = self.drive_work + self.contact_work + self.expansion_work
        return (done - held - used) / self.drive_work


ENERGIES: Final = len(fields(EnergyHistory))
"""Number of entries of the balance."""


@njit(cache=True)
def held_energy(points, count, step, elastic, cell):  # type: ignore[no-untyped-def]
    """Return kinetic and elastic energy of the points in J/m; the affine velocity's part included.

    `elastic` is `WorkpieceMaterial.elastic_ratios`: the warmer a point is, the less energy its
    elastic strain holds.
    """
    kinetic = strained = 0.0
    for k in range(count):
        p = points[k]
        spread = p.cxx * p.cxx + p.cxy * p.cxy + p.cyx * p.cyx + p.cyy * p.cyy
        # Second moment of the weights of quadratic splines: a quarter of a squared cell.
        kinetic += p.own_vx * p.own_vx + p.own_vy * p.own_vy + 0.25 * cell * cell * spread
        warm = kelvin_index(p.temperature, elastic.shape[0])
        sheared, pressed = elastic_energy(p, elastic[warm, SHEAR], elastic[warm, BULK], step)
        strained += sheared
        strained += pressed
    return 0.5 * step.mass * kinetic, strained


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
    """Return the state in its own arrays, which change when the simulation continues."""
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
