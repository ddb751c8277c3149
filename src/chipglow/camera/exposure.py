"""The exposure: a scene's radiance, summed over the integration time in one pass."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.sweep import BATCH, STEPS_PER_KELVIN, Check, Sums
from chipglow.radiometry import Band
from chipglow.radiometry.band import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.scene import Frame, Raster, Scene, is_gap
from chipglow.scene.splines import SplineFrame
from chipglow.surface import EmissivityField, EmissivityStack

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
        sub-frame had material.
    centre_radiance : ndarray
        Apparent radiance at the middle of the integration in W/(m² sr), float64, shape (y, x).
    effects : mapping
        What a measurement of it states of the surface: `Surface.effects`. Nothing by default.

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
    effects: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("mean_radiance", "peak_radiance", "peak_temperature", "centre_radiance"):
            shape = getattr(self, name).shape
            if shape != self.raster.shape:
                raise ValueError(
                    f"exposure: {name} has shape {shape}, expected {self.raster.shape}"
                )


@dataclass(frozen=True, eq=False)
class View:
    """A surface as a camera of one band looks at it.

    Parameters
    ----------
    emissivity : EmissivityField
        The surface, laid on the scene: what it is in this band.
    band : Band
        The band.
    reflected : float, optional
        Temperature in K of surroundings that the surface reflects; none by default.
    """

    emissivity: EmissivityField
    band: Band
    reflected: float | None = None

    @property
    def environment(self) -> float:
        """Radiance of the surroundings in W/(m² sr)."""
        return 0.0 if self.reflected is None else float(self.band.radiance(self.reflected))


def expose(
    scene: Scene,
    emissivity: EmissivityField,
    band: Band,
    start: float,
    duration: float,
    reflected: float | None = None,
    delays: NDArray[np.float64] | None = None,
) -> Exposure:
    """Sum a scene's apparent radiance over an integration time.

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
    delays : ndarray, optional
        How much later than `start` the integration of each row of samples begins in s, 0 or more,
        shape (y,): a rolling shutter's (`Camera.row_delays`). All at once by default.

    Returns
    -------
    Exposure

    Raises
    ------
    ValueError
        If the integration reaches beyond the scene or into a gap between its frames, or a
        temperature is outside the range of the camera's tables or an emissivity outside 0 to 1.

    Notes
    -----
    Apparent radiance is ε L(T) (Equation 3 of the paper), or ε L(T) + (1 − ε) L(T_reflected)
    (Equation 2). The void, "undefined" in the paper, has no radiance at all. L is looked up
    between values 1/32 K apart, within 6e-7 of it from 250 K on.
    """
    return expose_all(scene, (emissivity,), band, start, duration, reflected, delays)[0]


def expose_all(
    scene: Scene,
    emissivities: Sequence[EmissivityField],
    band: Band,
    start: float,
    duration: float,
    reflected: float | None = None,
    delays: NDArray[np.float64] | None = None,
    check: Check | None = None,
) -> tuple[Exposure, ...]:
    """Exposures of a scene with several surfaces: each of its frames is read once.

    Parameters
    ----------
    scene, band, start, duration, reflected, delays
        As for `expose`.
    emissivities : sequence of EmissivityField
        The surfaces, laid on the scene; one or more.
    check : callable, optional
        Called now and then meanwhile; what it raises ends the pass.

    Returns
    -------
    tuple of Exposure
        One for each surface, the same as `expose` makes.

    Raises
    ------
    ValueError
        As for `expose`.
    """
    views = [View(emissivity, band, reflected) for emissivity in emissivities]
    return expose_views(scene, views, start, duration, delays, check)


def expose_views(
    scene: Scene,
    views: Sequence[View],
    start: float,
    duration: float,
    delays: NDArray[np.float64] | None = None,
    check: Check | None = None,
) -> tuple[Exposure, ...]:
    """Exposures of a scene with several surfaces in several bands: each frame is read once.

    A surface that is seen in several bands, and a band in which several surfaces are seen, are
    computed once for each frame.

    Parameters
    ----------
    scene, start, duration, delays, check
        As for `expose_all`.
    views : sequence of View
        What is looked at, and in which band; one or more.

    Returns
    -------
    tuple of Exposure
        One for each view, the same as `expose` makes.

    Raises
    ------
    ValueError
        As for `expose`.
    """
    if delays is None:
        delays = np.zeros(scene.raster.rows)
    indices, weights, middles = _row_weights(scene, start, duration, delays)
    fields = list({id(view.emissivity): view.emissivity for view in views}.values())
    bands = list(dict.fromkeys(view.band for view in views))
    places = {id(one): number for number, one in enumerate(fields)}
    stack = EmissivityStack(fields)
    sums = Sums.zero(
        np.array([[places[id(view.emissivity)], bands.index(view.band)] for view in views]),
        np.stack([_fine_table(band) for band in bands]),
        np.array([view.environment for view in views], np.float32),
        stack.max_emissivity,
        scene.raster.shape,
        check or _nothing,
    )
    _sweep(scene, stack, indices, weights, middles, sums)
    mean, centre, peak, hottest = sums.mean, sums.centre, sums.peak, sums.hottest
    if not np.isfinite(mean).all():
        raise ValueError(
            f"exposure: from {start:g} s, temperature must be {TABLE_COLDEST:g} to "
            f"{TABLE_HOTTEST:g} K and emissivity 0 to 1, but they are not at "
            f"{np.count_nonzero(~np.isfinite(mean).all(axis=0))} samples"
        )
    hottest[hottest == 0.0] = np.nan
    return tuple(
        Exposure(
            start=start,
            duration=duration,
            raster=scene.raster,
            mean_radiance=mean[n],
            peak_radiance=peak[n],
            peak_temperature=hottest,
            centre_radiance=centre[n],
        )
        for n in range(len(views))
    )


def _nothing() -> None:
    pass


def frame_weights(
    times: NDArray[np.float64], frame_spacing: float, start: float, duration: float
) -> tuple[range, NDArray[np.float64]]:
    """Fraction of an integration time that each sub-frame stands for.

    A sub-frame stands for the time from its own to the next one's, the last one and those before
    a gap for `frame_spacing`: 10 µs that begin with a sub-frame hold fifty of 0.2 µs, all of one
    weight. A scene of one frame does not change, and stands for all times.

    Parameters
    ----------
    times : ndarray
        Times of the scene's frames in s, ascending, shape (n,).
    frame_spacing : float
        Usual time between frames in s.
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
        If the integration reaches beyond the scene, or into a gap between its frames.
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
            f"exposure: {start:.9g} s to {end:.9g} s is not within the scene, which lasts from "
            f"{times[0]:.9g} s to {ends[-1]:.9g} s"
        )
    for gap in np.flatnonzero(before_gap):
        if start < times[gap + 1] - rounding and end > ends[gap] + rounding:
            raise ValueError(
                f"exposure: {start:.9g} s to {end:.9g} s reaches into a gap of the scene, which "
                f"has no frame from {ends[gap]:.9g} s to {times[gap + 1]:.9g} s"
            )
    shared = np.minimum(ends, end) - np.maximum(times, start)
    covered = np.flatnonzero(shared > rounding)
    weights = shared[covered]
    return range(int(covered[0]), int(covered[-1]) + 1), weights / weights.sum()


