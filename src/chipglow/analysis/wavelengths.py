"""The error of one band and of the ratio of two against the true temperature, cause by cause."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from math import log
from typing import Annotated, Final, NamedTuple, Protocol

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema

from chipglow.analysis.cut import Progress, find_cut, spread_starts
from chipglow.analysis.images import around, pixel_phases
from chipglow.analysis.plan import Plan
from chipglow.analysis.ratio import CAUSES, true_temperature
from chipglow.camera import Camera, frame_weights
from chipglow.camera.chain import Chain, ExposedChain, chains_in_bands, expose_chains
from chipglow.camera.effect import EVERY, Effect
from chipglow.camera.exposure import surroundings_radiance
from chipglow.quantities import ZERO_CELSIUS, Array, Parameter, Part
from chipglow.quantities.units import INSTANT, POSITION, WAVELENGTHS
from chipglow.radiometry import Band, RatioThermometer
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import Surface

STEPS: Final = ("emissivity", "motion", "footprint", "optics", "delay")
"""The `CAUSES` of the mean error of a band or ratio; the others scatter."""

_DIRECTIONS: Final = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
"""In which the pixels of a second channel may be off: right, left, up and down."""

_NOISE_SHAPE: Final = (64, 64)
"""Elements over which the noise is determined."""


def _band(value: object, info: ValidationInfo) -> Band:
    if isinstance(value, Band):
        return value
    return Band(*WAVELENGTHS.parse_range(value, si=info.context is None))


BandText = Annotated[
    Band,
    PlainValidator(_band),
    PlainSerializer(lambda one: WAVELENGTHS.range_text((one.lower, one.upper)), when_used="json"),
    WithJsonSchema({"type": "string", "examples": [WAVELENGTHS.example]}),
]


@dataclass(frozen=True)
class WavelengthPlan(Part):
    """Bands that are compared, alone and as ratios of two.

    The uncertainty of the exponent makes the ratio of two emissivities the more uncertain the
    farther apart their bands are.
    """

    bands: Annotated[
        tuple[BandText, ...],
        Parameter(
            "The bands; each pair of them is a ratio. Diffraction is computed for each band."
        ),
    ] = (
        Band(0.9e-6, 1.1e-6),
        Band(1.5e-6, 1.7e-6),
        Band(2.0e-6, 2.4e-6),
        Band(3.2e-6, 3.8e-6),
        Band(*PAPER_BAND),
        Band(8.0e-6, 9.5e-6),
        Band(10e-6, 14e-6),
    )
    misregistration: Annotated[
        float,
        Parameter(
            "Distance on the scene from the pixels of a ratio's first channel to the pixels of the "
            "second, in an unknown direction.",
            POSITION,
            least=0.0,
        ),
    ] = 1e-6
    delay: Annotated[
        float, Parameter("Delay of the second channel's exposure.", INSTANT, least=0.0)
    ] = 0.0
    emissivity_uncertainty: Annotated[
        float,
        Parameter(
            "Relative standard uncertainty of the emissivity that one band alone needs.", least=0.0
        ),
    ] = 0.1
    exponent_uncertainty: Annotated[
        float,
        Parameter(
            "Standard uncertainty of the exponent with which the emissivity goes with the "
            "wavelength: 0 for a grey surface, as it is taken to be; -0.5 for a bare metal.",
            least=0.0,
        ),
    ] = 0.15

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.bands) < 2 or len(set(self.bands)) < len(self.bands):
            raise ValueError(f"bands: {len(self.bands)}, expected two or more that differ")

    @property
    def pairs(self) -> Iterator[tuple[int, int]]:
        """Indices of the bands of every ratio, the shorter wavelengths first."""
        middles = [one.lower + one.upper for one in self.bands]
        order = sorted(range(len(self.bands)), key=middles.__getitem__)
        return combinations(order, 2)

    @property
    def ratios(self) -> list[tuple[int, ...]]:
        """Indices of the compared bands: each alone, then the pairs."""
        return [*((number,) for number in range(len(self.bands))), *self.pairs]

    def thermometer(self, pair: Sequence[int]) -> RatioThermometer:
        first, second = (self.bands[number] for number in pair)
        exponent = log((second.lower + second.upper) / (first.lower + first.upper))
        return RatioThermometer(first, second, 1.0, self.exponent_uncertainty * exponent)


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
    """Return errors in K of bands and ratios over place, ratio and draw, by cause (`STEPS`).

    The emissivity at a pixel's centre counts as known for one band; for a ratio, two as equal.
    """
    tell = progress or (lambda label, part: None)
    cameras = [camera.in_band(band) for band in plan.bands]
    duration = camera.integration_time
    kept = [spot for spot in spots if _has_room(scene, spot.start + plan.delay, duration)]
    if not kept:
        raise ValueError(
            f"delay: {1e6 * plan.delay:g} us, expected so little that the scene lasts until the "
            "second channel's exposure ends"
        )
    draws: dict[str, list[xr.Dataset]] = {}
    for i, spot in enumerate(kept):
        tell("bands", i / len(kept))
        surface = surfaces[spot.surface]
        for number in range(textures if surface.redrawn(1) is not surface else 1):
            read = _draws(scene, surface.redrawn(number), cameras, plan, spot, phases)
            draws.setdefault(spot.place, []).append(read)
    tell("bands", 1.0)
    places = [_of_place(name, parts, cameras, plan) for name, parts in draws.items()]
    data = xr.concat(places, pd.Index(list(draws), name="place"), join="outer")
    names = [[band_name(plan.bands[number]) for number in bands] for bands in plan.ratios]
    for variable in data.data_vars.values():
        variable.attrs["units"] = "K"
    return data.drop_vars("draw").assign_coords(
        cause=list(STEPS),
        first_um=("ratio", [one[0] for one in names]),
        second_um=("ratio", [one[1] if len(one) > 1 else "" for one in names]),
    )


def wavelengths_frame(data: xr.Dataset) -> pd.DataFrame:
    """Return a table of the bands and pairs at each place: mean error, causes and total."""
    error = data.step.sum("cause", skipna=False)
    table = xr.Dataset(
        {
            "draws": data.truth.count("draw"),
            "truth_degC": data.truth.mean("draw") - ZERO_CELSIUS,
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
    return frame[["place", "first_um", "second_um", *map(str, table.data_vars), "total_K"]]


def cut_spots(
    scene: Scene, camera: Camera, plan: Plan, progress: Progress | None = None
) -> list[Spot]:
    """Return spots at the rake face, half a pixel into the chip, and in each shear band."""
    tell = progress or (lambda label, part: None)
    cut = find_cut(scene, camera.integration_time, plan.exposures, tell)
    spots = []
    for segment in cut.segments:
        tool = segment.tool
        inside = camera.pitch / 2 * np.array(tool.rake_normal)
        face = tool.rake_point(segment.contact_length / 2) + inside
        middle = segment.band.ridge.points[segment.band.middle]
        spots += [
            Spot("rake face", plan.rake_chip, segment.start, face),
            Spot("shear band", plan.band_chip, segment.start, middle),
        ]
    return spots


def point_spots(scene: Scene, camera: Camera, plan: Plan, surfaces: Sequence[str]) -> list[Spot]:
    """Return the points of a plan in every exposure, with every surface."""
    starts = spread_starts(scene, camera.integration_time, plan.exposures)
    return [
        Spot(f"{name}, {one}" if len(surfaces) > 1 else name, one, float(start), np.array(point))
        for name, point in plan.points.items()
        for one in surfaces
        for start in starts
    ]


def _has_room(scene: Scene, start: float, duration: float) -> bool:
    with suppress(ValueError):
        frame_weights(scene.times, scene.frame_spacing, start, duration)
        return True
    return False


def _draws(
    scene: Scene,
    surface: Surface,
    cameras: Sequence[Camera],
    plan: WavelengthPlan,
    spot: Spot,
    phases: int,
) -> xr.Dataset:
    """Return every band and ratio at one spot with one texture, a draw for each phase."""
    duration = cameras[0].integration_time
    chains = chains_in_bands(surface, scene, cameras)
    images = late = _exposed(chains, spot.start)
    if plan.delay:
        late = _exposed(chains, spot.start + plan.delay)
    centres = np.array([_centre(one, scene, spot) for one in pixel_phases(cameras[0], phases)])
    part, window = around(scene.raster, centres)
    truth = true_temperature(scene, spot.start + duration / 2)[part]
    samples = _Samples(window, centres, truth)
    bands = [
        _BandRadiances(
            camera,
            still=seen.exposure.centre_radiance[part],
            mean=seen.exposure.mean_radiance[part],
            pixels=_pixel_radiances(
                pixel_phases(camera, phases), seen, later, centres, plan.misregistration
            ),
        )
        for camera, seen, later in zip(cameras, images, late, strict=True)
    ]
    errors = []
    for numbers in plan.ratios:
        used = [bands[number] for number in numbers]
        thermometer = (
            _OneBand(plan, samples, *used) if len(used) == 1 else _Ratio(plan.thermometer(numbers))
        )
        errors.append(_errors(thermometer, samples, used))
    return xr.concat(errors, "ratio").assign(
        truth=("draw", samples.true_temperature),
        radiance=(("band", "draw"), np.stack([one.pixels.formed for one in bands])),
    )


def _exposed(chains: Sequence[Chain], start: float) -> list[ExposedChain]:
    pairs = zip(chains, expose_chains(chains, start), strict=True)
    return [chain.exposed(exposure, shares_blur=True) for chain, exposure in pairs]


@dataclass(frozen=True, eq=False)
class _Samples:
    """The samples around the pixels that are read, one pixel for each draw."""

    raster: Raster
    centres: Array  # of the pixels, shape (draw, 2)
    truth: Array  # true temperature in K in the middle of the exposure, (y, x)

    def at_centres(self, values: Array) -> Array:
        """Return values at the pixels' centres, linear between the samples."""
        return sample(values, self.raster, self.centres)

    @property
    def true_temperature(self) -> Array:
        return self.at_centres(self.truth)


