"""From measured frames to the true temperature of each pixel, with its uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse
from scipy.special import stdtrit

from chipglow.camera import Camera, Flag, Measurement, check_camera
from chipglow.camera.image import image_formation
from chipglow.correction.beyond import Beyond
from chipglow.correction.cells import CELLS_PER_PIXEL, Parts, cut_cells
from chipglow.correction.correction import Correction, CorrectionFlag, joined
from chipglow.correction.noise import noise_of
from chipglow.correction.outline import OutlineFit, find_outlines, outline_effect
from chipglow.correction.posterior import Image, Problem
from chipglow.correction.sensitivity import (
    BIAS_FACTOR,
    Effect,
    Knowledge,
    noise_effect,
    smoothing_effect,
    systematic_effects,
    texture_effect,
)
from chipglow.correction.zones import Motion, ObservedObject, ShapedObject, Zone, check_tools
from chipglow.laboratory.emissivity import reflected_temperature
from chipglow.quantities import Array
from chipglow.radiometry import Band
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.text import Notes
from chipglow.uncertainty import Estimate

_MODEL_ERROR: Final = 3e-4
"""Relative standard uncertainty of the predicted image.

Images of analytic fields by cells of half a pixel differ by 0.01 K to 0.07 K from those by samples
of a twenty-fourth of a pixel: up to 3e-4 of the radiance.
"""

_READINGS: Final = 256
"""Readings below the range of which the mean is taken; an integral, to 1 %."""

_BORDER: Final = 3
"""Width in pixels of the border whose values depend on radiance from beyond the image."""

_MARGIN: Final = 4
"""Pixels beyond the image on each side whose radiance is unknown too.

Their light reaches the image; within them the radiance continues as smoothly as in the image.
"""

_LEVEL: Final = 0.95
"""Probability of the expanded uncertainties."""


def correct(
    measurement: Measurement,
    camera: Camera,
    zones: Sequence[Zone] | ObservedObject,
    *,
    psf_uncertainty: float = 0.0,
    outline_uncertainty: float = 0.0,
    surroundings: Estimate | None = None,
    noise: float | None = None,
    seed: int = 2010,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Correct measured frames for emissivity, reflection, blur and footprint.

    Parameters
    ----------
    measurement : Measurement
        Frames of a real or of a simulated camera.
    camera : Camera
        Point spread function, its order, fill factor and further optics. Band and pitch must be
        those of the measurement.
    zones : sequence of Zone, or ObservedObject
        Emissivities and outlines of the parts of the object; where zones overlap, the later one
        counts.
    psf_uncertainty : float
        Relative standard uncertainty of the width of the point spread function, in addition to
        the stated components of a measured one.
    outline_uncertainty : float
        Standard uncertainty of the position of the outlines in m. If it is positive, the position
        is estimated from each frame.
    surroundings : Estimate, optional
        Temperature of the surroundings in K; 293 K without uncertainty by default.
    noise : float, optional
        Standard deviation of the noise in K at 600 K. By default it follows from the measurement's
        detector, or is estimated from the frame.
    seed : int
        Seed of the draws by which uncertainties are propagated.
    progress : callable, optional
        Called with the completed fraction. An exception raised here ends the computation.

    Returns
    -------
    Correction
        Temperature of each pixel with interval, contributions and flags.

    Raises
    ------
    ValueError
        If band or pitch differ, a tool is outside the image, no emissivity is known, or a frame
        has no pixel within the range.

    Notes
    -----
    The unknown is the logarithm of the blackbody radiance on cells of half a pixel, cut by the
    outlines. It minimises ½ Σ (y − A g)² / σ² + ½ Σ w (D x)² (Gauss-Newton with preconditioned
    conjugate gradients); A forms the image, D are second differences within zones, and their
    weights w follow from the data around each place by expectation maximisation. Beyond the image
    the radiance continues, with slopes that fade over 16 pixels, and falls back to a low level;
    that light has a relative standard uncertainty of 100 %. The bias of the prior is estimated from
    the solution and corrected twice. Uncertainties are propagated by the linearised solution:
    systematic errors by one change each, random fields by draws. The temperature belongs to the
    mean radiance over pixel and exposure.
    """
    if isinstance(zones, ObservedObject):
        observed = zones
    else:
        check_tools([zone.shape for zone in zones], measurement.raster)
        observed = ShapedObject(tuple(zones), measurement.raster)
    _check(measurement, camera, observed, psf_uncertainty, outline_uncertainty)
    known = Knowledge(
        observed,
        measurement.band,
        psf_uncertainty,
        outline_uncertainty,
        reflected_temperature() if surroundings is None else surroundings,
    )
    frames = [
        _corrected(
            measurement,
            frame,
            camera,
            known,
            noise,
            np.random.default_rng([seed, frame]),
            _part_of(progress, frame, len(measurement)),
        )
        for frame in range(len(measurement))
    ]
    return joined(
        [
            _correction_of(measurement, frame, solved, observed.zones)
            for frame, solved in enumerate(frames)
        ]
    )


