"""The chip's shape, motion and shear band: what describes its segmentation."""

from dataclasses import dataclass, fields
from math import nan
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.chip.segment import contact_length, shear_band
from chipglow.chip.segmentation import (
    ForceMeans,
    Segmentation,
    cut_history,
    mean_and_deviation,
    resolution,
    segmentation,
)
from chipglow.chip.shear_band import MIDDLE_HALF, ShearBand
from chipglow.quantities import ROUNDING, Array, Brief
from chipglow.scene import Frame, Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest

_MOST_FRAMES: Final = 64
"""Most frames of a scene that are read for the metrics."""

_FRAMES_A_BAND: Final = 2
"""Frames from one that is searched for a shear band to the next."""

_CONTACT_DISTANCE: Final = 3e-6
"""Distance in m from the rake face up to which material is in contact."""

_CHIP_OVER_FEED: Final = 1.2
"""Height of a surface in feeds from which it is the chip's."""

_UNDEFORMED: Final = 0.01
"""Plastic strain below which material is undeformed."""

_WHOLE: Final = 0.9
"""Fraction of a period at or above which a period counts as whole."""

_DEVELOPED: Final = 0.5
"""Strain rate of a developed band as a fraction of the largest."""

_CHIP_POINTS: Final = 33
"""Points across the middle half of the chip at which speed and strain are read."""


@dataclass(frozen=True, repr=False)
class ChipScan(Brief):
    """The chip as it passes one rake-normal line."""

    height: float
    """Height of the line in m up the rake face; NaN if no height always shows the free surface."""
    time: Array
    """Times of the frames that were looked at in s, shape (n,)."""
    thickness: Array
    """Thickness of the chip along the line in m, shape (n,); NaN without a height."""


@dataclass(frozen=True, repr=False)
class ChipMetrics(Segmentation, ForceMeans):
    """Segments and more of a chip; lengths in m, times in s, forces in N/m of width.

    A ``…_standard_deviation`` describes the averaged values, NaN for one value.
    """

    frequency: float
    """Segments per second in Hz."""
    speed: float
    """Cutting speed in m/s, by the undeformed workpiece under the cut; NaN if out of view."""
    spacing: float
    spacing_uncertainty: float
    """Length of uncut workpiece in a segment: `period` times `speed`."""
    chip_spacing: float
    """Length of chip in a segment: `period` times `chip_speed`."""
    feed: float
    """Uncut chip thickness, as given or from the scene; NaN if out of view."""
    thickness: float
    """Mean thickness of the chip at right angles to the rake face."""
    ratio: float
    """Chip ratio, `feed` / `thickness`."""
    chip_speed: float
    chip_speed_standard_deviation: float
    """Speed of the chip up the rake face at `scan` in m/s, over the frames."""
    contact: float
    contact_standard_deviation: float
    """Length of contact on the rake face, over the frames; NaN if it leaves the view."""
    shear_angle: float
    shear_angle_standard_deviation: float
    """Angle in rad from the cutting direction to the band's middle half, where it is developed."""
    band_width: float
    band_width_standard_deviation: float
    """Full width at half maximum of the strain rate across the band, over the same frames."""
    band_rate: float
    """Largest median strain rate in 1/s on the band's middle half in a frame."""
    band_strain: float
    """Largest plastic strain in the middle half of `valley` that passes `scan`, per segment."""
    scan: ChipScan
    """Position and times of the thickness."""


