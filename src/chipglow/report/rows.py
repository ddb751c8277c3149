"""The report's numbers as rows: errors with their scatter, cut, chip, camera; causes and parts."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import degrees, isfinite, nan
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis import Analysis, Cut, CuttingForces, Distribution, one_draw
from chipglow.analysis.reductions import Headline
from chipglow.camera import Camera
from chipglow.drawing.scales import KELVIN
from chipglow.laboratory.chip import ChipMetrics
from chipglow.quantities.format import quantity_text
from chipglow.report import paper
from chipglow.report.facts import Facts, texts
from chipglow.report.page import Term
from chipglow.report.paper import PAPER, PaperValue
from chipglow.scene import Raster

Values = Mapping[str, tuple[float, float]]
"""Values in the unit of their row and their standard uncertainties, by row; NaN where unknown."""

MAIN: Final = ("rake", "band", "band_worst")
"""Readings of a cut that the answer states."""

_ACROSS: Final = ("rake", "band")
"""Readings of a cut where its line of the same name crosses rake face or ridge."""


@dataclass(frozen=True)
class Row:
    """One quantity of the report, in its unit, and the published value if there is one.

    `here` is the result (the mean of its `draws`), `one_draw` that of a single frame. Without draws
    `uncertainty` is its standard uncertainty or its standard deviation over time or segments.
    `reference` belongs to an error: the reading of a camera without error in °C.
    """

    key: str
    quantity: str
    unit: str
    here: float | None
    decimals: int = 0
    explanation: str = ""
    draws: Distribution | None = None
    one_draw: float | None = None
    uncertainty: float | None = None
    reference: Distribution | None = None
    published: PaperValue | None = None

    @property
    def paper(self) -> float | None:
        """The published value."""
        return self.published.value if self.published else None

    @property
    def differs(self) -> bool | None:
        """Whether the published value lies outside the prediction interval; None if unknown.

        If the result was not drawn: whether the two are over two standard uncertainties apart.
        """
        if self.paper is None or self.here is None:
            return None
        if self.draws is not None:
            return self.draws.differs_from(self.paper) if self.draws.draws > 1 else None
        if self.uncertainty is None:
            return None
        return abs(self.here - self.paper) > 2 * self.uncertainty

    @property
    def paper_text(self) -> str:
        """The published value with its unit, or a dash."""
        return quantity_text(self.paper, self.unit, self.decimals)

    @property
    def here_text(self) -> str:
        """The result with its scatter or uncertainty and its unit, or a dash."""
        scatter = self.draws.standard_deviation if self.draws is not None else self.uncertainty
        return spread_text(self.here, scatter, self.unit, self.decimals)

    @property
    def interval_text(self) -> str:
        """The 95 % prediction interval, or a dash."""
        ends = self.draws.interval if self.draws is not None else (nan, nan)
        if not all(map(isfinite, ends)):
            return "–"
        low, high = (quantity_text(end, "", self.decimals) for end in ends)
        return f"{low} to {high} {self.unit}".strip()

    @property
    def one_draw_text(self) -> str:
        """The result of a single frame, or a dash."""
        return quantity_text(self.one_draw, self.unit, self.decimals)

    @property
    def differs_text(self) -> str:
        """Whether result and published value differ: yes, no, or a dash if unknown."""
        return {None: "–", True: "yes", False: "no"}[self.differs]

    @property
    def reference_text(self) -> str:
        """The reference, or a dash."""
        return draws_text(self.reference) if self.reference else "–"

    @property
    def term(self) -> Term:
        """The explanation with its id on the page; without one the id of the word's meaning."""
        general = "psf-contribution" if "_psf_" in self.key else "error"
        key = f"why-{self.key}" if self.explanation else general
        return Term(key, self.quantity, self.explanation)


@dataclass(frozen=True)
class PartRow:
    """Contributions to an error draw by draw in °C: psf, and motion and footprint or their rest."""

    key: str
    quantity: str
    error: Distribution
    parts: Mapping[str, Distribution]
    link: str


