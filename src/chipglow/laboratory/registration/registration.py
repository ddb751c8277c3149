"""Where a point of the infrared image is in the visible picture, and how surely."""

from dataclasses import dataclass, field
from math import ceil, hypot
from typing import Final, Literal, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares
from scipy.special import fdtrc

from chipglow.quantities import Array, Brief
from chipglow.scene import Raster
from chipglow.scene.lines import nearest
from chipglow.text import Notes

Model: TypeAlias = Literal["similarity", "affine", "homography"]
Method: TypeAlias = Literal["points", "dots"]

_PARAMETERS: Final = {"similarity": 4, "affine": 6, "homography": 8}
"""Free parameters of each model."""

_MIN_WIDTH_RATIO: Final = 0.01
"""Smallest width over length of points that do not count as on a line."""

_WORST_CONDITION: Final = 1e6
"""Largest condition number at which points determine the model."""

_MISPLACED_LEVEL: Final = 0.01
"""Significance level of the test for misplaced points, over all points."""

_EXACT_FIT: Final = 1e-9
"""Scatter in the normalised coordinates below which residuals are rounding errors."""

_BEST_PICKED: Final = 0.02
"""Scatter in visible pixels under which points are not picked: that of dots' middles."""


@dataclass(frozen=True)
class Registration:
    """A map from the infrared image onto the visible picture.

    A position (x, y) in m becomes (column, row) = (X / W, Y / W) with
    (X, Y, W) = `matrix` (x, y, 1). Columns and rows count from 0 in the middle of the upper left
    pixel.
    """

    matrix: Array
    """Shape (3, 3), its last element 1."""
    covariance: Array
    """Covariance of the elements of the matrix, row by row, shape (9, 9)."""
    model: Model
    method: Method
    degrees_of_freedom: float
    """Degrees of freedom of the covariance, for Student's t."""
    notes: Notes = field(default_factory=Notes)
    """Assumptions, and reasons why it may be wrong."""

    def __post_init__(self) -> None:
        for name, shape in (("matrix", (3, 3)), ("covariance", (9, 9))):
            value = getattr(self, name)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"registration: {name}: expected finite numbers, shape {shape}")
        if self.matrix[2, 2] != 1.0:
            raise ValueError(
                f"registration: matrix: its last element is {self.matrix[2, 2]:g}, expected 1"
            )
        if not abs(np.linalg.det(self.matrix)) > 0:
            raise ValueError("registration: matrix: must have an inverse")
        if not self.degrees_of_freedom > 0:
            raise ValueError(
                f"registration: degrees_of_freedom {self.degrees_of_freedom!r} must be positive"
            )

    def pixels(self, positions: ArrayLike) -> Array:
        """Return columns and rows in the visible picture of positions x, y in m, (..., 2)."""
        return _mapped_places(self.matrix, np.asarray(positions, np.float64))

    def positions(self, pixels: ArrayLike) -> Array:
        """Return positions x, y in m of columns and rows of the visible picture, (..., 2)."""
        back = np.asarray(np.linalg.inv(self.matrix), np.float64)
        return _mapped_places(back, np.asarray(pixels, np.float64))

    def pixel_covariance(self, positions: ArrayLike) -> Array:
        """Return the covariance of `pixels` in pixels², shape (..., 2, 2)."""
        slope = _element_slopes(self.matrix, np.asarray(positions, np.float64))
        return slope @ self.covariance @ np.swapaxes(slope, -1, -2)

    def position_covariance(self, positions: ArrayLike) -> Array:
        """Return the covariance in m² of the position found for the pixel of each position."""
        back = np.linalg.inv(self.jacobian(positions))
        return back @ self.pixel_covariance(positions) @ np.swapaxes(back, -1, -2)

    def jacobian(self, positions: ArrayLike) -> Array:
        """Return the derivative of column and row by x and y at positions, (..., 2, 2)."""
        places = np.asarray(positions, np.float64)
        depth = _depth(self.matrix, places)[..., None, None]
        pixels = self.pixels(places)[..., None]
        return (self.matrix[:2, :2] - pixels * self.matrix[2, :2]) / depth

    def uncertainty(self, raster: Raster) -> tuple[float, float]:
        """Return median and largest standard uncertainty in m, of x and y together."""
        variance = np.trace(self.position_covariance(raster.centres), axis1=-2, axis2=-1)
        found = np.sqrt(np.maximum(variance, 0.0))
        return float(np.median(found)), float(found.max())

    def geometry(self, raster: Raster) -> tuple[float, float, bool]:
        """Return the size of a visible pixel in m, its turn in degrees, and if it is mirrored."""
        left, right, bottom, top = raster.extent
        slope = self.jacobian(np.array([(left + right) / 2, (bottom + top) / 2]))
        area = float(np.linalg.det(slope))
        turn = float(np.degrees(np.arctan2(-slope[1, 0] * np.sign(area), slope[0, 0])))
        return 1 / float(np.sqrt(abs(area))), turn, area > 0

    def warp(self, image: NDArray[np.floating], raster: Raster, shape: tuple[int, int]) -> Array:
        """Return an infrared image as the visible camera would have it."""
        rows, columns = np.indices(shape)
        return nearest(image, raster, self.positions(np.stack([columns, rows], axis=-1)))


