"""The paper's figures beside ours, with their scatter, and whether the two differ."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite, nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis import Distribution, Headline, LocalError, StudyResult
from chipglow.quantities.format import quantity_text
from chipglow.report import evidence
from chipglow.report.page import Term
from chipglow.report.paper import PAPER, PaperValue, stands_beside


@dataclass(frozen=True)
class Row:
    """One quantity of the paper beside ours.

    Parameters
    ----------
    key : str
        Name for scripts, with the unit at its end.
    quantity : str
        What it is.
    unit : str
        Unit of the numbers, as printed.
    paper, here : float or None
        The paper's figure and ours, the mean where it was drawn; None where there is none.
    decimals : int
        Decimals worth printing.
    explanation : str
        What makes it, or what ours says.
    where : str
        Where the figure stands in the paper; empty without.
    draws : Distribution or None
        What `here` is the mean of, in the same unit; None where it is one number.
    one_draw : float or None
        What the paper's procedure gives, from one frame.
    uncertainty : float or None
        Standard uncertainty of `here` where it was not drawn, or how it varies over time or from
        segment to segment, if it is known.
    """

    key: str
    quantity: str
    unit: str
    paper: float | None
    here: float | None
    decimals: int
    explanation: str
    where: str = ""
    draws: Distribution | None = None
    one_draw: float | None = None
    uncertainty: float | None = None

    @property
    def differs(self) -> bool | None:
        """Whether the paper's figure lies outside what one more draw would give; None: unknown.

        Where ours was not drawn: whether the two are more than twice its uncertainty apart.
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
        """The paper's figure with its unit, or a dash."""
        return self._text(self.paper)

    @property
    def here_text(self) -> str:
        """Our figure with its scatter or uncertainty and its unit, or a dash."""
        scatter = self.draws.standard_deviation if self.draws is not None else self.uncertainty
        if self.here is None or scatter is None or not isfinite(scatter):
            return self._text(self.here)
        number, spread = (quantity_text(value, "", self.decimals) for value in (self.here, scatter))
        return f"{number} ± {spread} {self.unit}".strip()

    @property
    def interval_text(self) -> str:
        """Where one more draw lies with 95 % probability, or a dash."""
        ends = self.draws.interval if self.draws is not None else (nan, nan)
        if not all(map(isfinite, ends)):
            return "–"
        low, high = (quantity_text(end, "", self.decimals) for end in ends)
        return f"{low} to {high} {self.unit}".strip()

    @property
    def one_draw_text(self) -> str:
        """What one frame by the paper's procedure gives, or a dash."""
        return self._text(self.one_draw)

    @property
    def differs_text(self) -> str:
        """Whether the two differ: yes, no, or a dash where it is unknown."""
        return {None: "–", True: "yes", False: "no"}[self.differs]

    @property
    def term(self) -> Term:
        """What makes it, or how it is found."""
        return Term(f"why-{self.key}", self.quantity, self.explanation)

    def _text(self, value: float | None) -> str:
        return quantity_text(value, self.unit, self.decimals)


@dataclass(frozen=True)
class PartRow:
    """Of what one headline error consists, draw by draw, in °C.

    Parameters
    ----------
    key, quantity : str
        As those of the headline's `Row`.
    error : Distribution
        All of it.
    parts : mapping of Distribution
        ``psf``; ``motion`` and ``footprint`` where the motion's part is known, else ``rest``.
    """

    key: str
    quantity: str
    error: Distribution
    parts: Mapping[str, Distribution]

    @property
    def error_text(self) -> str:
        """The error's mean ± standard deviation."""
        return _mean_text(self.error)

    def text(self, name: str) -> str:
        """A part's mean ± standard deviation, or a dash."""
        return _mean_text(self.parts[name]) if name in self.parts else "–"


@dataclass(frozen=True)
class CauseRow:
    """What makes one headline scatter, in percent of its sum of squares, and by how much.

    Parameters
    ----------
    key, quantity, unit : str
        As those of the headline's `Row`.
    causes : tuple of tuple
        Of each cause: its name, how many values it took, the standard deviation of the means in
        the headline's unit (None for one value), its fraction in percent.
    decimals : int
        Decimals of the standard deviation worth printing.
    """

    key: str
    quantity: str
    unit: str
    causes: tuple[tuple[str, int, float | None, float], ...]
    decimals: int

    @property
    def texts(self) -> tuple[str, ...]:
        """Standard deviation and fraction of each cause; a dash for one of a single value."""
        return tuple(
            f"{quantity_text(deviation, self.unit, self.decimals)} ({fraction:.0f} %)"
            if deviation is not None
            else "–"
            for _, _, deviation, fraction in self.causes
        )