@dataclass(frozen=True)
class CauseRow:
    """Causes of the scatter of a row: name, number of values, standard deviation, fraction in %."""

    key: str
    quantity: str
    unit: str
    causes: tuple[tuple[str, int, float | None, float], ...]
    link: str

    @property
    def cells(self) -> tuple[str, ...]:
        """Standard deviation and fraction of each cause; a dash for one with a single value."""
        return tuple(
            "–" if deviation is None else f"{quantity_text(deviation, self.unit, 0)} ({part:.0f} %)"
            for _, _, deviation, part in self.causes
        )


def result_rows(analysis: Analysis, study: object = None) -> list[Row]:
    """Return all errors of an analysis and, for a cut, period, forces, contact and shear band.

    Parameters
    ----------
    analysis : Analysis
        The analysis.
    study : Study, optional
        Its study; published values are included if it is the paper's.
    """
    facts = Facts(analysis, study)
    return [*error_rows(facts), *cut_rows(facts)]


def results_frame(analysis: Analysis, study: object = None) -> pd.DataFrame:
    """Return the numbers of `result_rows`, one row per key.

    Returns
    -------
    pandas.DataFrame
        Columns ``quantity``, ``unit``, ``paper``, ``here``, ``one_draw``, ``uncertainty``,
        ``differs``, and ``standard_deviation``, ``least`` and ``greatest`` of the draws; None or
        NaN where unknown.
    """
    rows = result_rows(analysis, study)
    draws = [(row.draws.standard_deviation, *row.draws.range) if row.draws else () for row in rows]
    scatter = pd.DataFrame(draws, columns=["standard_deviation", "least", "greatest"])
    names = ("quantity", "unit", "paper", "here", "one_draw", "uncertainty", "differs")
    frame = pd.DataFrame([{name: getattr(row, name) for name in names} for row in rows])
    return frame.join(scatter).set_index(pd.Index([row.key for row in rows], name="key"))


def error_rows(facts: Facts) -> list[Row]:
    """Return each error and the contribution of the point spread function to it."""
    rows: list[Row] = []
    for name in map(str, facts.data.reading.values):
        if name in facts.headlines or facts.analysis.cut is not None:
            rows += _reading(facts, name)
    return rows


def cut_rows(facts: Facts) -> list[Row]:
    """Return the results of a cut without a camera: period, forces, contact, shear band."""
    cut = facts.analysis.cut
    if cut is None:
        return []
    forces = _rows(facts, _force_values(cut.forces)) if cut.forces else []
    return [*forces, *_segment_rows(facts, _segment_values(cut))]


def chip_rows(facts: Facts) -> list[Row]:
    """Return the metrics of a cut's chip."""
    cut = facts.analysis.cut
    return _rows(facts, _chip_values(cut.chip)) if cut and cut.chip else []


def camera_rows(facts: Facts) -> list[Row]:
    """Return NETD and range of the camera; none without a detector."""
    return _rows(facts, _camera_values(facts.analysis.camera, facts.analysis.raster))


def part_rows(facts: Facts, errors: list[Row]) -> list[PartRow]:
    """Return the contributions to the errors: of a cut those of the answer, else all."""
    rows, by_key = [], {row.key: row for row in errors}
    for name, found in facts.headlines.items():
        if facts.analysis.cut is None or name in MAIN:
            row = by_key[f"{slug(name)}_error_degC"]
            parts = _parts(facts, name, found)
            rows.append(PartRow(row.key, row.quantity, found.error, parts, row.term.key))
    return rows


def _parts(facts: Facts, name: str, found: Headline) -> Mapping[str, Distribution]:
    psf, rest = found.psf_portion, found.error.values - found.psf_portion.values
    # Motion is known where a cut's line crosses face or ridge, and against the peak only.
    if name in _ACROSS and facts.analysis.cut and facts.analysis.plan.reference == "maximum":
        motion = facts.data.line_motion.sel(line=name).values[:, : rest.shape[1], None]
        if np.isfinite(motion).all():
            moved = np.broadcast_to(motion, rest.shape)
            motion, footprint = (Distribution(one, psf.causes) for one in (moved, rest - moved))
            return {"psf": psf, "motion": motion, "footprint": footprint}
    return {"psf": psf, "rest": Distribution(rest, psf.causes)}


