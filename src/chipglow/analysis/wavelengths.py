"""Which bands to measure with: the error of one band, and of the ratio of two, side by side."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import hypot, isfinite, log
from typing import Final, TypeAlias

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis.cut import Progress, find_segments, spread_starts
from chipglow.analysis.images import pixel_phases
from chipglow.analysis.places import PointPlace
from chipglow.analysis.plan import Plan
from chipglow.analysis.ratio_error import ideal_image, true_temperature
from chipglow.camera import Camera, Exposure, expose_views, frame_weights
from chipglow.camera.ratio_camera import views_of
from chipglow.radiometry import Band, RatioThermometer
from chipglow.scene import Raster, Scene
from chipglow.scene.lines import nearest
from chipglow.surface import Surface

Array: TypeAlias = NDArray[np.float64]

STEPS: Final = ("emissivity", "motion", "footprint", "optics", "delay")
"""Causes of the mean error; each is the difference to the cause before it."""

_FOOTPRINT, _FORMED, _DELAYED, _SHIFTED = range(4)
"""Pixels read in every band; from the last on there is one for each of the directions."""

_DIRECTIONS: Final = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
_NOISE_SHAPE: Final = (64, 64)
"""Elements over which the noise is determined."""


@dataclass(frozen=True)
class WavelengthPlan:
    """Which bands are compared, and what is not known of them.

    The pixels of the second channel of a ratio are off by `misregistration` (m on the scene, in an
    unknown direction) and exposed later by `delay` (s). `emissivity_uncertainty` is the relative
    standard uncertainty of the emissivity that one band needs, `exponent_uncertainty` that of the
    exponent by which the emissivity depends on the wavelength: 0 for a grey surface, −0.5 for a
    bare metal (Hagen and Rubens). It makes the ratio of two emissivities the more uncertain the
    farther apart their bands are.
    """

    bands: tuple[Band, ...]
    misregistration: float = 0.0
    delay: float = 0.0
    emissivity_uncertainty: float = 0.1
    exponent_uncertainty: float = 0.15

    def __post_init__(self) -> None:
        if len(self.bands) < 2 or len(set(self.bands)) < len(self.bands):
            raise ValueError(f"bands: {len(self.bands)}, expected two or more that differ")
        for name in ("misregistration", "delay", "emissivity_uncertainty", "exponent_uncertainty"):
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0):
                raise ValueError(f"{name}: {value!r}, expected 0 or more")

    @property
    def pairs(self) -> Iterator[tuple[int, int]]:
        """Numbers of the bands of every ratio, that of the shorter waves first."""
        middles = [one.lower + one.upper for one in self.bands]
        order = sorted(range(len(self.bands)), key=middles.__getitem__)
        return combinations(order, 2)


@dataclass(frozen=True, eq=False)
class Spot:
    """A point, x and y in m, that is read on a surface in the exposure that begins at `start`."""

    place: str
    surface: str
    start: float
    point: Array


def wavelength_errors(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: WavelengthPlan,
    spots: Sequence[Spot],
    phases: int,
    textures: int,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors of one band and of ratios of two at some spots.

    The camera is given every band of the plan in turn, its diffraction with it. Spots of one place
    are draws of it; each is drawn for `phases` positions of the pixels along each axis and
    `textures` of the emissivity.

    Returns
    -------
    xarray.Dataset
        In K over ``place``, ``ratio`` (the bands alone, then their pairs) and ``draw``: ``step``,
        what each ``cause`` of `STEPS` adds to the error; ``misregistration``, what a shift of the
        second channel adds by ``direction``; without draws the standard uncertainties ``noise``
        and ``emissivity_uncertainty``. ``truth`` is the true temperature. `wavelengths_frame`
        makes a table of it.

    Raises
    ------
    ValueError
        If no exposure is left that has room for the delay, or a spot is outside the pixels.

    Notes
    -----
    The pixel that holds the spot is read. Its true temperature is that at its centre in the middle
    of the exposure, interpolated linearly between the four samples around it. For one band the
    emissivity at the pixel's centre is taken as known; for a ratio the two emissivities are taken
    as equal. Steps are differences like those of `ratio_errors`.
    """
    tell = progress or (lambda label, part: None)
    cameras = [replace(camera.in_band(band), detector=None) for band in plan.bands]
    kept = [spot for spot in spots if _has_room(scene, camera, spot.start, plan.delay)]
    if not kept:
        raise ValueError(
            f"delay: {1e6 * plan.delay:g} us, expected so little that the scene lasts until the "
            "second channel's exposure ends"
        )
    gathered: dict[str, list[_Readings]] = {}
    for i, spot in enumerate(kept):
        tell("bands", i / len(kept))
        surface = surfaces[spot.surface]
        for number in range(textures if surface.redrawn(1) is not surface else 1):
            readings = _read(scene, surface.redrawn(number), cameras, plan, spot, phases)
            gathered.setdefault(spot.place, []).append(readings)
    tell("bands", 1.0)
    places = {name: _Readings.joined(name, parts) for name, parts in gathered.items()}
    return _dataset(plan, camera, places)