@dataclass(frozen=True, repr=False)
class PointFit(Brief):
    """A registration from points that were seen in both images."""

    registration: Registration
    residuals: Array
    """Found less given column and row of each point in visible pixels, shape (n, 2)."""
    scatter: float
    """Standard deviation of a point's column or row in visible pixels: of both pickings."""
    misplaced: NDArray[np.bool_]
    """Whether a point lies farther off than the others make likely, shape (n,)."""
    positions: Array
    pixels: Array
    """The points: x and y in m, and column and row in the visible picture, each of shape (n, 2)."""

    def to_frame(self) -> pd.DataFrame:
        """Return a table of the points."""
        return pd.DataFrame(
            {
                "point": np.arange(1, len(self.positions) + 1),
                "x_um": 1e6 * self.positions[:, 0],
                "y_um": 1e6 * self.positions[:, 1],
                "visible_column": self.pixels[:, 0],
                "visible_row": self.pixels[:, 1],
                "residual": np.hypot(*self.residuals.T),
            }
        )


def fit_points(
    positions: ArrayLike, pixels: ArrayLike, model: Model = "affine", *, picked: bool = True
) -> PointFit:
    """Register two images by points that are seen in both.

    Parameters
    ----------
    positions : array_like
        x and y in m in the infrared image, shape (n, 2).
    pixels : array_like
        Column and row in the visible picture, shape (n, 2).
    model : {"similarity", "affine", "homography"}
        Turn and scale, mirrored or not; or with shear; or with perspective.
    picked : bool
        Whether people picked the points: it is a warning if they agree better than anyone can.

    Raises
    ------
    ValueError
        If there are too few points for the model and its uncertainty, or they lie on a line.

    Notes
    -----
    Least squares of the distances in the visible picture, from the direct linear solution in
    normalised coordinates (Hartley and Zisserman, Multiple View Geometry, 2nd ed., 4.1 and 4.4);
    the uncertainty comes from the residuals, so one point more than the model needs is required.
    A point is misplaced if the F test of its residual against the scatter of the other points
    (the externally studentised residual) is beyond 1 % over all points.
    """
    given, seen = _checked(positions, pixels, model)
    frame = _NormalisedFrame.around(given, seen)
    found, target = frame.unit(given), frame.unit_pixels(seen)
    orientations = (False, True) if model == "similarity" else (False,)
    basis, residual, slope, matrix = min(
        (_least(found, target, model, mirrored) for mirrored in orientations),
        key=lambda fit: float(fit[1] @ fit[1]),
    )
    freedom = residual.size - basis.shape[1]
    if np.linalg.cond(slope) > _WORST_CONDITION:
        raise ValueError(
            f"points: they leave the {model} open, expected {_least_points(model)} or more that "
            "are apart, no three on a line"
        )
    variance = float(residual @ residual) / freedom
    inverse = np.linalg.inv(slope.T @ slope)
    misplaced = _misplaced(residual, slope @ inverse @ slope.T, variance, freedom)
    full, spread = frame.undone(matrix, basis @ (variance * inverse) @ basis.T)
    residuals = residual.reshape(-1, 2) * frame.pixel_scale
    warnings = [
        f"Point {i + 1} is {hypot(*residuals[i]):.3g} visible pixels from where the others expect "
        "it."
        for i in np.flatnonzero(misplaced)
    ]
    scatter = float(np.sqrt(variance)) * frame.pixel_scale
    if picked and scatter < _BEST_PICKED:
        warnings.append(
            f"The points agree to {scatter:.1g} visible pixels, better than anyone picks them: "
            "they may be computed from each other, and the resulting uncertainty is too small."
        )
    notes = Notes(warnings=warnings)
    registration = Registration(full, spread, model, "points", float(freedom), notes)
    return PointFit(registration, residuals, scatter, misplaced, given, seen)