def chip_metrics(scene: Scene, feed: float | None = None) -> ChipMetrics:
    """Measure a chip: thickness, segmentation, contact, speed and shear band.

    A camera's view seldom holds two whole segments at once: the chip is measured as it passes one
    line at right angles to the rake face. Means are over the chip's length, in whole periods.
    """
    tool = scene.tool
    if tool is None:
        raise ValueError("scene: it does not state its tool, which the rake face needs")
    if feed is not None and not feed > 0:
        raise ValueError(f"feed is {feed!r}, expected more than 0 m")
    block = scene.longest_block
    even = np.linspace(block[0], block[-1], min(len(block), _MOST_FRAMES))
    frames = even.round().astype(int).tolist()
    heights = _heights(scene.raster, tool)
    seen = [_measured(scene.frame(k), scene.raster, tool, heights) for k in frames]
    profiles, contacts, feeds, speeds = map(np.array, zip(*seen, strict=True))
    feed = _median(feeds) if feed is None else feed
    speed = _median(speeds)
    scan = _scan(scene.times[frames], profiles, heights, tool, feed)
    history = cut_history(scene)
    segments = history.segmentation if history else None
    if segments is None or np.isnan(segments.peak):
        segments = segmentation(scan.time, scan.thickness, resolution(scene))
    period = segments.period
    passing = _passing(scene, tool, frames, scan, period)
    bands = _developed_bands(scene, frames[::_FRAMES_A_BAND])
    contact, contact_deviation = mean_and_deviation(contacts)
    measured: dict[str, Any] = {
        **{one.name: getattr(history, one.name, nan) for one in fields(ForceMeans)},
        **vars(segments),
        **passing,
        **_with_deviation("shear_angle", [_angle(band) for band in bands]),
        **_with_deviation("band_width", [band.width for band in bands]),
    }
    return ChipMetrics(
        **measured,
        frequency=1 / period,
        speed=speed,
        spacing=period * speed,
        spacing_uncertainty=segments.period_uncertainty * speed,
        chip_spacing=period * passing["chip_speed"],
        feed=feed,
        contact=contact,
        contact_standard_deviation=contact_deviation,
        ratio=feed / passing["thickness"],
        band_rate=max((band.middle_rate for band in bands), default=nan),
        scan=scan,
    )


def _measured(
    frame: Frame, raster: Raster, tool: Tool, heights: Array
) -> tuple[Array, float, float, float]:
    """Return the chip's thickness at the heights in m, its contact, feed and cutting speed."""
    solid = frame.material == Material.WORKPIECE
    contact = contact_length(raster, solid, tool, _CONTACT_DISTANCE)
    # Three samples beyond the contact must be in the image, or it may continue outside.
    end = tool.rake_point(contact + 3 * raster.spacing) + _CONTACT_DISTANCE * np.array(
        tool.rake_normal
    )
    return (
        _profile(solid, raster, tool, heights),
        contact if _inside(raster, end) else nan,
        _feed(frame, solid, raster),
        _speed(frame, solid, raster),
    )


def _scan(time: Array, profiles: Array, heights: Array, tool: Tool, feed: float) -> ChipScan:
    """Return the thickness at the lowest height where every frame shows the free surface."""
    surface = tool.rake_point(heights)[:, 1] + profiles * tool.rake_normal[1]
    rows = np.flatnonzero((surface > _CHIP_OVER_FEED * feed).all(axis=0))
    if not rows.size:
        return ChipScan(nan, time, np.full(time.size, nan))
    return ChipScan(float(heights[rows[0]]), time, profiles[:, rows[0]])


def _passing(
    scene: Scene, tool: Tool, frames: list[int], scan: ChipScan, period: float
) -> dict[str, float]:
    """Return the metrics of the chip that passes the line in whole periods."""
    windows = [] if np.isnan(scan.height) else _windows(scan.time, period)
    if not windows:
        return {"thickness": nan, "band_strain": nan, **_with_deviation("chip_speed", [])}
    valleys = [scan.thickness[window].min() for window in windows]
    depth = np.linspace(*MIDDLE_HALF, _CHIP_POINTS) * float(np.mean(valleys))
    points = tool.rake_point(scan.height) + depth[:, None] * np.array(tool.rake_normal)
    right, up, strain = (
        np.stack([sample(scene.field(name, k), scene.raster, points) for k in frames])
        for name in ("velocity_x", "velocity_y", "plastic_strain")
    )
    speed = (right * tool.rake_direction[0] + up * tool.rake_direction[1]).mean(axis=1)
    whole = np.logical_or.reduce(windows)
    moved = speed[whole].sum()
    largest = [np.median(strain[window].max(axis=0)) for window in windows]
    return {
        **_with_deviation("chip_speed", speed[whole]),
        "thickness": float((scan.thickness * speed)[whole].sum() / moved) if moved > 0 else nan,
        "band_strain": float(np.mean(largest)),
    }


