"""Values of an analysis that the report's texts show, and the texts with these values."""

from collections.abc import Mapping
from functools import cache, cached_property
from importlib.resources import files
from math import isfinite, nan
from typing import Any, Final

import numpy as np
from jinja2 import DictLoader, Environment, StrictUndefined, Template
from numpy.typing import NDArray

from chipglow.analysis import (
    Analysis,
    headlines,
    image_error,
    line_change,
    line_error,
    line_steepest,
    sensitivity_error,
    sensitivity_psf_fraction,
)
from chipglow.analysis.reductions import Headline
from chipglow.drawing import drawing
from chipglow.drawing.scales import KELVIN
from chipglow.quantities.format import quantity_text
from chipglow.report.paper import stands_beside
from chipglow.scene import Material
from chipglow.text.yaml_file import parse_yaml

Array = NDArray[np.float64]

SCENE_FIELDS: Final = ("temperature", "plastic_strain", "plastic_strain_rate", "emissivity")
"""Fields that the figure of the scene shows, if it has them."""

_IMPORT: Final = '{% from "macros" import gaussian_widths, main_cause, wings with context %}'


@cache
def texts() -> Mapping[str, Any]:
    """Return the templates of all texts."""
    text = files("chipglow.report").joinpath("texts.yaml").read_text(encoding="utf-8")
    found: Mapping[str, Any] = parse_yaml(text)
    return found