def _part_of(
    progress: Callable[[float], None] | None, frame: int, frames: int
) -> Callable[[float], None]:
    if progress is None:
        return lambda fraction: None
    return lambda fraction: progress((frame + fraction) / frames)


def _check(
    measurement: Measurement,
    camera: Camera,
    observed: ObservedObject,
    psf_uncertainty: float,
    outline_uncertainty: float,
) -> None:
    """Raise a ValueError if the correction is not defined."""
    check_camera(measurement, camera)
    if camera.psf is None:
        raise ValueError("correct: the camera has no point spread function; state camera.psf")
    if all(zone.emissivity is None for zone in observed.zones):
        raise ValueError("correct: no zone has a known emissivity")
    for name, value in (
        ("psf_uncertainty", psf_uncertainty),
        ("outline_uncertainty", outline_uncertainty),
    ):
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"correct: {name} is {value!r}, expected 0 or more")


@dataclass(frozen=True, eq=False)
class _Frame:
    """The solution of one frame."""

    parts: Parts
    x: Array
    effects: tuple[Effect, ...]
    image: Image
    resolution: Array
    """Side in m of the square that one datum determines, for each part."""
    misfit: float
    outline: OutlineFit | None
    motion: Motion
    notes: Notes


def _corrected(
    measurement: Measurement,
    frame: int,
    camera: Camera,
    known: Knowledge,
    noise: float | None,
    generator: np.random.Generator,
    progress: Callable[[float], None],
) -> _Frame:
    """Solve one frame, and propagate the uncertainties."""
    room = float(known.surroundings.values)
    inside, notes = _image(measurement, frame, camera, noise, room)
    image = inside.extended(_MARGIN)
    calibration = _calibration_images(measurement, frame)
    fit, former = None, None
    if known.outline_uncertainty:
        first = _problem_and_beyond(image, camera, known, measurement.raster)
        problem_of = partial(_problem, image, camera, measurement.raster.widened(_MARGIN))
        known, fit, former = find_outlines(
            first, known, calibration, problem_of, lambda: progress(0.0)
        )
    problem = _problem_and_beyond(image, camera, known, measurement.raster)
    posterior = problem.solve(generator, lambda: progress(0.0), former)
    progress(0.5)
    bias = posterior.bias()
    noise_changes, data = noise_effect(posterior, generator)
    effects = [
        noise_changes,
        smoothing_effect(posterior, generator),
        Effect("smoothing", BIAS_FACTOR * bias[None]),
        *texture_effect(posterior, known, generator),
        *systematic_effects(posterior, known, calibration),
    ]
    if len(known.observed.zones) > 1:
        effects.append(outline_effect(posterior, known, fit))
    progress(1.0)
    return _Frame(
        posterior.problem.parts,
        posterior.x + bias,
        tuple(effects),
        inside,
        posterior.problem.parts.cells.spacing / np.sqrt(data),
        posterior.misfit,
        fit,
        known.observed.motion,
        notes,
    )


def _calibration_images(measurement: Measurement, frame: int) -> list[Array]:
    """Return changes of the image by errors of the calibration, zero beyond the image."""
    errors = measurement.calibration_errors
    if errors is None:
        return []
    changes = errors.at(np.nan_to_num(measurement.radiance[frame]))
    return [np.pad(change, _MARGIN) for change in changes]


def _image(
    measurement: Measurement, frame: int, camera: Camera, noise: float | None, coldest: float
) -> tuple[Image, Notes]:
    """Return a frame as data: flagged pixels become bounds, or are missing."""
    flags, radiance = measurement.flags[frame], measurement.radiance[frame]
    under = flags & Flag.UNDER_RANGE > 0
    saturated = flags & Flag.SATURATED > 0
    missing = flags & (Flag.DEAD | Flag.REPLACED) > 0
    usable = ~(under | saturated | missing) & np.isfinite(radiance)
    if not usable.any():
        raise ValueError(f"correct: frame {frame} has no pixel within the range")
    limit = measurement.data.attrs.get("lower_limit")
    lowest = float(radiance[usable].min())
    least = lowest if limit is None else float(measurement.band.radiance(float(limit)))
    below, doubt = _below_range(measurement.band, least, coldest)
    known = np.where(under, below, radiance)
    missing |= ~np.isfinite(known)
    deviation, notes = noise_of(measurement, frame, usable, noise)
    deviation = np.hypot(deviation, np.where(under, doubt, 0.0))
    received, gain = _received(np.where(missing, lowest, known), camera, measurement.raster)
    spread = np.hypot(deviation / gain, _MODEL_ERROR * np.abs(received))
    return Image(received, spread, under & ~missing, saturated & ~missing, missing), notes


