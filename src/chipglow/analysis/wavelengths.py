"""The error of one band and of the ratio of two against the true temperature, cause by cause."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from math import log
from typing import Annotated, Final

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import PlainSerializer, PlainValidator, ValidationInfo, WithJsonSchema

from chipglow.analysis.cut import Progress, find_cut, spread_starts
from chipglow.analysis.images import around, pixel_phases
from chipglow.analysis.plan import Plan
from chipglow.analysis.ratio import CAUSES, true_temperature
from chipglow.camera import Camera, Exposure, frame_weights
from chipglow.camera.chain import Chain, ExposedChain, chains_in_bands, expose_chains
from chipglow.camera.effect import EVERY, Effect
from chipglow.camera.exposure import surroundings_radiance
from chipglow.quantities import ZERO_CELSIUS, Array, Parameter, Part
from chipglow.quantities.units import INSTANT, POSITION, WAVELENGTHS
from chipglow.radiometry import Band, RatioThermometer
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import Surface

STEPS: Final = ("emissivity", "motion", "footprint", "optics", "delay")
"""The `CAUSES` of the mean error of a band or ratio; the others scatter."""

_IDEAL, _FORMED, _DELAYED, _SHIFTED = range(4)
"""Pixels read in every band; from the last on there is one for each of the directions."""

_DIRECTIONS: Final = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
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
    exposures = expose_chains(chains, spot.start)
    images = late = _exposed(chains, exposures)
    if plan.delay:
        late = _exposed(chains, expose_chains(chains, spot.start + plan.delay))
    centres = np.array([_centre(one, scene, spot) for one in pixel_phases(cameras[0], phases)])
    pixels = []
    for camera, seen, later in zip(cameras, images, late, strict=True):
        moved = zip(pixel_phases(camera, phases), centres, strict=True)
        read = [_of_pixel(one, seen, later, at, plan.misregistration) for one, at in moved]
        pixels.append(np.transpose(read))
    part, window = around(scene.raster, centres)
    at_centres = partial(sample, raster=window, points=centres)  # linear between the samples
    local = [np.stack([one.centre_radiance[part], one.mean_radiance[part]]) for one in exposures]
    truth = true_temperature(scene, spot.start + duration / 2)[part]
    compared = [
        _compared(plan, cameras, bands, truth, local, pixels, at_centres) for bands in plan.ratios
    ]
    return xr.concat(compared, "ratio").assign(
        truth=("draw", at_centres(truth)), radiance=(("band", "draw"), np.stack(pixels)[:, _FORMED])
    )


def _exposed(chains: Sequence[Chain], exposures: Sequence[Exposure]) -> list[ExposedChain]:
    pairs = zip(chains, exposures, strict=True)
    return [chain.exposed(exposure, shares_blur=True) for chain, exposure in pairs]


def _compared(
    plan: WavelengthPlan,
    cameras: Sequence[Camera],
    bands: Sequence[int],
    truth: Array,
    local: Sequence[Array],
    pixels: Sequence[Array],
    at_centres: Callable[[Array], Array],
) -> xr.Dataset:
    """Return one band by the emissivity at the pixel's centre, or the ratio of a grey body."""
    own, first = at_centres(truth), cameras[bands[0]]
    on_samples: Callable[..., Array]
    in_pixels: Callable[..., Array]
    formed = [pixels[number][_FORMED] for number in bands]
    if len(bands) > 1:
        thermometer = plan.thermometer(bands)
        on_samples = in_pixels = thermometer.temperature
        gain, uncertainty = (1 / thermometer.sensitivity(own), thermometer.uncertainty(own))
    else:
        band, environment = first.band, surroundings_radiance(first.band, first.reflected)
        emissivity = (local[bands[0]][0] - environment) / (band.radiance(truth) - environment)
        at_centre, slope = at_centres(emissivity), band.slope(own)
        on_samples = partial(_by_emissivity, band, environment, emissivity)
        in_pixels = partial(_by_emissivity, band, environment, at_centre)
        gain = formed[0] / (at_centre * slope)
        uncertainty = plan.emissivity_uncertainty * (band.radiance(own) - environment) / slope
    # A band alone is neither delayed nor shifted.
    second = [pixels[number] for number in bands[1:]]
    temperature = in_pixels(*formed)
    chain = [
        own,
        *map(at_centres, on_samples(*(local[number] for number in bands))),
        in_pixels(*(pixels[number][_IDEAL] for number in bands)),
        temperature,
        in_pixels(formed[0], *(one[_DELAYED] for one in second)),
    ]
    shifted = in_pixels(formed[0], *(one[_SHIFTED:] for one in second)) - temperature
    return xr.Dataset(
        {
            "step": (("cause", "draw"), np.diff(chain, axis=0)),
            "misregistration": (
                ("direction", "draw"),
                np.broadcast_to(shifted, (len(_DIRECTIONS), own.size)),
            ),
            "gain": ("draw", gain),
            "emissivity_uncertainty": ("draw", uncertainty),
        }
    )


def _by_emissivity(band: Band, environment: float, emissivity: Array, radiance: Array) -> Array:
    return np.asarray(band.temperature((radiance - environment) / emissivity + environment))


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


def _of_pixel(
    camera: Camera, images: ExposedChain, late: ExposedChain, centre: Array, distance: float
) -> list[float]:
    """Return the radiance of the pixel with a centre: ideal, formed, delayed, shifted."""

    def read(
        of: ExposedChain, on: frozenset[Effect] = EVERY, shift: tuple[float, float] = (0.0, 0.0)
    ) -> float:
        # The pixel that looks elsewhere is one of a grid that begins within the first pixel.
        corner = np.mod(np.array(camera.offset) + np.multiply(shift, [1, -1]), camera.pitch)
        moved = replace(camera, offset=(float(corner[0]), float(corner[1])))
        pixels = moved.pixels(of.exposure.raster)
        return float(nearest(of.through(moved).radiance(on), pixels, centre + shift))

    shifts = [(distance * x, distance * y) for x, y in _DIRECTIONS]
    return [
        read(images, EVERY - CAUSES["optics"]),
        read(images),
        read(late),
        *(read(images, shift=shift) for shift in shifts),
    ]


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
