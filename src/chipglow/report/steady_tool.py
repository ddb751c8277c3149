"""A study compared with the same one with a tool at steady-state temperature."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from math import hypot, isfinite, nan
from typing import NamedTuple

import numpy as np

from chipglow.analysis import Analysis, CuttingForces, headline
from chipglow.laboratory.chip import contact_temperatures, rake_grid
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import deviation_text, difference_unit, slug
from chipglow.report.shown_units import in_unit

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


class _Number(NamedTuple):
    """A quantity that a steady tool may change."""

    key: str
    unit: str
    value: Callable[[Analysis], Spread]
    """Returns it in this unit."""
    texts: str = ""
    """Key of its texts, if it is another one."""
    surface: str = ""


def tool_rows(own: Analysis, steady: Analysis) -> list[ToolRow]:
    """Return the quantities that a steady tool may change; all else of the two is the same."""
    facts = Facts(own)
    rows = []
    for number in _numbers(own):
        template = texts()["tool_rows"][number.texts or number.key]
        rows.append(
            ToolRow(
                key=number.key,
                quantity=facts.text(template["quantity"], surface=number.surface),
                unit=number.unit,
                own=number.value(own),
                steady=number.value(steady),
                explanation=template["text"],
            )
        )
    return rows


def _numbers(analysis: Analysis) -> Iterator[_Number]:
    yield _Number("rake_chip_degC", "°C", _chip_temperature)
    yield _Number("rake_tool_degC", "°C", _tool_temperature)
    for name in analysis.measurements:
        key, value = f"rake_peak_{slug(name)}_degC", partial(_peak, name=name)
        yield _Number(key, "°C", value, texts="rake_peak_degC", surface=name)
    yield _Number("rake_error_K", "K", partial(_error, name="rake"))
    yield _Number("band_error_K", "K", partial(_error, name="band"))
    yield _Number("cutting_N_per_mm", "N/mm", _cutting_force)
    yield _Number("thrust_N_per_mm", "N/mm", _thrust_force)


def _chip_temperature(analysis: Analysis) -> Spread:
    """Return the temperature of the chip beside the contact over the segments, in °C."""
    return _in_celsius(_spread(chip for chip, _ in _beside_contacts(analysis)))


def _tool_temperature(analysis: Analysis) -> Spread:
    """Return the temperature of the tool beside the contact over the segments, in °C."""
    return _in_celsius(_spread(tool for _, tool in _beside_contacts(analysis)))


def _beside_contacts(analysis: Analysis) -> Iterator[tuple[float, float]]:
    """Yield the mean temperatures of chip and tool beside the contact of each segment, in K."""
    assert analysis.cut is not None
    for segment in analysis.cut.segments:
        yield contact_temperatures(
            segment.frame, analysis.raster, segment.tool, segment.contact_length
        )


def _cutting_force(analysis: Analysis) -> Spread:
    """Return the mean cutting force in N/mm."""
    forces = _forces(analysis)
    return (in_unit(forces.history.cutting_mean, "N/mm"), nan) if forces else _UNKNOWN


def _thrust_force(analysis: Analysis) -> Spread:
    """Return the mean thrust force in N/mm."""
    forces = _forces(analysis)
    return (in_unit(forces.history.thrust_mean, "N/mm"), nan) if forces else _UNKNOWN


def _forces(analysis: Analysis) -> CuttingForces | None:
    assert analysis.cut is not None
    return analysis.cut.forces


def _peak(analysis: Analysis, name: str) -> Spread:
    """Return the peak of the measured profile nearest the rake face over the frames, in °C."""
    assert analysis.tool is not None
    try:
        grid = rake_grid(analysis.measurements[name], analysis.tool)
    except ValueError:
        return _UNKNOWN
    return _in_celsius(_spread(max(filter(isfinite, one), default=nan) for one in grid.mean[:, 0]))


def _error(analysis: Analysis, name: str) -> Spread:
    found = headline(analysis.data, name)
    return (found.error.mean, found.error.standard_deviation) if found else _UNKNOWN


def _in_celsius(kelvins: Spread) -> Spread:
    mean, deviation = kelvins
    return in_unit(mean, "°C"), deviation


def _spread(values: Iterable[float]) -> Spread:
    known = [value for value in values if isfinite(value)]
    if not known:
        return _UNKNOWN
    return float(np.mean(known)), float(np.std(known, ddof=1)) if len(known) > 1 else nan
