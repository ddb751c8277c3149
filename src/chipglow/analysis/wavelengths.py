"""Which bands to measure with: the error of one band, and of the ratio of two, side by side."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import hypot, isfinite, log, nan
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis.cut_error import Plan, find_segments
from chipglow.analysis.draws import pixel_phases
from chipglow.analysis.old_places import PointPlace
from chipglow.analysis.ratio_error import ideal_image, true_temperature
from chipglow.analysis.scene_error import ScenePlan
from chipglow.analysis.starts import spread_starts
from chipglow.camera import Camera, Exposure, expose_views, frame_weights
from chipglow.camera.ratio_camera import views_of
from chipglow.radiometry import Band, RatioThermometer
from chipglow.scene import Raster, Scene
from chipglow.scene.lines import nearest
from chipglow.surface import Surface

Progress = Callable[[str, float], None]

STEPS: Final = ("emissivity", "motion", "footprint", "optics", "delay")
"""Causes of the mean error, in the order in which they come one upon the other."""

_FOOTPRINT, _FORMED, _DELAYED, _SHIFTED = range(4)
"""Pixels read in every band; from the last on there is one for each of the directions."""

_DIRECTIONS: Final = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
_NOISE_SHAPE: Final = (64, 64)
"""Elements by which the noise is found."""


@dataclass(frozen=True)
class WavelengthPlan:
    """Which bands are compared, and what is not known of them.

    Parameters
    ----------
    bands : tuple of Band
        The bands, two or more; each pair of them is a ratio, that of the shorter waves first.
    misregistration : float
        Distance in m on the scene by which the second channel's pixels are off, in a direction that
        is not known.
    delay : float
        How much later the second channel begins to integrate, in s.
    emissivity_uncertainty : float
        Relative standard uncertainty of the emissivity that one band needs.
    exponent_uncertainty : float
        Standard uncertainty of the exponent by which the emissivity goes with the wavelength: 0 for
        a grey surface, as it is taken to be; −0.5 for a bare metal (Hagen and Rubens). It makes the
        ratio of two emissivities the more uncertain the farther apart their bands are.

    Raises
    ------
    ValueError
        If a value is impossible.
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
class WavelengthError:
    """What one band, or the ratio of two, makes of one place. Temperatures in K.

    Parameters
    ----------
    place : str
        Where.
    first : Band
        The band, or that of the shorter waves.
    second : Band or None
        The other; None for one band alone, whose emissivity is taken to be known.
    truth : ndarray
        True temperature in every draw, shape (draw,).
    steps : mapping
        By the names of `STEPS` what each adds to the error, of the same shape.
    misregistration : ndarray
        What a shift of the second channel adds, shape (direction, draw).
    noise : float
        Standard deviation that the detectors' noise makes; 0 without detectors, NaN where a
        detector is full.
    emissivity : float
        Standard uncertainty that the emissivity makes, or the ratio of two.
    """

    place: str
    first: Band
    second: Band | None
    truth: NDArray[np.float64]
    steps: Mapping[str, NDArray[np.float64]]
    misregistration: NDArray[np.float64]
    noise: float
    emissivity: float

    @property
    def error(self) -> NDArray[np.float64]:
        """Measured less true temperature in every draw, without misregistration and noise."""
        return np.asarray(np.sum(list(self.steps.values()), axis=0), np.float64)

    @property
    def shift_error(self) -> float:
        """Root mean square of what the misregistration adds."""
        return float(np.sqrt(np.mean(self.misregistration**2)))

    @property
    def total(self) -> float:
        """Root of the sum of the squares of mean error, scatter over draws and uncertainties."""
        mean = float(np.sqrt(np.mean(self.error**2)))
        return hypot(mean, self.shift_error, self.noise, self.emissivity)


@dataclass(frozen=True, eq=False)
class WavelengthErrors:
    """The errors of all bands and pairs of them.

    Parameters
    ----------
    plan : WavelengthPlan
        What was compared.
    errors : tuple of WavelengthError
        At each place the bands alone, then their ratios.
    """

    plan: WavelengthPlan
    errors: tuple[WavelengthError, ...]

    @property
    def places(self) -> tuple[str, ...]:
        """Names of the places."""
        return tuple(dict.fromkeys(one.place for one in self.errors))

    def to_frame(self) -> pd.DataFrame:
        """A row for each band and pair at each place.

        Returns
        -------
        pandas.DataFrame
            Columns ``place``, ``first_um`` and ``second_um`` (the bands; the second is empty for
            one alone), ``draws``, ``truth_degC``; the mean ``error_K`` and what its causes add,
            ``emissivity_K`` to ``delay_K``; the ``standard_deviation_K`` of the error over the
            draws; ``misregistration_K``, ``noise_K`` and ``emissivity_uncertainty_K``; and
            ``total_K``, the root of the sum of their squares and the mean's.
        """
        return pd.DataFrame([_row(one) for one in self.errors])


