"""Which intervals of a cut are recorded as frames: a window, and later bands once developed."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor
from typing import Final

from chipglow.cutting.conditions import OutputWindow
from chipglow.quantities import Array
from chipglow.scene import Frame, Raster

_SMOOTH: Final = 5e-6
_STANDS_OUT: Final = 0.05
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

    A valley is the least of the force, smoothed over 5 µs, between two rises of 5 % of its mean.
    """

    def __init__(self, interval: float) -> None:
        self._length = max(1, round(_SMOOTH / interval))
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
        least = _STANDS_OUT * self._total / count
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
        self.first = max(ceil(window.start / step - 1e-9), 1)
        self._last_of_window = floor(window.end / step + 1e-9)
        end = cutting_length if window.later_bands else window.end
        self.last = floor(end / step + 1e-9)
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