@dataclass(frozen=True)
class _NormalisedFrame:
    """Coordinates in which the numbers of a registration are of the order of 1."""

    centre: Array
    """x and y in m that become 0."""
    scale: float
    """Length in m that becomes 1; y is turned round, so that it grows down as rows do."""
    pixel_centre: Array
    """Column and row that become 0."""
    pixel_scale: float
    """Visible pixels that become 1."""

    @classmethod
    def around(cls, positions: Array, pixels: Array) -> "_NormalisedFrame":
        """Return the middle of points, and their distance from it, in both images."""
        centre, pixel_centre = positions.mean(axis=0), pixels.mean(axis=0)
        scale = float(np.sqrt(((positions - centre) ** 2).sum(axis=1).mean()))
        pixel_scale = float(np.sqrt(((pixels - pixel_centre) ** 2).sum(axis=1).mean()))
        return cls(centre, scale, pixel_centre, pixel_scale)

    def unit(self, positions: Array) -> Array:
        """Return positions in these coordinates."""
        return (positions - self.centre) / self.scale * [1.0, -1.0]

    def unit_pixels(self, pixels: Array) -> Array:
        """Return columns and rows in these coordinates."""
        return (pixels - self.pixel_centre) / self.pixel_scale

    def undone(self, matrix: Array, covariance: Array) -> tuple[Array, Array]:
        """Return a matrix in these coordinates, and its covariance, for m and pixels."""
        x, y = self.centre / self.scale
        before = np.array([[1 / self.scale, 0, -x], [0, -1 / self.scale, y], [0, 0, 1]])
        column, row = self.pixel_centre
        after = np.array([[self.pixel_scale, 0, column], [0, self.pixel_scale, row], [0, 0, 1]])
        whole = after @ matrix @ before
        full = whole / whole[2, 2]
        slope = np.kron(after, before.T)
        slope = (slope - np.outer(full, slope[8])) / whole[2, 2]
        return full, slope @ covariance @ slope.T


def _parameter_basis(model: Model, mirrored: bool) -> Array:
    """Return the elements of a matrix by a model's parameters, but for the last one's 1; (9, k)."""
    if model != "similarity":
        return np.eye(9)[:, : _PARAMETERS[model]]
    sign = -1.0 if mirrored else 1.0
    basis = np.zeros((9, 4))
    basis[[0, 4], 0] = 1.0, sign
    basis[[1, 3], 1] = -sign, 1.0
    basis[2, 2] = basis[5, 3] = 1.0
    return basis