@dataclass(frozen=True, eq=False)
class Spot:
    """A point that is read in one exposure.

    Parameters
    ----------
    place : str
        What it is called.
    surface : str
        Name of the surface that is seen there.
    start : float
        When the exposure begins in s.
    point : ndarray
        x and y in m, shape (2,).
    """

    place: str
    surface: str
    start: float
    point: NDArray[np.float64]


def wavelength_errors(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: WavelengthPlan,
    spots: Sequence[Spot],
    phases: int,
    textures: int,
    progress: Progress | None = None,
) -> WavelengthErrors:
    """Errors of one band and of ratios of two at some spots.

    Parameters
    ----------
    scene : Scene
        What is truly there.
    surfaces : mapping
        Surfaces by name.
    camera : Camera
        The camera, which is given every band of the plan in turn, its diffraction with it.
    plan : WavelengthPlan
        The bands.
    spots : sequence of Spot
        Where to read; those of one place are draws of it.
    phases, textures : int
        How often each is drawn anew: positions of the pixels along each axis, and textures of the
        emissivity.
    progress : callable, optional
        Told what is being done and how much of it is done.

    Raises
    ------
    ValueError
        If no exposure is left that has room for the delay, or a spot is outside the pixels.

    Notes
    -----
    The pixel that holds the spot is read. Its true temperature is that at its centre in the middle
    of the exposure, linear between the four samples around it. One band is told the emissivity of
    just that place, the ratio that emissivities are the same. Steps are differences as those of
    `ratio_errors`.
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
    found: list[WavelengthError] = []
    for place, parts in gathered.items():
        readings = _Readings.joined(place, parts)
        noise = [
            _noise(camera.in_band(band), readings.pixel[number, _FORMED])
            for number, band in enumerate(plan.bands)
        ]
        found += [
            _alone(place, plan, camera.reflected, number, readings, noise[number])
            for number in range(len(plan.bands))
        ]
        found += [_ratio(place, plan, pair, readings, noise) for pair in plan.pairs]
    return WavelengthErrors(plan, tuple(found))


def cut_spots(
    scene: Scene, camera: Camera, plan: Plan, progress: Progress | None = None
) -> list[Spot]:
    """The chip at the rake face and the middle of the shear band, in every segment of a cut.

    The first is half a pixel from the face, at mid-contact; on the face chip and tool differ.

    Parameters
    ----------
    scene : Scene
        A cut.
    camera : Camera
        The camera: how long it exposes.
    plan : Plan
        How segments are found, and which surfaces are seen.
    progress : callable, optional
        Told what is being done and how much of it is done.

    Raises
    ------
    ValueError
        If there is no band or no contact.
    """
    spots = []
    for segment in find_segments(scene, camera.integration_time, plan, progress):
        tool = segment.tool
        inside = camera.pitch / 2 * np.array(tool.rake_normal)
        face = tool.rake_point(segment.contact_length / 2) + inside
        middle = segment.band.ridge.points[segment.band.middle]
        spots += [
            Spot("rake face", plan.rake_surface, segment.start, face),
            Spot("shear band", plan.band_surface, segment.start, middle),
        ]
    return spots


def point_spots(
    scene: Scene, camera: Camera, plan: ScenePlan, surfaces: Sequence[str]
) -> list[Spot]:
    """The user's points in every exposure, with every surface.

    Parameters
    ----------
    scene : Scene
        Any scene.
    camera : Camera
        The camera: how long it exposes.
    plan : ScenePlan
        The points, and how many exposures.
    surfaces : sequence of str
        Names of the surfaces.
    """
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
    """What is read at one place.

    Parameters
    ----------
    weights : ndarray
        Of the four samples around the pixel's centre, shape (sample, draw).
    truth : ndarray
        Their true temperatures in K, of the same shape.
    local : ndarray
        Their radiance in W/(m² sr) in the middle of the exposure and on average, shape (band, 2,
        sample, draw).
    pixel : ndarray
        Radiance of the pixel, shape (band, step, draw): `_FOOTPRINT` to `_SHIFTED` and on.
    """

    weights: NDArray[np.float64]
    truth: NDArray[np.float64]
    local: NDArray[np.float64]
    pixel: NDArray[np.float64]

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

    def at_centre(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
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


def _around(
    raster: Raster, points: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
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


def _centre(camera: Camera, scene: Scene, spot: Spot) -> NDArray[np.float64]:
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
    centre: NDArray[np.float64],
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


def _noise(camera: Camera, radiance: NDArray[np.float64]) -> float:
    """Standard deviation of the radiance that a camera reads of such pixels, relative to it."""
    calibration = camera.calibration(_NOISE_SHAPE)
    if calibration is None:
        return 0.0
    mean = float(radiance.mean())
    temperature = float(camera.band.temperature(mean))
    return float(calibration.netd(temperature) * camera.band.slope(temperature)) / mean


def _alone(
    place: str,
    plan: WavelengthPlan,
    reflected: float | None,
    number: int,
    readings: _Readings,
    noise: float,
) -> WavelengthError:
    """One band, by the emissivity that is at the pixel's centre."""
    band, truth = plan.bands[number], readings.at_centre(readings.truth)
    environment = 0.0 if reflected is None else float(band.radiance(reflected))
    of_samples = (readings.local[number, 0] - environment) / (
        band.radiance(readings.truth) - environment
    )
    emissivity = readings.at_centre(of_samples)

    def told(radiance: NDArray[np.float64], by: NDArray[np.float64]) -> NDArray[np.float64]:
        own = (radiance - environment) / by + environment
        return np.asarray(band.temperature(own), np.float64)

    centre, mean = (readings.at_centre(told(one, of_samples)) for one in readings.local[number])
    ideal, formed = (told(one, emissivity) for one in readings.pixel[number, : _FORMED + 1])
    slope = band.slope(truth)
    uncertain = plan.emissivity_uncertainty * (band.radiance(truth) - environment) / slope
    return WavelengthError(
        place=place,
        first=band,
        second=None,
        truth=truth,
        steps=_steps([truth, centre, mean, ideal, formed, formed]),
        misregistration=np.zeros((len(_DIRECTIONS), truth.size)),
        noise=float(np.mean(noise * readings.pixel[number, _FORMED] / (emissivity * slope))),
        emissivity=float(np.mean(uncertain)),
    )


