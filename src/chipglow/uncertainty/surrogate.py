"""A surrogate of a slow model: the polynomial that predicts left-out points best."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from chipglow.quantities import Array

_FORMS: Final[dict[str, Callable[[Array], Array]]] = {
    "constant": lambda x: np.ones((len(x), 1)),
    "plane": lambda x: np.column_stack([np.ones(len(x)), x]),
    "squares": lambda x: np.column_stack([np.ones(len(x)), x, x**2]),
    "quadratic": lambda x: np.column_stack(
        [np.ones(len(x)), x, x**2, *(a[:, None] * b[:, None] for a, b in combinations(x.T, 2))]
    ),
}
"""Terms of the polynomials, shape (point, term), by points of shape (point, input)."""


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A polynomial of standardised inputs for one output.

    Parameters
    ----------
    form : str
        constant, plane, squares (with the square of each input) or quadratic.
    coefficients : ndarray
        Coefficients of its terms.
    error : float
        Root mean square of the errors at the points, each left out of the fit that predicts it.
    """

    form: str
    coefficients: Array
    error: float

    @classmethod
    def fit(cls, points: Array, values: Array) -> "Surrogate":
        """Return the form with the smallest error, fitted to points (point, input) and values."""
        fits = []
        for form, terms in _FORMS.items():
            matrix = terms(points)
            rank = np.linalg.matrix_rank(matrix)
            if rank < matrix.shape[1] or len(points) <= matrix.shape[1] + 1:
                continue
            inverse = np.linalg.pinv(matrix)
            leverage = np.einsum("ij,ji->i", matrix, inverse)
            coefficients = inverse @ values
            left_out = (values - matrix @ coefficients) / (1 - leverage)
            fits.append(cls(form, coefficients, float(np.sqrt(np.mean(left_out**2)))))
        if not fits:
            raise ValueError(f"surrogate: {len(points)} points, expected 3 or more")
        return min(fits, key=lambda one: one.error)

    def at(self, points: Array) -> Array:
        """Return the values at points of shape (point, input)."""
        return np.asarray(_FORMS[self.form](points) @ self.coefficients)
