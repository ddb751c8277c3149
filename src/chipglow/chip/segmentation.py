"""Histories of a cut: segments, forces, and the inertia of the scaled mass."""

from dataclasses import dataclass
from itertools import pairwise
from math import nan, sqrt
from typing import Final

import numpy as np
import scipy  # its signal part is slow to import, and loaded at its first use
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

from chipglow.quantities import Array, Brief, quotient
from chipglow.scene import Scene
from chipglow.scene.scene import FORCE_UNITS

_SMOOTH: Final = 1e-6
"""Standard deviation in s of the Gaussian that smooths single points of the thickness."""

_STANDING_OUT: Final = 0.25
"""Smallest rise of a peak over the range of the thickness: less is a ripple between segments."""

LARGEST_FRACTION: Final = 0.01
"""Fraction of work or force from which inertia counts as too much."""


@dataclass(frozen=True, repr=False)
class Segmentation(Brief):
    """Segments of a chip; standard deviations and uncertainties are NaN for a single value."""

    peaks: Array
    valleys: Array
    """Times in s at which the chip is thickest, and thinnest between two peaks."""
    period: float
    """Mean time from valley to valley in s, which are sharper; NaN with less than two."""
    period_uncertainty: float
    """Standard uncertainty of the mean."""
    peak: float
    peak_standard_deviation: float
    valley: float
    valley_standard_deviation: float
    """Mean thickness at peaks and valleys in m; without two peaks the largest and the smallest."""
    degree: float
    """Degree of segmentation: 1 - valley over the mean of both peaks beside it, mean."""
    degree_uncertainty: float
    """Standard uncertainty of the mean."""

    @property
    def segments(self) -> int:
        """Number of whole segments."""
        return int(self.valleys.size)


def segmentation(time: ArrayLike, thickness: ArrayLike, resolution: float) -> Segmentation:
    """Find segments in a thickness in m at even times in s; peaks rise by `resolution` or more."""
    known = np.isfinite(np.asarray(thickness, np.float64))
    times, values = np.asarray(time, np.float64)[known], np.asarray(thickness, np.float64)[known]
    if times.size < 2:
        return Segmentation(np.zeros(0), np.zeros(0), *[nan] * 8)  # no segment: unknown numbers
    smooth = gaussian_filter1d(values, _SMOOTH / float(np.median(np.diff(times))), mode="nearest")
    # Percentiles, because single extremes change the range.
    least = max(resolution, _STANDING_OUT * float(np.ptp(np.percentile(smooth, [5, 95]))))
    tops = scipy.signal.find_peaks(smooth, prominence=least)[0]
    bottoms = np.array([a + smooth[a:b].argmin() for a, b in pairwise(tops)], np.int64)
    peaks, valleys = smooth[tops], smooth[bottoms]
    degrees = 1 - 2 * valleys / (peaks[1:] + peaks[:-1])
    if not valleys.size:
        peaks, valleys = smooth.max(keepdims=True), smooth.min(keepdims=True)
        degrees = 1 - valleys / peaks
    return Segmentation(
        times[tops],
        times[bottoms],
        *_mean_and_uncertainty(np.diff(times[bottoms])),
        *mean_and_deviation(peaks),
        *mean_and_deviation(valleys),
        *_mean_and_uncertainty(degrees),
    )


def mean_and_deviation(values: Array) -> tuple[float, float]:
    """Return the mean and the standard deviation; NaN of too few values."""
    mean = float(values.mean()) if values.size else nan
    return mean, float(values.std(ddof=1)) if values.size > 1 else nan


def _mean_and_uncertainty(values: Array) -> tuple[float, float]:
    mean, deviation = mean_and_deviation(values)
    return mean, deviation / sqrt(max(values.size, 1))


@dataclass(frozen=True, repr=False)
class ForceMeans(Brief):
    """Mean forces per width in N/m, and their mean range from one peak of the chip to the next.

    They are NaN without two peaks, and without a history of the forces.
    """

    cutting_mean: float
    cutting_swing: float
    thrust_mean: float
    thrust_swing: float


@dataclass(frozen=True, repr=False)
class CutHistory(ForceMeans):
    """Forces per width in N/m and thickness in m over time in s; segments after the build-up."""

    time: Array
    cutting: Array
    thrust: Array
    thickness: Array
    start: float
    """Time in s from which the history counts."""
    segmentation: Segmentation


def cut_history(scene: Scene) -> CutHistory | None:
    """Return means and segments of a scene's history; None without one."""
    if "cutting_force" not in scene.data:
        return None
    time, cutting, thrust, thickness = (_values(scene, n) for n in ("force_time", *FORCE_UNITS))
    first = end_of_build_up(cutting)
    segments = segmentation(time[first:], thickness[first:], resolution(scene))
    ends = np.searchsorted(time, segments.peaks)
    forces = *_mean_and_swing(cutting, first, ends), *_mean_and_swing(thrust, first, ends)
    return CutHistory(
        *forces,
        time=time,
        cutting=cutting,
        thrust=thrust,
        thickness=thickness,
        start=float(time[first]),
        segmentation=segments,
    )


def resolution(scene: Scene) -> float:
    """Return the smallest rise in m that counts as a segment: a cell, or two samples."""
    return float(scene.data.attrs.get("cell", 2 * scene.raster.spacing))


def _mean_and_swing(force: Array, first: int, ends: NDArray[np.int_]) -> tuple[float, float]:
    ranges = [np.ptp(force[a:b]) for a, b in pairwise(ends)]
    return float(force[first:].mean()), float(np.mean(ranges)) if ranges else nan


def end_of_build_up(cutting_force: Array) -> int:
    """Return where the force reaches the median of its second half, at a fifth or later."""
    later = cutting_force[cutting_force.size // 2 :]
    return max(int(np.argmax(cutting_force >= np.median(later))), cutting_force.size // 5)


@dataclass(frozen=True)
class Inertia:
    """Inertia of the scaled mass in a cut, after the first build-up of the chip."""

    kinetic_fraction: float
    """Largest change of the kinetic energy over the work of the drive so far; NaN if unknown."""
    force_fraction: float
    """Momentum flow of the scaled mass, ρV² times uncut chip thickness, over the cutting force."""
    mass_scaling: float
    """Factor on the density."""

    @property
    def warning(self) -> str:
        """Warning of too much inertia, or an empty text."""
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
        kinetic_fraction = np.fmax.reduce(quotient(np.abs(kinetic), work))
    flow = float(scene.data.attrs.get("momentum_flow", nan))
    scaling = float(scene.data.attrs.get("mass_scaling", nan))
    force_fraction = quotient(np.array(flow), cutting[first:].mean())
    return Inertia(float(kinetic_fraction), float(force_fraction), scaling)


def _values(scene: Scene, name: str) -> Array:
    return np.asarray(scene.data[name].values, dtype=np.float64)


def resolution_warnings(scene: Scene) -> tuple[str, ...]:
    """Return sentences about lengths of a cut that its grid does not resolve."""
    return tuple(str(scene.data.attrs.get("resolution_warnings", "")).splitlines())
