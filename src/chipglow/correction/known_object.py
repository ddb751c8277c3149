"""Corrections with emissivities of the laboratory: lines over the temperature, or a map."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from chipglow.camera import Camera, Flag, Measurement
from chipglow.correction.cells import cells_of
from chipglow.correction.correct import correct
from chipglow.correction.correction import Correction, joined
from chipglow.correction.known import KnownPart
from chipglow.correction.zones import (
    AT_REST,
    Labels,
    Motion,
    ObservedObject,
    ShapedObject,
    Zone,
    check_tools,
)
from chipglow.laboratory.emissivity import EmissivityLine, reflected_temperature
from chipglow.laboratory.emissivity.places import ELSEWHERE, TOOL
from chipglow.laboratory.emissivity.temperature import FAR
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.quantities.units import COLDEST
from chipglow.radiometry import Band, blackbody_radiance
from chipglow.scene import Raster, Region, Tool
from chipglow.surface import MapSurface
from chipglow.text import Notes
from chipglow.uncertainty import Estimate

_ROUNDS: Final = 4
"""Rounds in which temperature and emissivity follow from each other.

A kelvin changes an emissivity of 0.4 by 0.05 % (2e-4 1/K), and this a temperature of 1000 K by
0.2 K: each round leaves a fifth of the error.
"""

_LEAST: Final = 0.01
"""Smallest emissivity of a map: noise must not make it vanish."""

_MARGIN: Final = 2
"""Samples around a map to which its edge extends: outlines may move by as much."""

_OUTSIDE: Final = "outside the map"
_DARK: Final = Estimate(np.array(COLDEST))
"""Surroundings without radiation."""

_Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class KnownObject(ObservedObject):
    """Shaped zones with an emissivity at each point that changes with the temperature.

    Points outside `samples` belong to the first zone.
    """

    shapes: ShapedObject
    emissivity: Array
    """Emissivity on `samples` where `warmer` is 0, (zone, y, x)."""
    samples: Raster
    slopes: Array
    """Change of the emissivity with the temperature in 1/K, (zone,)."""
    warmer: Array
    """Temperature of the pixels in K above that at which `emissivity` holds, (zone, y, x)."""
    motion: Motion = AT_REST

    @property
    def zones(self) -> tuple[Zone, ...]:  # type: ignore[override]
        return self.shapes.zones

    @property
    def centre(self) -> tuple[float, float]:  # type: ignore[override]
        return self.shapes.centre

    def moved(self, motion: Motion) -> "KnownObject":
        return replace(self, motion=motion)

    def _at(self, x: Array, y: Array) -> tuple[Labels, Array]:
        labels = self.shapes.look_up(x, y)[0]
        # Beyond the image, the emissivities of its edge continue.
        left, right, bottom, top = self.shapes.pixels.extent
        inside, *sample = _nearest(self.samples, x.clip(left, right), y.clip(bottom, top))
        labels = np.where(inside, labels, 0).astype(np.int16)
        _, *pixel = _nearest(self.shapes.pixels, x, y)
        warmer = self.warmer[(labels, *pixel)]
        values = self.emissivity[(labels, *sample)] + self.slopes[labels] * warmer
        return labels, np.clip(values, _LEAST, 1.0)


def _nearest(raster: Raster, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Return whether points are on a raster, and row and column of their nearest samples."""
    column = np.floor((x - raster.left) / raster.spacing).astype(np.intp)
    row = np.floor((raster.top - y) / raster.spacing).astype(np.intp)
    nearest = row.clip(0, raster.rows - 1), column.clip(0, raster.columns - 1)
    away = np.maximum(np.abs(row - nearest[0]), np.abs(column - nearest[1]))
    return away <= _MARGIN, *nearest


def correct_known(
    measurement: Measurement,
    camera: Camera,
    parts: Sequence[KnownPart],
    *,
    surroundings: Estimate | None = None,
    progress: _Progress | None = None,
    **settings: Any,
) -> Correction:
    """Correct frames of an object whose emissivities were determined by regions.

    An emissivity that was determined at several temperatures is taken at the temperature of each
    pixel, by a first correction; its uncertainty is that at the mean temperature of its zone.

    Parameters
    ----------
    measurement : Measurement
        Frames of a real or of a simulated camera.
    camera : Camera
        See `chipglow.correct`.
    parts : sequence of KnownPart
        Parts of the image by `known_parts`.
    surroundings : Estimate, optional
        Temperature of the surroundings in K; 293 K without uncertainty by default.
    progress : callable, optional
        Called with the completed fraction.
    **settings
        `psf_uncertainty`, `outline_uncertainty`, `noise` and `seed` of `chipglow.correct`.

    Raises
    ------
    ValueError
        See `chipglow.correct`; also if the emissivity at the temperature of a zone is 0 or less,
        or above 1.
    """
    pixels = measurement.raster
    check_tools([part.shape for part in parts], pixels)
    lines = [EmissivityLine.constant(1.0) if one.line is None else one.line for one in parts]
    values, slopes = np.stack([line.estimate.values for line in lines]).T
    middles = np.array([line.middle for line in lines])
    names_only = tuple(Zone(part.name, 1.0, part.shape) for part in parts)
    labels = _labels(ShapedObject(names_only, pixels), pixels)

    def known(kelvins: Array) -> tuple[KnownObject, Notes]:
        means = [_mean(one[labels == number]) for number, one in enumerate(kelvins)]
        zones = tuple(part.zone(mean) for part, mean in zip(parts, means, strict=True))
        shapes = ShapedObject(zones, pixels)
        emissivity = np.broadcast_to(values[:, None, None], kelvins.shape)
        warmer = kelvins - middles[:, None, None]
        notes = Notes(warnings=list(_far(parts, means)))
        return KnownObject(shapes, emissivity, pixels, slopes, warmer), notes

    frames = _Frames(camera, known, values, slopes, middles, surroundings, settings)
    return frames.corrected(measurement, progress)


