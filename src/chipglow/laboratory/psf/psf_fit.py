"""Fit of a model of the optics to the pixels of edges and to the signals of apertures, all at once.

Every pixel is compared with the model at its own distance from the edge, with the pixel's
footprint as it lies to the edge: nothing is binned, so that the edge's angle and place, which are
fitted with the rest, broaden nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import cos, inf, log, pi, sin, sqrt
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from chipglow.camera import PointSpreadFunction
from chipglow.laboratory.psf.edge_line import EdgeLine
from chipglow.laboratory.psf.psf_models import (
    EdgeResponse,
    PSFModel,
    disc_response,
    edge_response,
    is_length,
)
from chipglow.quantities import TINY, Array, Brief

_LEAST_TURN: Final = pi / 18
"""Smallest angle in rad between edges of different orientation."""

_START_WIDTHS: Final = (0.5, 1.0, 1.7, 3.0, 5.0, 9.0)
"""Widths from which the fits start, in pixel pitches."""

_SLOPE_STEP: Final = 1e-5
"""Step of a shape parameter for its slope, in its scale."""

_LEAST_SCALE: Final = 1e-30
"""Smallest divisor of radiances and of squared residuals that are all the same."""

_SINGULAR: Final = 1e-13
"""Eigenvalues below this part of the largest are rounding: a parameter that nothing determines."""

_TOLERANCE: Final = 1e-8
"""Relative change of squares and parameters at which a fit ends: half of the digits."""

_EDGE_PARAMETERS: Final = 4
"""Parameters of an edge: two brightnesses, its place and its turn."""


@dataclass(frozen=True, eq=False, repr=False)
class EdgePixels(Brief):
    """The usable pixels of an image of an edge."""

    x: Array
    y: Array
    """Where they are in m, shape (n,)."""
    radiance: Array
    """In W/(m² sr), shape (n,)."""
    sigma: Array
    """Standard deviation of their noise in W/(m² sr), shape (n,)."""
    pitch: float
    footprint: float
    """Distance between pixels, and side of a pixel's sensitive square, in m."""
    line: EdgeLine

    @cached_property
    def reach(self) -> float:
        """Largest distance from the edge in m."""
        return float(np.abs(self.line.distance(self.x, self.y)).max()) + 4 * self.pitch


@dataclass(frozen=True, eq=False, repr=False)
class ApertureSignals(Brief):
    """Readings of the camera at the centre of bright round apertures before one source."""

    diameters: Array
    """In m, shape (n,)."""
    radiance: Array
    sigma: Array
    """Mean of the middle pixels and its standard uncertainty in W/(m² sr), shape (n,)."""
    radii: tuple[Array, ...]
    """Distances of those pixels from the aperture's middle in m."""
    footprint: float
    """Side of a pixel's sensitive square in m."""
    outside: float
    """Radiance beside the apertures in W/(m² sr): the background, and what tails add to it."""

    @cached_property
    def frequency(self) -> Array:
        """Frequencies in 1/m on which the transfer function is asked for."""
        # Up to the third zero of a pixel, in 32 steps per period of the largest aperture.
        return np.arange(0.0, 3 / self.footprint, 1 / (16 * float(self.diameters.max())))

    @cached_property
    def weights(self) -> Array:
        """Return the matrix from a transfer function to signals, shape (aperture, frequency)."""
        pairs = zip(self.diameters, self.radii, strict=True)
        return np.array(
            [disc_response(self.frequency, d, radii, self.footprint) for d, radii in pairs]
        )


@dataclass(frozen=True)
class FittedEdge:
    """Results of a fit for one edge."""

    line: EdgeLine
    normal_uncertainty: float
    """Standard uncertainty of its direction in rad."""
    background: float
    step: float
    """Radiance of the dark side, and how much brighter the other is, in W/(m² sr)."""
    step_uncertainty: float


