"""A study compared with the same one with a tool at steady-state temperature."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import hypot, isfinite, nan

import numpy as np

from chipglow.analysis import Analysis, headline
from chipglow.drawing.scales import KELVIN
from chipglow.laboratory.chip import contact_temperatures, rake_grid
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import deviation_text, difference_unit, slug

Spread = tuple[float, float]
"""Mean and standard deviation; NaN where unknown."""

_UNKNOWN: Spread = (nan, nan)


@dataclass(frozen=True)
class ToolRow:
    """One quantity with the study's own tool and with a steady one, in the unit of its key."""

    key: str
    quantity: str
    unit: str
    own: Spread
    steady: Spread
    explanation: str

    @property
    def difference(self) -> Spread:
        """Steady minus own, and the standard deviation of the difference of two single values."""
        return self.steady[0] - self.own[0], hypot(self.steady[1], self.own[1])

    @property
    def cells(self) -> Mapping[str, str]:
        return {
            "quantity": self.quantity,
            "own": deviation_text(*self.own, self.unit, 0),
            "steady": deviation_text(*self.steady, self.unit, 0),
            "difference": deviation_text(*self.difference, difference_unit(self.unit), 0, "+"),
        }

    @property
    def link(self) -> str:
        """Id of the explanation on the page."""
        return f"tool-{self.key}"


def tool_rows(own: Analysis, steady: Analysis) -> list[ToolRow]:
    """Return the quantities that a steady tool may change; all else of the two is the same."""
    facts, before, after = Facts(own), _values(own), _values(steady)
    rows = []
    for key, spread in before.items():
        kind = "rake_peak_degC" if key.startswith("rake_peak") else key
        template, surface = texts()["rows"]["tool"][kind], key[len("rake_peak_") : -len("_degC")]
        name = next((one for one in own.measurements if slug(one) == surface), "")
        quantity = facts.text(template["quantity"], surface=name)
        rows.append(ToolRow(key, quantity, template["unit"], spread, after[key], template["text"]))
    return rows


def _values(analysis: Analysis) -> Mapping[str, Spread]:
    assert analysis.cut is not None
    contacts = [
        contact_temperatures(one.frame, analysis.raster, one.tool, one.contact_length)
        for one in analysis.cut.segments
    ]
    chip, tool = (_spread(kelvins) for kelvins in zip(*contacts, strict=True))
    forces = analysis.cut.forces
    peaks = {
        f"rake_peak_{slug(name)}_degC": _peak(analysis, name) for name in analysis.measurements
    }
    return {
        "rake_chip_degC": (chip[0] - KELVIN, chip[1]),
        "rake_tool_degC": (tool[0] - KELVIN, tool[1]),
        **peaks,
        "rake_error_K": _error(analysis, "rake"),
        "band_error_K": _error(analysis, "band"),
        "cutting_N_per_mm": (1e-3 * forces.history.cutting_mean, nan) if forces else _UNKNOWN,
        "thrust_N_per_mm": (1e-3 * forces.history.thrust_mean, nan) if forces else _UNKNOWN,
    }


def _peak(analysis: Analysis, name: str) -> Spread:
    """Return the peak of the measured profile nearest the rake face over the frames, in °C."""
    assert analysis.tool is not None
    try:
        grid = rake_grid(analysis.measurements[name], analysis.tool)
    except ValueError:
        return _UNKNOWN
    mean, deviation = _spread(max(filter(isfinite, one), default=nan) for one in grid.mean[:, 0])
    return mean - KELVIN, deviation


def _error(analysis: Analysis, name: str) -> Spread:
    found = headline(analysis.data, name)
    return (found.error.mean, found.error.standard_deviation) if found else _UNKNOWN


def _spread(values: Iterable[float]) -> Spread:
    known = [value for value in values if isfinite(value)]
    if not known:
        return _UNKNOWN
    return float(np.mean(known)), float(np.std(known, ddof=1)) if len(known) > 1 else nan