class Facts:
    """Values of an analysis for the texts of its report; each method is a function of a text."""

    def __init__(self, analysis: Analysis, study: object = None) -> None:
        self.analysis, self.data = analysis, analysis.data
        self.is_compared = stands_beside(study, analysis)
        camera, cut, data = analysis.camera, analysis.cut, analysis.data
        self.starts = len(cut.one_segment) if cut else data.sizes["instant"]
        names = list(analysis.measurements)
        self.read_surfaces = [name for name in names if name in data.seen_surface.values] or names
        self._context: dict[str, Any] = {
            "analysis": analysis,
            "camera": camera,
            "cut": cut,
            "chip": cut.chip if cut else None,
            "forces": cut.forces if cut else None,
            "psf": camera.psf,
            "pitch": camera.pitch,
            "lower_limit": None if camera.lower_limit is None else camera.lower_limit - KELVIN,
            "exposure": time_text(camera.integration_time),
            "time": time_text(analysis.frame.time, ".4g"),
            "reference": analysis.plan.reference,
            "line_reach": analysis.plan.line_reach,
            "cause": data.exposure.attrs["title"],
            "surfaces": list(data.surface.values),
            "lines": list(data.line.values) if "line" in data else [],
            "flagged": float(data.flagged.mean()),
            "exposures": data.sizes["instant"],
            "starts": self.starts,
            "scene_panels": [name.replace("_", " ") for name in SCENE_FIELDS if name in data],
            "hottest": _hottest(analysis),
            "band_width": self._segment_mean("band_width"),
            "widths": data.psf_width.values if "psf_width" in data else (),
        }
        functions = (
            *("series", "largest_cause", "psf_fractions", "change", "steepest", "beside"),
            *("contact_range", "contact_reaches_border", "middle_rate", "band_sweep"),
            *("highest_measured", "most_negative"),
        )
        self._context |= {name: getattr(self, name) for name in functions}
        self._context["definition"] = self.text(texts()["definition"])

    @cached_property
    def headlines(self) -> Mapping[str, Headline]:
        """The readings that are known in every draw."""
        return headlines(self.data)

    def text(self, template: str, **values: Any) -> str:
        """Return a text with the values of the analysis and further ones, in one line."""
        return " ".join(_template(template).render(self._context | values).split())

    def read_curves(self) -> list[Array]:
        """Return where errors are read in the shown exposure: points in m, of shape (n, 2)."""
        if self.analysis.cut is None:
            outlines = (place.outline() for place in self.analysis.places)
            return [points for points in outlines if points is not None]
        lines = self.data.isel(exposure=0).sel(line=["rake", "band"])
        points = np.stack([lines.line_x.values, lines.line_y.values], axis=-1)
        return [one[np.isfinite(one).all(axis=1)] for one in points]

    def series(self, reading: str, unit: str) -> Array | None:
        """Return error in °C or fraction of the PSF in % over the PSF widths; None if unknown."""
        if "psf_width" not in self.data or reading not in self.data.reading:
            return None
        order = self.analysis.camera.psf_order
        if unit == "%":
            values = 100 * sensitivity_psf_fraction(self.data, order, reading)
        else:
            values = sensitivity_error(self.data, order, reading)
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
        psf, found, values = (
            self.analysis.camera.psf,
            self.headlines.get(reading),
            self.series(reading, "%"),
        )
        fraction = found.psf_fraction if found else None
        if psf is None or fraction is None or values is None:
            return None, None
        widths = self.data.psf_width.values
        if not widths[0] <= psf.fwhm <= widths[-1]:
            return None, None
        return fraction.mean, float(np.interp(psf.fwhm, widths, values)) / 100

    def change(self, line: str, near: float, far: float) -> float:
        """Return the change of the scene between two distances on a line, in K."""
        return line_change(self.data, line, near, far)

    def steepest(self, line: str, length: float) -> float:
        """Return the largest change of the scene over a length on a line, in K."""
        return line_steepest(self.data, line, length)

    def beside(self) -> tuple[float, float]:
        """Return the mean of the most negative errors on the workpiece and the chip side, in K."""
        error = line_error(self.data, "band")
        low, high = (
            float(error.where(side).min("point").mean())
            for side in (error.distance <= 0, error.distance >= 0)
        )
        return low, high

    def contact_range(self) -> tuple[float, float]:
        """Return the smallest and largest error along the contact in one draw, in K."""
        error = line_error(self.data, "contact")[0, 0, 0]
        return float(error.min()), float(error.max())

    def contact_reaches_border(self) -> bool:
        """Whether the contact ends at the border of the view."""
        contact = self.data.sel(line="contact").isel(exposure=0)
        x, y = (
            values[np.isfinite(values)][-1]
            for values in (contact.line_x.values, contact.line_y.values)
        )
        left, _, _, top = self.analysis.raster.extent
        margin = 3 * self.analysis.raster.spacing
        return bool(y > top - margin or x < left + margin)

    def middle_rate(self) -> float:
        """Return the median over the segments of the strain rate in the middle half of the band."""
        assert self.analysis.cut is not None
        return float(np.median([one.moment.middle_rate for one in self.analysis.cut.segments]))

    def band_sweep(self) -> float:
        """Return how far the band moves across itself during the exposure, in m."""
        return self._segment_mean("sweep")

    def highest_measured(self) -> float:
        """Return the highest measured temperature of the shown exposure in °C."""
        shown = self.data.radiance_temperature.isel(instant=self.data.attrs["shown_instant"])
        return float(shown.max()) - KELVIN

    def most_negative(self) -> dict[str, float]:
        """Return the most negative error of every surface's image, in K."""
        error = image_error(self.data).where(~self.data.flagged)
        return {str(name): float(error.sel(surface=name).min()) for name in error.surface.values}

    def _segment_mean(self, name: str) -> float:
        cut = self.analysis.cut
        return float(np.mean([getattr(one, name) for one in cut.segments])) if cut else nan


def time_text(seconds: float, form: str = ".3g") -> str:
    """Return a time in the unit that suits it."""
    factor, unit = drawing.time_unit(seconds)
    return f"{seconds * factor:{form}} {unit}"


def _hottest(analysis: Analysis) -> float:
    frame = analysis.frame
    solid = frame.temperature[frame.material != Material.VOID]
    return float(solid.max()) - KELVIN if solid.size else nan


@cache
def _template(text: str) -> Template:
    return _environment().from_string(f"{_IMPORT}{text}" if "{" in text else text)


@cache
def _environment() -> Environment:
    loader = DictLoader({"macros": texts()["macros"]})
    made = Environment(loader=loader, undefined=StrictUndefined)
    made.filters |= {"number": _number, "percent": _percent, "um": _micrometres}
    return made


def _number(value: float, unit: str, decimals: int = 0) -> str:
    return quantity_text(value, unit, decimals) if isfinite(value) else "an unknown value"


def _percent(fraction: float) -> str:
    return _number(100 * fraction, "%")


def _micrometres(length: float) -> str:
    return f"{length * 1e6:.3g} µm" if isfinite(length) else "of unknown length"