def _ratio(
    place: str,
    plan: WavelengthPlan,
    pair: tuple[int, int],
    readings: _Readings,
    noise: Sequence[float],
) -> WavelengthError:
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
    return WavelengthError(
        place=place,
        first=first,
        second=second,
        truth=truth,
        steps=_steps([truth, centre, mean, ideal, formed, delayed]),
        misregistration=shifted - formed,
        noise=float(np.mean(relative / thermometer.sensitivity(truth))),
        emissivity=float(np.mean(thermometer.uncertainty(truth))),
    )


def _steps(told: Sequence[NDArray[np.floating]]) -> dict[str, NDArray[np.float64]]:
    """Differences of temperatures that have one cause after the other."""
    pairs = zip(STEPS, told[1:], told[:-1], strict=True)
    return {name: np.asarray(after - before, np.float64) for name, after, before in pairs}


def band_name(band: Band) -> str:
    """Limits of a band in um."""
    return f"{1e6 * band.lower:.4g}-{1e6 * band.upper:.4g}"


def _row(one: WavelengthError) -> dict[str, Any]:
    """The row of a table."""
    return {
        "place": one.place,
        "first_um": band_name(one.first),
        "second_um": band_name(one.second) if one.second else "",
        "draws": one.truth.size,
        "truth_degC": float(one.truth.mean()) - 273.15,
        "error_K": float(one.error.mean()),
        **{f"{name}_K": float(values.mean()) for name, values in one.steps.items()},
        "standard_deviation_K": float(one.error.std(ddof=1)) if one.error.size > 1 else nan,
        "misregistration_K": one.shift_error,
        "noise_K": one.noise,
        "emissivity_uncertainty_K": one.emissivity,
        "total_K": one.total,
    }
