"""The numbers of a report: errors, forces, shear bands, chip and camera."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import floor, inf, isfinite, log10, nan
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from chipglow.analysis import Analysis, Cut, Distribution, Headline, one_draw
from chipglow.analysis.distribution import student_factor
from chipglow.chip import Segment
from chipglow.quantities import ZERO_CELSIUS
from chipglow.quantities.format import quantity_text
from chipglow.report import numbers, paper
from chipglow.report.facts import Facts
from chipglow.report.numbers import Entry, Source
from chipglow.report.page import texts
from chipglow.report.paper import PAPER, PaperValue

MAIN: Final = ("rake", "band", "band_worst")
"""Readings of a cut that the answer states."""

_ACROSS: Final = ("rake", "band")
"""Readings of a cut where its line of the same name crosses rake face or ridge."""

_READING_UNITS: Final = {
    "error_degC": "K",
    "true_error_degC": "K",
    "corrected_error_degC": "K",
    "psf_portion_degC": "K",
    "psf_fraction_percent": "%",
}
"""By the ends of the keys of a reading; errors are differences of temperatures."""

_FINEST_SPREAD: Final = 1e-6
"""Uncertainty below which numbers are equal but for the rounding of the computation."""


@dataclass(frozen=True)
class Row:
    """One quantity of the report, in its unit, and the published value, if known."""

    key: str
    quantity: str
    unit: str
    here: float | None  # the result, a mean of the draws
    decimals: int = 0
    explanation: str = ""
    draws: Distribution | None = None
    one_draw: float | None = None  # of a single frame
    uncertainty: float | None = None  # standard, or deviation over time
    freedom: float | None = None  # degrees of freedom of a standard uncertainty
    is_least: bool = False  # whether the true value may be greater, beyond the view
    reference: Distribution | None = None  # reading of a camera without error in °C
    published: PaperValue | None = None
    parts: Mapping[str, Distribution] = field(default_factory=dict)  # contributions to an error

    @property
    def differs(self) -> bool | None:
        """Whether the published value ± its rounding lies outside the 95 % interval.

        None if there is no interval.
        """
        if self.published is None or self.here is None:
            return None
        value, rounding = self.published.value, self.published.rounding
        if self.draws is not None:
            has_interval = isfinite(self.draws.interval[0])
            return self.draws.differs_from(value, rounding) if has_interval else None
        reach = self.expanded_uncertainty + rounding
        return abs(self.here - value) > reach if isfinite(reach) else None

    @property
    def expanded_uncertainty(self) -> float:
        """Expanded uncertainty of the result at a coverage of 95 %; infinite if unknown."""
        if self.draws is not None:
            return self.draws.expanded_uncertainty
        if self.uncertainty is None or self.freedom is None:
            return inf
        return student_factor(self.freedom) * self.uncertainty

    @property
    def cells(self) -> Mapping[str, str]:
        """The row in tables: texts by column, a dash where nothing is known."""
        draws = self.draws
        has_draws = draws is not None or self.freedom is not None
        spread = self.expanded_uncertainty if has_draws else self.uncertainty
        low, high = draws.interval if draws and not self.is_least else (nan, nan)
        ends = (quantity_text(known(end), "", self.decimals) for end in (low, high))
        written = spread_text if has_draws else deviation_text
        mean = written(self.here, None if self.is_least else spread, self.unit, self.decimals)
        causes = draws.parts if draws else {}
        return {
            "quantity": self.quantity,
            "paper": self.published.text(self.unit) if self.published else "–",
            "mean": f"more than {mean}" if self.is_least else mean,
            "interval": f"{' to '.join(ends)} {self.unit}".strip() if isfinite(low) else "–",
            "one-draw": quantity_text(self.one_draw, self.unit, self.decimals),
            "differs": {None: "–", True: "yes", False: "no"}[self.differs],
            "reference": draws_text(self.reference, unit="°C"),
            "error": draws_text(draws),
            **{name: draws_text(part) for name, part in self.parts.items()},
            **{
                name: f"{quantity_text(part.standard_deviation, self.unit, 0)} "
                f"({100 * part.fraction:.0f} %)"
                if isfinite(part.standard_deviation)
                else "–"
                for name, part in causes.items()
            },
        }

    @property
    def link(self) -> str:
        """Id of the explanation on the page; without one that of the word's meaning."""
        general = "psf-contribution" if "_psf_" in self.key else "error"
        return f"why-{self.key}" if self.explanation else general


