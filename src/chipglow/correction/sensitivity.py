"""Changes of the corrected radiance by each source of uncertainty."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf
from typing import Final

import numpy as np
from scipy.ndimage import gaussian_filter

from chipglow.camera import ImageFormation, MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.psf import FWHM_PER_SIGMA
from chipglow.correction.cells import Parts
from chipglow.correction.posterior import Posterior
from chipglow.correction.prior import local_mean
from chipglow.correction.zones import ObservedObject
from chipglow.quantities import Array
from chipglow.radiometry import Band
from chipglow.uncertainty import Estimate

DRAWS: Final = 12
"""Draws of each random field: a standard uncertainty from 12 draws has a relative one of 20 %,
which Student's factor of 12 degrees of freedom contains."""

BIAS_FACTOR: Final = 2.0
"""Standard uncertainty of smoothing in units of the estimated bias of the solution.

The bias is estimated from the solution itself, which is smoother than the truth. With this factor
the intervals at known outlines held 95 % on 30 scenes for tuning of ``benchmarks/correction.py``.
"""

_WIDTH_STEP: Final = 0.01
"""Relative change of the width of the point spread function for derivatives."""

_PSF_DRAWS: Final = 6
"""Draws of the point spread function within its uncertainty."""

_LEAST_DATA: Final = 1e-4
"""Smallest number of data for a part: below it, a detail would be larger than 100 cells."""


@dataclass(frozen=True, eq=False)
class Effect:
    """Changes of the parts' values (error, part) by errors of one standard uncertainty each."""

    source: str
    changes: Array
    degrees_of_freedom: float = inf


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Knowledge of camera, object and surroundings, with standard uncertainties."""

    observed: ObservedObject
    band: Band
    psf_uncertainty: float
    """Relative standard uncertainty of the width of the point spread function."""
    outline_uncertainty: float
    """Standard uncertainty of the position of the outlines in m, in each direction."""
    surroundings: Estimate
    """Temperature of the surroundings in K."""


def noise_effect(posterior: Posterior, generator: np.random.Generator) -> tuple[Effect, Array]:
    """Return the effect of the noise, by draws, and the data that determine each part.

    The number of data is the diagonal of the resolution matrix H⁻¹ Gᵀ W G, estimated by the same
    draws and averaged over neighbours.
    """
    right_sides = [posterior.noise_response(generator) for _ in range(DRAWS)]
    effect = _drawn("noise", posterior, right_sides)
    products = np.stack(right_sides) * effect.changes * np.sqrt(DRAWS)
    parts = posterior.problem.parts
    data = local_mean(products.mean(axis=0), parts.cell, parts.cells.shape)
    return effect, np.maximum(data, _LEAST_DATA)


def smoothing_effect(posterior: Posterior, generator: np.random.Generator) -> Effect:
    """Return the effect of the unknown curvatures, by draws of the prior."""
    curvatures = [posterior.prior_response(generator) for _ in range(DRAWS)]
    return _drawn("smoothing", posterior, curvatures)


def _drawn(source: str, posterior: Posterior, right_sides: list[Array]) -> Effect:
    changes = posterior.drawn_all(right_sides)
    return Effect(source, changes / np.sqrt(len(right_sides)), len(right_sides))


def systematic_effects(
    posterior: Posterior, known: Knowledge, calibration: list[Array]
) -> Iterator[Effect]:
    """Yield the effects of systematic errors: of emissivity, point spread function and others."""
    for source, changes in systematic_images(posterior, known, calibration).items():
        if changes:
            yield Effect(source, posterior.changed_all(changes))


def systematic_images(
    posterior: Posterior, known: Knowledge, calibration: list[Array]
) -> dict[str, list[Array]]:
    """Return the changes of the image by systematic errors of one standard uncertainty each."""
    return {
        "emissivity": list(_emissivity_images(posterior, known)),
        "psf": list(_psf_images(posterior, known)),
        "calibration": calibration,
        "surroundings": list(_surroundings_images(posterior, known)),
        "border": _border_images(posterior),
        "range": _range_images(posterior),
    }


def texture_effect(
    posterior: Posterior, known: Knowledge, generator: np.random.Generator
) -> Iterator[Effect]:
    """Yield the effect of the texture of the emissivity, by draws of a field of its grain."""
    zones = known.observed.zones
    if not any(zone.texture for zone in zones):
        return
    parts = posterior.problem.parts
    images = []
    for _ in range(DRAWS):
        relative = np.zeros(parts.size)
        for number, zone in enumerate(zones):
            own = np.flatnonzero(parts.zone == number)
            if zone.texture and own.size:
                field = _grainy_field(zone.grain, parts, generator)
                relative[own] = zone.texture * field[parts.cell[own]] / parts.emissivity[own]
        images.append(posterior.seen(posterior.sent * relative))
    changes = posterior.changed_all(images)
    yield Effect("texture", changes / np.sqrt(DRAWS), DRAWS)


def _grainy_field(grain: float, parts: Parts, generator: np.random.Generator) -> Array:
    """Return a random field on the cells, of mean 0, standard deviation 1 and a length in m."""
    width = grain / parts.cells.spacing / FWHM_PER_SIGMA
    field = gaussian_filter(generator.standard_normal(parts.cells.shape), width, mode="wrap")
    return np.asarray(field / field.std()).ravel()


def _emissivity_images(posterior: Posterior, known: Knowledge) -> Iterator[Array]:
    """Yield the change of the image by the common error of each zone's emissivity."""
    parts = posterior.problem.parts
    reflected = float(known.band.radiance(known.surroundings.values))
    for number, zone in enumerate(known.observed.zones):
        if zone.uncertainty and (parts.zone == number).any():
            relative = np.where(parts.zone == number, zone.uncertainty / parts.emissivity, 0.0)
            own = posterior.sent - parts.area * parts.emissivity * reflected
            yield posterior.seen(own * relative)