@dataclass(frozen=True, eq=False, repr=False)
class ModelFit(Brief):
    """A model of the optics fitted to edges and apertures."""

    model: PSFModel
    values: Array
    covariance: Array
    """Their covariance; what the residuals show beyond the noise is in it."""
    fwhm: float
    fwhm_uncertainty: float
    """Full width at half maximum of the optics, and its uncertainty by this model, in m."""
    edges: tuple[FittedEdge, ...]
    source: float
    aperture_background: float
    """Radiance of the source above the background, and that in W/(m² sr); NaN without any."""
    vector: Array
    """All fitted parameters: those of the model, of the edges and of the apertures."""
    chi_square: float
    """Sum of the squared residuals over their noise."""
    count: int
    """Number of pixels and apertures."""
    reduced_chi_squared: float
    """Squared residuals of the means at a distance over their noise: 1 if only noise is left."""

    @property
    def free(self) -> int:
        """Number of parameters."""
        return self.vector.size

    @property
    def bic(self) -> float:
        """The Bayesian information criterion."""
        return self.count * log(self.chi_square / self.count) + (self.free + 1) * log(self.count)

    @property
    def uncertainties(self) -> Array:
        """Standard uncertainties of the parameters."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def psf(self) -> PointSpreadFunction:
        """Return the optics' point spread function."""
        return self.model.psf(self.values)

    def response(self, edge: int, pixels: EdgePixels) -> EdgeResponse:
        """Return the edge-spread function of optics and pixel for one of the edges, from 0 to 1."""
        return _response(self.model, self.values, self.edges[edge].line, pixels)

    def predicted(self, edge: int, pixels: EdgePixels) -> Array:
        """Return the radiance of an edge's pixels in W/(m² sr)."""
        found = self.edges[edge]
        distance = found.line.distance(pixels.x, pixels.y)
        return found.background + found.step * self.response(edge, pixels)(distance)


def fit_model(
    model: PSFModel,
    edges: Sequence[EdgePixels],
    apertures: ApertureSignals | None = None,
    start: ModelFit | None = None,
    tolerance: float = _TOLERANCE,
    tries: int = 1,
) -> ModelFit:
    """Fit by weighted least squares with the edges' places, backgrounds and steps free."""
    problem = _Problem(model, tuple(edges), apertures)
    starts = problem.starts()[:tries] if start is None else [start.vector]
    ends = [problem.least(vector, tolerance) for vector in starts]
    return problem.fitted(min(ends, key=problem.cost))


