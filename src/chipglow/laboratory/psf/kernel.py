"""The point spread function of a knife edge as a kernel, with what makes it uncertain."""

from collections.abc import Callable
from typing import Final

import numpy as np

from chipglow.camera import MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.kernel import normalised
from chipglow.laboratory.psf.knife_edge import RADIAL, KnifeEdge
from chipglow.laboratory.psf.psf_fit import ModelFit
from chipglow.laboratory.psf.radial_psf import FIT, kernel_component
from chipglow.quantities import Array
from chipglow.uncertainty.estimate import factor

MODEL: Final = "psf model"
"""Name of the component that the choice among the models makes."""

UNEXPLAINED: Final = "psf unexplained"
"""Name of the component that is made by what no model explains."""

_SAMPLES_PER_WIDTH: Final = 10
_NO_WEIGHT: Final = 1e-6

_Kernel = Callable[[PointSpreadFunction], Array]


def psf_kernel(knife: KnifeEdge, model: str | None = None) -> MeasuredPSF:
    """Return the kernel of the optics with the components of its uncertainty.

    `FIT` has an error for each direction of the covariance of the model's parameters; of the one
    without a model it is that of `RadialPSF`. `MODEL` has one for each other model: its difference
    by the root of its weight. `UNEXPLAINED`, where the best model leaves more than noise does, is
    the difference of the point spread function without a model. They are the parts of
    `KnifeEdge.fwhm_uncertainty`.
    """
    psf = knife.psf(model=model)
    if model == RADIAL:
        assert isinstance(psf, MeasuredPSF)
        return psf
    fit = knife.best if model is None else knife.fit(model)
    spacing = psf.spacing if isinstance(psf, MeasuredPSF) else psf.fwhm / _SAMPLES_PER_WIDTH
    middle = normalised(psf.kernel(spacing))

    def kernel(other: PointSpreadFunction) -> Array:
        return _of_side(normalised(other.kernel(spacing)), len(middle))

    parts = {FIT: _of_the_fit(knife, fit, kernel), MODEL: _of_the_model(knife, fit, kernel)}
    if knife.unexplained:
        radial = knife.radial
        parts[UNEXPLAINED] = [kernel(radial.psf()) - kernel(radial.model_psf())]
    components = [kernel_component(name, effects) for name, effects in parts.items() if effects]
    return MeasuredPSF(middle, spacing, tuple(components))


def _of_the_fit(knife: KnifeEdge, fit: ModelFit, kernel: _Kernel) -> list[Array]:
    """Return the changes of the kernel by each independent error of the model's parameters."""
    pixels = knife.edges[0].pixels
    low, high = (np.array(ends) for ends in fit.model.bounds(pixels.pitch, pixels.reach))
    unit = np.where(fit.uncertainties > 0, fit.uncertainties, 1.0)
    effects = []
    for error in factor(fit.covariance, FIT).T:
        if not error.any():
            continue
        ends = [np.clip(fit.values + sign * error, low, high) for sign in (-1.0, 1.0)]
        behind, ahead = (kernel(fit.model.psf(values)) for values in ends)
        # Less than two errors lie between them where a parameter is at the end of its range.
        errors = np.linalg.norm((ends[1] - ends[0]) / unit) / np.linalg.norm(error / unit)
        effects.append((ahead - behind) / errors)
    return effects


def _of_the_model(knife: KnifeEdge, fit: ModelFit, kernel: _Kernel) -> list[Array]:
    """Return the changes of the kernel by each other model, by the root of its weight."""
    here = kernel(fit.psf())
    return [
        np.sqrt(weight) * (kernel(other.psf()) - here)
        for other, weight in zip(knife.fits, knife.weights, strict=True)
        if other is not fit and weight > _NO_WEIGHT
    ]


def _of_side(kernel: Array, side: int) -> Array:
    """Return the middle of a kernel, or the kernel amid zeros."""
    more = (side - len(kernel)) // 2
    if more >= 0:
        return np.pad(kernel, more)
    return kernel[-more:more, -more:more]