def _below_range(band: Band, limit: float, coldest: float) -> tuple[float, float]:
    """Return mean and standard deviation of the radiance of pixels below a limit of radiance.

    Any reading in K between the coldest one and the limit is equally probable.
    """
    highest = float(band.temperature(limit))
    readings = np.linspace(min(coldest, highest), highest, _READINGS)
    radiance = band.radiance(readings)
    return float(radiance.mean()), float(radiance.std())


def _received(displayed: Array, camera: Camera, pixels: Raster) -> tuple[Array, Array]:
    """Return the radiance that the pixels received, and the gain from it to the displayed one."""
    dark, unit = np.zeros(pixels.shape), np.ones(pixels.shape)
    for term in camera.optics:
        dark = term.on_pixels(dark, pixels, camera.band)
        unit = term.on_pixels(unit, pixels, camera.band)
    gain = unit - dark
    return (displayed - dark) / gain, gain


def _problem_and_beyond(image: Image, camera: Camera, known: Knowledge, inner: Raster) -> Problem:
    """Return the problem of an image with a margin around the `inner` pixels, and light beyond."""
    problem = _problem(image, camera, inner.widened(_MARGIN), known)
    problem.beyond = Beyond.of(known.observed, problem.parts, problem.formation, inner)
    return problem


def _problem(image: Image, camera: Camera, pixels: Raster, known: Knowledge) -> Problem:
    parts = cut_cells(known.observed, pixels)
    formation = image_formation(camera, parts.cells, pixels=pixels)
    room = float(known.band.radiance(known.surroundings.values))
    cells = parts.cells.rows * parts.cells.columns
    mirrored = np.bincount(parts.cell, parts.area * (1 - parts.emissivity), cells)
    reflected = room * formation.forward(mirrored.reshape(parts.cells.shape))
    return Problem(image, parts, replace(formation, beyond="nothing"), reflected)


def _correction_of(
    measurement: Measurement, frame: int, solved: _Frame, zones: Sequence[Zone]
) -> Correction:
    """Return the solution of one frame on the pixels."""
    pixels, band = measurement.raster, measurement.band
    data = _on_pixels(solved, measurement, frame, zones).expand_dims("time")
    data = data.assign_coords(raster_coordinates(pixels, measurement.times[[frame]]))
    data.attrs = {
        "pitch": pixels.spacing,
        "band_lower": band.lower,
        "band_upper": band.upper,
        "zones": ", ".join(zone.name for zone in zones),
        **solved.notes.attrs(),
    }
    return Correction(data)


def _on_pixels(
    solved: _Frame, measurement: Measurement, frame: int, zones: Sequence[Zone]
) -> xr.Dataset:
    """Return temperatures, intervals and effects of one frame on the pixels."""
    parts, band, shape = solved.parts, measurement.band, solved.parts.pixels.shape
    known = np.array([zone.emissivity is not None for zone in zones])
    zone_of_all = _zone_of_pixels(parts, known, shape)
    mean, zone = _pixel_means(parts, zone_of_all.ravel()), _inside(zone_of_all)
    black = np.exp(parts.at_centroids @ solved.x)

    def on_pixels(values: Array) -> Array:
        return _inside((mean @ values).reshape(shape))

    radiance = np.where(zone < 0, np.nan, on_pixels(black))
    temperature = band.temperature(radiance)
    per_kelvin = np.asarray(band.slope(temperature))
    rows, sources, freedoms = [], [], []
    for effect in solved.effects:
        for change in effect.changes:
            rows.append(on_pixels(black * (parts.at_centroids @ change)))
            sources.append(effect.source)
            freedoms.append(effect.degrees_of_freedom)
    relative = np.stack(rows) / radiance
    uncertainty, freedom = _combined(relative, np.array(sources), np.array(freedoms))
    factor = stdtrit(freedom, (1 + _LEVEL) / 2)
    lower, upper = (
        np.asarray(band.temperature(radiance * np.exp(sign * factor * uncertainty)))
        for sign in (-1.0, 1.0)
    )
    flags = _flags(solved.image, zone)
    below, above = (
        flags & one > 0 for one in (CorrectionFlag.UPPER_BOUND, CorrectionFlag.LOWER_BOUND)
    )
    images: dict[str, tuple[Any, str]] = {
        "temperature": (np.where(below | above, np.nan, temperature), "K"),
        "measured": (measurement.radiance_temperature()[frame], "K"),
        "standard_uncertainty": (uncertainty * radiance / per_kelvin, "K"),
        "lower": (np.where(below, np.nan, lower), "K"),
        "upper": (np.where(above, np.nan, upper), "K"),
        "flags": (flags, "1"),
        "zone": (zone.astype(np.int16), "1"),
        "resolution": (on_pixels(solved.resolution), "m"),
    }
    variables: dict[str, tuple[Any, ...]] = {
        name: (("y", "x"), values, {"units": unit}) for name, (values, unit) in images.items()
    }
    kelvins = (relative * radiance / per_kelvin).astype(np.float32)
    variables["effect"] = ("error", "y", "x"), kelvins, {"units": "K"}
    variables["fine_temperature"] = (
        ("fine_y", "fine_x"),
        _inside(_fine(parts, black, known, band), CELLS_PER_PIXEL),
        {"units": "K"},
    )
    variables["misfit"] = (), solved.misfit, {"units": "1"}
    motion = np.array(astuple(solved.motion))
    spread = (
        np.array(astuple(solved.outline.standard_uncertainty)) if solved.outline else np.zeros(3)
    )
    variables["outline_motion"] = "motion", motion, {"units": "m, m, rad"}
    variables["outline_uncertainty"] = "motion", spread, {"units": "m, m, rad"}
    coordinates = {
        "source": ("error", np.array(sources, dtype=str)),
        "degrees_of_freedom": ("error", np.array(freedoms)),
        "motion": ["right", "up", "turn"],
        "fine_x": ("fine_x", _inside(parts.cells.x, CELLS_PER_PIXEL), {"units": "m"}),
        "fine_y": ("fine_y", _inside(parts.cells.y, CELLS_PER_PIXEL), {"units": "m"}),
    }
    return xr.Dataset(variables, coordinates)