def correct_mapped(
    measurement: Measurement,
    camera: Camera,
    image: MapSurface,
    shapes: Sequence[Region | Tool] = (),
    *,
    surroundings: Estimate | None = None,
    progress: _Progress | None = None,
    **settings: Any,
) -> Correction:
    """Correct frames of an object whose emissivity was determined pixel by pixel.

    The map is an image of the same camera and has its blur. It is sharpened by a correction of its
    own, so that the blur does not count twice. A change of the emissivity with the temperature is
    the mean of each zone's.

    Parameters
    ----------
    measurement : Measurement
        Frames of a real or of a simulated camera.
    camera : Camera
        See `chipglow.correct`; the map is one of the same camera.
    image : MapSurface
        Emissivity map by `read_emissivity_map`, in the measurement's coordinates. Outside of it
        nothing is determined.
    shapes : sequence of Region or Tool
        Outlines at which temperature or emissivity change abruptly.
    surroundings : Estimate, optional
        Temperature of the surroundings in K; 293 K without uncertainty by default.
    progress : callable, optional
        Called with the completed fraction.
    **settings
        `psf_uncertainty`, `outline_uncertainty`, `noise` and `seed` of `chipglow.correct`.

    Raises
    ------
    ValueError
        See `chipglow.correct`; or if the map and the image do not overlap.
    """
    pixels = measurement.raster
    if not _nearest(image.raster, *_centres(pixels))[0].any():
        raise ValueError(
            f"emissivity: the map lies at {_extent(image.raster)}, expected the place of the "
            f"measurement, {_extent(pixels)}"
        )
    check_tools(shapes, pixels)
    sharp = _sharpened(image, camera, shapes, pixels)

    def known(kelvins: Array) -> tuple[KnownObject, Notes]:
        return replace(sharp, warmer=kelvins - image.middle), Notes()

    values = np.array([zone.emissivity or 1.0 for zone in sharp.zones])
    middles = np.full(values.size, image.middle)
    frames = _Frames(camera, known, values, sharp.slopes, middles, surroundings, settings)
    return frames.corrected(measurement, progress)


@dataclass(frozen=True, eq=False)
class _Frames:
    """The correction of frames one by one, each with the emissivities at its own temperatures."""

    camera: Camera
    known: Callable[[Array], tuple[KnownObject, Notes]]
    """The object at temperatures of the pixels in K, (zone, y, x)."""
    values: Array
    slopes: Array
    middles: Array
    """Mean emissivity of the zones, its change in 1/K, and the temperature where it holds in K."""
    surroundings: Estimate | None
    settings: dict[str, Any]

    @property
    def room(self) -> Estimate:
        """Temperature of the surroundings."""
        return reflected_temperature() if self.surroundings is None else self.surroundings

    def corrected(self, measurement: Measurement, progress: _Progress | None) -> Correction:
        count, found = len(measurement), []
        for frame in range(count):

            def tell(fraction: float, before: int = frame) -> None:
                if progress is not None:
                    progress((before + fraction) / count)

            found.append(self._frame(measurement.part(slice(frame, frame + 1)), tell))
        return joined(found)

    def _frame(self, image: Measurement, progress: _Progress) -> Correction:
        by_zone = zip(self.values, self.slopes, self.middles, strict=True)
        first = np.stack([self._by_emissivity(image, *zone) for zone in by_zone])
        result = self._solved(image, first, progress)
        if not self.slopes.any():
            return result
        better = result.data["temperature"][0].values
        return self._solved(image, np.where(np.isfinite(better), better, first), progress)

    def _solved(self, image: Measurement, kelvins: Array, progress: _Progress) -> Correction:
        known, notes = self.known(kelvins)
        result = correct(
            image, self.camera, known, surroundings=self.room, progress=progress, **self.settings
        )
        return result.with_notes(notes)

    def _by_emissivity(self, image: Measurement, value: float, slope: float, at: float) -> Array:
        """Return the temperature of the pixels in K by the emissivity alone."""
        kelvins = image.radiance_temperature(flagged=True)[0]
        found = np.where(np.isfinite(kelvins), kelvins, np.nanmedian(kelvins))
        seen = np.asarray(image.band.radiance(found))
        reflected = float(image.band.radiance(float(self.room.values)))
        for _ in range(_ROUNDS):
            emissivity = np.clip(value + slope * (found - at), _LEAST, 1.0)
            own = blackbody_radiance(seen, emissivity, reflected)
            found = np.asarray(image.band.temperature(np.maximum(own, reflected)))
        return np.asarray(found, np.float64)