class _Heading(NamedTuple):
    """Key and unit of a row, and the templates of its quantity and its explanation."""

    key: str
    unit: str
    texts: Mapping[str, str]


def result_rows(analysis: Analysis, study: Any = None) -> list[Row]:
    """Return all errors of an analysis and, for a cut, period, forces, contact and shear band."""
    rows = all_rows(Facts(analysis, study))
    return [*rows["errors"], *rows["cut"]]


def results_frame(analysis: Analysis, study: Any = None) -> pd.DataFrame:
    """Return the numbers of `result_rows` as a table, one row per key."""
    rows = result_rows(analysis, study)
    draws = [(row.draws.standard_deviation, *row.draws.range) if row.draws else () for row in rows]
    scatter = pd.DataFrame(draws, columns=["standard_deviation", "least", "greatest"])
    names = ("quantity", "unit", "here", "one_draw", "uncertainty", "differs")
    frame = pd.DataFrame([{name: getattr(row, name) for name in names} for row in rows])
    published = [row.published for row in rows]
    frame.insert(2, "paper", [one.value if one else None for one in published])
    frame.insert(3, "paper_rounding", [one.rounding if one else None for one in published])
    return frame.join(scatter).set_index(pd.Index([row.key for row in rows], name="key"))


def all_rows(facts: Facts) -> dict[str, list[Row]]:
    """Return the rows of the report: errors, cut, corrected temperatures, chip and camera."""
    cut = facts.analysis.cut
    names = map(str, facts.data.reading.values)
    errors = [_reading(facts, name) for name in names if cut or name in facts.headlines]
    return {
        "errors": [row for pair in errors for row in pair],
        "cut": [*_forces(facts, cut), *_segments(facts, cut)] if cut else [],
        "corrected": list(_corrected(facts, cut)) if cut else [],
        "chip": _chip(facts, cut) if cut else [],
        "camera": _camera(facts),
    }


def _forces(facts: Facts, cut: Cut) -> list[Row]:
    if cut.forces is None:
        return []
    return [_number_row(facts, entry, cut.forces) for entry in numbers.FORCES]


def _segments(facts: Facts, cut: Cut) -> list[Row]:
    return [_segment_row(facts, entry, cut) for entry in numbers.SEGMENT]


def _corrected(facts: Facts, cut: Cut) -> Iterator[Row]:
    """Yield the rows of the corrected places, and of the image around them."""
    words = texts()["corrected"]
    for window in cut.corrected:
        for place in window.places:
            names = {"place": place.name, "window": window}
            for entry in numbers.PLACE:
                key = f"{slug(place.name)}_{entry.key}"
                yield _number_row(facts, replace(entry, key=key), place, words[entry.key], names)
    for window in cut.corrected:
        for whole in numbers.WINDOW:
            key, names = f"{slug(window.surface)}_{whole.key}", {"window": window}
            yield _number_row(facts, replace(whole, key=key), window, words[whole.key], names)


def _chip(facts: Facts, cut: Cut) -> list[Row]:
    if cut.chip is None:
        return []
    return [_number_row(facts, entry, cut.chip) for entry in numbers.CHIP]


def _camera(facts: Facts) -> list[Row]:
    if facts.calibration is None:
        return []
    camera = numbers.CalibratedCamera(facts.analysis.camera, facts.calibration)
    return [_number_row(facts, entry, camera) for entry in numbers.CAMERA]