def cause_rows(rows: list[Row]) -> list[CauseRow]:
    """Return the causes of the scatter of all rows with several draws."""
    return [
        CauseRow(
            row.key,
            row.quantity,
            row.unit,
            tuple(
                (name, part.draws, known(part.standard_deviation), 100 * part.fraction)
                for name, part in row.draws.parts.items()
            ),
            row.term.key,
        )
        for row in rows
        if row.draws is not None and row.draws.draws > 1
    ]


def _row(facts: Facts, key: str, here: float, kind: str = "", **more: Any) -> Row:
    """Return a row; `kind` names its texts if the key has none of its own."""
    template = texts()["rows"].get(key) or texts()["rows"][kind]
    draws = more.get("draws")
    decimals = _decimals(draws) if draws and template is texts()["rows"].get(kind) else 0
    names = {name: more.pop(name) for name in ("id", "name", "surface") if name in more}
    row = Row(
        key,
        facts.text(template["quantity"], **names),
        template["unit"],
        known(here),
        template.get("decimals", decimals),
        facts.text(template["text"], **names),
        **more,
    )
    return _compared(facts, row, names.get("id", "")) if facts.is_compared else row


def _compared(facts: Facts, row: Row, reading: str) -> Row:
    """Return a row with the published value and its comparison."""
    series = facts.series(reading, row.unit) if reading in MAIN else None
    widths = facts.data.psf_width.values if series is not None else np.empty(0)
    more = paper.comparison(row.key, row.draws, row.unit, widths, series)
    explanation = f"{row.explanation} {more}".strip()
    return replace(row, explanation=explanation, published=PAPER.get(row.key))


def _rows(facts: Facts, values: Values) -> list[Row]:
    """Return rows of values that were not drawn."""
    return [
        _row(facts, key, here, uncertainty=known(uncertainty))
        for key, (here, uncertainty) in values.items()
    ]


def _segment_rows(facts: Facts, values: Mapping[str, NDArray[np.float64]]) -> Iterator[Row]:
    """Yield rows of values of every segment; the first is that of the one draw."""
    for key, every in values.items():
        finite = every[np.isfinite(every)]
        draws = Distribution(finite, ("segment",)) if finite.size else None
        mean = draws.mean if draws else nan
        yield _row(facts, key, mean, draws=draws, one_draw=known(float(every[0])))


def _reading(facts: Facts, name: str) -> tuple[Row, Row]:
    """Return the rows of an error and of the contribution of the PSF to it."""
    found, one = facts.headlines.get(name), one_draw(facts.data, name)
    surface = str(facts.data.seen_surface.sel(reading=name).item())
    names, stem = {"id": name, "name": name, "surface": surface}, slug(name)
    error = _row(
        facts,
        f"{stem}_error_degC",
        found.error.mean if found else nan,
        "error_degC",
        draws=found.error if found else None,
        one_draw=known(one.error),
        reference=_shifted(found.reference, -KELVIN) if found else None,
        **names,
    )
    if found is None:
        error = replace(error, explanation=texts()["unread"])
    key, draws, one_psf = "psf_fraction_percent", None, 100 * one.psf_fraction
    if found and (fraction := found.psf_fraction):
        draws = Distribution(100.0 * fraction.values, fraction.causes)
    elif found and facts.analysis.cut is None:
        key, draws, one_psf = "psf_portion_degC", found.psf_portion, one.psf_portion
    mean = draws.mean if draws else nan
    part = _row(facts, f"{stem}_{key}", mean, key, draws=draws, one_draw=known(one_psf), **names)
    return error, part


def slug(name: str) -> str:
    """Return a name of letters, digits and underscores."""
    return re.sub(r"\W+", "_", name).strip("_")


def known(value: float) -> float | None:
    """Return the number, or None if it is not finite."""
    return float(value) if isfinite(value) else None


def draws_text(draws: Distribution | None, scale: float = 1.0) -> str:
    """Return mean and standard deviation of draws in °C, with a decimal for small numbers."""
    if draws is None:
        return "–"
    spread = draws.standard_deviation
    return spread_text(scale * draws.mean, spread, "°C", _decimals(draws))


def _decimals(draws: Distribution) -> int:
    """Return one decimal for numbers below ten, else none."""
    deviation = draws.standard_deviation
    size = max(abs(draws.mean), deviation if isfinite(deviation) else 0.0)
    return 0 if size >= 9.95 else 1


