"""Solutions with the Hessian of a problem, by preconditioned conjugate gradients."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import ImageFormation
from chipglow.correction.batch_formation import BatchFormation, SingleFormation
from chipglow.quantities import Array

_MOST_ITERATIONS: Final = 200
"""Most iterations of conjugate gradients."""

_MOST_CORRECTIONS: Final = 12
"""Most corrections of a solution by its exact residual; each leaves about 1/30 of it."""

_CORRECTION_TOLERANCE: Final = 3e-2
"""Relative error at which a correction ends: the fast formation errs by about as much."""

RIDGE: Final = 1e-8
"""Weak weight of all values, so that parts without data and without neighbours are determined."""


@dataclass(frozen=True, eq=False)
class Hessian:
    """Second derivatives of a problem: light to images and back, and the prior.

    Errors of solutions are measured by their energy eᵀ H e. Its root bounds the error of any value
    or mean in units of its standard uncertainty.
    """

    formation: ImageFormation
    batch: BatchFormation | SingleFormation
    """The same for many fields, in single precision and with approximate light from far."""
    light_change: Any
    """Sparse array (cell, part): the change of the cells' light with the solution."""
    pixel_weights: Array
    """Weights of the data, (y, x)."""
    bending: Any
    """Sparse array (part, part) of the prior."""
    preconditioner: Any
    """Factors of a similar matrix."""

    def solved(self, right: Array, error: float, relative: float = 0.0) -> Array:
        """Solve approximately, with the fast formation of images.

        `right` is (part,) or (part, error). The solution ends at an `error` in standard
        uncertainties, or at one `relative` to the solution.
        """
        columns = right.reshape(right.shape[0], -1)
        target = np.full(columns.shape[1], error**2)
        if relative:
            target = np.maximum(target, relative**2 * self._energy(columns))
        return self._approximate(columns, target).reshape(right.shape)

    def refined(self, right: Array, error: float, relative: float = 0.0) -> Array:
        """Solve as `solved`, and correct by exact residuals until they are small too."""
        columns = right.reshape(right.shape[0], -1)
        solution, residual = np.zeros_like(columns), columns.copy()
        energy = self._energy(residual)
        target = np.maximum(error**2, relative**2 * energy)
        for _ in range(_MOST_CORRECTIONS):
            remains = energy > target
            if not remains.any():
                break
            least = np.maximum(target, _CORRECTION_TOLERANCE**2 * energy)[remains]
            solution[:, remains] += self._approximate(residual[:, remains], least)
            residual[:, remains] = columns[:, remains] - self.product(solution[:, remains])
            energy[remains] = self._energy(residual[:, remains])
        return solution.reshape(right.shape)

    def product(self, changes: Array) -> Array:
        """Return the Hessian times changes of the solution, (part, error)."""
        light = self.light_change @ changes
        for number, column in enumerate(light.T):
            image = self.formation.forward(column.reshape(self.formation.samples.shape))
            light[:, number] = self.formation.adjoint(self.pixel_weights * image).ravel()
        return np.asarray(self.light_change.T @ light + self.bending @ changes + RIDGE * changes)

    def _energy(self, residual: Array) -> Array:
        """Return the energy of the errors of solutions with a residual, for each column."""
        return np.asarray((residual * self.preconditioner.solve(residual)).sum(axis=0))

    def _approximate(self, right: Array, target: Array) -> Array:
        """Return approximate solutions whose errors have at most the energy `target`."""
        return _conjugate_gradients(self._fast_product, self.preconditioner.solve, right, target)

    def _fast_product(self, changes: Array) -> Array:
        # The prior's differences of large numbers need double precision, the light does not.
        light_change, weights = self._single
        images = weights * self.batch.forward(light_change @ changes.astype(np.float32))
        seen = light_change.T @ self.batch.adjoint(images)
        return np.asarray(seen + self.bending @ changes + RIDGE * changes)

    @cached_property
    def _single(self) -> tuple[Any, NDArray[np.float32]]:
        """Change of the light and weights of the pixels in single precision."""
        weights = self.pixel_weights.astype(np.float32).reshape(-1, 1)
        return self.light_change.astype(np.float32), weights


def _conjugate_gradients(
    product: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    target: Array,
) -> Array:
    """Solve for the columns of `right` in step, until their errors have the energy `target`."""
    solution, residual = np.zeros_like(right), right.copy()
    active = np.arange(right.shape[1])
    direction, before = np.zeros_like(right), np.ones(active.size)
    for _ in range(_MOST_ITERATIONS):
        preconditioned = precondition(residual[:, active])
        squares = (residual[:, active] * preconditioned).sum(axis=0)
        remains = squares > target[active]
        if not remains.any():
            break
        active, squares, before = active[remains], squares[remains], before[remains]
        direction = preconditioned[:, remains] + direction[:, remains] * (squares / before)
        image = product(direction)
        step = squares / (direction * image).sum(axis=0)
        solution[:, active] += step * direction
        residual[:, active] -= step * image
        before = squares
    return solution