def _number_row(
    facts: Facts,
    entry: Entry[Source],
    source: Source,
    words: Mapping[str, str] | None = None,
    names: Mapping[str, Any] | None = None,
) -> Row:
    """Return the row of a number that was not drawn, by default with the texts of its key."""
    value = entry.shown(source)
    return _row(
        facts,
        _Heading(entry.key, entry.unit, words or texts()["rows"][entry.key]),
        value.number,
        names={"value": value.number, "uncertainty": value.uncertainty, **(names or {})},
        decimals=entry.decimals,
        uncertainty=known(value.uncertainty),
        freedom=known(value.freedom),
    )


def _segment_row(facts: Facts, entry: Entry[Segment], cut: Cut) -> Row:
    """Return the row of a value of every segment; the first belongs to the one draw."""
    every = np.array([entry.shown(segment).number for segment in cut.segments])
    finite = every[np.isfinite(every)]
    draws = Distribution(finite, ("segment",), limits=(0.0, inf)) if finite.size else None
    raster = facts.analysis.raster
    is_least = any(entry.is_truncated(segment, raster) for segment in cut.segments)
    return _row(
        facts,
        _Heading(entry.key, entry.unit, texts()["rows"][entry.key]),
        draws.mean if draws else nan,
        names={"is_least": is_least},
        decimals=entry.decimals,
        draws=draws,
        one_draw=known(every[0]),
        is_least=is_least,
    )


def _reading(facts: Facts, name: str) -> Iterator[Row]:
    """Yield the rows of an error and of the contribution of the PSF to it."""
    found, one = facts.headlines.get(name), one_draw(facts.data, name)
    is_main = name in MAIN or facts.analysis.cut is None
    if found is None:
        error = _drawn(facts, name, "error_degC", None, one.error)
        yield replace(error, explanation=texts()["unread"])
    else:
        celsius = found.reference.having(found.reference.values - ZERO_CELSIUS)
        parts = _parts(facts, name, found) if is_main else {}
        more: Any = {"reference": celsius, "parts": parts}
        yield _drawn(facts, name, "error_degC", found.error, one.error, **more)
    fraction = found.psf_fraction if found else None
    if found and facts.analysis.cut is None:
        yield _drawn(facts, name, "psf_portion_degC", found.psf_portion, one.psf_portion)
    else:
        draws = fraction and replace(fraction, values=100 * fraction.values, limits=(0.0, 100.0))
        single = one.psf_portion / one.error if one.error else nan
        yield _drawn(facts, name, "psf_fraction_percent", draws, 100 * single)
    if found and is_main:
        yield _drawn(facts, name, "true_error_degC", found.true_error, one.true_error)
        yield _drawn(
            facts, name, "corrected_error_degC", found.corrected_error, one.corrected_error
        )


def _drawn(
    facts: Facts, name: str, kind: str, draws: Distribution | None, one: float, **more: Any
) -> Row:
    """Return a row of a reading; `kind` names its texts if it has no special ones."""
    key, readings = f"{slug(name)}_{kind}", texts()["readings"]
    if key not in readings and draws:
        more["decimals"] = _decimals(draws)
    reading = facts.data.sel(reading=name)
    surface, place = (str(reading[one].item()) for one in ("seen_surface", "place"))
    where = place if name in MAIN else name
    if name == "band_worst":
        where = "beside the shear band"
    names = {"id": name, "name": name, "surface": surface, "where": where}
    more |= {"draws": draws, "one_draw": known(one)}
    mean = draws.mean if draws else nan
    heading = _Heading(key, _READING_UNITS[kind], readings.get(key, readings[kind]))
    return _row(facts, heading, mean, names, reading=name, **more)