class _PixelRadiances(NamedTuple):
    """Radiances of the pixels in one band in W/(m² sr), one for each draw."""

    ideal: Array  # without the optics
    formed: Array
    delayed: Array
    shifted: Array  # shape (direction, draw)


@dataclass(frozen=True, eq=False)
class _BandRadiances:
    """Radiances of samples and pixels in the band of a camera in W/(m² sr)."""

    camera: Camera
    still: Array  # of the samples in the middle of the exposure, (y, x)
    mean: Array  # of the samples over the exposure, (y, x)
    pixels: _PixelRadiances


class _Thermometer(Protocol):
    """A temperature in K from the radiances of one band, or of two."""

    def of_samples(self, *radiances: Array) -> Array:
        """Return the temperature of the samples."""

    def of_pixels(self, *radiances: Array) -> Array:
        """Return the temperature of the pixels, from radiances of shape (..., draw)."""

    def gain(self, truth: Array, formed: Array) -> Array:
        """Return the error in K over a small relative error of one radiance."""

    def emissivity_uncertainty(self, truth: Array) -> Array:
        """Return the standard uncertainty in K by that of the emissivity."""


class _OneBand:
    """One band, of which the emissivity at the centre of each pixel is known."""

    def __init__(self, plan: WavelengthPlan, samples: _Samples, seen: _BandRadiances) -> None:
        camera = seen.camera
        self._band, self._relative = camera.band, plan.emissivity_uncertainty
        self._environment = surroundings_radiance(camera.band, camera.reflected)
        black = self._band.radiance(samples.truth)
        self._emissivity = (seen.still - self._environment) / (black - self._environment)
        self._at_centres = samples.at_centres(self._emissivity)

    def of_samples(self, *radiances: Array) -> Array:
        return self._temperature(self._emissivity, *radiances)

    def of_pixels(self, *radiances: Array) -> Array:
        return self._temperature(self._at_centres, *radiances)

    def gain(self, truth: Array, formed: Array) -> Array:
        return np.asarray(formed / (self._at_centres * self._band.slope(truth)))

    def emissivity_uncertainty(self, truth: Array) -> Array:
        above = self._band.radiance(truth) - self._environment
        return np.asarray(self._relative * above / self._band.slope(truth))

    def _temperature(self, emissivity: Array, radiance: Array) -> Array:
        black = (radiance - self._environment) / emissivity + self._environment
        return np.asarray(self._band.temperature(black))