def wavelengths_frame(data: xr.Dataset) -> pd.DataFrame:
    """A row for each band and pair at each place.

    Columns ``place``, ``first_um`` and ``second_um`` (the bands; the second is empty for one
    alone), ``draws``, ``truth_degC``; the mean ``error_K`` and what its causes add,
    ``emissivity_K`` to ``delay_K``; the ``standard_deviation_K`` of the error over the draws;
    ``misregistration_K``, ``noise_K`` and ``emissivity_uncertainty_K``; and ``total_K``, the root
    of the sum of their squares and that of the mean.
    """
    error = data.step.sum("cause", skipna=False)
    table = xr.Dataset(
        {
            "draws": data.truth.count("draw"),
            "truth_degC": data.truth.mean("draw") - 273.15,
            "error_K": error.mean("draw"),
            **{f"{name}_K": data.step.sel(cause=name, drop=True).mean("draw") for name in STEPS},
            "standard_deviation_K": error.std("draw", ddof=1),
            "misregistration_K": np.sqrt((data.misregistration**2).mean(("direction", "draw"))),
            "noise_K": data.noise,
            "emissivity_uncertainty_K": data.emissivity_uncertainty,
        }
    )
    parts = "misregistration_K", "noise_K", "emissivity_uncertainty_K"
    squares = (error**2).mean("draw") + sum(table[name] ** 2 for name in parts)
    frame = table.assign(total_K=np.sqrt(squares)).to_dataframe().reset_index()
    columns = ["place", "first_um", "second_um", *map(str, table.data_vars), "total_K"]
    return frame[columns]


def cut_spots(
    scene: Scene, camera: Camera, plan: Plan, progress: Progress | None = None
) -> list[Spot]:
    """The chip at the rake face and the middle of the shear band, in every segment of a cut.

    The first is half a pixel from the face, at mid-contact; on the face chip and tool differ.
    Raises a ValueError if there is no band or no contact.
    """
    tell = progress or (lambda label, part: None)
    found = find_segments(scene, camera.integration_time, plan.exposures, plan.touching, tell)
    spots = []
    for segment in found.segments:
        tool = segment.tool
        inside = camera.pitch / 2 * np.array(tool.rake_normal)
        face = tool.rake_point(segment.contact_length / 2) + inside
        middle = segment.band.ridge.points[segment.band.middle]
        spots += [
            Spot("rake face", plan.rake_surface, segment.start, face),
            Spot("shear band", plan.band_surface, segment.start, middle),
        ]
    return spots


def point_spots(scene: Scene, camera: Camera, plan: Plan, surfaces: Sequence[str]) -> list[Spot]:
    """The points of a plan in every exposure, with every surface."""
    starts = spread_starts(scene, camera.integration_time, plan.exposures)
    several = len(surfaces) > 1
    return [
        Spot(
            f"{place.name}, {name}" if several else place.name,
            name,
            float(start),
            np.array(place.point),
        )
        for place in plan.places
        if isinstance(place, PointPlace)
        for name in surfaces
        for start in starts
    ]


def _has_room(scene: Scene, camera: Camera, start: float, delay: float) -> bool:
    """Whether the scene lasts until a delayed exposure ends."""
    try:
        frame_weights(scene.times, scene.frame_spacing, start + delay, camera.integration_time)
    except ValueError:
        return False
    return True


@dataclass(frozen=True, eq=False)
class _Readings:
    """What is read at one place, in K and W/(m² sr).

    `weights` and `truth` are those of the four samples around the pixel's centre, shape (sample,
    draw), and `local` their radiance in the middle of the exposure and on average, shape (band, 2,
    sample, draw). `pixel` is the pixel's radiance, shape (band, step, draw).
    """

    weights: Array
    truth: Array
    local: Array
    pixel: Array

    @classmethod
    def joined(cls, place: str, parts: Sequence["_Readings"]) -> "_Readings":
        """All draws of a place but those with a pixel at whose centre there is no material."""
        weights, truth, local, pixel = (
            np.concatenate([getattr(one, name) for one in parts], axis=-1)
            for name in ("weights", "truth", "local", "pixel")
        )
        known = np.isfinite(truth).all(axis=0)
        if not known.any():
            raise ValueError(f"{place}: no material is there, expected some in one draw or more")
        return cls(weights[:, known], truth[:, known], local[..., known], pixel[..., known])

    def at_centre(self, values: NDArray[np.floating]) -> Array:
        """Values of the samples, shape (..., sample, draw), at the pixel's centre."""
        return np.asarray((values * self.weights).sum(axis=-2), np.float64)


