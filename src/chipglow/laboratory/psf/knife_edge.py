"""A camera's point spread function from images of straight edges (the knife-edge method).

All is done on radiance. Light is spread and added up by the optics, so that radiance is convolved
with the point spread function; temperature, a bent function of it, is not.
"""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, cosh, degrees, exp, hypot, log, sqrt
from typing import TYPE_CHECKING, Final

import numpy as np
import pandas as pd
import xarray as xr
from scipy.optimize import brentq
from scipy.special import chdtri

from chipglow.camera import MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.kernel import normalised, resized
from chipglow.laboratory.psf.edge_image import EdgeImage, usable_pixels
from chipglow.laboratory.psf.edge_line import EdgeLine
from chipglow.laboratory.psf.edge_spread import BINS_PER_PITCH, edge_curves
from chipglow.laboratory.psf.linearity import asymmetry
from chipglow.laboratory.psf.psf_fit import (
    ApertureSignals,
    EdgePixels,
    FittedEdge,
    ModelFit,
    fit_model,
    orientations,
    with_noise,
)
from chipglow.laboratory.psf.psf_models import (
    AnnularModel,
    DefocusedDiscModel,
    DefocusedRingModel,
    EllipticalModel,
    GaussianModel,
    GaussianTailModel,
    MoffatModel,
    PSFModel,
)
from chipglow.laboratory.psf.size_of_source import ApertureImage, aperture_signals
from chipglow.quantities import Array, Brief
from chipglow.radiometry import Band
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Cause, Component
from chipglow.uncertainty.estimate import factor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIT: Final = "psf fit"
"""Name of the component that the noise of the images makes."""

MODEL: Final = "psf model"
"""Name of the component that the choice among the models makes."""

OVAL: Final = "psf oval"
"""Name of the component of an oval that the edges do not show."""

_MOST_OVAL: Final = 2.0
"""Ratio of the axes of such an oval, at most."""

_COARSE_TOLERANCE: Final = 1e-6
"""Relative change of the sum of squares at which the fits that choose a model end."""

_NOISE_ALONE: Final = 1.6
"""Reduced chi-squared up to which residuals count as noise."""

_CHANCE_LEVEL: Final = 0.01
"""Probability of a chi-squared below which a model does not describe the edges."""

_STARTS: Final = 6
"""Starts of a fit whose residuals are not noise: clipping leads to several minima."""

_APERTURES_APART: Final = 4.0
"""Mean squared residual of the apertures, in their uncertainties, from which they contradict the
edges."""

_NEGLIGIBLE: Final = 5e-4
"""Residual over the step below which a misfit is negligible, even if it is significant."""

_PLATEAU_WIDTHS: Final = 3.0
"""Shortest side of an edge in widths of the line-spread function; tails and brightness of a shorter
one cannot be distinguished."""

_UNRESOLVED: Final = 0.3
"""Width of the optics over the pixel below which the pixel hides it."""

_ALIGNED: Final = np.pi / 9
"""Tilt in rad of two edges up to which they lie along rows or columns."""

_SAMPLES_PER_WIDTH: Final = 10
"""Samples of a width of the point spread function, for its uncertainty."""

_LEAST_WEIGHT: Final = 1e-6
"""Weight of a model up to which its difference from the best is left out."""

_Kernel = Callable[..., Array]


@dataclass(frozen=True, eq=False, repr=False)
class EdgeResult(Brief):
    """Results of one image of an edge."""

    image: EdgeImage
    pixels: EdgePixels
    """Its pixels in use; x and y from the image's centre."""
    curves: xr.Dataset
    """Edge-spread, line-spread and modulation transfer function; see `edge_curves`."""
    noise: float
    """Standard deviation of a pixel on the dark side in W/(m² sr)."""
    fwhm: float
    fwhm_uncertainty: float
    """Full width at half maximum in m by this edge alone, and its standard uncertainty."""
    line_fwhm: float
    """Full width at half maximum of the line-spread function in m: optics and pixel."""


