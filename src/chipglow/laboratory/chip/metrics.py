"""The chip's shape, motion and shear band: what describes its segmentation."""

from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.laboratory.chip.ridge import NoShearBandError
from chipglow.laboratory.chip.segment import contact_length
from chipglow.laboratory.chip.segmentation import Segmentation, segmentation
from chipglow.laboratory.chip.shear_band import ShearBand, find_shear_band
from chipglow.quantities import Array
from chipglow.scene import Frame, Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest

_MOST_FRAMES: Final = 64
_FRAMES_A_BAND: Final = 2
_TOUCHING: Final = 3e-6
_CHIP_OVER_FEED: Final = 1.2
_UNDEFORMED: Final = 0.01
_WHOLE: Final = 0.9
"""Fraction of a period at or above which a period counts as whole."""

_DEVELOPED: Final = 0.5


@dataclass(frozen=True)
class ChipScan:
    """The chip as it passes one rake-normal line."""

    height: float
    """Where the line stands on the rake face, in m up from the end of the edge; NaN if at
    no height the chip's free surface is in the view all the time.
    """
    time: Array
    """Times of the frames that were looked at in s, shape (n,)."""
    thickness: Array
    """Distance from the rake face to the free surface along the line in m, shape (n,); NaN
    without a height.
    """


@dataclass(frozen=True)
class ChipMetrics:
    """What describes a segmented chip; lengths in m, times in s, forces in N/m of width.

    A ``…_standard_deviation`` is that of what the mean was taken over, NaN for one value.
    """

    period: float
    period_uncertainty: float
    """Time from segment to segment and its standard uncertainty, from the force history; NaN
    without one or without two force peaks (the uncertainty: three).
    """
    frequency: float
    """Segments a second in Hz: 1 over `period`."""
    speed: float
    """Cutting speed in m/s: the undeformed workpiece's under the cut; NaN if none is in the view.
    """
    spacing: float
    spacing_uncertainty: float
    """Length of uncut workpiece in a segment: `period` times `speed`."""
    chip_spacing: float
    """Length of chip in a segment, from band to band along it: `period` times `chip_speed`."""
    feed: float
    """Uncut chip thickness, as given or from the scene; NaN if the workpiece's free surface is
    not in the view at the left.
    """
    thickness: float
    """Mean thickness of the chip, at right angles to the rake face; see `scan` for when it and
    what follows from it are NaN.
    """
    peak: float
    peak_standard_deviation: float
    valley: float
    valley_standard_deviation: float
    """Mean of the largest and the least thickness of each segment, and their standard
    deviation over the segments.
    """
    degree: float
    """Degree of segmentation, (`peak` - `valley`) / `peak`."""
    ratio: float
    """Chip ratio, `feed` / `thickness`."""
    chip_speed: float
    chip_speed_standard_deviation: float
    """Mean speed of the chip up the rake face in m/s where `scan` stands, and its standard
    deviation over the frames: a segmented chip moves by fits and starts.
    """
    contact: float
    contact_standard_deviation: float
    """Length of contact on the rake face, mean and standard deviation over the frames; NaN if
    it reaches the border of the view in one of them.
    """
    shear_angle: float
    shear_angle_standard_deviation: float
    """Angle in rad from the direction of cutting to the straight line through the middle half of
    the shear band, over the frames in which the band is developed: where it reaches the free
    surface and its rate is at least half the largest. NaN without such a frame, as the next.
    """
    band_width: float
    band_width_standard_deviation: float
    """Full width at half maximum of the strain rate across the band, over the same frames."""
    band_rate: float
    """Greatest plastic strain rate of the band in 1/s: median over its middle half, in the frame
    where that is largest.
    """
    band_strain: float
    """Greatest plastic strain that passes `scan`, as the median over the middle half of `valley`
    and the mean over the segments: that of the bands once they are formed.
    """
    cutting_mean: float
    cutting_swing: float
    thrust_mean: float
    thrust_swing: float
    """Forces as in `Segmentation`; NaN without a force history."""
    segments: int
    """Whole segments that pass `scan`; without a period the scene counts as one."""
    scan: ChipScan
    """Where and when the thickness was read. The thickness is NaN if the chip is cut by the
    border of the view at every height at some time, or the scene is shorter than a period.
    """


