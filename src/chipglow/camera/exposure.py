"""The exposure: a scene's radiance, summed over the integration time in one pass."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from chipglow.radiometry import Band
from chipglow.radiometry.band import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.scene import Raster, Scene
from chipglow.surface import EmissivityField

_STEPS_PER_KELVIN: Final = 32.0
_ROUNDING: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Exposure:
    """What a scene sent toward the camera during one integration time, on the scene's samples.

    Parameters
    ----------
    start, duration : float
        When the integration began and how long it lasted, in s.
    raster : Raster
        The scene's samples.
    mean_radiance : ndarray
        Mean over time of the apparent radiance in W/(m² sr), float64, shape (y, x).
    peak_radiance : ndarray
        Largest apparent radiance of any sub-frame in W/(m² sr), float32, shape (y, x).
    peak_temperature : ndarray
        Highest true temperature of any sub-frame in K, float32, shape (y, x); NaN where no
        sub-frame had a surface (an emissivity over 0).
    centre_radiance : ndarray
        Apparent radiance at the middle of the integration in W/(m² sr), float64, shape (y, x).

    Raises
    ------
    ValueError
        If an array is not of the raster's shape.
    """

    start: float
    duration: float
    raster: Raster
    mean_radiance: NDArray[np.float64]
    peak_radiance: NDArray[np.float32]
    peak_temperature: NDArray[np.float32]
    centre_radiance: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("mean_radiance", "peak_radiance", "peak_temperature", "centre_radiance"):
            shape = getattr(self, name).shape
            if shape != self.raster.shape:
                raise ValueError(
                    f"exposure: {name} has shape {shape}, expected {self.raster.shape}"
                )


def expose(
    scene: Scene,
    emissivity: EmissivityField,
    band: Band,
    start: float,
    duration: float,
    reflected: float | None = None,
) -> Exposure:
    """Sum a scene's apparent radiance over an integration time; one sub-frame in memory at once.

    Parameters
    ----------
    scene : Scene
        The true temperature over time.
    emissivity : EmissivityField
        The surface, laid on the scene.
    band : Band
        The camera's spectral band.
    start, duration : float
        When the integration begins and how long it lasts, in s.
    reflected : float, optional
        Temperature in K of surroundings that the surface reflects; none by default.

    Returns
    -------
    Exposure

    Raises
    ------
    ValueError
        If the integration reaches beyond the scene, or a temperature is outside 200 K to 4000 K
        or an emissivity outside 0 to 1.

    Notes
    -----
    Apparent radiance is ε L(T) (Equation 3 of the paper), or ε L(T) + (1 − ε) L(T_reflected)
    (Equation 2). Where the emissivity is 0 the paper leaves the surface undefined: no radiance
    at all. L is looked up between values 1/32 K apart, within 4e-7 of it from 250 K on.
    """
    indices, weights = frame_weights(scene.times, scene.frame_spacing, start, duration)
    middle = _frame_at(scene, start + duration / 2, indices)
    environment = 0.0 if reflected is None else float(band.radiance(reflected))
    table, shape = _fine_table(band), scene.raster.shape
    mean, centre = np.zeros(shape), np.zeros(shape)
    peaks = np.zeros(shape, dtype=np.float32), np.zeros(shape, dtype=np.float32)
    for index, weight in zip(indices, weights, strict=True):
        frame = scene.frame(index)
        temperature = np.ascontiguousarray(frame.temperature)
        surface = np.ascontiguousarray(emissivity.emissivity(frame))
        _accumulate(temperature, surface, weight, table, environment, mean, *peaks)
        if index == middle:
            # Its peaks are in already: to take them again changes nothing.
            _accumulate(temperature, surface, 1.0, table, environment, centre, *peaks)
    if not np.isfinite(mean).all():
        raise ValueError(
            f"exposure: from {start:g} s, temperature must be {TABLE_COLDEST:g} to "
            f"{TABLE_HOTTEST:g} K and emissivity 0 to 1, but they are not at "
            f"{np.count_nonzero(~np.isfinite(mean))} samples"
        )
    peak_radiance, peak_temperature = peaks
    peak_temperature[peak_temperature == 0.0] = np.nan
    return Exposure(
        start=start,
        duration=duration,
        raster=scene.raster,
        mean_radiance=mean,
        peak_radiance=peak_radiance,
        peak_temperature=peak_temperature,
        centre_radiance=centre,
    )


def frame_weights(
    times: NDArray[np.float64], frame_spacing: float, start: float, duration: float
) -> tuple[range, NDArray[np.float64]]:
    """Share of an integration time that each sub-frame stands for.

    A sub-frame stands for the time from its own to the next one's, the last one for
    `frame_spacing`: 10 µs that begin with a sub-frame hold fifty of 0.2 µs, all of one weight. A
    scene of one frame does not change, and stands for all times.

    Parameters
    ----------
    times : ndarray
        Times of the scene's frames in s, ascending, shape (n,).
    frame_spacing : float
        Time that the last frame stands for in s.
    start, duration : float
        When the integration begins and how long it lasts, in s.

    Returns
    -------
    indices : range
        The sub-frames that the integration covers.
    weights : ndarray
        Their weights, of sum 1.

    Raises
    ------
    ValueError
        If the integration reaches beyond the scene.
    """
    if times.size == 1:
        return range(1), np.ones(1)
    edges = np.append(times, times[-1] + frame_spacing)
    rounding = _ROUNDING * min(frame_spacing, duration)
    end = start + duration
    if not (start >= edges[0] - rounding and end <= edges[-1] + rounding):
        raise ValueError(
            f"exposure: {start:.9g} s to {end:.9g} s is not within the scene, which lasts from "
            f"{edges[0]:.9g} s to {edges[-1]:.9g} s"
        )
    shared = np.minimum(edges[1:], end) - np.maximum(edges[:-1], start)
    covered = np.flatnonzero(shared > rounding)
    weights = shared[covered]
    return range(int(covered[0]), int(covered[-1]) + 1), weights / weights.sum()


def _frame_at(scene: Scene, time: float, indices: range) -> int:
    """The one of these frames that stands for a time."""
    rounded = time + _ROUNDING * scene.frame_spacing
    index = int(np.searchsorted(scene.times, rounded, side="right")) - 1
    return min(max(index, indices[0]), indices[-1])


@lru_cache(maxsize=8)
def _fine_table(band: Band) -> NDArray[np.float64]:
    """Radiance at steps so fine that a straight line between them is exact enough, and fast."""
    count = round((TABLE_HOTTEST - TABLE_COLDEST) * _STEPS_PER_KELVIN) + 1
    return np.asarray(
        band.radiance(TABLE_COLDEST + np.arange(count) / _STEPS_PER_KELVIN), dtype=np.float64
    )


@njit(cache=True, parallel=True, error_model="numpy")
def _accumulate(  # type: ignore[no-untyped-def]
    temperature, emissivity, weight, table, environment, total, peak_radiance, peak_temperature
):
    """Add one sub-frame; without branches, so that it is compiled to vector instructions."""
    last = table.size - 1
    for y in prange(temperature.shape[0]):
        for x in range(temperature.shape[1]):
            t = temperature[y, x]
            e = emissivity[y, x]
            position = (np.float64(t) - TABLE_COLDEST) * _STEPS_PER_KELVIN
            inside = min(max(position, 0.0), last - 1.0)
            i = np.int32(inside)
            black = table[i] + (inside - i) * (table[i + 1] - table[i])
            apparent = environment + np.float64(e) * (black - environment)
            if e == 0.0:
                apparent = 0.0
            if not (0.0 <= position <= last and 0.0 <= e <= 1.0):
                apparent = np.nan
            total[y, x] += weight * apparent
            peak_radiance[y, x] = max(peak_radiance[y, x], np.float32(apparent))
            peak_temperature[y, x] = max(peak_temperature[y, x], t if e > 0.0 else np.float32(0.0))