def _row_weights(
    scene: Scene, start: float, duration: float, delays: NDArray[np.float64]
) -> tuple[range, NDArray[np.float64], NDArray[np.intp]]:
    """Sub-frames of an exposure, their weights in each row, and which is in a row's middle."""
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
    weights: NDArray[np.float64],
    middles: NDArray[np.intp],
    sums: Sums,
) -> None:
    """Add sub-frames to sums, in the quickest way that scene and surfaces allow."""
    features = stack.features if stack.is_bare else None
    if features is not None and (splines := _splines(scene, indices)):
        shifts = np.stack([features.shift(frame.time) for frame in splines])
        textures, fixed = features.textures, features.fixed_positions
        sums.add_splines(splines, fixed, shifts, textures, weights, middles)
        return
    for begin, frames in _batches(scene, indices, stack.needed):
        part = np.ascontiguousarray(weights[:, begin : begin + len(frames)])
        inside = middles - begin
        if features is None:
            sums.add_given(frames, [stack.emissivities(one) for one in frames], part, inside)
        else:
            positions = [features.positions(frame) for frame in frames]
            shifts = np.stack([features.shift(frame.time) for frame in frames])
            sums.add_features(frames, positions, shifts, features.textures, part, inside)


def _splines(scene: Scene, indices: range) -> list[SplineFrame]:
    """The splines of these frames; none for a scene of samples."""
    found = (scene.splines(index) for index in indices)
    return [splines for splines in found if splines is not None]


def _batches(
    scene: Scene, indices: range, needs: Collection[str] | None
) -> Iterator[tuple[int, list[Frame]]]:
    """Frames, a few at a time, with the place of the first; the next are read meanwhile."""

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
    """Radiance at steps so fine that a straight line between them is exact enough, and fast."""
    count = round((TABLE_HOTTEST - TABLE_COLDEST) * STEPS_PER_KELVIN) + 1
    values = np.asarray(band.radiance(TABLE_COLDEST + np.arange(count) / STEPS_PER_KELVIN))
    return np.stack([values, np.diff(values, append=values[-1])], axis=1).astype(np.float32)