def _heights(raster: Raster, tool: Tool) -> Array:
    """Return heights on the rake face in the view, at steps of two samples."""
    # A rake face that is tilted by up to 48° (cos = 1/1.5) crosses the whole image.
    heights = np.arange(0.0, raster.rows * raster.spacing * 1.5, 2 * raster.spacing)
    return heights[: max(1, int(_inside(raster, tool.rake_point(heights)).sum()))]


def _inside(raster: Raster, points: Array) -> NDArray[np.bool_]:
    """Return which points are in the view, a sample or more from its border."""
    left, right, bottom, top = raster.extent
    low, high = (np.array([left, bottom]), np.array([right, top]))
    inside = (points > low + raster.spacing) & (points < high - raster.spacing)
    return np.asarray(inside.all(axis=-1))


def _profile(solid: NDArray[np.bool_], raster: Raster, tool: Tool, heights: Array) -> Array:
    """Return the distance to the end of the longest stretch of material; NaN outside the view."""
    step = raster.spacing / 2
    distance = step * (np.arange(2 * (raster.rows + raster.columns)) + 0.5)
    places = tool.rake_point(heights)[:, None] + distance[:, None] * np.array(tool.rake_normal)
    read = nearest(solid, raster, places)
    index = np.arange(distance.size)
    void = np.maximum.accumulate(np.where(read == 1, -1, index), axis=1)
    last = (index - void).argmax(axis=1)
    rows = np.arange(heights.size)
    after = np.minimum(last + 1, index[-1])
    known = (read[rows, last] == 1) & (read[rows, after] == 0)
    return np.where(known, distance[last] + step / 2, nan)


def _feed(frame: Frame, solid: NDArray[np.bool_], raster: Raster) -> float:
    """Return the height of the uncut surface at the left border, before the cut if known."""
    void = np.flatnonzero(~solid[:, 0])
    top = int(void[-1]) + 1 if void.size else 0  # of the workpiece: a curled chip may be over it
    if not 0 < top < raster.rows:
        return nan
    middle = raster.y[top] if frame.material_y is None else frame.material_y[top, 0]
    return float(middle) + raster.spacing / 2


def _speed(frame: Frame, solid: NDArray[np.bool_], raster: Raster) -> float:
    """Return the speed of the undeformed workpiece under the cut, before the edge."""
    before = (raster.y[:, None] < 0) & (raster.x < 0)
    still = before & solid & (frame.needed("plastic_strain") < _UNDEFORMED)
    return float(np.median(frame.needed("velocity_x")[still])) if still.any() else nan


def _windows(time: Array, period: float) -> list[NDArray[np.bool_]]:
    """Return whole periods, the last at the end of the scene; without a period the scene."""
    if np.isnan(period):
        return [np.ones(time.size, dtype=np.bool_)]
    end = time[-1] + (time[-1] - time[0]) / max(time.size - 1, 1)
    count = int((end - time[0]) / period + 1 - _WHOLE)
    before_end = (end - time) / period
    return [(before_end > k + ROUNDING) & (before_end <= k + 1 + ROUNDING) for k in range(count)]


def _developed_bands(scene: Scene, frames: list[int]) -> list[ShearBand]:
    """Find the bands that reach the free surface with half the largest rate or more."""
    fields = ("plastic_strain_rate", "material")
    bands = [shear_band(scene, *(scene.field(name, k) for name in fields)) for k in frames]
    free = [band for band in bands if band and band.reaches_surface]
    largest = max((band.middle_rate for band in free), default=0.0)
    return [band for band in free if band.middle_rate >= _DEVELOPED * largest]


def _angle(band: ShearBand) -> float:
    """Return the angle of the line through the middle half, over the horizontal to the left."""
    points = band.ridge.points[band.middle_half]
    direction = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
    return float(np.arctan2(-direction[1] * np.sign(direction[0]), abs(direction[0])))


def _median(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan


def _with_deviation(name: str, values: ArrayLike) -> dict[str, float]:
    """Return the mean of the known values and the standard deviation, by their names."""
    every = np.asarray(values, np.float64)
    mean, _ = mean_and_deviation(every[np.isfinite(every)])
    return {name: mean, f"{name}_standard_deviation": mean_and_deviation(every)[1]}
