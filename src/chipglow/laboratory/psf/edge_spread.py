"""Oversampled edge-spread function of an image, and the line-spread function and MTF it gives."""

from typing import Any, Final

import numpy as np
import xarray as xr

from chipglow.laboratory.psf.psf_fit import EdgePixels, ModelFit
from chipglow.laboratory.psf.psf_models import footprint_transfer
from chipglow.quantities import TINY, Array

BINS_PER_PITCH: Final = 4
"""Bins for each pixel pitch of an edge-spread function, as in ISO 12233."""

_WINDOW_PITCHES: Final = 10.0
"""Smallest distance from the edge, in pixel pitches, up to which the line-spread function is
transformed."""

_WINDOW_WIDTHS: Final = 5.0
"""The same distance in widths of the line-spread function."""

_KNOWN_SCATTER: Final = 10
"""Fewest pixels of a bin whose own scatter is its noise."""

_FREQUENCIES: Final = 65
"""Spatial frequencies of an MTF, from 0 to one over the pitch."""


def edge_curves(fit: ModelFit, index: int, pixels: EdgePixels) -> xr.Dataset:
    """Return edge-spread, line-spread and modulation transfer function of an edge, in SI units.

    Bins are a quarter of the pitch. The MTF of the fitted model is added to the transform of
    the residuals: a transform of the bins alone would lack what the tails hold beyond the window.
    """
    edge = fit.edges[index]
    every = edge.line.distance(pixels.x, pixels.y)
    width = pixels.pitch / BINS_PER_PITCH
    bins = np.floor(every / width).astype(np.int64)
    bins -= bins.min()
    count = np.bincount(bins)
    number = count[count > 0]

    def mean(values: Array) -> Array:
        return np.bincount(bins, values)[count > 0] / number

    departure = (pixels.radiance - fit.predicted(index, pixels)) / edge.step
    distance, residual = mean(every), mean(departure)
    value = mean((pixels.radiance - edge.background) / edge.step)
    scatter = np.maximum(mean(departure**2) - residual**2, 0.0) * number / np.maximum(number - 1, 1)
    noise = mean((pixels.sigma / edge.step) ** 2)
    variance = np.where(number >= _KNOWN_SCATTER, np.maximum(scatter, noise), noise)
    uncertainty, apart = np.sqrt(variance / number), np.diff(distance)
    columns: dict[str, tuple[str, Any, str]] = {
        "distance": ("bin", distance, "m"),
        "esf": ("bin", value, "1"),
        "esf_uncertainty": ("bin", uncertainty, "1"),
        "esf_residual": ("bin", residual, "1"),
        "pixels": ("bin", number, "1"),
        "line_distance": ("line", (distance[1:] + distance[:-1]) / 2, "m"),
        "lsf": ("line", np.diff(value) / apart, "m-1"),
        "lsf_uncertainty": ("line", np.hypot(uncertainty[1:], uncertainty[:-1]) / apart, "m-1"),
    }
    transfer = _transfer(fit, index, pixels, distance, residual, uncertainty)
    columns |= {name: ("frequency", values, "1") for name, values in transfer.items()}
    columns["frequency"] = ("frequency", transfer["frequency"], "m-1")
    return xr.Dataset(
        {
            name: ((f"{dimension}_index",), values, {"units": unit})
            for name, (dimension, values, unit) in columns.items()
        }
    )


def _transfer(
    fit: ModelFit,
    index: int,
    pixels: EdgePixels,
    distance: Array,
    residual: Array,
    uncertainty: Array,
) -> dict[str, Array]:
    """Return the MTF, its uncertainty, and the fitted one with and without pixel."""
    edge, width = fit.edges[index], pixels.pitch / BINS_PER_PITCH
    frequency = np.linspace(0.0, 1 / pixels.pitch, _FREQUENCIES)
    optics = fit.model.transfer(fit.values, frequency, edge.line.normal)
    model = optics * footprint_transfer(frequency, edge.line.normal, pixels.footprint)
    near = np.abs(distance) < max(_WINDOW_PITCHES * pixels.pitch, _WINDOW_WIDTHS * fit.fwhm)
    phase = np.exp(-2j * np.pi * frequency[:, None] * distance[near])
    weight = 2j * np.pi * frequency[:, None] * phase * width
    weight /= np.sinc(frequency * width)[:, None]
    value = model + weight @ residual[near]
    size = np.abs(value)
    direction = np.where(size > 0, value / np.maximum(size, TINY), 1.0)
    # Only the part of the noise along the value changes its magnitude, to first order.
    along = (weight * np.conj(direction)[:, None]).real
    noise = along**2 @ uncertainty[near] ** 2
    scale = size * edge.step_uncertainty / edge.step
    return {
        "frequency": frequency,
        "mtf": size,
        "mtf_uncertainty": np.sqrt(noise + scale**2),
        "mtf_model": np.abs(model),
        "mtf_optics": np.abs(optics),
    }