def comparison_rows(result: StudyResult) -> list[Row]:
    """Every figure of the paper that the study gives anew, and what the paper does not give.

    Parameters
    ----------
    result : StudyResult
        The study.

    Returns
    -------
    list of Row
        The paper's quantities first.
    """
    return [*error_rows(result), *cut_rows(result)]


def cut_rows(result: StudyResult) -> list[Row]:
    """What the cut gives without a camera: period, forces, contact, shear band.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    rows = [*_period_rows(result), *_further_rows(result)]
    if stands_beside(result):
        return rows
    return [replace(row, paper=None, where="") for row in rows]


def part_rows(result: StudyResult) -> list[PartRow]:
    """Of what the errors of the answer consist.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    quantities = {row.key: row.quantity for row in error_rows(result)}
    return [
        PartRow(
            key := f"{name}_error_degC",
            quantities[key],
            headline.error,
            _parts(result, name, headline),
        )
        for name, headline in result.draws.headlines.items()
        if name in ("rake", "band", "band_worst")
    ]


def _parts(result: StudyResult, name: str, headline: Headline) -> dict[str, Distribution]:
    error, psf = headline.error, headline.psf_portion
    rest = error.values - psf.values
    motions = {"rake": result.draws.rake_line.motion, "band": result.draws.band_line.motion}
    motion = motions.get(name)
    # It is known where the line crosses face or ridge, and against the peak of the exposure.
    if motion is None or result.plan.reference != "maximum" or not np.isfinite(motion).all():
        return {"psf": psf, "rest": Distribution(rest, error.causes)}
    moved = np.broadcast_to(motion[..., None], rest.shape)
    return {
        "psf": psf,
        "motion": Distribution(moved, error.causes),
        "footprint": Distribution(rest - moved, error.causes),
    }


def comparison_frame(result: StudyResult) -> pd.DataFrame:
    """The numbers of `comparison_rows`, a row each.

    Parameters
    ----------
    result : StudyResult
        The study.

    Returns
    -------
    pandas.DataFrame
        By their key: columns ``quantity``, ``unit``, ``paper``, ``here``, the
        ``standard_deviation`` of its draws with the ``least`` and the ``greatest``, ``one_draw``,
        the ``uncertainty`` of what was not drawn, and ``differs``; None or NaN where unknown.
    """
    rows = comparison_rows(result)
    draws = [(row.draws.standard_deviation, *row.draws.range) if row.draws else () for row in rows]
    scatter = pd.DataFrame(draws, columns=["standard_deviation", "least", "greatest"])
    names = ("quantity", "unit", "paper", "here", "one_draw", "uncertainty", "differs")
    frame = pd.DataFrame([{name: getattr(row, name) for name in names} for row in rows])
    return frame.join(scatter).set_index(pd.Index([row.key for row in rows], name="key"))


def cause_rows(result: StudyResult) -> list[CauseRow]:
    """What makes the headlines scatter.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    return [
        CauseRow(
            key=row.key,
            quantity=row.quantity,
            unit=row.unit,
            causes=tuple(
                (name, part.draws, known(part.standard_deviation), 100 * part.fraction)
                for name, part in row.draws.parts.items()
            ),
            decimals=row.decimals,
        )
        for row in error_rows(result)
        if row.draws is not None and row.draws.draws > 1
    ]


def error_rows(result: StudyResult) -> list[Row]:
    """The camera's errors and the point spread function's portion of each.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    return list(_error_rows(result))