def chip_metrics(scene: Scene, feed: float | None = None) -> ChipMetrics:
    """Measure a chip: thickness, segmentation, contact, speed and shear band.

    A camera's view seldom holds two whole segments at once. So the chip is measured as it passes
    one line at right angles to the rake face, the lowest on which its free surface is in the view
    and over 1.2 times the feed all the time. There it is formed and still lies on the face: on a
    higher line, which a taller view would have, it has lifted off and curls, so that the line
    crosses the gap and the chip oblique. The means are over whole periods, each moment
    weighted by the chip's speed, which makes them means over the chip's length; nine tenths of a
    period count as a whole one. At most 64 frames, evenly spread, are looked at; of a scene with
    gaps those of its longest part without.
    """
    tool = scene.tool
    if tool is None:
        raise ValueError("scene: it does not state its tool, which the rake face needs")
    if feed is not None and not feed > 0:
        raise ValueError(f"feed is {feed!r}, expected over 0 m")
    frames = _frame_numbers(scene)
    looks = [_Look.at(scene.frame(i), scene.raster, tool) for i in frames]
    if feed is None:
        feed = _median([look.feed for look in looks])
    forces = _segmentation(scene)
    period = forces.period if forces else nan
    time = np.array([look.time for look in looks])
    row = _scan_row(looks, feed)
    heights = _heights(scene.raster, tool)
    thickness = np.array([look.profile[row] if row is not None else nan for look in looks])
    scan = ChipScan(nan if row is None else float(heights[row]), time, thickness)
    passing = _Passing.of(scene, frames, scan, period)
    bands = _developed_bands(scene, frames[::_FRAMES_A_BAND])
    angles = np.array([_angle(band) for band in bands])
    widths = np.array([band.width for band in bands])
    speed = _median([look.speed for look in looks])
    contacts = np.array([look.contact for look in looks])
    uncertainty = forces.period_uncertainty if forces else nan
    return ChipMetrics(
        period=period,
        period_uncertainty=uncertainty,
        frequency=1 / period,
        speed=speed,
        spacing=period * speed,
        spacing_uncertainty=uncertainty * speed,
        chip_spacing=period * passing.speed,
        feed=feed,
        thickness=passing.thickness,
        peak=_mean(passing.peaks),
        peak_standard_deviation=_deviation(passing.peaks),
        valley=_mean(passing.valleys),
        valley_standard_deviation=_deviation(passing.valleys),
        degree=1 - _mean(passing.valleys) / _mean(passing.peaks),
        ratio=feed / passing.thickness,
        chip_speed=passing.speed,
        chip_speed_standard_deviation=passing.speed_standard_deviation,
        contact=float(contacts.mean()),
        contact_standard_deviation=_deviation(contacts),
        shear_angle=_mean(angles),
        shear_angle_standard_deviation=_deviation(angles),
        band_width=_mean(widths),
        band_width_standard_deviation=_deviation(widths),
        band_rate=max((band.middle_rate for band in bands), default=nan),
        band_strain=passing.strain,
        cutting_mean=forces.cutting_mean if forces else nan,
        cutting_swing=forces.cutting_swing if forces else nan,
        thrust_mean=forces.thrust_mean if forces else nan,
        thrust_swing=forces.thrust_swing if forces else nan,
        segments=passing.peaks.size,
        scan=scan,
    )