@dataclass(frozen=True, eq=False)
class KnifeEdge:
    """A camera's point spread function by the knife-edge method."""

    edges: tuple[EdgeResult, ...]
    fits: tuple[ModelFit, ...]
    """Models of the optics fitted to all images at once, the best by its criterion first."""
    apertures: ApertureSignals | None
    """Signals of apertures that were fitted with the edges."""
    oval: float
    """Relative standard uncertainty of the width by an oval that the edges do not show."""
    notes: Notes

    @property
    def best(self) -> ModelFit:
        """The fit of the best model."""
        return self.fits[0]

    @property
    def weights(self) -> tuple[float, ...]:
        """Probability of each model by the Bayesian criterion; all are equal if none fits."""
        if self.unexplained:
            return (1 / len(self.fits),) * len(self.fits)
        # exp(−350) is small enough for 0, and does not underflow.
        likely = [exp(-min(fit.bic - self.best.bic, 700.0) / 2) for fit in self.fits]
        return tuple(value / sum(likely) for value in likely)

    @property
    def fwhm(self) -> float:
        """Full width at half maximum of the optics' point spread function in m, best model."""
        return self.best.fwhm

    @property
    def fwhm_uncertainty(self) -> float:
        """Its standard uncertainty in m."""
        return hypot(self.edge_uncertainty, self.oval * self.fwhm)

    @property
    def band(self) -> Band | None:
        """Band of the images; None if they state none or several."""
        first, *others = (edge.image.band for edge in self.edges)
        return first if all(band == first for band in others) else None

    @property
    def edge_uncertainty(self) -> float:
        """Standard uncertainty across the edges in m, with the models' spread, without ovals."""
        pairs = zip(self.weights, self.fits, strict=True)
        spread = sum(weight * (fit.fwhm - self.fwhm) ** 2 for weight, fit in pairs)
        return sqrt(self.best.fwhm_uncertainty**2 + spread)

    @property
    def unexplained(self) -> bool:
        """Whether the best model leaves what noise does in less than one of a hundred edges."""
        bins = sum(edge.curves["distance"].size for edge in self.edges)
        free = max(bins - self.best.free, 1)
        chance = float(chdtri(free, _CHANCE_LEVEL)) / free
        return self.best.reduced_chi_squared > chance and max(map(_left, self.edges)) > _NEGLIGIBLE

    def to_frame(self) -> pd.DataFrame:
        """Return the models; one row each, the best first."""
        return pd.DataFrame(
            {
                "model": fit.model.name,
                "fwhm_um": 1e6 * fit.fwhm,
                "fwhm_uncertainty_um": 1e6 * fit.fwhm_uncertainty,
                "bic": fit.bic - self.best.bic,
                "weight": weight,
                "reduced_chi_squared": fit.reduced_chi_squared,
            }
            for fit, weight in zip(self.fits, self.weights, strict=True)
        )

    def plot(self) -> "Figure":
        """Draw images, edge- and line-spread functions with the best fit, and the MTF.

        Returns a figure, as it has several panels.
        """
        from chipglow.laboratory.psf.figure import draw_knife_edge

        return draw_knife_edge(self)

    def _repr_html_(self) -> str:
        return result_html("KnifeEdge", self.to_frame(), self.notes)

    def edge_frame(self) -> pd.DataFrame:
        """Return the images; one row each."""
        return pd.DataFrame(map(_edge_row, self.edges, self.best.edges))

    def fit(self, name: str) -> ModelFit:
        """Return the fit of a model by its name."""
        fits = {fit.model.name: fit for fit in self.fits}
        if name not in fits:
            raise ValueError(f"model: {name!r} was not fitted, expected one of {', '.join(fits)}")
        return fits[name]

    def psf(self, model: str | None = None) -> PointSpreadFunction:
        """Return the optics' point spread function, for ``Camera(psf=...)``."""
        return (self.best if model is None else self.fit(model)).psf()


