"""Changes of the corrected radiance by each source of uncertainty."""

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from math import inf
from typing import Final

import numpy as np
from scipy.ndimage import gaussian_filter

from chipglow.camera import ImageFormation, MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.psf import FWHM_PER_SIGMA
from chipglow.correction.cells import Parts, cut_cells
from chipglow.correction.posterior import Posterior
from chipglow.correction.prior import local_mean
from chipglow.correction.zones import Motion, ObservedObject
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

_OUTLINE_STEP: Final = 0.03
"""Displacement of the outlines in pixels for derivatives; cells are cut to 1/8192 of a pixel."""

_OUTLINE_ERROR: Final = 0.04
"""Smallest standard uncertainty in pixels of a found position: no chip is evenly smooth.

Outlines of 40 analytic scenes for tuning of ``benchmarks/correction.py`` erred by 0.01 pixels
(median), the worst one of a clear outline by 0.07.
"""

_CELLS_ALIKE: Final = 9.0
"""Number of cells with similar bends, though the prior takes each for independent.

With a ninth of the information, 28 of 29 outlines in cuts for tuning were within two standard
uncertainties of the truth; with all of it 22.
"""

_RESPONSE_TOLERANCE: Final = 1e-2
"""Relative error of the solution's response to a motion, which counts in the second order."""

_CELL_ERROR: Final = 0.003
"""Standard uncertainty in pixels of an outline by the cells, also of one whose position is exact.

Images by cells half as wide as a pixel err by up to 0.07 K beside an outline, as much as by such a
displacement.
"""

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


@dataclass(frozen=True, eq=False)
class OutlineFit:
    """The motion of the outlines, from their present position, that the image shows."""

    motion: Motion
    root: Array
    """Motions in m (turns at `_turn_radius`) of one standard uncertainty each, (3, direction)."""
    standard_uncertainty: Motion

    turn_radius: float
    """Distance in m at which `root` states turns."""

    def moves(self, least: float) -> bool:
        """Return whether the outlines move by `least` standard uncertainties or more.

        Along a straight outline, where nothing shows its position, this is a large motion.
        """
        lengths = np.array(astuple(self.motion)) * (1.0, 1.0, self.turn_radius)
        return bool(np.linalg.norm(np.linalg.solve(self.root, lengths)) >= least)

    def shown(self, most: float) -> Array:
        """Return the directions (right, up) in which the standard uncertainty is below `most` m."""
        variances, directions = np.linalg.eigh((self.root @ self.root.T)[:2, :2])
        return np.asarray(directions.T[variances < most**2])

    def doubted(self, shift: Array) -> "OutlineFit":
        """Return the fit if the outlines may as well be displaced by `shift` (right, up) in m."""
        covariance = self.root @ self.root.T
        covariance[:2, :2] += np.outer(shift, shift) / 4
        return _outline_fit(self.motion, covariance, self.turn_radius)


@dataclass(frozen=True, eq=False)
class LinearErrors:
    """Systematic errors that are estimated with the outlines' position."""

    images: Sequence[Array]
    """Changes of the image by one standard uncertainty each."""
    responses: Array
    """Changes of the solution by those of the image, (error, part)."""
    parts: Parts

    @classmethod
    def of(cls, posterior: Posterior, images: Sequence[Array]) -> "LinearErrors":
        responses = posterior.changed_all(images, _RESPONSE_TOLERANCE)
        return cls(images, responses, posterior.problem.parts)

    def responses_at(self, parts: Parts) -> Array:
        """Return the responses at the parts of other outlines, without solving again."""
        responses = [self.parts.continued(one, parts) for one in self.responses]
        return np.reshape(responses, (len(self.images), parts.size))


