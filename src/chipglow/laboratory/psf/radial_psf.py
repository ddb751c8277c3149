"""A round point spread function from edges, which departs from a model as far as data ask.

The light is shared among rings about the point. Each ring has a known edge-spread function, so
that the fractions follow from the measured one by least squares: the inversion of Abel's integral.
Alone that would blow up the noise. No fraction is negative, and the difference to the best model
changes as smoothly from ring to ring as the data let it: what the data do not show, as the finest
of the core and the farthest of the tails, is the model's.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
import xarray as xr
from scipy.optimize import nnls

from chipglow.camera import MeasuredPSF
from chipglow.laboratory.psf.psf_fit import ApertureSignals, EdgePixels, ModelFit
from chipglow.laboratory.psf.psf_models import (
    disc_response,
    disc_transfer,
    edge_response,
    sampled_kernel,
)
from chipglow.quantities import Array
from chipglow.uncertainty import Cause, Component, Estimate

FIT: Final = "psf fit"
"""Name of the component of uncertainty that the noise of the images makes."""

_KEPT: Final = 0.9999
"""Fraction of the variance of the fractions that the kernel's fewer errors hold."""

_RINGS: Final = 32
_SMOOTHNESS: Final[list[float]] = np.geomspace(1e2, 1e-4, 13).tolist()
_ROUGHER: Final = 4
_REPEATS: Final = 24


def psf_cause(name: str, content: Array, errors: int) -> Cause:
    """Return a cause of errors of one point spread function, the same in another run."""
    return Cause(name, hashlib.sha256(content.tobytes()).hexdigest()[:16], errors)


def kernel_component(name: str, effects: Sequence[Array]) -> Component:
    """Return a component of uncertainty from its effects on a kernel."""
    columns = np.stack([one.ravel() for one in effects], axis=1)
    return Component(psf_cause(name, columns, len(effects)), columns)


@dataclass(frozen=True, eq=False)
class RadialPSF:
    """A round point spread function of the optics, ring by ring."""

    edges: Array
    """Radii in m that limit the rings, from 0, shape (n + 1,)."""
    estimate: Estimate
    """Fraction of the light in each ring, shape (n,); what is missing to 1 lies beyond. Its
    component `FIT` is by the noise, and by how much the fractions change when they are let be
    rougher.
    """
    model: Array
    """Fraction of the light of the best model in each ring, shape (n,)."""
    smoothness: float

    @property
    def fractions(self) -> Array:
        """Array of `estimate`."""
        return self.estimate.values

    @property
    def wider(self) -> float:
        """By how much its full width at half maximum is over that of the best model in m.

        Both are read from the rings, so that what these are too coarse for drops out.
        """
        return _ring_width(self.edges, self.fractions) - _ring_width(self.edges, self.model)

    @property
    def radius(self) -> Array:
        """Middles of the rings in m."""
        return (self.edges[1:] + self.edges[:-1]) / 2

    @property
    def density(self) -> Array:
        """Light per area in 1/m²."""
        return self.fractions / (np.pi * np.diff(self.edges**2))

    @property
    def encircled(self) -> Estimate:
        """Fraction of the light within each of the radii `edges`."""
        return self.estimate.linear(np.tri(self.edges.size, self.fractions.size, -1))

    def psf(self) -> MeasuredPSF:
        """Return the kernel with its uncertainty, straight lines between the rings' middles."""
        kernel, spacing = self._kernel(self.fractions)
        (found,) = self.estimate.components
        directions, sizes, _ = np.linalg.svd(found.effects, full_matrices=False)
        kept = 1 + int(np.searchsorted(np.cumsum(sizes**2), _KEPT * np.sum(sizes**2)))
        errors = (directions * sizes)[:, :kept]
        component = kernel_component(FIT, [self._kernel(error)[0] for error in errors.T])
        return MeasuredPSF(kernel, spacing, (component,))

    def model_psf(self) -> MeasuredPSF:
        """Return the same kernel of the best model: with what the rings are too coarse for."""
        return MeasuredPSF(*self._kernel(self.model))

    def _kernel(self, fractions: Array) -> tuple[Array, float]:
        """Return the kernel of light that is shared among the rings so, and its spacing in m."""
        radius, density = self.radius, fractions / np.diff(self.edges**2)

        def at(x: Array, y: Array) -> Array:
            return np.interp(np.hypot(x, y), radius, density, right=0.0)

        return sampled_kernel(at, float(self.edges[-1]), float(self.edges[1]))


