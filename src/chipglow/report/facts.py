"""The values of an analysis that texts and figures of its report read."""

from collections.abc import Mapping
from functools import cached_property
from math import nan
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import (
    Analysis,
    Cut,
    Headline,
    headlines,
    sensitivity_error,
    sensitivity_psf_fraction,
)
from chipglow.camera import FlatFieldCalibration
from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.report.page import template, texts
from chipglow.report.quoted import Quoted

Array = NDArray[np.float64]

_MARGIN: Final = 50.0
"""Part of a temperature scale below the camera's limit, and its smallest range, in K."""

SCENE_FIELDS: Final = ("temperature", "plastic_strain", "plastic_strain_rate", "emissivity")
"""Fields that the figure of the scene shows, if it has them."""


class Facts:
    """An analysis as texts and figures read it; `context` holds the names that texts know."""

    def __init__(self, analysis: Analysis, study: Any = None) -> None:
        self.analysis, self.data = analysis, analysis.data
        self.study = study
        self.is_compared = analysis.cut is not None and study is not None and study.is_papers
        cut = analysis.cut
        self.starts = len(cut.one_segment) if cut else self.data.sizes["instant"]
        self.read_surfaces = list(analysis.surfaces)

    @cached_property
    def context(self) -> Mapping[str, Any]:
        """Values and functions by the names that texts use."""
        analysis, data, cut = self.analysis, self.data, self.analysis.cut
        camera = analysis.camera
        values = {
            "analysis": analysis,
            "attribution_reference": data.attrs.get("attribution_reference", ""),
            "camera": camera,
            "cause": data.exposure.attrs["title"],
            "chip": cut.chip if cut else None,
            "cut": cut,
            "data": data,
            "exposure": time_text(camera.integration_time),
            "forces": cut.forces if cut else None,
            "is_compared": self.is_compared,
            "largest_cause": self.largest_cause,
            "lines": list(data.line.values) if "line" in data else [],
            "pitch": camera.pitch,
            "plan": analysis.plan,
            "psf": camera.psf,
            "psf_fractions": self.psf_fractions,
            "quoted": Quoted(analysis),
            "reference": texts()["references"][analysis.plan.reference],
            "scene_fields": [name for name in SCENE_FIELDS if name in data],
            "series": self.series,
            "starts": self.starts,
            "surfaces": list(data.surface.values),
            "time": time_text(analysis.frame.time, ".4g"),
            "widths": data.psf_width.values if "psf_width" in data else (),
        }
        return {**values, "definition": template(texts()["definition"]).render(values)}

    @cached_property
    def calibration(self) -> FlatFieldCalibration | None:
        """The calibration of the camera's detector, if it has one."""
        camera = self.analysis.camera
        return camera.calibration(camera.pixels(self.analysis.raster).shape)

    @property
    def cut(self) -> Cut:
        """The cut, for texts and figures that exist for cuts only."""
        assert self.analysis.cut is not None
        return self.analysis.cut

    @cached_property
    def headlines(self) -> Mapping[str, Headline]:
        """The readings that are known in every draw."""
        return headlines(self.data)

    @property
    def settings(self) -> Mapping[str, str]:
        """Settings of the camera and the surfaces, as text by name."""
        analysis, camera = self.analysis, self.analysis.camera
        pixels, psf, limit = camera.pixels(analysis.raster), camera.psf, camera.lower_limit
        spectral = f"{1e6 * camera.band.lower:.4g} to {1e6 * camera.band.upper:.4g} µm"
        applied = {"detector": "on the pixel image", "optics": "before the pixels integrate"}
        order, blur = applied[camera.psf_order], "none"
        if psf is not None:
            blur = f"{psf}, {1e6 * psf.fwhm:.3g} µm wide at half maximum, {order}"
        bits = camera.detector.bits if camera.detector else None
        lowest = "no lower limit" if limit is None else f"from {limit - ZERO_CELSIUS:.0f} °C"
        calibration = self.calibration
        highest = f" to {calibration.full_temperature - ZERO_CELSIUS:.0f} °C" if calibration else ""
        reflected = camera.reflected
        settings = {
            "Spectral band": spectral,
            "Pixels": f"{pixels.columns} × {pixels.rows}, {1e6 * camera.pitch:.4g} µm on the scene",
            "Exposure": f"{time_text(camera.integration_time)} at {camera.frame_rate:.6g} Hz",
            "Point spread function": blur,
            "Range": f"{lowest}{highest}",
            "Reflected temperature": (
                "none" if reflected is None else f"{reflected - ZERO_CELSIUS:.0f} °C"
            ),
            "Detector": "ideal" if bits is None else f"{bits} bits, with noise",
        }
        for name in self.read_surfaces:
            middle = float(self.data.set_emissivity.sel(surface=name))
            settings[f"Emissivity of {name}"] = f"{middle:.2f}, median of the hot part"
        return settings

    def text(self, text: str, **values: Any) -> str:
        """Return a text with the values of the analysis and further ones, in one line."""
        return " ".join(template(text).render({**self.context, **values}).split())

    def heat_limits(self, celsius: Array) -> tuple[float, float]:
        """Return ends of a scale of temperatures, the lower near the camera's lower limit."""
        low, high = scales.ends(celsius, 0.5, 99.9, 1.0)
        limit = self.analysis.camera.lower_limit
        # From 50 K below the limit, over 50 K or more.
        low = low if limit is None else max(limit - ZERO_CELSIUS - _MARGIN, low)
        return low, max(high, low + _MARGIN)

    def series(self, reading: str, unit: str) -> Array | None:
        """Return error in K or fraction of the PSF in % over the PSF widths; None if unknown."""
        if "psf_width" not in self.data or reading not in self.data.reading:
            return None
        order = self.analysis.camera.psf_order
        one = self.data, order, reading
        values = 100 * sensitivity_psf_fraction(*one) if unit == "%" else sensitivity_error(*one)
        return values if np.isfinite(values).all() else None

    def largest_cause(self, reading: str) -> tuple[str, float]:
        """Return the cause that contributes most to the variance, and its fraction."""
        found = self.headlines.get(reading)
        if found is None or found.error.draws < 2:
            return "", nan
        name, part = max(found.error.parts.items(), key=lambda item: item[1].fraction)
        return (name, part.fraction) if part.fraction > 0 else ("", nan)

    def psf_fractions(self, reading: str) -> tuple[float | None, float | None]:
        """Return the contribution of the camera's PSF, and of a Gaussian of the same width."""
        psf, found = self.analysis.camera.psf, self.headlines.get(reading)
        fraction, values = found.psf_fraction if found else None, self.series(reading, "%")
        if psf is None or fraction is None or values is None:
            return None, None
        widths = self.data.psf_width.values
        if not widths[0] <= psf.fwhm <= widths[-1]:
            return None, None
        return fraction.mean, float(np.interp(psf.fwhm, widths, values)) / 100


def time_text(seconds: float, form: str = ".3g") -> str:
    """Return a time in the unit that suits it."""
    factor, unit = drawing.time_unit(seconds)
    return f"{seconds * factor:{form}} {unit}"