@dataclass(frozen=True)
class _Ratio:
    """The ratio of two bands; the emissivity is taken to be the same in both."""

    thermometer: RatioThermometer

    def of_samples(self, *radiances: Array) -> Array:
        return self.thermometer.temperature(*radiances)

    def of_pixels(self, *radiances: Array) -> Array:
        return self.thermometer.temperature(*radiances)

    def gain(self, truth: Array, formed: Array) -> Array:
        return 1 / self.thermometer.sensitivity(truth)

    def emissivity_uncertainty(self, truth: Array) -> Array:
        return self.thermometer.uncertainty(truth)


def _errors(
    thermometer: _Thermometer, samples: _Samples, bands: Sequence[_BandRadiances]
) -> xr.Dataset:
    """Return the errors of a thermometer, cause by cause in the order of `STEPS`."""
    truth = samples.true_temperature
    first, *others = [one.pixels for one in bands]  # a band alone is neither delayed nor shifted
    temperature = thermometer.of_pixels(first.formed, *(one.formed for one in others))
    readings = [
        truth,
        samples.at_centres(thermometer.of_samples(*(one.still for one in bands))),
        samples.at_centres(thermometer.of_samples(*(one.mean for one in bands))),
        thermometer.of_pixels(first.ideal, *(one.ideal for one in others)),
        temperature,
        thermometer.of_pixels(first.formed, *(one.delayed for one in others)),
    ]
    shifted = thermometer.of_pixels(first.formed, *(one.shifted for one in others)) - temperature
    shifts = np.broadcast_to(shifted, (len(_DIRECTIONS), truth.size))
    return xr.Dataset(
        {
            "step": (("cause", "draw"), np.diff(readings, axis=0)),
            "misregistration": (("direction", "draw"), shifts),
            "gain": ("draw", thermometer.gain(truth, first.formed)),
            "emissivity_uncertainty": ("draw", thermometer.emissivity_uncertainty(truth)),
        }
    )