@dataclass(frozen=True)
class _Look:
    """What one frame shows: profile of the chip over the heights on the rake face, in m."""

    time: float
    profile: Array
    exit_height: Array
    contact: float
    feed: float
    speed: float

    @classmethod
    def at(cls, frame: Frame, raster: Raster, tool: Tool) -> "_Look":
        solid = frame.material == Material.WORKPIECE
        heights = _heights(raster, tool)
        profile = _profile(frame, raster, tool, heights)
        contact = contact_length(raster, solid, tool, _TOUCHING)
        end = tool.rake_point(contact + 3 * raster.spacing) + _TOUCHING * np.array(tool.rake_normal)
        return cls(
            time=frame.time,
            profile=profile,
            exit_height=tool.rake_point(heights)[:, 1] + profile * tool.rake_normal[1],
            contact=contact if _inside(raster, end) else nan,
            feed=_feed(frame, solid, raster),
            speed=_speed(frame, solid, raster),
        )


@dataclass(frozen=True)
class _Passing:
    """The chip over whole segments as they pass the scanned line."""

    thickness: float
    peaks: Array
    valleys: Array
    speed: float
    speed_standard_deviation: float
    strain: float

    @classmethod
    def of(cls, scene: Scene, frames: list[int], scan: ChipScan, period: float) -> "_Passing":
        windows = _windows(scan.time, period)
        if not windows or np.isnan(scan.height):
            nothing = np.zeros(0)
            return cls(nan, nothing, nothing, nan, nan, nan)
        valleys = np.array([scan.thickness[window].min() for window in windows])
        assert scene.tool is not None
        speed, strain = np.zeros(len(frames)), []
        reach = float(valleys.mean())
        depth = np.linspace(0.25, 0.75, 33) * reach
        foot, normal = scene.tool.rake_point(scan.height), np.array(scene.tool.rake_normal)
        points = foot + depth[:, None] * normal
        up = scene.tool.rake_direction
        for k, number in enumerate(frames):
            along_x, along_y = (
                sample(scene.field(name, number), scene.raster, points)
                for name in ("velocity_x", "velocity_y")
            )
            speed[k] = (along_x * up[0] + along_y * up[1]).mean()
            strain.append(sample(scene.field("plastic_strain", number), scene.raster, points))
        whole = np.logical_or.reduce(windows)
        moved = speed[whole].sum()
        greatest = [np.median(np.array(strain)[window].max(axis=0)) for window in windows]
        return cls(
            thickness=(float((scan.thickness * speed)[whole].sum() / moved) if moved > 0 else nan),
            peaks=np.array([scan.thickness[window].max() for window in windows]),
            valleys=valleys,
            speed=float(speed[whole].mean()),
            speed_standard_deviation=_deviation(speed[whole]),
            strain=float(np.mean(greatest)),
        )


def _frame_numbers(scene: Scene) -> list[int]:
    frames = scene.longest_block
    even = np.linspace(frames[0], frames[-1], min(len(frames), _MOST_FRAMES))
    return [int(number) for number in even.round()]


def _heights(raster: Raster, tool: Tool) -> Array:
    """Heights on the rake face in the view, each two samples."""
    heights = np.arange(0.0, raster.rows * raster.spacing * 1.5, 2 * raster.spacing)
    points = tool.rake_point(heights)
    return heights[: max(1, int(_inside(raster, points).sum()))]


def _inside(raster: Raster, points: Array) -> NDArray[np.bool_]:
    """Which points are in the view, a sample or more from its border."""
    left, right, bottom, top = raster.extent
    x, y, rim = points[..., 0], points[..., 1], raster.spacing
    across = (x > left + rim) & (x < right - rim)
    return across & (y > bottom + rim) & (y < top - rim)