def _inside(extended: NDArray[Any], parts: int = 1) -> NDArray[Any]:
    """Return the measured part of an extended image or axis with `parts` values along a pixel."""
    edge = slice(parts * _MARGIN, -parts * _MARGIN)
    return extended[(edge,) * extended.ndim]


def _zone_of_pixels(
    parts: Parts, known: NDArray[np.bool_], shape: tuple[int, int]
) -> NDArray[np.intp]:
    """Return the zone of known emissivity with the largest area in each pixel; −1 without one."""
    pixels = shape[0] * shape[1]
    areas = np.zeros((known.size, pixels))
    np.add.at(areas, (parts.zone, parts.pixel), parts.area)
    areas[~known] = 0.0
    return np.where(areas.max(axis=0) > 0, areas.argmax(axis=0), -1).reshape(shape)


def _pixel_means(parts: Parts, zone: NDArray[np.intp]) -> Any:
    """Return the sparse array (pixel, part) of means by area over each pixel's zone."""
    own = np.flatnonzero(zone[parts.pixel] == parts.zone)
    sums = np.bincount(parts.pixel[own], parts.area[own], zone.size)
    weights = parts.area[own] / sums[parts.pixel[own]]
    return sparse.csr_array((weights, (parts.pixel[own], own)), shape=(zone.size, parts.size))


def _combined(effects: Array, sources: NDArray[np.str_], freedoms: Array) -> tuple[Array, Array]:
    """Return the standard uncertainty and its degrees of freedom (JCGM 100:2008, G.4.1)."""
    squares = effects**2
    total, fourth = squares.sum(axis=0), np.zeros(effects.shape[1:])
    for source in dict.fromkeys(sources.tolist()):
        own = (sources == source) & np.isfinite(freedoms)
        if own.any():
            fourth += squares[own].sum(axis=0) ** 2 / freedoms[own][0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(total), np.where(fourth > 0, total**2 / fourth, np.inf)


def _flags(image: Image, zone: NDArray[np.intp]) -> NDArray[np.uint8]:
    border = np.ones(zone.shape, np.bool_)
    border[_BORDER:-_BORDER, _BORDER:-_BORDER] = False
    held = {
        CorrectionFlag.UPPER_BOUND: image.under_range,
        CorrectionFlag.LOWER_BOUND: image.lower_bound,
        CorrectionFlag.INTERPOLATED: image.missing,
        CorrectionFlag.NOT_DETERMINED: zone < 0,
        CorrectionFlag.BORDER: border,
    }
    flags = [np.where(mask, flag, 0) for flag, mask in held.items()]
    return np.asarray(np.sum(flags, axis=0), np.uint8)


def _fine(parts: Parts, black: Array, known: NDArray[np.bool_], band: Band) -> Array:
    """Return the temperature in K of the largest part of known emissivity in each cell."""
    order = np.argsort(np.where(known[parts.zone], parts.area, -1.0))
    found = np.full(parts.cells.rows * parts.cells.columns, np.nan)
    determined = order[known[parts.zone[order]]]
    found[parts.cell[determined]] = band.temperature(black[determined])
    return found.reshape(parts.cells.shape).astype(np.float32)