class _Problem:
    """Residuals and their derivatives by the model's, the edges' and the apertures' parameters."""

    def __init__(
        self, model: PSFModel, edges: tuple[EdgePixels, ...], apertures: ApertureSignals | None
    ) -> None:
        self.model, self.edges, self.apertures = model, edges, apertures
        self.shapes = len(model.parameters)
        limits = np.cumsum([0, *(edge.x.size for edge in edges)])
        self.rows = [slice(first, last) for first, last in pairwise(limits)]
        pitch = min(edge.pitch for edge in edges)
        low, high = model.bounds(pitch, max(edge.reach for edge in edges))
        scales = [pitch if is_length(name) else 1.0 for name in model.parameters]
        for edge in edges:
            contrast = max(float(np.ptp(edge.radiance)), TINY)
            scales += [contrast, contrast, edge.pitch, edge.pitch / edge.reach]
            low, high = low + [-inf] * _EDGE_PARAMETERS, high + [inf] * _EDGE_PARAMETERS
        if apertures is not None:
            outside = apertures.outside
            contrast = float(apertures.radiance.max()) - outside
            # Else a small change between large apertures could be that of a huge source.
            low += [outside - 0.5 * contrast, 0.5 * contrast]
            high += [outside + 0.1 * contrast, 2.0 * contrast]
            scales += [max(float(np.ptp(apertures.radiance)), _LEAST_SCALE)] * 2
        self.low, self.high, self.scales = np.array(low), np.array(high), np.array(scales)

    def least(self, vector: Array, tolerance: float) -> Array:
        """Return the parameters with the least squares near some others."""
        low, high = self.low / self.scales, self.high / self.scales
        result = least_squares(
            lambda v: self.residual(v * self.scales),
            np.clip(vector / self.scales, low + 1e-9, high - 1e-9),  # a start within the bounds
            jac=lambda v: self.jacobian(v * self.scales) * self.scales,
            bounds=(low, high),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            max_nfev=60,
        )
        return np.asarray(result.x * self.scales)

    def cost(self, vector: Array) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residual(vector) ** 2))

    def starts(self) -> list[Array]:
        """Return some parameters to begin with, those first that fit best as they are."""
        pitch = max(edge.pitch for edge in self.edges)
        low, high = self.low[: self.shapes], self.high[: self.shapes]
        candidates = [
            self._beginning(np.clip(values, low, high))
            for width in _START_WIDTHS
            for values in self.model.starts(width * pitch)
        ]
        return sorted(candidates, key=self.cost)

    def residual(self, vector: Array) -> Array:
        """Return measured minus modelled values over the noise."""
        values, places, source = self._split(vector)
        parts = []
        for edge, place in zip(self.edges, places, strict=True):
            line = _line(place)
            fractions = _response(self.model, values, line, edge)(line.distance(edge.x, edge.y))
            parts.append((edge.radiance - (place[0] + place[1] * fractions)) / edge.sigma)
        if self.apertures is not None:
            modelled = source[0] + source[1] * self._fractions(values)
            parts.append((self.apertures.radiance - modelled) / self.apertures.sigma)
        return np.concatenate(parts)

    def jacobian(self, vector: Array) -> Array:
        """Return the derivative of the residuals by the parameters."""
        values, places, _ = self._split(vector)
        here = self.residual(vector)
        result = np.zeros((here.size, vector.size))
        columns = iter(range(self.shapes, vector.size))
        for edge, place, rows in zip(self.edges, places, self.rows, strict=True):
            line = _line(place)
            distance = line.distance(edge.x, edge.y)
            response = _response(self.model, values, line, edge)
            slope = place[1] * response.slope(distance)
            turned = edge.y * cos(line.normal) - edge.x * sin(line.normal)
            for value in (np.ones_like(slope), response(distance), -slope, slope * turned):
                result[rows, next(columns)] = -value / edge.sigma
        if self.apertures is not None:
            rows = slice(self.rows[-1].stop, None)
            result[rows, next(columns)] = -1 / self.apertures.sigma
            result[rows, next(columns)] = -self._fractions(values) / self.apertures.sigma
        for k in range(self.shapes):
            shift = _SLOPE_STEP * self.scales[k] * (1 if vector[k] < self.high[k] / 2 else -1)
            moved = vector.copy()
            moved[k] += shift
            result[:, k] = (self.residual(moved) - here) / shift
        return result

    def fitted(self, vector: Array) -> ModelFit:
        """Return the result, with uncertainties from the residuals."""
        residual, jacobian = self.residual(vector), self.jacobian(vector)
        reduced = self._reduced_chi_squared(vector, residual)
        scaled = jacobian * self.scales
        inverse = np.linalg.pinv(scaled.T @ scaled, rcond=_SINGULAR, hermitian=True)
        inverse = inverse * np.outer(self.scales, self.scales)
        # Residuals beyond the noise count as more noise (Birge).
        noise = float(residual @ residual) / max(residual.size - vector.size, 1)
        covariance = inverse * max(reduced, 1.0) * noise
        values, places, source = self._split(vector)
        inner = covariance[: self.shapes, : self.shapes]
        gradient = self._fwhm_gradient(values)
        _, spreads, _ = self._split(np.sqrt(np.maximum(np.diag(covariance), 0.0)))
        return ModelFit(
            self.model,
            values,
            inner,
            self.model.fwhm(values),
            sqrt(max(float(gradient @ inner @ gradient), 0.0)),
            tuple(
                FittedEdge(_line(place), spread[3], place[0], place[1], spread[1])
                for place, spread in zip(places.tolist(), spreads.tolist(), strict=True)
            ),
            float(source[1]) if source.size else np.nan,
            float(source[0]) if source.size else np.nan,
            vector,
            float(residual @ residual),
            residual.size,
            reduced,
        )  # fmt: skip

    def _split(self, vector: Array) -> tuple[Array, Array, Array]:
        """Return the parameters of the model, of the edges (edge, 4) and of the apertures."""
        last = self.shapes + _EDGE_PARAMETERS * len(self.edges)
        edges = vector[self.shapes : last].reshape(-1, _EDGE_PARAMETERS)
        return vector[: self.shapes], edges, vector[last:]

    def _fwhm_gradient(self, values: Array) -> Array:
        gradient = np.empty(self.shapes)
        for k in range(self.shapes):
            shift = 1e-3 * self.scales[k]
            above, below = values.copy(), values.copy()
            above[k] = min(values[k] + shift, self.high[k])
            below[k] = max(values[k] - shift, self.low[k])
            change = self.model.fwhm(above) - self.model.fwhm(below)
            gradient[k] = change / (above[k] - below[k])
        return gradient

    def _reduced_chi_squared(self, vector: Array, residual: Array) -> float:
        """Return the squared mean residuals at a distance over their noise, per freedom."""
        total, bins = 0.0, 0
        for edge, place, rows in zip(self.edges, self._split(vector)[1], self.rows, strict=True):
            part, distance = residual[rows], _line(place).distance(edge.x, edge.y)
            # Bins of a quarter of a pitch, as of ISO 12233.
            index = np.floor((distance - distance.min()) / (edge.pitch / 4)).astype(np.int64)
            count = np.bincount(index)
            sums = np.bincount(index, part)
            there = count >= 2
            variance = max(float(part.var()), _LEAST_SCALE)
            total += float(np.sum(sums[there] ** 2 / count[there])) / variance
            bins += int(there.sum())
        return total / max(bins - vector.size, 1)

    def _fractions(self, values: Array) -> Array:
        """Return the signals of the apertures as fractions of an endless source's."""
        assert self.apertures is not None
        return self.apertures.weights @ self.model.mean_transfer(values, self.apertures.frequency)

    def _beginning(self, values: Array) -> Array:
        """Return all parameters for some of the model, backgrounds and steps by least squares."""
        parts = [values]
        for edge in self.edges:
            response = _response(self.model, values, edge.line, edge)
            fractions = response(edge.line.distance(edge.x, edge.y))
            step, background = np.polyfit(fractions, edge.radiance, 1, w=1 / edge.sigma)
            parts.append(np.array([background, step, edge.line.position, edge.line.normal]))
        if self.apertures is not None:
            signals = self.apertures
            line = np.polyfit(self._fractions(values), signals.radiance, 1, w=1 / signals.sigma)
            parts.append(np.clip(line[::-1], self.low[-2:], self.high[-2:]))
        return np.concatenate(parts)