def _profile(frame: Frame, raster: Raster, tool: Tool, heights: Array) -> Array:
    """Distance from the rake face to the chip's free surface; NaN where the view ends before.

    The chip is the longest stretch of material on the line: it may have lifted off the face.
    """
    step = raster.spacing / 2
    distance = step * (np.arange(2 * (raster.rows + raster.columns)) + 0.5)
    places = tool.rake_point(heights)[:, None] + distance[:, None] * np.array(tool.rake_normal)
    read = nearest(frame.material == Material.WORKPIECE, raster, places)
    index = np.arange(distance.size)
    void = np.maximum.accumulate(np.where(read == 1, -1, index), axis=1)
    last = (index - void).argmax(axis=1)
    rows = np.arange(heights.size)
    after = np.minimum(last + 1, index[-1])
    known = (read[rows, last] == 1) & (read[rows, after] == 0)
    return np.where(known, distance[last] + step / 2, nan)


def _feed(frame: Frame, solid: NDArray[np.bool_], raster: Raster) -> float:
    """Height of the uncut surface at the left border, before the cut where that is known."""
    void = np.flatnonzero(~solid[:, 0])
    top = int(void[-1]) + 1 if void.size else 0  # of the workpiece: a curled chip may be over it
    if not 0 < top < raster.rows:
        return nan
    if frame.material_y is not None:
        return float(frame.material_y[top, 0]) + raster.spacing / 2
    return float(raster.y[top]) + raster.spacing / 2


def _speed(frame: Frame, solid: NDArray[np.bool_], raster: Raster) -> float:
    """Speed of what is not deformed, under the cut and before the edge."""
    before = (raster.y[:, None] < 0) & (raster.x < 0)
    still = before & solid & (frame.needed("plastic_strain") < _UNDEFORMED)
    return float(np.median(frame.needed("velocity_x")[still])) if still.any() else nan


def _scan_row(looks: list[_Look], feed: float) -> int | None:
    """The lowest height at which every frame shows the chip's free surface, over the uncut one."""
    chip = [look.exit_height > _CHIP_OVER_FEED * feed for look in looks]
    seen = np.flatnonzero(np.all(chip, axis=0))
    return int(seen[0]) if seen.size else None


def _windows(time: Array, period: float) -> list[NDArray[np.bool_]]:
    """Whole periods, the last at the end of the scene; without a period the whole scene."""
    if np.isnan(period):
        return [np.ones(time.size, dtype=np.bool_)]
    step = (time[-1] - time[0]) / max(time.size - 1, 1)
    end = time[-1] + step
    count = int((end - time[0]) / period + 1 - _WHOLE)
    before_end = (end - time) / period
    return [(before_end > k + 1e-9) & (before_end <= k + 1 + 1e-9) for k in range(count)]


def _segmentation(scene: Scene) -> Segmentation | None:
    if "cutting_force" not in scene.data:
        return None
    names = ("force_time", "cutting_force", "thrust_force")
    return segmentation(*(scene.data[name].values for name in names))


def _developed_bands(scene: Scene, frames: list[int]) -> list[ShearBand]:
    """Bands that reach the free surface with half the largest rate or more."""
    found = [band for number in frames if (band := _band(scene, number)) is not None]
    greatest = max((band.middle_rate for band in found), default=0.0)
    return [band for band in found if band.middle_rate >= _DEVELOPED * greatest]


def _band(scene: Scene, number: int) -> ShearBand | None:
    assert scene.tool is not None
    rate, material = (scene.field(name, number) for name in ("plastic_strain_rate", "material"))
    try:
        band = find_shear_band(scene.raster, rate, material == Material.WORKPIECE, scene.tool)
    except NoShearBandError:
        return None
    return band if band.reaches_surface else None


def _angle(band: ShearBand) -> float:
    """Angle of the straight line through the middle half, over the horizontal to the left."""
    points = band.ridge.points[band.middle_half]
    offset = points - points.mean(axis=0)
    direction = np.linalg.svd(offset, full_matrices=False)[2][0]
    return float(np.arctan2(-direction[1] * np.sign(direction[0]), abs(direction[0])))


def _median(values: list[float]) -> float:
    known = np.array(values)[np.isfinite(values)]
    return float(np.median(known)) if known.size else nan


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else nan


def _deviation(values: Array) -> float:
    return float(np.std(values, ddof=1)) if values.size > 1 else nan