def _read(
    scene: Scene,
    surface: Surface,
    cameras: Sequence[Camera],
    plan: WavelengthPlan,
    spot: Spot,
    phases: int,
) -> _Readings:
    """Readings of one spot with one texture, at every phase of the pixels."""
    duration = cameras[0].integration_time
    views = views_of(surface, scene, cameras)
    exposures = late = expose_views(scene, views, spot.start, duration)
    if plan.delay:
        late = expose_views(scene, views, spot.start + plan.delay, duration)
    centres = [_centre(one, scene, spot) for one in pixel_phases(cameras[0], phases)]
    rows, columns, weights = _around(scene.raster, np.array(centres))
    truth = true_temperature(scene, spot.start + duration / 2)
    local = [
        [one.centre_radiance[rows, columns], one.mean_radiance[rows, columns]] for one in exposures
    ]
    pixel = [
        [
            _of_pixel(phase, exposure, later, centre, plan.misregistration)
            for phase, centre in zip(pixel_phases(camera, phases), centres, strict=True)
        ]
        for camera, exposure, later in zip(cameras, exposures, late, strict=True)
    ]
    return _Readings(
        weights, truth[rows, columns], np.array(local), np.moveaxis(np.array(pixel), 1, 2)
    )


def _around(raster: Raster, points: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Rows, columns and weights of the four samples around points, each of shape (4, point)."""
    column = (points[:, 0] - raster.x[0]) / raster.spacing
    row = (raster.y[0] - points[:, 1]) / raster.spacing
    left = np.clip(np.floor(column), 0, max(raster.columns - 2, 0)).astype(np.intp)
    upper = np.clip(np.floor(row), 0, max(raster.rows - 2, 0)).astype(np.intp)
    right, lower = np.minimum(left + 1, raster.columns - 1), np.minimum(upper + 1, raster.rows - 1)
    across, down = np.clip(column - left, 0.0, 1.0), np.clip(row - upper, 0.0, 1.0)
    return (
        np.stack([upper, upper, lower, lower]),
        np.stack([left, right, left, right]),
        np.stack(
            [(1 - down) * (1 - across), (1 - down) * across, down * (1 - across), down * across]
        ),
    )


def _centre(camera: Camera, scene: Scene, spot: Spot) -> Array:
    """Centre of the pixel that holds a spot."""
    pixels = camera.pixels(scene.raster)
    corner = np.array([pixels.left, pixels.top])
    column, row = np.floor((spot.point - corner) * [1, -1] / pixels.spacing).astype(int)
    if not (0 <= column < pixels.columns and 0 <= row < pixels.rows):
        raise ValueError(f"{spot.place}: {1e6 * spot.point} um is outside the pixels")
    return np.array([pixels.x[column], pixels.y[row]])


def _of_pixel(
    camera: Camera,
    exposure: Exposure,
    late: Exposure,
    centre: Array,
    distance: float,
) -> list[float]:
    """Radiance of the pixel with a centre: ideal, formed, delayed, shifted."""
    raster, pixels = exposure.raster, camera.pixels(exposure.raster)

    def formed(of: Exposure, shift: tuple[float, float] = (0.0, 0.0)) -> float:
        # The pixel that looks elsewhere is one of a grid that begins within the first pixel.
        corner = np.mod(np.array(camera.offset) + np.multiply(shift, [1, -1]), camera.pitch)
        moved = replace(camera, offset=(float(corner[0]), float(corner[1])))
        image = moved.form_image(of.mean_radiance, raster)
        return float(nearest(image, moved.pixels(raster), centre + shift))

    own = formed(exposure)
    return [
        float(nearest(ideal_image(camera, exposure), pixels, centre)),
        own,
        own if late is exposure else formed(late),
        *(
            formed(exposure, (distance * x, distance * y)) if distance else own
            for x, y in _DIRECTIONS
        ),
    ]


def _noise(camera: Camera, radiance: Array) -> float:
    """Standard deviation of the radiance that a camera reads of such pixels, relative to it."""
    calibration = camera.calibration(_NOISE_SHAPE)
    if calibration is None:
        return 0.0
    mean = float(radiance.mean())
    temperature = float(camera.band.temperature(mean))
    return float(calibration.netd(temperature) * camera.band.slope(temperature)) / mean


@dataclass(frozen=True, eq=False)
class _Error:
    """What a band or a ratio makes of one place, by draw, and its standard uncertainties in K."""

    steps: Array
    misregistration: Array
    noise: float
    emissivity: float


def _dataset(plan: WavelengthPlan, camera: Camera, places: Mapping[str, _Readings]) -> xr.Dataset:
    ratios: list[tuple[int, ...]] = [(i,) for i in range(len(plan.bands))]
    ratios += list(plan.pairs)
    draws = max(one.truth.shape[1] for one in places.values())
    shape = len(places), len(ratios)
    truth = np.full((shape[0], draws), np.nan)
    steps = np.full((*shape, len(STEPS), draws), np.nan)
    shifts = np.full((*shape, len(_DIRECTIONS), draws), np.nan)
    noise, emissivity = np.empty(shape), np.empty(shape)
    for i, readings in enumerate(places.values()):
        own = readings.at_centre(readings.truth)
        truth[i, : own.size] = own
        noises = [
            _noise(camera.in_band(band), readings.pixel[number, _FORMED])
            for number, band in enumerate(plan.bands)
        ]
        for j, bands in enumerate(ratios):
            if len(bands) == 1:
                one = _alone(plan, camera.reflected, bands[0], readings, noises[bands[0]])
            else:
                one = _ratio(plan, (bands[0], bands[1]), readings, noises)
            steps[i, j, :, : own.size] = one.steps
            shifts[i, j, :, : own.size] = one.misregistration
            noise[i, j], emissivity[i, j] = one.noise, one.emissivity
    names = [[band_name(plan.bands[number]) for number in bands] for bands in ratios]
    kelvin, over = {"units": "K"}, ("place", "ratio")
    return xr.Dataset(
        {
            "truth": (("place", "draw"), truth, kelvin),
            "step": ((*over, "cause", "draw"), steps, kelvin),
            "misregistration": ((*over, "direction", "draw"), shifts, kelvin),
            "noise": (over, noise, kelvin),
            "emissivity_uncertainty": (over, emissivity, kelvin),
        },
        coords={
            "place": list(places),
            "cause": list(STEPS),
            "first_um": ("ratio", [one[0] for one in names]),
            "second_um": ("ratio", [one[1] if len(one) > 1 else "" for one in names]),
        },
    )


def _alone(
    plan: WavelengthPlan, reflected: float | None, number: int, readings: _Readings, noise: float
) -> _Error:
    """One band, by the emissivity that is at the pixel's centre."""
    band, truth = plan.bands[number], readings.at_centre(readings.truth)
    environment = 0.0 if reflected is None else float(band.radiance(reflected))
    of_samples = (readings.local[number, 0] - environment) / (
        band.radiance(readings.truth) - environment
    )
    emissivity = readings.at_centre(of_samples)

    def told(radiance: Array, by: Array) -> Array:
        own = (radiance - environment) / by + environment
        return np.asarray(band.temperature(own), np.float64)

    centre, mean = (readings.at_centre(told(one, of_samples)) for one in readings.local[number])
    ideal, formed = (told(one, emissivity) for one in readings.pixel[number, : _FORMED + 1])
    slope = band.slope(truth)
    uncertain = plan.emissivity_uncertainty * (band.radiance(truth) - environment) / slope
    return _Error(
        steps=np.diff([truth, centre, mean, ideal, formed, formed], axis=0),
        misregistration=np.zeros((len(_DIRECTIONS), truth.size)),
        noise=float(np.mean(noise * readings.pixel[number, _FORMED] / (emissivity * slope))),
        emissivity=float(np.mean(uncertain)),
    )


def _ratio(
    plan: WavelengthPlan, pair: tuple[int, int], readings: _Readings, noise: Sequence[float]
) -> _Error:
    """The ratio of two bands, as of a grey body."""
    first, second = (plan.bands[number] for number in pair)
    one, other = (readings.pixel[number] for number in pair)
    middles = first.lower + first.upper, second.lower + second.upper
    uncertainty = plan.exponent_uncertainty * log(middles[1] / middles[0])
    thermometer = RatioThermometer(first, second, 1.0, uncertainty)
    centre, mean = readings.at_centre(
        thermometer.temperature(readings.local[pair[0]], readings.local[pair[1]])
    )
    ideal, formed = thermometer.temperature(one[: _FORMED + 1], other[: _FORMED + 1])
    delayed = thermometer.temperature(one[_FORMED], other[_DELAYED])
    shifted = thermometer.temperature(one[_FORMED], other[_SHIFTED:])
    truth = readings.at_centre(readings.truth)
    relative = hypot(*(noise[number] for number in pair))
    return _Error(
        steps=np.diff([truth, centre, mean, ideal, formed, delayed], axis=0),
        misregistration=shifted - formed,
        noise=float(np.mean(relative / thermometer.sensitivity(truth))),
        emissivity=float(np.mean(thermometer.uncertainty(truth))),
    )


def band_name(band: Band) -> str:
    """Limits of a band in um."""
    return f"{1e6 * band.lower:.4g}-{1e6 * band.upper:.4g}"