def _error_rows(result: StudyResult) -> Iterator[Row]:
    rake, band = result.rake, result.band_errors
    on_rake, on_band = result.plan.rake_surface, result.plan.band_surface
    yield from _headline(
        result,
        "rake",
        f"Error at the rake face, mid-contact ({on_rake})",
        rake.face,
        (PAPER.rake_error, PAPER.rake_psf_fraction),
        (evidence.rake_error(result), evidence.rake_fraction(result)),
    )
    yield from _headline(
        result,
        "rake_extremum",
        f"Most negative error within two pixels of the rake face ({on_rake})",
        rake.extremum,
        (PAPER.rake_error, PAPER.rake_psf_fraction),
        (
            "On the same line. The error rises steeply to either side of its extremum, which "
            "moves with the pixels; read at the face it is often less.",
            "At the same place.",
        ),
    )
    yield from _headline(
        result,
        "rake_mean",
        f"Mean error along the contact ({on_rake})",
        rake.along_contact,
        (None, None),
        (evidence.contact(result), "Of the mean along the contact."),
    )
    yield from _headline(
        result,
        "band",
        f"Error at the centre of the shear band, by the ridge of strain rate ({on_band})",
        band.centre,
        (PAPER.band_error, PAPER.band_psf_fraction),
        (evidence.band_error(result), evidence.band_fraction(result)),
    )
    yield from _headline(
        result,
        "band_measured",
        f"The same, by the ridge of measured temperature ({on_band})",
        band.measured_centre,
        (PAPER.band_error, PAPER.band_psf_fraction),
        (
            "Where the measured temperature is greatest within two pixels of the ridge of strain "
            "rate: the centre for somebody who has the image alone.",
            "At the same place.",
        ),
    )
    yield from _headline(
        result,
        "band_worst",
        f"Most negative error beside the shear band ({on_band})",
        band.worst,
        (PAPER.band_worst, None),
        (evidence.band_worst(result), "At the same place."),
    )


def _period_rows(result: StudyResult) -> list[Row]:
    if result.forces is None:
        return []
    segments, inert = result.forces.segmentation, result.forces.inertia
    return [
        Row(
            "segment_period_us",
            "Segment period",
            "µs",
            PAPER.segment_period.value * 1e6,
            known(segments.period * 1e6),
            0,
            evidence.period(result, result.forces.segmentation),
            PAPER.segment_period.where,
            uncertainty=known(segments.period_uncertainty * 1e6),
        ),
        own_row(
            "force_segments_count",
            "Segments in the force history",
            "",
            float(segments.segments),
            0,
            f"Peaks of the cutting force after {segments.start * 1e6:.0f} µs.",
        ),
        own_row(
            "cutting_force_mean_N_per_mm",
            "Mean cutting force",
            "N/mm",
            segments.cutting_mean * 1e-3,
            0,
            evidence.beside(result, "Per width of cut.", "The paper gives no forces."),
        ),
        own_row(
            "cutting_force_swing_N_per_mm",
            "Swing of the cutting force",
            "N/mm",
            segments.cutting_swing * 1e-3,
            0,
            "Mean height of the peaks over the valleys between them.",
        ),
        own_row(
            "thrust_force_mean_N_per_mm",
            "Mean thrust force",
            "N/mm",
            segments.thrust_mean * 1e-3,
            0,
            evidence.beside(result, "Per width of cut.", "The paper gives no forces."),
        ),
        own_row(
            "energy_unaccounted_percent",
            "Work that the energy balance does not find",
            "%",
            result.forces.unaccounted * 100,
            1,
            "Work of the drive less kinetic and elastic energy, plastic and friction work, and the "
            "elastic energy lost by sharing dilation: what the solver's grid dissipates.",
        ),
        own_row(
            "kinetic_fraction_percent",
            "Kinetic energy of the scaled mass over the work, at most",
            "%",
            inert.kinetic_fraction * 100,
            2,
            "Its change since the start, after the build-up: how much the scaling of the mass can "
            f"matter. {inert.warning}".strip(),
        ),
        own_row(
            "inertia_force_fraction_percent",
            "Momentum flux of the scaled mass over the cutting force",
            "%",
            inert.force_fraction * 100,
            2,
            "Density times speed squared times uncut chip thickness: what stops it is part of the "
            f"force. The true mass has 1/{inert.mass_scaling:g} of it.",
        ),
    ]