def _edge_row(edge: EdgeResult, fitted: FittedEdge) -> dict[str, float | str]:
    half = int(np.argmin(np.abs(edge.curves["frequency"].values - 0.5 / edge.image.pitch)))
    return {
        "image": edge.image.name,
        "normal_deg": degrees(fitted.line.normal),
        "normal_uncertainty_deg": degrees(fitted.normal_uncertainty),
        "fwhm_um": 1e6 * edge.fwhm,
        "fwhm_uncertainty_um": 1e6 * edge.fwhm_uncertainty,
        "line_fwhm_um": 1e6 * edge.line_fwhm,
        "step_over_noise": fitted.step / edge.noise,
        "mtf_at_nyquist": float(edge.curves["mtf"][half]),
        "mtf_at_nyquist_uncertainty": float(edge.curves["mtf_uncertainty"][half]),
    }


def knife_edge(images: Sequence[EdgeImage], apertures: Sequence[ApertureImage] = ()) -> KnifeEdge:
    """Determine the point spread function of a camera.

    Parameters
    ----------
    images : sequence of EdgeImage
        Images of a straight edge, best of several orientations.
    apertures : sequence of ApertureImage, optional
        Images of round apertures of several diameters before one source: how much brighter the
        middle of a large one is shows the tails.

    Raises
    ------
    NoEdgeError
        If an image shows no straight edge, or more than one.

    Notes
    -----
    The models are fitted to all pixels of all images by weighted least squares, each with its
    background, step, place and angle free, first with even weights, then with the noise that the
    best model leaves on the dark and the bright side. Covariances include the residuals beyond the
    noise. Noise is taken as independent from pixel to pixel.
    """
    if not images:
        raise ValueError("edges: none is given, expected an image or more")
    read = [usable_pixels(image) for image in images]
    edges = [pixels for pixels, _ in read]
    notes = sum((said for _, said in read), Notes())
    signals = aperture_signals(apertures, images[0].footprint) if apertures else None
    models, oval = _models(images, edges, notes)
    notes += Notes([text for image in images for text in image.notes.assumed])
    first = [fit_model(model, edges, signals, tolerance=_COARSE_TOLERANCE) for model in models]
    if min(fit.reduced_chi_squared for fit in first) > _NOISE_ALONE:
        # Heavy clipping leads to several minima.
        first = [
            fit_model(model, edges, signals, None, _COARSE_TOLERANCE, _STARTS) for model in models
        ]
    found = min(first, key=lambda fit: fit.bic)
    edges = [with_noise(edge, found.predicted(k, edge)) for k, edge in enumerate(edges)]
    fits = sorted(
        (fit_model(fit.model, edges, signals, fit) for fit in first), key=lambda fit: fit.bic
    )
    best = fits[0]
    alone = len(edges) == 1 and signals is None
    results = tuple(_result(best, k, images[k], edges[k], alone) for k in range(len(edges)))
    for k, result in enumerate(results):
        notes.warnings.extend(_edge_warnings(best, k, result))
    notes.warnings.extend(_fit_warnings(best, results))
    if signals is not None:
        notes.warnings.extend(_aperture_warnings(best, signals))
    return KnifeEdge(results, tuple(fits), signals, oval, notes)


def _models(
    images: Sequence[EdgeImage], edges: Sequence[EdgePixels], notes: Notes
) -> tuple[list[PSFModel], float]:
    """Return the models that the images can distinguish, and how uncertain an oval makes them.

    The limits: two edges along rows and columns leave cosh(ln r)^(1/2), one edge r^(1/2).
    """
    round_models = GaussianTailModel, MoffatModel, DefocusedDiscModel, DefocusedRingModel
    models: list[PSFModel] = [GaussianModel(), *(model() for model in round_models)]
    wavelength = images[0].wavelength
    if wavelength is None:
        notes.assumed.append(
            "Diffraction was not tried: the measurement does not state the limits of its band."
        )
    else:
        models.append(AnnularModel(wavelength))
        notes.assumed.append(
            f"Diffraction acts at {wavelength * 1e6:.4g} um, the centre of the band; only the "
            "ratio of the wavelength to the numerical aperture can be determined."
        )
    directions = orientations(edges)
    tilts = [abs(EdgeLine(direction, 0.0).tilt) for direction in directions]
    if len(directions) >= 3:
        return [*models, EllipticalModel(tilted=True)], 0.0
    shape, limit, more = "oval", log(_MOST_OVAL) / 2, "edges of three orientations"
    if len(directions) == 2 and max(tilts) < _ALIGNED:
        models.append(EllipticalModel(tilted=False))
        shape, limit, more = "oblique oval", log(cosh(log(_MOST_OVAL))) / 2, "an edge at 45 deg"
    oval = limit / sqrt(3)
    notes.assumed.append(
        f"The edges do not show an {shape} point spread function of up to {_MOST_OVAL:g}:1, which "
        f"makes {100 * oval:.2g} % of the width uncertain; {more} would."
    )
    return models, oval