def radial_psf(
    fit: ModelFit,
    edges: Sequence[EdgePixels],
    curves: Sequence[xr.Dataset],
    apertures: ApertureSignals | None,
    generator: np.random.Generator,
) -> RadialPSF:
    """Invert edge-spread functions and signals of apertures.

    The weight of the smoothness is the one with the least sum of squared residuals and twice the
    number of free fractions that it leaves (Mallows, 1973). What it hides is
    estimated by the change with a hundredth of that weight. The repeats draw the model too.
    """
    radii = _radii(fit, edges)
    design, left = _rows(fit, edges, curves, apertures, radii)
    penalty = _penalty(radii, _core(fit, edges))
    fractions_by = _shares_by(fit, radii)
    model = fractions_by(fit.values)
    # Light of the model beyond the last ring stays in it.
    data, beyond = left + design @ model, 1.0 - float(model.sum())
    solutions = [_solved(design, data, weight * penalty, model) for weight in _SMOOTHNESS]
    criteria = [
        _criterion(design, data, weight * penalty, solution)
        for weight, solution in zip(_SMOOTHNESS, solutions, strict=True)
    ]
    chosen = int(np.argmin(criteria))
    weight = _SMOOTHNESS[chosen]
    repeats = []
    for values in _drawn(fit, edges, generator):
        fractions = fractions_by(values)
        noisy = left + generator.standard_normal(left.size) + design @ fractions
        repeats.append(_solved(design, noisy, weight * penalty, fractions))
    rougher = solutions[min(chosen + _ROUGHER, len(solutions) - 1)]
    all_fractions = np.array([solutions[chosen], rougher, *repeats])
    all_fractions /= all_fractions.sum(axis=1, keepdims=True) + beyond
    component = Component(
        psf_cause(FIT, all_fractions, len(all_fractions) - 1), _effects(all_fractions)
    )
    return RadialPSF(radii, Estimate(all_fractions[0], (component,)), model, weight)


def _ring_width(edges: Array, fractions: Array) -> float:
    """Return twice the largest radius in m with half of the largest density."""
    radius, density = (edges[1:] + edges[:-1]) / 2, fractions / np.diff(edges**2)
    half = density.max() / 2
    last = int(np.flatnonzero(density >= half)[-1])
    if last + 1 == radius.size:
        return 2 * float(radius[-1])
    fraction = (density[last] - half) / (density[last] - density[last + 1])
    return 2 * float(radius[last] + fraction * (radius[last + 1] - radius[last]))


def _drawn(fit: ModelFit, edges: Sequence[EdgePixels], generator: np.random.Generator) -> Array:
    """Draw the model's parameters as of other noise, shape (repeat, parameter)."""
    values, vectors = np.linalg.eigh(fit.covariance)
    spread = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = fit.values + generator.standard_normal((_REPEATS, values.size)) @ spread.T
    low, high = fit.model.bounds(edges[0].pitch, edges[0].reach)
    return np.asarray(np.clip(drawn, low, high))


def _effects(values: Array) -> Array:
    """Return what the repeats (rows 2 on) and the rougher solution (row 1) change."""
    repeats = values[2:]
    away = (repeats - repeats.mean(axis=0)) / np.sqrt(len(repeats) - 1)
    return np.concatenate([[values[1] - values[0]], away]).T.copy()


def _radii(fit: ModelFit, edges: Sequence[EdgePixels]) -> Array:
    """Return the limits of the rings: even in the core, in proportion to the radius beyond."""
    core = _core(fit, edges)
    last = 0.8 * min(edge.reach for edge in edges)
    return core * np.sinh(np.linspace(0.0, np.arcsinh(last / core), _RINGS + 1))