def _row(
    facts: Facts,
    heading: _Heading,
    here: float,
    names: Mapping[str, Any],
    reading: str = "",
    **more: Any,
) -> Row:
    """Return a row; if the study is the paper's with the published value and its comparison."""
    key = heading.key
    quantity, text = (facts.text(heading.texts[name], **names) for name in ("quantity", "text"))
    row = Row(key, quantity, heading.unit, known(here), explanation=text, **more)
    if not facts.is_compared:
        return row
    series = facts.series(reading, row.unit) if reading in MAIN else None
    widths = facts.data.psf_width.values if series is not None else np.empty(0)
    compared = paper.comparison(key, row.draws, row.unit, widths, series)
    explanation = f"{text} {compared}".strip()
    return replace(row, explanation=explanation, published=PAPER.get(key))


def _parts(facts: Facts, name: str, found: Headline) -> Mapping[str, Distribution]:
    psf, rest = found.psf_portion, found.error.values - found.psf_portion.values
    # Motion is known where a cut's line crosses face or ridge, and against the peak only.
    if name in _ACROSS and facts.analysis.cut and facts.analysis.plan.reference == "maximum":
        motion = facts.data.line_motion.sel(line=name).values[:, : rest.shape[1], None]
        if np.isfinite(motion).all():
            moved = np.broadcast_to(motion, rest.shape)
            return {"psf": psf, "motion": psf.having(moved), "footprint": psf.having(rest - moved)}
    return {"psf": psf, "rest": psf.having(rest)}


def main_readings(facts: Facts) -> Iterator[str]:
    """Yield the first error at every place with every surface; of a cut its main ones."""
    is_cut = facts.analysis.cut is not None
    places = set()
    for name, found in facts.headlines.items():
        place = (found.place, found.surface)
        is_main_of_cut = is_cut and name in MAIN
        is_first_at_place = not is_cut and place not in places
        if is_main_of_cut or is_first_at_place:
            places.add(place)
            yield name


def slug(name: str) -> str:
    """Return a name of letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_")


def known(value: float) -> float | None:
    """Return the number, or None if it is not finite."""
    return float(value) if isfinite(value) else None


def draws_text(draws: Distribution | None, scale: float = 1.0, unit: str = "K") -> str:
    """Return mean and its expanded uncertainty, with a decimal for small numbers."""
    if draws is None:
        return "–"
    return spread_text(scale * draws.mean, draws.expanded_uncertainty, unit, _decimals(draws))


def _decimals(draws: Distribution) -> int:
    """Return one decimal for numbers below ten and for small uncertainties, else none."""
    deviation = draws.standard_deviation
    size = max(abs(draws.mean), deviation if isfinite(deviation) else 0.0)
    # 9.95 is the smallest number that rounds to 10.0, and 0.95 to 1.0 with one decimal.
    return 0 if size >= 9.95 and not draws.expanded_uncertainty < 0.95 else 1


def spread_text(
    value: float | None, spread: float | None, unit: str, decimals: int, sign: str = ""
) -> str:
    """Return a number ± its uncertainty, if known and not 0, and its unit; a dash for None or NaN.

    An uncertainty that would round to 0 is shown to its first digit.
    """
    if value is None or not isfinite(value):
        return "–"
    if spread is None or not _FINEST_SPREAD <= spread < inf:
        return quantity_text(value, unit, decimals, sign)
    if not round(spread, decimals):
        decimals = -floor(log10(spread))
    number = quantity_text(value, "", decimals, sign)
    return f"{number} ± {quantity_text(spread, unit, decimals)}"


def deviation_text(
    value: float | None, deviation: float | None, unit: str, decimals: int, sign: str = ""
) -> str:
    """Return a number, and the standard deviation of single values in brackets, if known."""
    text = spread_text(value, None, unit, decimals, sign)
    if text == "–" or deviation is None or not isfinite(deviation):
        return text
    return f"{text} (sd {quantity_text(deviation, difference_unit(unit), decimals)})"


def difference_unit(unit: str) -> str:
    """Return the unit of differences of values in a unit."""
    return "K" if unit == "°C" else unit
