"""Exposures: a scene's radiance integrated over an exposure time."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.exposure_kernels import BATCH, STEPS_PER_KELVIN, Check, Sums
from chipglow.quantities import Array, Brief
from chipglow.quantities.units import COLDEST, HOTTEST
from chipglow.radiometry import Band
from chipglow.scene import Frame, Raster, Scene, is_gap
from chipglow.surface import EmissivityField, EmissivityStack

_ROUNDING: Final = 1e-6
"""Part of a frame spacing or an exposure that counts as rounding of times."""

_SPARSE: Final = 1e-3
"""Ratio of exposure to frame spacing below which a changing scene causes a warning."""


@dataclass(frozen=True, eq=False, repr=False)
class Exposure(Brief):
    """A scene's radiance during one integration time; arrays in W/(m² sr), shape (y, x)."""

    start: float
    """Start of the integration in s."""
    duration: float
    """Integration time in s."""
    raster: Raster
    mean_radiance: Array
    """Time average of the apparent radiance."""
    peak_radiance: NDArray[np.float32]
    """Largest apparent radiance of all sub-frames."""
    peak_temperature: NDArray[np.float32]
    """Highest true temperature of all sub-frames in K; NaN without material."""
    centre_radiance: Array
    """Apparent radiance at the middle of the integration."""
    mean_temperature: Array
    """Time average of the true temperature of the material in K; NaN without material."""
    material_fraction: Array
    """Fraction of the integration in which there is material."""
    centre_temperature: NDArray[np.float32]
    """True temperature at the middle of the integration in K; NaN without material."""
    effects: Mapping[str, str] = field(default_factory=dict)
    """Attributes of a measurement about the surface, by `Surface.effects`."""
    warnings: tuple[str, ...] = ()
    """Warnings about the emissivity, by `Origin.warnings`."""


def surroundings_radiance(band: Band, reflected: float | None) -> float:
    """Return the in-band radiance of surroundings at a temperature in K; 0 without them."""
    return 0.0 if reflected is None else float(band.radiance(reflected))


@dataclass(frozen=True, eq=False)
class SpectralView:
    """Emissivity of a scene in a band, with the temperature of the surroundings in K."""

    emissivity: EmissivityField
    band: Band
    reflected: float | None = None


def expose(
    scene: Scene,
    views: Sequence[SpectralView],
    start: float,
    duration: float,
    delays: Array | None = None,
    check: Check | None = None,
) -> tuple[Exposure, ...]:
    """Integrate the apparent radiance of views of a scene over a duration, starting at `start`.

    Surfaces and bands that views share are computed once. `delays` in s are the delays of the rows
    of samples with a rolling shutter. An exception that `check` raises aborts the exposure.

    Apparent radiance is ε L(T) (Equation 3 of the paper), or ε L(T) + (1 − ε) L(T_reflected)
    (Equation 2). The void, "undefined" in the paper, has no radiance. L is interpolated in a table
    of 1/32 K, with a relative error of at most 6e-7 above 250 K.
    """
    if delays is None:
        delays = np.zeros(scene.raster.rows)
    indices, weights, middles = _row_weights(scene, start, duration, delays)
    fields = list(dict.fromkeys(view.emissivity for view in views))
    bands = list(dict.fromkeys(view.band for view in views))
    stack = EmissivityStack(fields)
    sums = Sums(
        np.array([[fields.index(view.emissivity), bands.index(view.band)] for view in views]),
        np.stack([_fine_table(band) for band in bands]),
        np.array([surroundings_radiance(v.band, v.reflected) for v in views], np.float32),
        max(field.max_emissivity for field in fields),
        scene.raster.shape,
        check,
    )
    # The fastest kernel for scene and surfaces.
    features = None if any(field.changes for field in fields) else stack.features
    read = indices if features is not None else ()
    splines = [one for index in read if (one := scene.splines(index)) is not None]
    if features is not None and splines:
        sums.add_splines(splines, features, weights, middles)
    else:
        for begin, frames in _batches(scene, indices, stack.required_fields):
            part = np.ascontiguousarray(weights[:, begin : begin + len(frames)])
            if features is None:
                sums.add_given(frames, stack, part, middles - begin)
            else:
                sums.add_features(frames, features, part, middles - begin)
    mean, hottest = sums.mean, sums.hottest
    if not np.isfinite(mean).all():
        raise ValueError(
            f"exposure: at {start:g} s, temperature is not within {COLDEST:g} to {HOTTEST:g} K or "
            "emissivity not within 0 to 1 at "
            f"{np.count_nonzero(~np.isfinite(mean).all(axis=0))} samples"
        )
    hottest[hottest == 0.0] = np.nan
    sums.middle[sums.middle == 0.0] = np.nan
    with np.errstate(invalid="ignore"):
        heat = sums.heat / sums.present
    of_material = heat, sums.present, sums.middle
    return tuple(
        Exposure(start, duration, scene.raster, radiance, peak, hottest, centre, *of_material)
        for radiance, peak, centre in zip(mean, sums.peak, sums.centre, strict=True)
    )