def _core(fit: ModelFit, edges: Sequence[EdgePixels]) -> float:
    return max(fit.fwhm, 0.5 * min(edge.pitch for edge in edges)) / 2


def _rows(
    fit: ModelFit,
    edges: Sequence[EdgePixels],
    curves: Sequence[xr.Dataset],
    apertures: ApertureSignals | None,
    radii: Array,
) -> tuple[Array, Array]:
    """Return the design and the model's residuals of bins and apertures, over the noise."""
    rows, data = [], []
    for found, pixels, one in zip(fit.edges, edges, curves, strict=True):
        uncertainty = one["esf_uncertainty"].values
        columns = [
            edge_response(
                partial(_ring_transfer, radii, k),
                found.line.normal,
                pixels.footprint,
                pixels.reach,
            )(one["distance"].values)
            for k in range(radii.size - 1)
        ]
        rows.append(np.array(columns).T / uncertainty[:, None])
        data.append(one["esf_residual"].values / uncertainty)
    if apertures is not None:
        transfers = [_ring_transfer(radii, k, apertures.frequency) for k in range(radii.size - 1)]
        sigma = apertures.sigma / fit.source
        rows.append((apertures.weights @ np.array(transfers).T) / sigma[:, None])
        fractions = apertures.weights @ fit.model.mean_transfer(fit.values, apertures.frequency)
        left = (apertures.radiance - fit.aperture_background) / fit.source - fractions
        data.append(left / sigma)
    return np.concatenate(rows), np.concatenate(data)


def _ring_transfer(radii: Array, k: int, frequency: Array) -> Array:
    """Return the transfer function of an even ring."""
    inner, outer = radii[k], radii[k + 1]
    whole = outer**2 * disc_transfer(frequency * outer) - inner**2 * disc_transfer(
        frequency * inner
    )
    return np.asarray(whole / (outer**2 - inner**2))


def _penalty(radii: Array, width: float) -> Array:
    """Return the second differences from ring to ring; beyond the last one there is nothing.

    They are those of the density in the core, which is flat there, and of the density times the
    square of the radius in the tails, in which the density alone would be too small to be smoothed.
    """
    middles = (radii[1:] + radii[:-1]) / 2
    weighted = np.diag((middles**2 + width**2) / np.diff(radii**2))
    padded = np.concatenate([weighted[:1], weighted, np.zeros((1, middles.size))])
    return np.diff(padded, n=2, axis=0) * 1e3


def _shares_by(fit: ModelFit, radii: Array) -> Callable[[Array], Array]:
    """Return a function of a model's parameters for its light in each ring."""
    frequency = np.arange(0.0, 6 / fit.fwhm, 1 / (32 * float(radii[-1])))
    middle = np.zeros(1)
    encircled = np.array(
        [disc_response(frequency, 2 * radius, middle, 0.0) for radius in radii.tolist()]
    )
    rings = np.diff(encircled, axis=0)
    return lambda values: np.maximum(rings @ fit.model.mean_transfer(values, frequency), 0.0)


def _solved(design: Array, data: Array, penalty: Array, model: Array) -> Array:
    matrix = np.concatenate([design, penalty])
    wanted = np.concatenate([data, penalty @ model])
    # The normal equations are small, whatever the number of bins.
    normal = matrix.T @ matrix
    factor = np.linalg.cholesky(normal + 1e-12 * np.trace(normal) * np.eye(len(normal)))
    solution, _ = nnls(factor.T, np.linalg.solve(factor, matrix.T @ wanted))
    return np.asarray(solution)


def _criterion(design: Array, data: Array, penalty: Array, fractions: Array) -> float:
    """Return squared residuals plus twice the trace of the smoother."""
    left = data - design @ fractions
    free = fractions > 0
    normal = design[:, free].T @ design[:, free]
    smooth = penalty[:, free].T @ penalty[:, free]
    return float(left @ left + 2 * np.trace(np.linalg.solve(normal + smooth, normal)))