def spread_text(
    value: float | None, spread: float | None, unit: str, decimals: int, sign: str = ""
) -> str:
    """Return a number with its spread, if that is known, and its unit; a dash for None or NaN."""
    if value is None or not isfinite(value):
        return "–"
    if spread is None or not isfinite(spread):
        return quantity_text(value, unit, decimals, sign)
    number = quantity_text(value, "", decimals, sign)
    return f"{number} ± {quantity_text(spread, unit, decimals)}"


def _shifted(draws: Distribution, offset: float) -> Distribution:
    return Distribution(draws.values + offset, draws.causes)


def _force_values(forces: CuttingForces) -> Values:
    of, inertia = forces.segmentation, forces.inertia
    return {
        "segment_period_us": (1e6 * of.period, 1e6 * of.period_uncertainty),
        "force_segments_count": (of.segments, nan),
        "cutting_force_mean_N_per_mm": (1e-3 * of.cutting_mean, nan),
        "cutting_force_swing_N_per_mm": (1e-3 * of.cutting_swing, nan),
        "thrust_force_mean_N_per_mm": (1e-3 * of.thrust_mean, nan),
        "energy_unaccounted_percent": (100 * forces.unaccounted, nan),
        "kinetic_fraction_percent": (100 * inertia.kinetic_fraction, nan),
        "inertia_force_fraction_percent": (100 * inertia.force_fraction, nan),
    }


def _segment_values(cut: Cut) -> Mapping[str, NDArray[np.float64]]:
    segments = cut.segments
    return {
        "contact_length_um": np.array([1e6 * one.contact_length for one in segments]),
        "band_width_um": np.array([1e6 * one.band_width for one in segments]),
        "band_peak_rate_per_s": np.array([one.moment.rate.max() for one in segments]),
        "band_length_um": np.array([1e6 * one.band.length for one in segments]),
    }


def _chip_values(chip: ChipMetrics) -> Values:
    frequency_uncertainty = chip.frequency * chip.period_uncertainty / chip.period
    return {
        "segment_frequency_kHz": (1e-3 * chip.frequency, 1e-3 * frequency_uncertainty),
        "segment_spacing_um": (1e6 * chip.spacing, 1e6 * chip.spacing_uncertainty),
        "chip_spacing_um": (1e6 * chip.chip_spacing, nan),
        "feed_um": (1e6 * chip.feed, nan),
        "chip_thickness_um": (1e6 * chip.thickness, nan),
        "chip_peak_um": (1e6 * chip.peak, 1e6 * chip.peak_standard_deviation),
        "chip_valley_um": (1e6 * chip.valley, 1e6 * chip.valley_standard_deviation),
        "segmentation_degree_percent": (100 * chip.degree, nan),
        "chip_ratio": (chip.ratio, nan),
        "chip_speed_m_per_s": (chip.chip_speed, chip.chip_speed_standard_deviation),
        "chip_contact_um": (1e6 * chip.contact, 1e6 * chip.contact_standard_deviation),
        "shear_angle_deg": (
            degrees(chip.shear_angle),
            degrees(chip.shear_angle_standard_deviation),
        ),
        "shear_band_width_um": (1e6 * chip.band_width, 1e6 * chip.band_width_standard_deviation),
        "shear_band_rate_per_s": (chip.band_rate, nan),
        "shear_band_strain": (chip.band_strain, nan),
    }


def _camera_values(camera: Camera, scene: Raster) -> Values:
    """Return NETD and range of a camera that observes a scene; empty without a detector."""
    calibration = camera.calibration(camera.pixels(scene).shape)
    if calibration is None:
        return {}
    lower = nan if camera.lower_limit is None else camera.lower_limit
    return {
        "netd_half_K": (calibration.half_netd, nan),
        "netd_half_temperature_degC": (calibration.half_temperature - KELVIN, nan),
        "netd_lower_K": (calibration.netd(lower) if isfinite(lower) else nan, nan),
        "lower_limit_degC": (lower - KELVIN, nan),
        "saturated_degC": (calibration.full_temperature - KELVIN, nan),
    }
