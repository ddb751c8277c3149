"""Exposures: a scene's radiance, summed over the integration time in one pass."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.sweep import BATCH, STEPS_PER_KELVIN, Check, Sums
from chipglow.quantities import Array
from chipglow.quantities.units import COLDEST, HOTTEST
from chipglow.radiometry import Band
from chipglow.scene import Frame, Raster, Scene, is_gap
from chipglow.surface import EmissivityField, EmissivityStack

_ROUNDING: Final = 1e-6
_SPARSE: Final = 1e-3
"""Fraction of the time between frames under which an exposure hardly fits a scene that changes."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """A scene's radiance during one integration time, on the scene's samples; W/(m² sr), (y, x)."""

    start: float
    """Start of the integration in s."""
    duration: float
    """Integration time in s."""
    raster: Raster
    mean_radiance: Array
    """Mean over time of the apparent radiance."""
    peak_radiance: NDArray[np.float32]
    """Largest apparent radiance of any sub-frame."""
    peak_temperature: NDArray[np.float32]
    """Highest true temperature of any sub-frame in K; NaN without material."""
    centre_radiance: Array
    """Apparent radiance at the middle of the integration."""
    effects: Mapping[str, str] = field(default_factory=dict)
    """Attributes of its measurements about the surface: `Surface.effects`."""
    warnings: tuple[str, ...] = ()
    """Why the surface may have another emissivity: `Origin.warnings`."""


def surroundings_radiance(band: Band, reflected: float | None) -> float:
    """Return the in-band radiance of surroundings at a temperature in K; 0 without them."""
    return 0.0 if reflected is None else float(band.radiance(reflected))


@dataclass(frozen=True, eq=False)
class View:
    """A surface, laid on a scene, in a band, with the temperature in K of surroundings."""

    emissivity: EmissivityField
    band: Band
    reflected: float | None = None

    @property
    def environment(self) -> float:
        """Radiance of the surroundings in W/(m² sr)."""
        return surroundings_radiance(self.band, self.reflected)


def expose(
    scene: Scene,
    views: Sequence[View],
    start: float,
    duration: float,
    delays: Array | None = None,
    check: Check | None = None,
) -> tuple[Exposure, ...]:
    """Sum a scene's apparent radiance from `start` on over a duration, in s, for some views.

    Each frame is read once. A surface that is seen in several bands, and a band in which several
    surfaces are seen, are computed once for each frame. `delays` are how much later than `start`
    each row of samples begins in s, of a rolling shutter; an error that `check`, called now and
    then, raises ends the pass.

    Apparent radiance is ε L(T) (Equation 3 of the paper), or ε L(T) + (1 − ε) L(T_reflected)
    (Equation 2). The void, "undefined" in the paper, has no radiance at all. L is looked up
    between values 1/32 K apart, within 6e-7 of it from 250 K on.
    """
    if delays is None:
        delays = np.zeros(scene.raster.rows)
    indices, weights, middles = _row_weights(scene, start, duration, delays)
    fields = list({id(view.emissivity): view.emissivity for view in views}.values())
    bands = list(dict.fromkeys(view.band for view in views))
    places = {id(one): number for number, one in enumerate(fields)}
    stack = EmissivityStack(fields)
    sums = Sums(
        np.array([[places[id(view.emissivity)], bands.index(view.band)] for view in views]),
        np.stack([_fine_table(band) for band in bands]),
        np.array([view.environment for view in views], np.float32),
        stack.max_emissivity,
        scene.raster.shape,
        check,
    )
    _sweep(scene, stack, indices, weights, middles, sums)
    mean, hottest = sums.mean, sums.hottest
    if not np.isfinite(mean).all():
        raise ValueError(
            f"exposure: from {start:g} s, temperature must be {COLDEST:g} to "
            f"{HOTTEST:g} K and emissivity 0 to 1, but they are not at "
            f"{np.count_nonzero(~np.isfinite(mean).all(axis=0))} samples"
        )
    hottest[hottest == 0.0] = np.nan
    return tuple(
        Exposure(start, duration, scene.raster, of_view, peak, hottest, centre)
        for of_view, peak, centre in zip(mean, sums.peak, sums.centre, strict=True)
    )


def sparse_frames(scene: Scene, duration: float) -> str:
    """Return a warning if a scene changes and its frames are far apart for an exposure in s."""
    if duration >= _SPARSE * scene.frame_spacing:
        return ""
    first, last = (scene.field("temperature", index) for index in (0, len(scene) - 1))
    if np.array_equal(first, last):
        return ""
    return (
        f"The scene changes, and its frames are {scene.frame_spacing:.3g} s apart, "
        f"{scene.frame_spacing / duration:.2g} times the exposure of {1e6 * duration:.4g} µs: "
        "are its times in another unit?"
    )


def frame_weights(
    times: Array, frame_spacing: float, start: float, duration: float
) -> tuple[range, Array]:
    """Return the sub-frames that an integration covers, and their weights, of sum 1.

    A sub-frame stands for the time until the next one, the last one and those before a gap for
    `frame_spacing`: 10 µs that begin with a sub-frame hold fifty of 0.2 µs, all of one weight. A
    scene of one frame does not change, and stands for all times.
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
            f"exposure: {_microseconds(start, end)} is not within the scene, which lasts from "
            f"{_microseconds(times[0], ends[-1])}"
        )
    for gap in np.flatnonzero(before_gap):
        if start < times[gap + 1] - rounding and end > ends[gap] + rounding:
            raise ValueError(
                f"exposure: {_microseconds(start, end)} reaches into a gap of the scene, which "
                f"has no frame from {_microseconds(ends[gap], times[gap + 1])}"
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
    """Return an exposure's sub-frames, their weights in each row, and each row's middle one."""
    times, spacing = scene.times, scene.frame_spacing
    different, row_of = np.unique(delays, return_inverse=True)
    starts = start + different
    try:
        covered = [frame_weights(times, spacing, one, duration) for one in starts[::-1]][::-1]
    except ValueError as error:
        if not different[-1]:
            raise
        late = f"line_time: the last row's exposure begins {different[-1]:.4g} s after the first's"
        raise ValueError(f"{late}; {error}") from None
    indices = range(covered[0][0].start, covered[-1][0].stop)
    weights = np.zeros((different.size, len(indices)))
    for of_row, (own, values) in zip(weights, covered, strict=True):
        of_row[own.start - indices.start : own.stop - indices.start] = values
    middles = [
        min(max(scene.frame_at(one + duration / 2), own[0]), own[-1]) - indices.start
        for one, (own, _) in zip(starts, covered, strict=True)
    ]
    return indices, weights[row_of], np.array(middles, np.intp)[row_of]


def _sweep(
    scene: Scene,
    stack: EmissivityStack,
    indices: range,
    weights: Array,
    middles: NDArray[np.intp],
    sums: Sums,
) -> None:
    """Add sub-frames to sums, in the quickest way that scene and surfaces allow."""
    features = stack.features if stack.is_bare else None
    if features is not None:
        splines = [one for i in indices if (one := scene.splines(i)) is not None]
        if splines:
            sums.add_splines(splines, features, weights, middles)
            return
    for begin, frames in _batches(scene, indices, stack.required_fields):
        part = np.ascontiguousarray(weights[:, begin : begin + len(frames)])
        if features is None:
            sums.add_given(frames, stack, part, middles - begin)
        else:
            sums.add_features(frames, features, part, middles - begin)


def _batches(
    scene: Scene, indices: range, needs: Collection[str] | None
) -> Iterator[tuple[int, list[Frame]]]:
    """Yield the place of the first and a few frames, while the next ones are read."""

    def read(begin: int) -> list[Frame]:
        return [scene.frame(index, needs) for index in indices[begin : begin + BATCH]]

    begins = range(0, len(indices), BATCH)
    with ThreadPoolExecutor(1) as reader:
        coming = reader.submit(read, 0)
        for begin in begins:
            frames = coming.result()
            if begin != begins[-1]:
                coming = reader.submit(read, begin + BATCH)
            yield begin, frames


@lru_cache(maxsize=8)
def _fine_table(band: Band) -> NDArray[np.float32]:
    """Return radiance at steps so fine that a straight line between them is exact enough."""
    count = round((HOTTEST - COLDEST) * STEPS_PER_KELVIN) + 1
    values = np.asarray(band.radiance(COLDEST + np.arange(count) / STEPS_PER_KELVIN))
    return np.stack([values, np.diff(values, append=values[-1])], axis=1).astype(np.float32)