def _of_place(
    name: str, parts: Sequence[xr.Dataset], cameras: Sequence[Camera], plan: WavelengthPlan
) -> xr.Dataset:
    """Return all draws of a place but those without material at the pixel's centre."""
    data = xr.concat(parts, "draw").dropna("draw", subset=["truth"])
    if not data.sizes["draw"]:
        raise ValueError(f"{name}: must have material in one draw or more")
    radiances = data.radiance.mean("draw").values
    relative = [_noise(camera, one) for camera, one in zip(cameras, radiances, strict=True)]
    noise = [np.linalg.norm([relative[number] for number in bands]) for bands in plan.ratios]
    return data.drop_vars(["gain", "radiance"]).assign(
        noise=data.gain.mean("draw") * xr.DataArray(noise, dims="ratio"),
        emissivity_uncertainty=data.emissivity_uncertainty.mean("draw"),
        draw=np.arange(data.sizes["draw"]),
    )


def _centre(camera: Camera, scene: Scene, spot: Spot) -> Array:
    pixels = camera.pixels(scene.raster)
    corner = np.array([pixels.left, pixels.top])
    column, row = np.floor((spot.point - corner) * [1, -1] / pixels.spacing).astype(int)
    if not (0 <= column < pixels.columns and 0 <= row < pixels.rows):
        raise ValueError(f"{spot.place}: {1e6 * spot.point} um is outside the pixels")
    return np.array([pixels.x[column], pixels.y[row]])


def _pixel_radiances(
    cameras: Sequence[Camera],
    images: ExposedChain,
    late: ExposedChain,
    centres: Array,
    distance: float,
) -> _PixelRadiances:
    """Return what the pixels with these centres receive in one band, one of each camera."""

    def read(
        of: ExposedChain, on: frozenset[Effect] = EVERY, shift: tuple[float, float] = (0.0, 0.0)
    ) -> Array:
        pairs = zip(cameras, centres, strict=True)
        return np.array([_pixel_radiance(of, camera, at, on, shift) for camera, at in pairs])

    shifts = [(distance * x, distance * y) for x, y in _DIRECTIONS]
    return _PixelRadiances(
        ideal=read(images, EVERY - CAUSES["optics"]),
        formed=read(images),
        delayed=read(late),
        shifted=np.stack([read(images, shift=shift) for shift in shifts]),
    )


def _pixel_radiance(
    of: ExposedChain,
    camera: Camera,
    centre: Array,
    on: frozenset[Effect],
    shift: tuple[float, float],
) -> float:
    """Return the radiance of the pixel that looks aside of a centre, right and up in m."""
    # That pixel is one of a grid that begins within the first pixel.
    corner = np.mod(np.array(camera.offset) + np.multiply(shift, [1, -1]), camera.pitch)
    moved = replace(camera, offset=(float(corner[0]), float(corner[1])))
    pixels = moved.pixels(of.exposure.raster)
    return float(nearest(of.through(moved).radiance(on), pixels, centre + shift))


def _noise(camera: Camera, radiance: float) -> float:
    """Return the relative standard deviation of the radiance that a camera reads."""
    calibration = camera.calibration(_NOISE_SHAPE)
    if calibration is None:
        return 0.0
    temperature = float(camera.band.temperature(radiance))
    return float(calibration.netd(temperature) * camera.band.slope(temperature)) / radiance


def band_name(band: Band) -> str:
    """Return the limits of a band in µm."""
    return f"{1e6 * band.lower:.4g}-{1e6 * band.upper:.4g}"