def _sharpened(
    image: MapSurface, camera: Camera, shapes: Sequence[Region | Tool], pixels: Raster
) -> KnownObject:
    """Return an emissivity map as an object, without the blur of the camera."""
    raster, band = image.raster, camera.band
    level = float(band.radiance(image.middle))
    known = np.isfinite(image.values) & (image.values > 0)
    flags = np.where(known, 0, Flag.DEAD).astype(np.uint8)
    light = level * np.where(known, image.values, 1.0)
    measured = Measurement.from_radiance(light[None], band, np.zeros(1), raster, flags=flags[None])
    named = [(TOOL if isinstance(one, Tool) else one.name, one) for one in shapes]
    outlines = ShapedObject(
        (
            Zone(_OUTSIDE, None),
            Zone(ELSEWHERE, 1.0),
            *(Zone(name, 1.0, shape) for name, shape in named),
        ),
        pixels,
    )
    found = correct(measured, camera, outlines, surroundings=_DARK).data.isel(time=0)
    cells = cells_of(raster)
    emissivity = np.asarray(band.radiance(found["fine_temperature"].values.astype(float))) / level
    at_cells, at_pixels = (_labels(outlines, one) for one in (cells, raster))
    spread = _relative_spread(found, band) * emissivity.mean()
    zones, filled, slopes = [], [], []
    for number, zone in enumerate(outlines.zones):
        own = at_pixels == number
        filled.append(_continued(emissivity, at_cells == number))
        slopes.append(0.0 if image.slopes is None or not own.any() else _mean(image.slopes[own]))
        zones.append(
            replace(
                zone,
                emissivity=float(np.clip(_mean(emissivity[at_cells == number]), _LEAST, 1.0)),
                uncertainty=0.0 if image.uncertainty is None else _mean(image.uncertainty[own]),
                texture=_mean(spread[own]),
                grain=raster.spacing,
            )
            if own.any()
            else replace(zone, emissivity=None)
        )
    shaped = ShapedObject(tuple(zones), pixels)
    return KnownObject(shaped, np.stack(filled), cells, np.array(slopes), np.zeros(0))


def _relative_spread(found: Any, band: Band) -> Array:
    """Return the relative standard uncertainty of a sharpened map by noise and smoothing."""
    own = np.isin(found["source"].values, ("noise", "smoothing"))
    kelvins = np.sqrt((found["effect"].values[own].astype(np.float64) ** 2).sum(axis=0))
    temperature = found["temperature"].values
    return np.asarray(kelvins * band.slope(temperature) / band.radiance(temperature))


def _continued(values: Array, own: NDArray[np.bool_]) -> Array:
    """Return the values of a zone's cells, continued beyond it by those of the nearest cells."""
    if not own.any():
        return np.ones_like(values)
    nearest = distance_transform_edt(~own, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def _labels(shapes: ShapedObject, raster: Raster) -> Labels:
    return shapes.look_up(*_centres(raster))[0]


def _centres(raster: Raster) -> tuple[Array, Array]:
    x, y = np.meshgrid(raster.x, raster.y)
    return x, y


def _mean(values: Array) -> float:
    """Return the mean of the known values; 0 if all are unknown (a zone outside the image)."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else 0.0


def _extent(raster: Raster) -> str:
    left, right, bottom, top = (f"{1e6 * edge:.4g}" for edge in raster.extent)
    return f"x {left} to {right} um, y {bottom} to {top} um"


def _far(parts: Sequence[KnownPart], means: Sequence[float]) -> Iterator[str]:
    """Yield a warning for each zone far from the temperatures of its emissivity."""
    for part, mean in zip(parts, means, strict=True):
        measured = () if part.line is None else part.line.temperatures
        if not measured or not mean:
            continue
        low, high = min(measured), max(measured)
        away = max(low - mean, mean - high)
        if away > FAR:
            ends = (f"{end - ZERO_CELSIUS:.0f} °C" for end in dict.fromkeys((low, high)))
            yield (
                f"{part.name}: its emissivity was determined {away:.0f} K away, at "
                f"{' to '.join(ends)}; u does not include the error of the extrapolation."
            )
