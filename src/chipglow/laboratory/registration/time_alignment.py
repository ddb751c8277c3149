"""Offset and drift of two cameras' clocks, from an event that both recorded."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import log
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.fft import dct, idct
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, minimize_scalar
from scipy.special import stdtr

from chipglow.camera import Flag, Measurement, Recording
from chipglow.laboratory.registration.registration import Registration
from chipglow.quantities import TINY, Array, Brief
from chipglow.text import Notes

_FEWEST_FRAMES: Final = 6
"""Fewest frames that two signals share: twice the fitted level, slope and offset."""

_LEAST_OVERLAP: Final = 0.5
"""Smallest fraction of the infrared frames for which there are visible ones."""

_RIVAL_GAIN: Final = 9.0
"""Twice the logarithm of the likelihood ratio below which another offset is nearly as likely: three
standard deviations."""

_CHANCE_LEVEL: Final = 0.01
"""Probability of such a correlation at one of the offsets, if the signals are unrelated, from which
it is a warning."""

_ROUNDING: Final = 1e-12
"""Squares of correlations are rounded to this: a rest of 0 has no logarithm."""

_CONSTANT: Final = 1e-9
"""Standard deviation over the mean of a signal that is constant but for rounding."""

_MOST_OFFSETS: Final = 2_000_000
"""Most offsets that are tried; limits memory and time."""

_OFFSETS_PER_FRAME: Final = 3
"""Offsets that are tried for each visible frame."""

_VALUES_AT_ONCE: Final = 200_000
"""Values that are computed at once: 1.6 MB."""

_PENALTY_EXPONENTS: Final = (-6.0, 9.0)
"""Powers of ten of the penalty: from no smoothing to that of all but the slowest changes."""


@dataclass(frozen=True)
class TimeAlignment:
    """Offset of the visible camera's clock: visible time = infrared time + `offset`."""

    offset: float
    """In s."""
    uncertainty: float
    """Standard uncertainty of the offset in s."""
    correlation: float
    """Correlation of both signals after alignment."""
    degrees_of_freedom: float
    warnings: tuple[str, ...] = ()
    """Warnings, as sentences."""


def align_times(
    infrared_times: Array, infrared_signal: Array, visible_times: Array, visible_signal: Array
) -> TimeAlignment:
    """Find the offset of two clocks from one signal that both cameras saw.

    Parameters
    ----------
    infrared_times, visible_times : ndarray
        Middles of the exposures in s of each camera's own clock, ascending, shapes (n,) and (m,).
    infrared_signal, visible_signal : ndarray
        A number a frame that shows the same event: the position of the chip's edge, or the mean
        brightness of a region. One may fall where the other rises.

    Raises
    ------
    ValueError
        If there are too few frames, times do not ascend, or a signal does not change.

    Notes
    -----
    The visible signal is smoothed by generalised cross-validation (Garcia, Comput. Stat. Data Anal.
    54 (2010) 1167). Of all offsets at which at least half of the infrared frames have visible ones,
    that of the largest correlation is refined by least squares. Changes faster than the visible
    frames go into the residuals and with them into the uncertainty.
    """
    _check("infrared", infrared_times, infrared_signal)
    _check("visible", visible_times, visible_signal)
    smooth = _smoothed(visible_signal / np.std(visible_signal))
    spline = CubicSpline(visible_times, smooth, extrapolate=False)
    target = (infrared_signal - infrared_signal.mean()) / infrared_signal.std()
    offsets, correlations = _correlations(infrared_times, target, visible_times, spline)
    best = int(np.abs(correlations).argmax())
    found = _refined(infrared_times, target, spline, float(offsets[best]))
    warnings = (
        *_chance(found.correlation, found.degrees_of_freedom, len(offsets)),
        *_rivals(offsets, correlations, best, len(target)),
    )
    return replace(found, warnings=warnings)


def simultaneous_frames(
    alignment: TimeAlignment,
    infrared_times: Array,
    integration_time: float,
    visible_times: Array,
    visible_exposure: float,
) -> list[NDArray[np.int64]]:
    """Return the visible frames exposed within each integration; times in s are starts."""
    return [
        np.flatnonzero(
            (visible_times < begin + integration_time) & (visible_times + visible_exposure > begin)
        )
        for begin in infrared_times + alignment.offset
    ]


