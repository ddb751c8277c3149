"""Oversampled edge-spread function of an image, and the line-spread function and MTF it gives."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.laboratory.psf.psf_fit import EdgePixels, ModelFit
from chipglow.laboratory.psf.psf_models import footprint_transfer
from chipglow.quantities import Array

BINS_PER_PITCH: Final = 4
_WINDOW_PITCHES: Final = 10.0
_WINDOW_WIDTHS: Final = 5.0
_FREQUENCIES: Final = 65


@dataclass(frozen=True, eq=False)
class EdgeSpread:
    """Edge-spread function: the mean of the pixels at each distance from the edge."""

    distance: Array
    """Mean distance of a bin's pixels from the edge in m, shape (n,)."""
    value: Array
    uncertainty: Array
    """Their mean, 0 for the dark and 1 for the bright side, and its standard uncertainty."""
    residual: Array
    """What the fitted model leaves of the value."""
    count: NDArray[np.int64]
    width: float
    """Width of a bin in m."""


@dataclass(frozen=True, eq=False)
class LineSpread:
    """Line-spread function: the derivative of the edge-spread function."""

    distance: Array
    """Distance from the edge in m, shape (n,)."""
    value: Array
    uncertainty: Array
    """In 1/m, and its standard uncertainty."""


@dataclass(frozen=True, eq=False)
class TransferFunction:
    """Modulation transfer function of optics and pixel along the edge's normal."""

    frequency: Array
    """Spatial frequency in 1/m, shape (n,), up to twice the pixels' Nyquist frequency."""
    value: Array
    uncertainty: Array
    model: Array
    optics: Array
    """That of the fitted model with the pixel, and of its optics alone."""


def edge_spread(fit: ModelFit, index: int, pixels: EdgePixels) -> EdgeSpread:
    """Bins of a quarter of the pitch along the fitted edge's normal.

    The uncertainty is that of a mean: from the scatter of the bin's pixels about the model where
    there are enough of them, but not less than the noise of all pixels as bright would give.
    """
    edge = fit.edges[index]
    distance = edge.line.distance(pixels.x, pixels.y)
    width = pixels.pitch / BINS_PER_PITCH
    bins = np.floor(distance / width).astype(np.int64)
    bins -= bins.min()
    residual = (pixels.radiance - fit.predicted(index, pixels)) / edge.step
    value = (pixels.radiance - edge.background) / edge.step
    count = np.bincount(bins)
    there = count > 0
    number = count[there]

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(bins, values)[there] / number)

    left = mean(residual)
    scatter = np.maximum(mean(residual**2) - left**2, 0.0) * number / np.maximum(number - 1, 1)
    noise = mean((pixels.sigma / edge.step) ** 2)
    variance = np.where(number >= 10, np.maximum(scatter, noise), noise)
    return EdgeSpread(mean(distance), mean(value), np.sqrt(variance / number), left, number, width)


def line_spread(spread: EdgeSpread) -> LineSpread:
    """Differences of neighbouring bins over their distance."""
    apart = np.diff(spread.distance)
    return LineSpread(
        (spread.distance[1:] + spread.distance[:-1]) / 2,
        np.diff(spread.value) / apart,
        np.hypot(spread.uncertainty[1:], spread.uncertainty[:-1]) / apart,
    )


def transfer_function(
    fit: ModelFit, index: int, pixels: EdgePixels, spread: EdgeSpread
) -> TransferFunction:
    """Modulation transfer function of an edge.

    The transform of the edge-spread function is that of the fitted model and that of the residuals
    within a window, times 2πif in place of the derivative. A plain transform of the measured
    bins would end at the window, and what tails are beyond would be missing at low frequencies;
    here the model stands for them. The mean over a bin is made up for by its sinc; differences,
    for which ISO 12233 has a factor, are not taken.
    """
    edge = fit.edges[index]
    frequency = np.linspace(0.0, 1 / pixels.pitch, _FREQUENCIES)
    optics = fit.model.transfer(fit.values, frequency, edge.line.normal)
    model = optics * footprint_transfer(frequency, edge.line.normal, pixels.footprint)
    window = max(_WINDOW_PITCHES * pixels.pitch, _WINDOW_WIDTHS * fit.fwhm)
    near = np.abs(spread.distance) < window
    phase = np.exp(-2j * np.pi * frequency[:, None] * spread.distance[near])
    weight = 2j * np.pi * frequency[:, None] * phase * spread.width
    weight /= np.sinc(frequency * spread.width)[:, None]
    value = model + weight @ spread.residual[near]
    size = np.abs(value)
    direction = np.where(size > 0, value / np.maximum(size, 1e-300), 1.0)
    # Only the part of the noise along the value changes its magnitude, to first order.
    along = (weight * np.conj(direction)[:, None]).real
    noise = along**2 @ spread.uncertainty[near] ** 2
    scale = size * edge.step_uncertainty / edge.step
    return TransferFunction(
        frequency, size, np.sqrt(noise + scale**2), np.abs(model), np.abs(optics)
    )
