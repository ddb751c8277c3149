"""The position of the outlines: found in the image, with its uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from itertools import chain
from typing import Final, TypeAlias

import numpy as np

from chipglow.correction.cells import Parts, cut_cells
from chipglow.correction.posterior import Posterior, Problem
from chipglow.correction.sensitivity import Effect, Knowledge, systematic_images
from chipglow.correction.zones import Motion, ObservedObject
from chipglow.quantities import Array

_OUTLINE_ROUNDS: Final = 25
"""Most rounds in which the outlines move to fit the image; 2 to 5 are usual, far away up to 15."""

_OUTLINE_FOUND: Final = 0.5
"""Last motion of the outlines in standard uncertainties: the next one would be a tenth of it."""

_ELSEWHERE: Final = 0.5, 0.8
"""Distances in pixels at which a second minimum is looked for.

In analytic scenes, where there is one, it is 0.5 to 0.8 pixels from the outline, and the loss is
less than there within 0.15 pixels of the outline."""

_FAR_LESS: Final = 0.67
"""Loss relative to that of a found position from which on another one is the right one.

In scenes with a second minimum it was 0.4; at a gap in a cut, places farther and farther behind
the edge had 0.85 to 0.95 of the loss at the outline."""

_LEVEL_FACTOR: Final = 2.0
"""Standard uncertainties within which positions are looked for: 95 % of them."""

_OUTLINE_STILL: Final = 0.005
"""Mean displacement in pixels that changes nothing: outlines may slide along themselves."""

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

_RESPONSE_TOLERANCE: Final = 1e-3
"""Relative error of the solution's response to a motion: at 1e-2, uncertainties erred by 8 %."""

_CELL_ERROR: Final = 0.003
"""Standard uncertainty in pixels of an outline by the cells, also of one whose position is exact.

Images by cells half as wide as a pixel err by up to 0.07 K beside an outline, as much as by such a
displacement.
"""


ProblemOf: TypeAlias = Callable[[Knowledge], Problem]
"""Return the problem of an image with known outlines."""


@dataclass(frozen=True, eq=False)
class OutlineFit:
    """The motion of the outlines, from their present position, that the image shows."""

    motion: Motion
    covariance: Array
    """Covariance of the motion to the right, up and of the turn at `turn_radius`, in m²."""
    turn_radius: float
    """Distance in m at which `covariance` states turns."""

    @property
    def root(self) -> Array:
        """Motions in m of one standard uncertainty each, (3, direction)."""
        symmetric = (self.covariance + self.covariance.T) / 2
        return np.asarray(np.linalg.cholesky(symmetric), np.float64)

    @property
    def standard_uncertainty(self) -> Motion:
        return Motion(*(np.sqrt(np.diag(self.covariance)) / (1.0, 1.0, self.turn_radius)))

    def moves(self, least: float) -> bool:
        """Return whether the outlines move by `least` standard uncertainties or more.

        Along a straight outline, where nothing shows its position, this is a large motion.
        """
        lengths = np.array(astuple(self.motion)) * (1.0, 1.0, self.turn_radius)
        return bool(np.linalg.norm(np.linalg.solve(self.root, lengths)) >= least)

    def shown(self, most: float) -> Array:
        """Return the directions (right, up) in which the standard uncertainty is below `most` m."""
        variances, directions = np.linalg.eigh(self.covariance[:2, :2])
        return np.asarray(directions.T[variances < most**2])

    def doubted(self, shift: Array) -> "OutlineFit":
        """Return the fit if the outlines may as well be displaced by `shift` (right, up) in m."""
        covariance = self.covariance.copy()
        covariance[:2, :2] += np.outer(shift, shift) / 4
        return replace(self, covariance=covariance)


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


def find_outlines(
    first: Problem,
    known: Knowledge,
    calibration: list[Array],
    problem_of: ProblemOf,
    check: Callable[[], None],
) -> tuple[Knowledge, OutlineFit, Posterior]:
    """Move the outlines from those of the `first` problem to where the image shows them.

    The prior is nearly even: weights that follow from the data would admit, where an outline is
    wrong, the bends of the radiance that this error causes.

    The search may end at a second minimum. Where the loss is less at a place beside it, another
    search begins there. If that one ends at a far smaller loss, its end counts; if the loss is a
    little smaller, as a gap behind the edge can make it, the uncertainty contains that place too.
    """
    posterior = first.smooth_robustly(check)
    images = [*chain(*systematic_images(posterior, known, calibration).values())]
    systematic = LinearErrors.of(posterior, images)
    found, fit, posterior = _moved_to_fit(posterior, known, systematic, problem_of, check)
    for shift in _shifts_elsewhere(found, fit, first.parts.pixels.spacing):
        elsewhere = _shifted(found, shift)
        other = problem_of(elsewhere).smooth_robustly(check, posterior)
        if other.robust_loss >= posterior.robust_loss:
            continue
        second = _moved_to_fit(other, elsewhere, systematic, problem_of, check)
        _, _, there = second
        if there.robust_loss < _FAR_LESS * posterior.robust_loss:
            return second
        fit = fit.doubted(shift)
    return found, fit, posterior


def _moved_to_fit(
    posterior: Posterior,
    known: Knowledge,
    systematic: LinearErrors,
    problem_of: ProblemOf,
    check: Callable[[], None],
) -> tuple[Knowledge, OutlineFit, Posterior]:
    """Move the outlines until they fit the image."""
    for _ in range(_OUTLINE_ROUNDS):
        fit = fit_outline(posterior, known, systematic)
        observed = known.observed.moved(_added(known.observed.motion, fit.motion))
        known = replace(known, observed=observed)
        if not fit.moves(_OUTLINE_FOUND):
            break
        problem = problem_of(known)
        if posterior.problem.parts.displacement(problem.parts) < _OUTLINE_STILL:
            break
        posterior = problem.smooth_robustly(check, posterior)
    return known, fit, posterior


def _shifts_elsewhere(known: Knowledge, fit: OutlineFit, pitch: float) -> list[Array]:
    """Return the shifts (right, up) in m to places where a second minimum may be.

    They are those along which the image shows the position, within the stated uncertainty.
    """
    motion = np.array([known.observed.motion.right, known.observed.motion.up])
    most = _LEVEL_FACTOR * known.outline_uncertainty
    shifts = [
        sign * distance * pitch * direction
        for direction in fit.shown(known.outline_uncertainty / 2)
        for distance in _ELSEWHERE
        for sign in (1.0, -1.0)
    ]
    return [shift for shift in shifts if np.linalg.norm(motion + shift) < most]


def _shifted(known: Knowledge, shift: Array) -> Knowledge:
    motion = _added(known.observed.motion, Motion(*shift))
    return replace(known, observed=known.observed.moved(motion))


def _added(one: Motion, other: Motion) -> Motion:
    return Motion(one.right + other.right, one.up + other.up, one.turn + other.turn)


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
    return OutlineFit(Motion(*(motion * scale)), covariance, turn_radius)


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