def _line(place: Sequence[float] | Array) -> EdgeLine:
    return EdgeLine(float(place[3]), float(place[2]))


def with_noise(edge: EdgePixels, predicted: Array) -> EdgePixels:
    """Return the pixels with a noise whose variance is a line between those of the two sides."""
    span = float(np.ptp(predicted))
    fraction = (predicted - predicted.min()) / max(span, TINY)
    square = (edge.radiance - predicted) ** 2
    sides = [fraction < 0.5, fraction >= 0.5]
    # The means of both sides, taken at the sides' own mean brightness.
    means = [
        (float(fraction[side].mean()), float(square[side].mean())) for side in sides if side.any()
    ]
    slope = 0.0
    if len(means) == 2:
        slope = (means[1][1] - means[0][1]) / max(means[1][0] - means[0][0], 1e-3)
    variance = means[0][1] + slope * (fraction - means[0][0])
    # Each pixel has some noise: 2 % of the mean variance, or the rounding of 32-bit numbers.
    least = max(0.02 * float(square.mean()), (1e-7 * span) ** 2, TINY)
    return replace(edge, sigma=np.sqrt(np.maximum(variance, least)))


def _response(model: PSFModel, values: Array, line: EdgeLine, edge: EdgePixels) -> EdgeResponse:
    return edge_response(model, tuple(values), line.normal, edge.footprint, edge.reach)


def orientations(edges: Sequence[EdgePixels]) -> list[float]:
    """Return the directions of the edges' normals, 0 to π, at least 10 degrees apart."""
    found: list[float] = []
    for edge in edges:
        direction = edge.line.normal % pi
        apart = [abs((direction - other + pi / 2) % pi - pi / 2) for other in found]
        if min(apart, default=pi) >= _LEAST_TURN:
            found.append(direction)
    return found