def _result(
    best: ModelFit, k: int, image: EdgeImage, pixels: EdgePixels, alone: bool
) -> EdgeResult:
    own = best
    if not alone:
        round_model = isinstance(best.model, EllipticalModel)
        own = fit_model(GaussianModel() if round_model else best.model, [pixels])
    dark = best.edges[k].line.distance(pixels.x, pixels.y) < 0
    noise = float(np.median(pixels.sigma[dark]))
    line = best.response(k, pixels).slope
    half = float(line(np.array(0.0))) / 2
    line_fwhm = 2 * float(brentq(lambda u: float(line(np.array(u))) - half, 0.0, pixels.reach))
    curves = edge_curves(best, k, pixels)
    return EdgeResult(image, pixels, curves, noise, own.fwhm, own.fwhm_uncertainty, line_fwhm)


def _edge_warnings(best: ModelFit, k: int, result: EdgeResult) -> Iterator[str]:
    """Yield warnings about the edge's place in its image."""
    pixels, name = result.pixels, result.image.name
    distance = best.edges[k].line.distance(pixels.x, pixels.y)
    core = np.sort(distance[np.abs(distance) < max(best.fwhm, 2 * pixels.pitch)])
    gap = float(np.diff(core).max()) if core.size > 1 else pixels.pitch
    # 5 % beyond a bin leave the aliasing limit as it is.
    if gap > 1.05 * pixels.pitch / BINS_PER_PITCH:
        yield (
            f"{name}: With a tilt of {degrees(best.edges[k].line.tilt):.2f} deg the pixels lie at "
            f"distances up to {gap * 1e6:.2g} um apart, not at a quarter of the pitch: beyond "
            f"{0.5 / gap / 1e3:.3g} /mm the MTF is aliased; tilt the edge by 2 deg to 10 deg."
        )
    short = min(-float(distance.min()), float(distance.max()))
    if short < _PLATEAU_WIDTHS * result.line_fwhm:
        yield (
            f"{name}: Only {short * 1e6:.3g} um of one side of the edge are seen, under "
            f"{_PLATEAU_WIDTHS:g} widths: tails and brightness of the side cannot be distinguished."
        )
    yield from _not_linear(best, k, result)


def _not_linear(best: ModelFit, k: int, result: EdgeResult) -> Iterator[str]:
    """Warn if the values of an edge are not, or not shown to be, linear in radiance."""
    response, name = best.response(k, result.pixels), result.image.name
    found = asymmetry(result.curves, response, response.slope, result.line_fwhm)
    is_counts = result.image.unit == "counts"
    if found is not None and found.is_clear:
        cause = (
            "Counts with a gamma, an automatic contrast or a detector that is not linear have "
            "that: record linear counts, or set a calibration."
            if is_counts
            else "A calibration whose curve is wrong causes that."
        )
        yield (
            f"{name}: The values may not be linear in the radiance: the edge-spread function is "
            f"not symmetric, by {100 * abs(found.value):.2g} % of the step (standard uncertainty "
            f"{100 * found.standard_uncertainty:.1g} %). {cause} So do an unevenly lit side and "
            "coma. The width may be wrong."
        )
    elif is_counts and (found is None or found.is_hidden):
        yield (
            f"{name}: Counts are taken as linear in the radiance, but too little of the edge is "
            "seen, or too much noise, to show even a gamma of 2.2; set a calibration, or average "
            "more frames."
        )


