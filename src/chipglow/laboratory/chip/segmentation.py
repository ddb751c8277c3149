"""What a cut's histories show: segmentation by the force, and the inertia of the scaled mass."""

from dataclasses import dataclass
from itertools import pairwise
from math import nan, sqrt
from typing import Final

import numpy as np
import scipy  # its signal part is slow to import, and loaded at its first use
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

from chipglow.cutting import unresolved
from chipglow.quantities import Array
from chipglow.scene import Scene

_LEAST_PROMINENCE: Final = 0.3
"""Least rise of the autocorrelation from the valley before its first peak to that peak."""

_STANDING_OUT: Final = 0.35
"""Least prominence of the peaks of unequal segments over the range of the force."""

_LEAST_SMOOTH: Final = 0.7
"""Least fraction of its range that a force with unequal segments keeps when it is smoothed."""

_LEAST_SWING: Final = 0.1
"""Least range of the force over its mean: less is the ripple of a continuous chip."""

LARGEST_FRACTION: Final = 0.01
"""Fraction of work or force from which inertia counts as too much."""


@dataclass(frozen=True)
class Segmentation:
    """Segments in a force history."""

    start: float
    """Time in s from which the history counts, after the first build-up of the chip."""
    period: float
    """Mean time from one force peak to the next in s; NaN with less than two peaks."""
    period_uncertainty: float
    """Standard uncertainty of the period in s; NaN for less than two intervals."""
    correlation_period: float
    """Period in s from the autocorrelation, as a check; NaN if the segments are too unequal."""
    peaks: Array
    """Times of the force peaks in s."""
    cutting_mean: float
    thrust_mean: float
    """Mean forces per width of cut from `start` on in N/m."""
    cutting_swing: float
    thrust_swing: float
    """Mean height of the forces' peaks over the valleys between them in N/m; NaN without peaks."""

    @property
    def segments(self) -> int:
        """Number of whole segments: peaks of the cutting force."""
        return int(self.peaks.size)


def segmentation(
    time: ArrayLike, cutting_force: ArrayLike, thrust_force: ArrayLike
) -> Segmentation:
    """Compute period and swing of the segments from the history of the forces.

    The autocorrelation of the history after the build-up gives a first period; where segments are
    too unequal for that, three or more peaks of the force smoothed over a quarter of its
    correlation time. Then the force is smoothed over a fifteenth of that period, and its peaks, at
    least six tenths of a period apart and a fifth of the swing high, count.
    """
    times = np.asarray(time, dtype=np.float64)
    cutting = np.asarray(cutting_force, dtype=np.float64)
    thrust = np.asarray(thrust_force, dtype=np.float64)
    steps = np.diff(times)
    if times.size < 16 or (steps <= 0).any() or not np.allclose(steps, steps.mean(), rtol=0.01):
        raise ValueError("force history: expected 16 or more times at even ascending steps")
    step = float(steps.mean())
    first = end_of_build_up(cutting)
    times, cutting, thrust = times[first:], cutting[first:], thrust[first:]
    regular = coarse = nan
    least = _LEAST_SWING * abs(cutting.mean())
    if cutting.size >= 8 and _range(swing := scipy.signal.detrend(cutting)) > least:
        correlation = _correlation(swing)
        regular = _correlation_period(correlation, step)
        coarse = regular if np.isfinite(regular) else _unequal_period(swing, correlation, step)
    peaks = np.zeros(0, dtype=np.int64)
    swings = [nan, nan]
    if np.isfinite(coarse):
        smooth = [gaussian_filter1d(force, coarse / step / 15) for force in (cutting, thrust)]
        peaks = _peaks(smooth[0], coarse / step)
        swings = [_swing(force, peaks) for force in smooth]
    intervals = np.diff(times[peaks])
    return Segmentation(
        start=float(times[0]),
        period=float(intervals.mean()) if intervals.size else nan,
        period_uncertainty=(
            float(intervals.std(ddof=1)) / sqrt(intervals.size) if intervals.size > 1 else nan
        ),
        correlation_period=regular,
        peaks=times[peaks],
        cutting_mean=float(cutting.mean()),
        thrust_mean=float(thrust.mean()),
        cutting_swing=swings[0],
        thrust_swing=swings[1],
    )