def _check(name: str, times: Array, values: Array) -> None:
    if times.ndim != 1 or times.shape != values.shape:
        raise ValueError(f"{name} signal: {values.size} values but {times.size} times")
    if times.size < _FEWEST_FRAMES:
        raise ValueError(f"{name} signal: {times.size} frames, expected {_FEWEST_FRAMES} or more")
    if not (np.isfinite(values).all() and (np.diff(times) > 0).all()):
        raise ValueError(f"{name} signal: expected finite values at ascending times")
    if not values.std() > _CONSTANT * max(abs(values.mean()), TINY):
        raise ValueError(f"{name} signal: does not change, expected an event that is seen in it")


def _smoothed(signal: Array) -> Array:
    """Smooth by a penalty on second differences, chosen by generalised cross-validation."""
    parts = dct(signal, norm="ortho")
    rough = (2 - 2 * np.cos(np.pi * np.arange(signal.size) / signal.size)) ** 2

    def loss(exponent: float) -> float:
        kept = 1 / (1 + 10.0**exponent * rough)
        rest = float((((1 - kept) * parts) ** 2).sum())
        return rest / float((1 - kept).sum()) ** 2

    best = minimize_scalar(loss, bounds=_PENALTY_EXPONENTS, method="bounded").x
    return np.asarray(idct(parts / (1 + 10.0**best * rough), norm="ortho"))


def _correlations(
    times: Array, target: Array, visible_times: Array, spline: CubicSpline
) -> tuple[Array, Array]:
    """Return offsets in s on a grid, and the correlation at each."""
    step = float(np.median(np.diff(visible_times))) / _OFFSETS_PER_FRAME
    low = visible_times[0] - np.quantile(times, 1 - _LEAST_OVERLAP)
    high = visible_times[-1] - np.quantile(times, _LEAST_OVERLAP)
    count = int((high - low) / step) + 1
    if not 1 <= count <= _MOST_OFFSETS:
        raise ValueError(
            "signals: the series do not overlap, or are too long, expected up to "
            f"{_MOST_OFFSETS // _OFFSETS_PER_FRAME} visible frames and half of the "
            "infrared ones among them"
        )
    offsets = low + step * np.arange(count)
    parts = np.array_split(offsets, max(offsets.size * times.size // _VALUES_AT_ONCE, 1))
    found = [_correlation(target, spline(times + part[:, None])) for part in parts]
    return offsets, np.concatenate(found)


def _correlation(target: Array, values: Array) -> Array:
    """Return the correlation of each row with the target where both are known, shape (n,)."""
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=1, keepdims=True), 1)
    one, other = np.where(known, target, 0.0), np.where(known, values, 0.0)
    one = np.where(known, one - one.sum(axis=1, keepdims=True) / count, 0.0)
    other = np.where(known, other - other.sum(axis=1, keepdims=True) / count, 0.0)
    size = np.sqrt((one**2).sum(axis=1) * (other**2).sum(axis=1))
    enough = count[:, 0] >= max(_FEWEST_FRAMES, _LEAST_OVERLAP * target.size)
    product = (one * other).sum(axis=1)
    return np.where(enough & (size > 0), product / np.maximum(size, TINY), 0.0)


def _refined(times: Array, target: Array, spline: CubicSpline, begin: float) -> TimeAlignment:
    """Return the clocks near an offset, by least squares."""
    known = np.isfinite(spline(times + begin))
    times, target = times[known] + begin, target[known]
    unit = float(np.median(np.diff(spline.x)))

    def placed(shift: float) -> Array:
        return np.asarray(spline(np.clip(times + unit * shift, spline.x[0], spline.x[-1])))

    slope, level = np.polyfit(placed(0.0), target, 1)
    start = [level, slope, 0.0]
    fit = least_squares(lambda p: p[0] + p[1] * placed(p[2]) - target, start, x_scale="jac")
    freedom = max(times.size - len(start), 1)
    variance = float(fit.fun @ fit.fun) / freedom * np.linalg.pinv(fit.jac.T @ fit.jac)[2, 2]
    correlation = float(np.corrcoef(target, target + fit.fun)[0, 1]) * float(np.sign(fit.x[1]))
    offset = begin + unit * float(fit.x[2])
    return TimeAlignment(offset, unit * float(np.sqrt(variance)), correlation, freedom)