def _least(
    found: Array, target: Array, model: Model, mirrored: bool
) -> tuple[Array, Array, Array, Array]:
    """Return basis, residuals, their slopes and the matrix of the least squares."""
    basis, last = _parameter_basis(model, mirrored), np.eye(3)[2]

    def matrix_of(parameters: Array) -> Array:
        return (basis @ parameters).reshape(3, 3) + np.outer(last, last)

    def residual(parameters: Array) -> Array:
        return (_mapped_places(matrix_of(parameters), found) - target).ravel()

    def slope(parameters: Array) -> Array:
        return (_element_slopes(matrix_of(parameters), found) @ basis).reshape(-1, basis.shape[1])

    begin = _direct(found, target, basis)
    # Few parameters: the fit ends at rounding errors.
    fit = least_squares(residual, begin, slope, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return basis, residual(fit.x), slope(fit.x), matrix_of(fit.x)


def _direct(found: Array, target: Array, basis: Array) -> Array:
    """Return the direct linear solution: X − column W = 0 and Y − row W = 0."""
    slopes = _element_slopes(np.eye(3), found)
    slopes[..., 6:8] = -target[..., None] * found[:, None]
    return np.asarray(np.linalg.lstsq((slopes @ basis).reshape(target.size, -1), target.ravel())[0])


def _checked(positions: ArrayLike, pixels: ArrayLike, model: Model) -> tuple[Array, Array]:
    given, seen = np.asarray(positions, np.float64), np.asarray(pixels, np.float64)
    if model not in _PARAMETERS:
        raise ValueError(f"model: {model!r}, expected {', '.join(_PARAMETERS)}")
    if given.ndim != 2 or given.shape[1:] != (2,) or given.shape != seen.shape:
        raise ValueError(f"points: shapes {given.shape} and {seen.shape}, expected (n, 2) twice")
    if not (np.isfinite(given).all() and np.isfinite(seen).all()):
        raise ValueError("points: a value is not finite, expected numbers")
    least = _least_points(model)
    if len(given) < least:
        raise ValueError(
            f"points: {len(given)} for the model {model!r}, expected {least} or more: one more "
            "than it needs, so that the residuals show the uncertainty"
        )
    for name, points in (("infrared image", given), ("visible picture", seen)):
        _, lengths, _ = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        if not lengths[1] > _MIN_WIDTH_RATIO * lengths[0]:
            raise ValueError(
                f"points: in the {name} they lie on a line, expected points spread in both "
                "directions"
            )
    return given, seen


def _least_points(model: Model) -> int:
    return ceil(_PARAMETERS[model] / 2) + 1


def _misplaced(residual: Array, hat: Array, variance: float, freedom: int) -> NDArray[np.bool_]:
    """Do the F test of every point against the scatter of the others, 1 % over all points."""
    count = residual.size // 2
    misplaced = np.zeros(count, np.bool_)
    for i in range(count if freedom > 2 and variance > _EXACT_FIT**2 else 0):
        part = slice(2 * i, 2 * i + 2)
        own = float(residual[part] @ np.linalg.solve(np.eye(2) - hat[part, part], residual[part]))
        others = max(variance * freedom - own, 0.0) / (freedom - 2)
        ratio = own / 2 / others if others > 0 else np.inf
        misplaced[i] = fdtrc(2, freedom - 2, ratio) < _MISPLACED_LEVEL / count
    return misplaced


def _depth(matrix: Array, places: Array) -> Array:
    return np.asarray(places @ matrix[2, :2] + matrix[2, 2])


def _mapped_places(matrix: Array, places: Array) -> Array:
    """Return places mapped by a matrix, shape (..., 2)."""
    return (places @ matrix[:2, :2].T + matrix[:2, 2]) / _depth(matrix, places)[..., None]


def _element_slopes(matrix: Array, places: Array) -> Array:
    """Return the derivative of mapped places by the matrix elements, shape (..., 2, 9)."""
    whole = np.concatenate([places, np.ones((*places.shape[:-1], 1))], axis=-1)
    whole = whole / _depth(matrix, places)[..., None]
    slopes = np.zeros((*places.shape, 9))
    slopes[..., 0, 0:3] = slopes[..., 1, 3:6] = whole
    slopes[..., 6:9] = -_mapped_places(matrix, places)[..., None] * whole[..., None, :]
    return slopes