def sparse_frames(scene: Scene, duration: float) -> str:
    """Return a warning if the frames of a changing scene are far apart for an exposure in s."""
    if duration >= _SPARSE * scene.frame_spacing:
        return ""
    first, last = (scene.field("temperature", index) for index in (0, len(scene) - 1))
    if np.array_equal(first, last):
        return ""
    return (
        f"The scene changes, but its frames are {scene.frame_spacing:.3g} s apart, "
        f"{scene.frame_spacing / duration:.2g} times the exposure of {1e6 * duration:.4g} µs. "
        "Check the unit of the scene's times."
    )


def frame_weights(
    times: Array, frame_spacing: float, start: float, duration: float
) -> tuple[range, Array]:
    """Return the sub-frames that an integration covers, and their weights, of sum 1.

    A sub-frame covers the time until the next one; the last sub-frame, and each before a gap,
    covers `frame_spacing`. The single frame of a constant scene covers all times.
    """
    if times.size == 1:
        return range(1), np.ones(1)
    ends = np.append(times[1:], times[-1] + frame_spacing)
    before_gap = is_gap(ends - times, frame_spacing)
    ends[before_gap] = times[before_gap] + frame_spacing
    rounding = _ROUNDING * min(frame_spacing, duration)
    end = start + duration
    if not (start >= times[0] - rounding and end <= ends[-1] + rounding):
        raise ValueError(
            f"exposure: {_microseconds(start, end)} is not within the scene, which covers "
            f"{_microseconds(times[0], ends[-1])}"
        )
    for gap in np.flatnonzero(before_gap):
        if start < times[gap + 1] - rounding and end > ends[gap] + rounding:
            raise ValueError(
                f"exposure: {_microseconds(start, end)} overlaps a gap of the scene, which has no "
                f"frame from {_microseconds(ends[gap], times[gap + 1])}"
            )
    shared = np.minimum(ends, end) - np.maximum(times, start)
    covered = np.flatnonzero(shared > rounding)
    weights = shared[covered]
    return range(int(covered[0]), int(covered[-1]) + 1), weights / weights.sum()


def _microseconds(begin: float, end: float) -> str:
    return f"{1e6 * begin:.6g} us to {1e6 * end:.6g} us"


def _row_weights(
    scene: Scene, start: float, duration: float, delays: Array
) -> tuple[range, Array, NDArray[np.intp]]:
    """Return the sub-frames of an exposure, their weights in each row, and each central one."""
    times, spacing = scene.times, scene.frame_spacing
    different, row_of = np.unique(delays, return_inverse=True)
    starts = start + different
    try:
        covered = [frame_weights(times, spacing, one, duration) for one in starts[::-1]][::-1]
    except ValueError as error:
        if not different[-1]:
            raise
        delay = f"line_time: the last row is exposed {different[-1]:.4g} s after the first"
        raise ValueError(f"{delay}; {error}") from None
    indices = range(covered[0][0].start, covered[-1][0].stop)
    weights = np.zeros((different.size, len(indices)))
    for row, (frames, values) in zip(weights, covered, strict=True):
        row[frames.start - indices.start : frames.stop - indices.start] = values
    middles = [
        min(max(scene.frame_at(one + duration / 2), frames[0]), frames[-1]) - indices.start
        for one, (frames, _) in zip(starts, covered, strict=True)
    ]
    return indices, weights[row_of], np.array(middles, np.intp)[row_of]


def _batches(
    scene: Scene, indices: range, fields: Collection[str] | None
) -> Iterator[tuple[int, list[Frame]]]:
    """Yield batches of frames, each with the position of its first; read from a file meanwhile."""

    def read(begin: int) -> list[Frame]:
        return [scene.frame(index, fields) for index in indices[begin : begin + BATCH]]

    begins = range(0, len(indices), BATCH)
    if scene.in_memory or len(begins) == 1:
        for begin in begins:
            yield begin, read(begin)
        return
    with ThreadPoolExecutor(1) as reader:
        pending = reader.submit(read, 0)
        for begin in begins:
            frames = pending.result()
            if begin != begins[-1]:
                pending = reader.submit(read, begin + BATCH)
            yield begin, frames


@lru_cache(maxsize=8)
def _fine_table(band: Band) -> NDArray[np.float32]:
    """Return the radiance at steps of 1 / `STEPS_PER_KELVIN`, and its change to the next step."""
    count = round((HOTTEST - COLDEST) * STEPS_PER_KELVIN) + 1
    values = np.asarray(band.radiance(COLDEST + np.arange(count) / STEPS_PER_KELVIN))
    return np.stack([values, np.diff(values, append=values[-1])], axis=1).astype(np.float32)