def _chance(correlation: float, freedom: float, offsets: int) -> Iterator[str]:
    """Yield a warning if one of the offsets would have this correlation by chance."""
    # Rounding of a full correlation.
    rest = max(1.0 - correlation**2, 1e-15)
    likely = 2 * float(stdtr(freedom, -abs(correlation) * np.sqrt(freedom / rest))) * offsets
    if likely >= _CHANCE_LEVEL:
        yield f"A correlation of {correlation:.2f} is no better than that of unrelated signals."


def _rivals(offsets: Array, correlations: Array, best: int, count: int) -> Iterator[str]:
    """Yield a warning for another offset beyond the best one's peak that is nearly as likely."""
    squares = correlations**2
    below = squares < squares[best] / 2
    left = np.flatnonzero(below[:best])
    right = np.flatnonzero(below[best:])
    others = squares.copy()
    others[(left[-1] if left.size else 0) : (best + right[0] if right.size else None)] = 0.0
    rival = int(others.argmax())
    gain = count * log((1 - others[rival] + _ROUNDING) / (1 - squares[best] + _ROUNDING))
    if gain <= _RIVAL_GAIN and others[rival] > 0.0:
        yield (
            f"An offset of {(offsets[rival] - offsets[best]) * 1e6:.4g} us more fits nearly as "
            f"well, with a correlation of {correlations[rival]:.2f}: they are periodic, or say "
            "little."
        )


@dataclass(frozen=True, eq=False, repr=False)
class RecordingAlignment(Brief):
    """The clocks of two recordings; made by `align_recordings`."""

    clocks: TimeAlignment
    """How they go by each other."""
    infrared_times: Array
    """When each infrared integration began in s, shape (n,)."""
    visible_frames: list[NDArray[np.int64]]
    """Indices of the visible frames that were exposed within each, from 0."""
    notes: Notes = field(default_factory=Notes)

    def to_frame(self) -> pd.DataFrame:
        """Return a table of the infrared frames."""
        return pd.DataFrame(
            {
                "infrared_frame": np.arange(self.infrared_times.size),
                "infrared_time_us": 1e6 * self.infrared_times,
                "visible_frames": [" ".join(map(str, found)) for found in self.visible_frames],
            }
        )


def align_recordings(
    registration: Registration,
    infrared: Measurement,
    visible: Recording,
    region: tuple[float, float, float, float],
) -> RecordingAlignment:
    """Find the offset of two cameras' clocks by the mean brightness of a region."""
    if "integration_time" not in infrared.data.attrs:
        raise ValueError("the measurement does not state its integration_time")
    integration = float(infrared.data.attrs["integration_time"])
    left, bottom, right, top = region

    def inside(places: Array) -> NDArray[np.bool_]:
        x, y = places[..., 0], places[..., 1]
        return (x >= left) & (x <= right) & (y >= bottom) & (y <= top)

    down, across = np.indices(visible.signal.shape[1:])
    seen = inside(registration.positions(np.stack([across, down], axis=-1)))
    hot = inside(infrared.raster.centres)
    if not (hot.any() and seen.any()):
        raise ValueError("region: must lie within both images")
    signals = infrared.radiance[:, hot].mean(axis=1), visible.signal[:, seen].mean(axis=1)
    heat, brightness = (np.asarray(signal, np.float64) for signal in signals)
    exposure = visible.integration_time or float(np.median(np.diff(visible.times)))
    times = infrared.times
    clocks = align_times(times + integration / 2, heat, visible.times + exposure / 2, brightness)
    within = simultaneous_frames(clocks, times, integration, visible.times, exposure)
    notes = Notes(warnings=list(clocks.warnings))
    if visible.integration_time is None:
        notes.assumed.append(
            f"A visible exposure lasts as long as its frame, {1e6 * exposure:.4g} us."
        )
    return RecordingAlignment(clocks, times, within, notes)


def infrared_radiance(measurement: Measurement, frame: int) -> Array:
    """Return the radiance of a frame for `fit_dots`: NaN where a pixel is dead."""
    return np.where(measurement.flags[frame] & Flag.DEAD, np.nan, measurement.radiance[frame])