def _fit_warnings(best: ModelFit, edges: Sequence[EdgeResult]) -> Iterator[str]:
    """Yield warnings about the best fit."""
    footprint = max(edge.image.footprint for edge in edges)
    if best.fwhm < _UNRESOLVED * footprint or best.fwhm_uncertainty > 0.5 * best.fwhm:
        yield (
            f"The optics' width of {best.fwhm * 1e6:.2g} um is hardly seen beside the pixel's "
            f"{footprint * 1e6:.3g} um: take it for an upper limit."
        )
    left = max(_left(edge) for edge in edges)
    if best.reduced_chi_squared > _NOISE_ALONE and left > _NEGLIGIBLE:
        yield (
            f"No model fits: the best, {best.model.name}, leaves "
            f"{sqrt(best.reduced_chi_squared):.2g} times the noise in the means at a distance, "
            f"{100 * left:.2g} % of the step near the edge; uncertainties are enlarged by it, "
            "and all models have the same weight."
        )


def _aperture_warnings(best: ModelFit, signals: ApertureSignals) -> Iterator[str]:
    """Warn if apertures contradict the edges."""
    fractions = signals.weights @ best.model.mean_transfer(best.values, signals.frequency)
    left = (signals.radiance - best.aperture_background) / best.source - fractions
    square = float(np.sum((left * best.source / signals.sigma) ** 2))
    largest = int(np.argmax(np.abs(left)))
    if square >= _APERTURES_APART * left.size and abs(left[largest]) >= _NEGLIGIBLE:
        yield (
            f"The apertures and the edges contradict each other: the signal of "
            f"{signals.diameters[largest] * 1e6:.4g} um is {100 * abs(left[largest]):.2g} % of the "
            "source away from the fit; check the diameters and that the source is even."
        )


def _left(edge: EdgeResult) -> float:
    """Return the root mean square of the residuals near the edge over the step."""
    near = np.abs(edge.curves["distance"].values) < 2 * edge.line_fwhm
    return float(np.sqrt(np.mean(edge.curves["esf_residual"].values[near] ** 2)))


def psf_kernel(knife: KnifeEdge, model: str | None = None) -> MeasuredPSF:
    """Return the optics' kernel with the errors `FIT`, `MODEL` and `OVAL` of `fwhm_uncertainty`."""
    fit = knife.best if model is None else knife.fit(model)
    psf = fit.psf()
    spacing = psf.spacing if isinstance(psf, MeasuredPSF) else psf.fwhm / _SAMPLES_PER_WIDTH
    middle = normalised(psf.kernel(spacing))
    half = len(middle) // 2

    def kernel(other: PointSpreadFunction, wider: float = 1.0) -> Array:
        near, light = _within(other, (half + 1) * spacing / wider)
        return resized(light * normalised(near.kernel(spacing / wider)), half, half)

    by_model = [
        np.sqrt(weight) * (kernel(other.psf()) - middle)
        for other, weight in zip(knife.fits, knife.weights, strict=True)
        if other is not fit and weight > _LEAST_WEIGHT
    ]
    parts = {FIT: _of_the_fit(knife, fit, kernel), MODEL: by_model}
    if knife.oval:
        parts[OVAL] = [(kernel(psf, 1 + knife.oval) - kernel(psf, 1 - knife.oval)) / 2]
    components = [_component(name, effects) for name, effects in parts.items() if effects]
    return MeasuredPSF(middle, spacing, tuple(components), band=knife.band)


def _within(psf: PointSpreadFunction, reach: float) -> tuple[PointSpreadFunction, float]:
    """Return what a kernel needs within a distance in m, and its fraction of the light.

    The tails of a model that does not fit can reach over millimetres.
    """
    if not isinstance(psf, MeasuredPSF):
        return psf, 1.0
    middle = len(psf.weights) // 2
    kept = min(ceil(reach / psf.spacing) + 1, middle)
    inner = psf.weights[middle - kept : middle + kept + 1, middle - kept : middle + kept + 1]
    return MeasuredPSF(inner, psf.spacing), float(inner.sum())


def _component(name: str, effects: Sequence[Array]) -> Component:
    """Return errors of a kernel, which are the same in another run."""
    columns = np.stack([one.ravel() for one in effects], axis=1)
    identity = hashlib.sha256(columns.tobytes()).hexdigest()[:16]
    return Component(Cause(name, identity, len(effects)), columns)


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