def _psf_images(posterior: Posterior, known: Knowledge) -> Iterator[Array]:
    """Yield changes of the image by the width and the stated components of the PSF."""
    formation = posterior.problem.formation
    psf = formation.psf
    if psf is None:
        return
    if known.psf_uncertainty:
        wide, narrow = (
            _image_with(posterior, _stretched(psf, 1 + sign * _WIDTH_STEP, formation))
            for sign in (1, -1)
        )
        yield (wide - narrow) * known.psf_uncertainty / (2 * _WIDTH_STEP)
    if isinstance(psf, MeasuredPSF) and psf.components:
        generator = np.random.default_rng(0)
        plain = _image_with(posterior, replace(psf, components=()))
        for _ in range(_PSF_DRAWS):
            error = sum(
                component.effects @ generator.standard_normal(component.cause.errors)
                for component in psf.components
            )
            weights = psf.weights + np.reshape(error, psf.weights.shape) / np.sqrt(_PSF_DRAWS)
            changed = MeasuredPSF(np.maximum(weights, 0.0), psf.spacing, includes=psf.includes)
            yield _image_with(posterior, changed) - plain


def _stretched(
    psf: PointSpreadFunction, factor: float, formation: ImageFormation
) -> PointSpreadFunction:
    """Return a point spread function with all lengths multiplied by a factor."""
    spacing = formation.samples.spacing / 4
    return MeasuredPSF(psf.kernel(spacing), spacing * factor, includes=psf.includes)


def _image_with(posterior: Posterior, psf: PointSpreadFunction) -> Array:
    """Return the image of the solution with another point spread function."""
    problem = posterior.problem
    image = replace(problem.formation, psf=psf).forward(posterior.light)
    if problem.beyond is not None:
        image += problem.beyond.image(posterior.beyond, psf)
    return image


def _surroundings_images(posterior: Posterior, known: Knowledge) -> Iterator[Array]:
    uncertainty = float(known.surroundings.standard_uncertainty)
    if uncertainty:
        slope = float(known.band.slope(known.surroundings.values))
        parts = posterior.problem.parts
        yield posterior.seen(parts.area * (1 - parts.emissivity)) * slope * uncertainty


def _range_images(posterior: Posterior) -> list[Array]:
    """Return the change if all pixels below the range are brighter by a standard deviation."""
    image = posterior.problem.image
    return [np.where(image.under_range, image.noise, 0.0)] if image.under_range.any() else []


def _border_images(posterior: Posterior) -> list[Array]:
    """Return the change of the image by the radiance beyond each side of it."""
    beyond = posterior.problem.beyond
    return [] if beyond is None else beyond.errors(posterior.beyond)