def end_of_build_up(cutting_force: Array) -> int:
    """Return the index at which the cutting force reaches the median of its second half.

    It is at least a fifth of the history.
    """
    later = cutting_force[cutting_force.size // 2 :]
    return max(int(np.argmax(cutting_force >= np.median(later))), cutting_force.size // 5)


def _range(force: Array) -> float:
    """Return the range from 5 % to 95 % of the values."""
    low, high = np.percentile(force, [5.0, 95.0])
    return float(high - low)


def _correlation(swing: Array) -> Array:
    """Compute the autocorrelation up to half of the history; 0 for a constant force."""
    spectrum = np.fft.rfft(swing, 2 * swing.size)
    raw = np.fft.irfft(np.abs(spectrum) ** 2)[: swing.size]
    if not raw[0] > 0:
        return np.zeros(swing.size // 2)
    correlation = (raw / np.arange(swing.size, 0, -1))[: swing.size // 2]
    return np.asarray(gaussian_filter1d(correlation / correlation[0], 2.0))


def _correlation_period(correlation: Array, step: float) -> float:
    """Return the lag of the first clear peak of the autocorrelation; NaN if undefined."""
    down = np.flatnonzero(correlation < 0)
    if down.size == 0:
        return nan
    peaks, _ = scipy.signal.find_peaks(correlation, prominence=_LEAST_PROMINENCE)
    peaks = peaks[peaks > down[0]]
    return float(peaks[0] * step) if peaks.size else nan


def _unequal_period(swing: Array, correlation: Array, step: float) -> float:
    """Return the mean interval between the peaks that stand out; NaN for less than three."""
    down = np.flatnonzero(correlation < 0)
    if down.size == 0:
        return nan
    smooth = gaussian_filter1d(swing, down[0] / 4)
    if _range(smooth) < _LEAST_SMOOTH * _range(swing):
        return nan
    peaks, _ = scipy.signal.find_peaks(smooth, prominence=_STANDING_OUT * _range(smooth))
    return float(np.diff(peaks).mean() * step) if peaks.size > 2 else nan


def _peaks(force: Array, period: float) -> NDArray[np.int64]:
    peaks, _ = scipy.signal.find_peaks(
        force, distance=max(0.6 * period, 1.0), prominence=_range(force) / 5
    )
    return np.asarray(peaks, dtype=np.int64)


def _swing(force: Array, peaks: NDArray[np.int64]) -> float:
    """Return the mean height of the peaks over the valleys between them."""
    if peaks.size < 2:
        return nan
    heights = [max(force[a], force[b]) - force[a:b].min() for a, b in pairwise(peaks)]
    return float(np.mean(heights))


@dataclass(frozen=True)
class Inertia:
    """Inertia of the scaled mass in a cut, after the first build-up of the chip."""

    kinetic_fraction: float
    """Greatest change of the kinetic energy over the work of the drive so far; NaN if unknown."""
    force_fraction: float
    """Momentum flow of the scaled mass, ρV² times uncut chip thickness, over the cutting force."""
    mass_scaling: float
    """Factor on the density."""

    @property
    def warning(self) -> str:
        """Warning of too much inertia; empty if there is none."""
        fractions = (
            (self.kinetic_fraction, "kinetic energy reaches {} of the work"),
            (self.force_fraction, "momentum is worth {} of the cutting force"),
        )
        over = [text.format(f"{s:.1%}") for s, text in fractions if s > LARGEST_FRACTION]
        if not over:
            return ""
        return (
            f"The scaled mass's {' and its '.join(over)}, expected up to {LARGEST_FRACTION:.0%}: "
            f"lower mass_scaling, now {self.mass_scaling:g}."
        )


def inertia(scene: Scene) -> Inertia | None:
    """Compute the inertia of a scene's cut; None without a force history."""
    if "cutting_force" not in scene.data:
        return None
    cutting = _values(scene, "cutting_force")
    first = end_of_build_up(cutting)
    kinetic_fraction = nan
    if "drive_work" in scene.data:
        kinetic, work = (_values(scene, n)[first:] for n in ("kinetic_energy", "drive_work"))
        kinetic_fraction = np.fmax.reduce(_ratio(np.abs(kinetic), work))
    flow = float(scene.data.attrs.get("momentum_flow", nan))
    scaling = float(scene.data.attrs.get("mass_scaling", nan))
    force_fraction = _ratio(np.array(flow), cutting[first:].mean())
    return Inertia(float(kinetic_fraction), float(force_fraction), scaling)


def _ratio(part: Array, whole: Array) -> Array:
    """Return the quotient; NaN where the divisor is 0, as before the tool touches."""
    unknown = np.full(np.shape(whole), nan)
    return np.asarray(np.divide(part, whole, out=unknown, where=whole > 0.0))


def _values(scene: Scene, name: str) -> Array:
    return np.asarray(scene.data[name].values, dtype=np.float64)


def resolution_warnings(scene: Scene, band_width: float = nan) -> tuple[str, ...]:
    """Return sentences about lengths of a cut that its grid does not resolve."""
    known = str(scene.data.attrs.get("resolution_warnings", ""))
    cell = float(scene.data.attrs.get("cell", 0.0))
    return (*known.splitlines(), *unresolved({"shear band": band_width}, cell))
