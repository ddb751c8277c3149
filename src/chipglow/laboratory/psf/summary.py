"""A point spread function by the knife edge in sentences."""

from math import sqrt

import numpy as np

from chipglow.camera import AnnularAperturePSF, GaussianPSF
from chipglow.laboratory.psf.knife_edge import KnifeEdge
from chipglow.laboratory.psf.psf_fit import ModelFit
from chipglow.laboratory.psf.psf_models import is_length
from chipglow.quantities import uncertain_text


def sentences(found: KnifeEdge) -> list[str]:
    """Return the result, and how to use it."""
    width = uncertain_text(found.fwhm * 1e6, found.fwhm_uncertainty * 1e6)
    lines = [
        f"The optics' point spread function is {width} um wide (full width at half maximum, with "
        f"its standard uncertainty; {found.best.model.name}: {_parameters(found.best)})."
    ]
    lines += _directions(found)
    if (text := study_section(found)) is not None:
        lines.append(f"For a study's camera: psf_order: optics, psf: {text}")
    return lines


def study_section(found: KnifeEdge) -> str | None:
    """Return the best model as a study's camera section; None if only a file can hold it."""
    psf = found.psf()
    if isinstance(psf, GaussianPSF):
        return f"{{kind: gaussian, fwhm: {psf.fwhm * 1e6:.4g} um}}"
    if isinstance(psf, AnnularAperturePSF):
        return (
            f"{{kind: annular-aperture, wavelength: {psf.wavelength * 1e6:.4g} um, "
            f"numerical_aperture: {psf.numerical_aperture:.4g}, "
            f"obscuration: {psf.obscuration:.4g}}}"
        )
    return None


def _parameters(fit: ModelFit) -> str:
    texts = []
    for name, value, deviation in zip(
        fit.model.parameters, fit.values, fit.uncertainties, strict=True
    ):
        scale, unit = (1e6, " um") if is_length(name) else (1.0, "")
        number = uncertain_text(float(value) * scale, float(deviation) * scale)
        texts.append(f"{name.replace('_', ' ')} {number}{unit}")
    return ", ".join(texts)


def _directions(found: KnifeEdge) -> list[str]:
    """Return whether edges of several orientations agree."""
    if len(found.edges) < 2:
        return []
    widths = np.array([edge.fwhm for edge in found.edges])
    spread = np.array([edge.fwhm_uncertainty for edge in found.edges])
    apart = float(np.ptp(widths))
    unsure = sqrt(float(spread[widths.argmax()] ** 2 + spread[widths.argmin()] ** 2))
    verdict = "agree" if apart < 2 * unsure else "differ: the point spread function is not round"
    return [
        f"The edges' own widths lie {apart * 1e6:.2g} um apart, with a standard uncertainty of "
        f"{unsure * 1e6:.2g} um: they {verdict}."
    ]
