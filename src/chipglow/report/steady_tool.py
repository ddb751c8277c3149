"""A study beside the same one with a tool that has been cutting for long."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import hypot, isfinite, nan
from typing import Final

import numpy as np

from chipglow.analysis import StudyResult
from chipglow.laboratory.chip import contact_temperatures
from chipglow.quantities.format import quantity_text
from chipglow.report.page import Line, Term, table_part
from chipglow.report.paper import PAPER, stands_beside

_Of = Callable[[StudyResult], tuple[float, float]]

_OVER_CUT: Final = "Mean over the cut."


@dataclass(frozen=True)
class ToolRow:
    """One quantity of a study with its own tool and with a steady one.

    Parameters
    ----------
    key : str
        Name for scripts, with the unit at its end.
    quantity : str
        What it is.
    unit : str
        Unit of the numbers, as printed.
    own, steady : tuple of float
        Mean and standard deviation of the frames, segments or draws; NaN where unknown.
    explanation : str
        What it is the mean of.
    """

    key: str
    quantity: str
    unit: str
    own: tuple[float, float]
    steady: tuple[float, float]
    explanation: str

    @property
    def difference(self) -> tuple[float, float]:
        """Steady less own, and the standard deviation of the difference of two single ones."""
        return self.steady[0] - self.own[0], hypot(self.steady[1], self.own[1])

    @property
    def line(self) -> Line:
        """The row of the report's table."""
        texts = (_text(self.own, self.unit), _text(self.steady, self.unit))
        return Line(
            (self.quantity, *texts, _text(self.difference, self.unit, "+")),
            self.unit,
            self.term.key,
        )

    @property
    def term(self) -> Term:
        """How it is found."""
        return Term(f"tool-{self.key}", f"Steady tool: {self.quantity}", self.explanation)


def tool_rows(own: StudyResult, steady: StudyResult) -> list[ToolRow]:
    """What a steady tool changes.

    Parameters
    ----------
    own, steady : StudyResult
        The study with its own tool and with a steady one; all else is the same.
    """
    beside = (
        "True temperature within 15 µm of the rake face along the contact; mean ± standard "
        "deviation of the segments."
    )
    peak = (
        "Radiance temperature in squares of 3 by 3 pixels (the paper's Figure 7); mean ± "
        "standard deviation of the frames' peaks."
    )
    kinds: list[tuple[str, str, str, _Of, str]] = [
        *(
            (
                f"rake_peak_{name.replace(' ', '_')}_degC",
                f"Peak of the measured profile nearest the rake face ({name})",
                "°C",
                partial(_peak, name),
                peak,
            )
            for name in own.surfaces
        ),
        *(
            (
                f"{name}_error_K",
                what,
                "K",
                partial(_error, name),
                "Mean ± standard deviation of the draws.",
            )
            for name, what in (
                ("rake", "Error at the rake face, mid-contact"),
                ("band", "Error at the centre of the shear band"),
            )
        ),
        ("cutting_N_per_mm", "Cutting force", "N/mm", partial(_force, "cutting_mean"), _OVER_CUT),
        ("thrust_N_per_mm", "Thrust force", "N/mm", partial(_force, "thrust_mean"), _OVER_CUT),
    ]
    (chip, tool), (steady_chip, steady_tool) = _beside(own), _beside(steady)
    return [
        ToolRow("rake_chip_degC", "Chip at the rake face", "°C", chip, steady_chip, beside),
        ToolRow("rake_tool_degC", "Tool at the rake face", "°C", tool, steady_tool, beside),
        *(
            ToolRow(key, quantity, unit, of(own), of(steady), explanation)
            for key, quantity, unit, of, explanation in kinds
        ),
    ]


def steady_tool_part(own: StudyResult, rows: list[ToolRow]) -> str:
    """The report's section, of `tool_rows`."""
    heads = ("Quantity", "This study's tool", "Steady tool", "Difference")
    return table_part(" ".join(_sentences(own, rows)), heads, (row.line for row in rows))


def _sentences(own: StudyResult, rows: list[ToolRow]) -> Iterator[str]:
    yield (
        "The same cut with a tool that has been cutting for long: it begins with the temperature "
        "that conduction from the contact to the holder makes."
    )
    peak = next((row for row in rows if row.key == f"rake_peak_{_key(own)}_degC"), None)
    if peak is None or not isfinite(peak.difference[0]) or not stands_beside(own):
        return
    yield (
        f"The peak of the paper's simulated profile nearest the rake face is about "
        f"{PAPER.rake_missing.value:.0f} °C under the measured one "
        f"({PAPER.rake_missing.where}). The steady tool raises ours by "
        f"{_text(peak.difference, '°C')}. How warm the paper's tool was is not known."
    )


def _key(result: StudyResult) -> str:
    return result.plan.rake_surface.replace(" ", "_")


def _beside(result: StudyResult) -> list[tuple[float, float]]:
    """Of the chip and of the tool, in °C."""
    found = [
        contact_temperatures(one.frame, result.raster, one.tool, one.contact_length)
        for one in result.segments
    ]
    spreads = (_spread(list(kelvins)) for kelvins in zip(*found, strict=True))
    return [(mean - 273.15, deviation) for mean, deviation in spreads]


def _peak(name: str, result: StudyResult) -> tuple[float, float]:
    grid = result.surfaces[name].rake_grid
    if grid is None:
        return nan, nan
    mean, deviation = _spread([max(filter(isfinite, one), default=nan) for one in grid.mean[:, 0]])
    return mean - 273.15, deviation


def _error(name: str, result: StudyResult) -> tuple[float, float]:
    headline = result.draws.headlines.get(name)
    if headline is None:
        return nan, nan
    draws = headline.error
    return draws.mean, draws.standard_deviation if draws.draws > 1 else nan


def _force(name: str, result: StudyResult) -> tuple[float, float]:
    if result.forces is None:
        return nan, nan
    return getattr(result.forces.segmentation, name) * 1e-3, nan


def _spread(values: list[float]) -> tuple[float, float]:
    """Mean and sample standard deviation of what is known."""
    known = [value for value in values if isfinite(value)]
    if not known:
        return nan, nan
    return float(np.mean(known)), float(np.std(known, ddof=1)) if len(known) > 1 else nan


def _text(value: tuple[float, float], unit: str, sign: str = "") -> str:
    mean, deviation = value
    if not isfinite(mean):
        return "–"
    if not isfinite(deviation):
        return quantity_text(mean, unit, 0, sign)
    return f"{quantity_text(mean, '', 0, sign)} ± {quantity_text(deviation, unit, 0)}"