def _further_rows(result: StudyResult) -> list[Row]:
    segments = result.segments
    contacts = np.array([segment.contact_length for segment in segments])
    widths = np.array([segment.band_width for segment in segments])
    rates = np.array([segment.moment.rate.max() for segment in segments])
    middle = float(np.median([segment.moment.middle_rate for segment in segments]))
    lengths = np.array([segment.band.length for segment in segments])
    return [
        _of_segments(
            "contact_length_um",
            "Contact length on the rake face",
            "µm",
            contacts * 1e6,
            0,
            _contact_text(result),
        ),
        _of_segments(
            "band_width_um",
            "Width of the shear band",
            "µm",
            widths * 1e6,
            1,
            evidence.beside(
                result,
                "Full width at half maximum of the plastic strain rate at one moment, median over "
                "the band's middle half.",
                "The paper's error depends on its own, which it does not state.",
            ),
        ),
        _of_segments(
            "band_peak_rate_per_s",
            "Greatest plastic strain rate on the shear band",
            "1/s",
            rates,
            -3,
            "The emissivity map takes 30 000 1/s and more for shear band wholly; the "
            f"median over our bands' middle halves is {_thousands(middle)} 1/s.",
        ),
        _of_segments(
            "band_length_um",
            "Length of the shear band",
            "µm",
            lengths * 1e6,
            0,
            f"It begins {result.band.start * 1e6:.0f} µm from the cutting edge and ends at "
            + ("the free surface." if result.band.reaches_surface else "the border of the view."),
        ),
    ]


def _contact_text(result: StudyResult) -> str:
    end = result.rake.contact.points[-1]
    left, _, _, top = result.raster.extent
    margin = 3 * result.raster.spacing
    if end[1] > top - margin or end[0] < left + margin:
        return "From the edge up to the border of the view: the chip touches beyond it."
    return "From the edge up to where the chip leaves the face."


def _headline(
    result: StudyResult,
    name: str,
    quantity: str,
    one_draw: LocalError,
    paper: tuple[PaperValue | None, PaperValue | None],
    explanations: tuple[str, str],
) -> Iterator[Row]:
    """The rows of an error and of the point spread function's part of it."""
    headline = result.draws.headlines.get(name)
    paper = paper if stands_beside(result) else (None, None)
    error = headline.error if headline else None
    fraction = headline.psf_fraction if headline else None
    yield _drawn(
        f"{name}_error_degC", quantity, "°C", paper[0], error, one_draw.error, explanations[0]
    )
    yield _drawn(
        f"{name}_psf_fraction_percent",
        "PSF's portion of it",
        "%",
        paper[1],
        fraction,
        one_draw.psf_fraction,
        explanations[1],
        scale=100.0,
    )


def _drawn(
    key: str,
    quantity: str,
    unit: str,
    paper: PaperValue | None,
    draws: Distribution | None,
    one_draw: float,
    explanation: str,
    scale: float = 1.0,
) -> Row:
    drawn = Distribution(scale * draws.values, draws.causes) if draws else None
    if drawn and paper:
        explanation = evidence.joined(explanation, evidence.place(drawn, scale * paper.value, unit))
    return Row(
        key,
        quantity,
        unit,
        scale * paper.value if paper else None,
        drawn.mean if drawn else None,
        0,
        explanation,
        paper.where if paper else "",
        drawn,
        known(scale * one_draw),
    )


def _of_segments(
    key: str, quantity: str, unit: str, values: NDArray[np.float64], decimals: int, explanation: str
) -> Row:
    found = values[np.isfinite(values)]
    draws = Distribution(found, ("segment",)) if found.size else None
    return Row(
        key,
        quantity,
        unit,
        None,
        draws.mean if draws else None,
        decimals,
        explanation,
        draws=draws,
        one_draw=known(float(values[0])),
    )


def _mean_text(draws: Distribution) -> str:
    spread = draws.standard_deviation
    if not isfinite(spread):
        return quantity_text(draws.mean, "°C", 0)
    return f"{quantity_text(draws.mean, '', 0)} ± {quantity_text(spread, '°C', 0)}"


def own_row(
    key: str,
    quantity: str,
    unit: str,
    here: float,
    decimals: int,
    explanation: str,
    uncertainty: float = nan,
) -> Row:
    """A quantity that is not the paper's; see `Row`, NaN for what is unknown."""
    return Row(
        key, quantity, unit, None, known(here), decimals, explanation,
        uncertainty=known(uncertainty),
    )  # fmt: skip


def known(value: float) -> float | None:
    """The number, or None where it is unknown."""
    return float(value) if isfinite(value) else None


def _thousands(value: float) -> str:
    return f"{round(value, -3):,.0f}".replace(",", " ")