def fit_outline(posterior: Posterior, known: Knowledge, systematic: LinearErrors) -> OutlineFit:
    """Estimate the motion of the outlines together with the radiance, linearised.

    The image shows the position where the radiance changes across an outline. Where it does not,
    the stated uncertainty remains. A motion is not larger than that uncertainty. The `systematic`
    errors are estimated too: they may look like a motion.
    """
    turn_radius = _turn_radius(posterior.problem.parts)
    motions = _motion_images(posterior, known)
    images = [*motions, *systematic.images]
    of_motions = posterior.changed_all(motions, _RESPONSE_TOLERANCE)
    others = systematic.responses_at(posterior.problem.parts)
    responses = np.concatenate([of_motions, others])
    weights, changes = posterior.pixel_weights, np.stack(images)
    unexplained = changes - np.stack([posterior.seen_change(one) for one in responses])
    # These sums over data and prior depend on errors of the responses in the second order only.
    information = np.tensordot(weights * unexplained, unexplained, ((1, 2), (1, 2)))
    information += responses @ (posterior.bending @ responses.T)
    slope = np.tensordot(changes, weights * posterior.residual) - responses @ posterior.gradient
    deviations = np.ones(len(images))
    deviations[:3] = known.outline_uncertainty
    scale = np.array([1.0, 1.0, 1 / turn_radius])
    former = np.zeros(len(images))
    former[:3] = np.array(astuple(known.observed.motion)) / scale
    covariance = np.linalg.inv(information / _CELLS_ALIKE + np.diag(deviations**-2.0))
    motion = (covariance @ (slope / _CELLS_ALIKE - former / deviations**2))[:3]
    # Without an outline in the image, the motion is zero.
    motion *= known.outline_uncertainty / max(np.abs(motion).max(), known.outline_uncertainty)
    least = _OUTLINE_ERROR * posterior.problem.parts.pixels.spacing
    covariance = covariance[:3, :3] + least**2 * np.eye(3)
    return _outline_fit(Motion(*(motion * scale)), covariance, turn_radius)


def _outline_fit(motion: Motion, covariance: Array, turn_radius: float) -> OutlineFit:
    """Return the fit of a motion with its covariance in m², turns at their radius."""
    spread = np.sqrt(np.diag(covariance)) / (1.0, 1.0, turn_radius)
    root = np.asarray(np.linalg.cholesky((covariance + covariance.T) / 2), np.float64)
    return OutlineFit(motion, root, Motion(*spread), turn_radius)


def outline_effect(posterior: Posterior, known: Knowledge, fit: OutlineFit | None) -> Effect:
    """Return the effect of the remaining uncertainty of the outlines' position.

    Without a fit, the position is exact but for the cells.
    """
    images = np.stack(_motion_images(posterior, known))
    least = _CELL_ERROR * posterior.problem.parts.pixels.spacing
    errors = least * images if fit is None else np.tensordot(fit.root.T, images, axes=1)
    return Effect("outline", -posterior.changed_all(list(errors)))


def _turn_radius(parts: Parts) -> float:
    """Return the distance in m at which a turn is as large as a shift: a quarter of the image."""
    return max(parts.pixels.shape) * parts.pixels.spacing / 4


def _motion_images(posterior: Posterior, known: Knowledge) -> list[Array]:
    """Return the changes of the image with a motion to the right, up and with a turn, per m."""
    parts = posterior.problem.parts
    step = _OUTLINE_STEP * parts.pixels.spacing
    motion, scale = np.array(astuple(known.observed.motion)), (1.0, 1.0, _turn_radius(parts))
    images = []
    for direction in np.eye(3):
        ahead, behind = (
            known.observed.moved(Motion(*(motion + sign * step * direction / scale)))
            for sign in (1.0, -1.0)
        )
        change = _image_of_moved(posterior, ahead) - _image_of_moved(posterior, behind)
        images.append(np.asarray(change / (2 * step)))
    return images


def _image_of_moved(posterior: Posterior, observed: ObservedObject) -> Array:
    """Return the image of moved zones whose fields stay and continue into new cells."""
    problem = posterior.problem
    parts = cut_cells(observed, problem.parts.pixels)
    x = problem.parts.continued(posterior.x, parts)
    light = parts.spread(x) @ (parts.area * parts.emissivity * np.exp(parts.at_centroids @ x))
    return problem.formation.forward(light.reshape(parts.cells.shape))
