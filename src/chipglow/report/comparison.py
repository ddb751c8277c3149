"""The paper's figures beside ours, each difference with its evidence."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from chipglow.analysis.paper import PAPER, PaperValue, StudyResult
from chipglow.report import evidence
from chipglow.report.quantity import quantity_text


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
        The paper's figure and ours; None where there is none.
    decimals : int
        Decimals worth printing.
    explanation : str
        Why they differ, or what ours says.
    where : str
        Where the figure stands in the paper; empty without.
    """

    key: str
    quantity: str
    unit: str
    paper: float | None
    here: float | None
    decimals: int
    explanation: str
    where: str = ""

    @property
    def difference(self) -> float | None:
        """Ours less the paper's; None where one is missing."""
        if self.paper is None or self.here is None:
            return None
        return self.here - self.paper

    @property
    def paper_text(self) -> str:
        """The paper's figure with its unit, or a dash."""
        return quantity_text(self.paper, self.unit, self.decimals)

    @property
    def here_text(self) -> str:
        """Our figure with its unit, or a dash."""
        return quantity_text(self.here, self.unit, self.decimals)

    @property
    def difference_text(self) -> str:
        """The difference with its sign and unit, or a dash; of shares in percentage points."""
        text = quantity_text(self.difference, self.unit, self.decimals, sign="+")
        return text.replace("%", "points")


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
    return [*_error_rows(result), *_period_rows(result), *_further_rows(result)]


def _error_rows(result: StudyResult) -> list[Row]:
    rake, band = result.rake, result.band_errors
    on_rake, on_band = result.plan.rake_surface, result.plan.band_surface
    return [
        _error(
            "rake_error_degC",
            f"Error at the rake face, mid-contact ({on_rake})",
            PAPER.rake_error,
            rake.error,
            evidence.rake_error(result),
        ),
        _share(
            "rake_psf_share_percent",
            "PSF's share of it",
            PAPER.rake_psf_share,
            rake.psf_share,
            evidence.rake_share(result),
        ),
        _error(
            "band_error_degC",
            f"Error at the centre of the shear band ({on_band})",
            PAPER.band_error,
            band.error,
            evidence.band_error(result),
        ),
        _share(
            "band_psf_share_percent",
            "PSF's share of it",
            PAPER.band_psf_share,
            band.psf_share,
            evidence.band_share(result),
        ),
        _error(
            "band_worst_error_degC",
            f"Most negative error beside the shear band ({on_band})",
            PAPER.band_worst,
            band.worst,
            evidence.band_worst(result),
        ),
    ]


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
            _known(segments.period * 1e6),
            0,
            evidence.period(result.forces.segmentation),
            PAPER.segment_period.where,
        ),
        _own(
            "force_segments_count",
            "Segments in the force history",
            "",
            float(segments.segments),
            0,
            f"Peaks of the cutting force after {segments.start * 1e6:.0f} µs.",
        ),
        _own(
            "cutting_force_mean_N_per_mm",
            "Mean cutting force",
            "N/mm",
            segments.cutting_mean * 1e-3,
            0,
            "Per width of cut; the paper gives no forces.",
        ),
        _own(
            "cutting_force_swing_N_per_mm",
            "Swing of the cutting force",
            "N/mm",
            segments.cutting_swing * 1e-3,
            0,
            "Mean height of the peaks over the valleys between them.",
        ),
        _own(
            "thrust_force_mean_N_per_mm",
            "Mean thrust force",
            "N/mm",
            segments.thrust_mean * 1e-3,
            0,
            "Per width of cut; the paper gives no forces.",
        ),
        _own(
            "energy_unaccounted_percent",
            "Work that the energy account does not find",
            "%",
            result.forces.unaccounted * 100,
            1,
            "Work of the drive less kinetic and elastic energy, plastic and friction work, and the "
            "elastic energy lost by sharing dilation: what the solver's grid dissipates.",
        ),
        _own(
            "kinetic_share_percent",
            "Kinetic energy of the scaled mass over the work, at most",
            "%",
            inert.kinetic_share * 100,
            2,
            "Its change since the start, after the build-up: how much the scaling of the mass can "
            f"matter. {inert.warning}".strip(),
        ),
        _own(
            "inertia_force_share_percent",
            "Momentum flow of the scaled mass over the cutting force",
            "%",
            inert.force_share * 100,
            2,
            "Density times speed squared times uncut chip thickness: what stops it is part of the "
            f"force. The true mass has 1/{inert.mass_scaling:g} of it.",
        ),
    ]


def _further_rows(result: StudyResult) -> list[Row]:
    rake = result.rake
    band = result.momentary_band or result.band
    low, high = rake.error_range
    return [
        _own(
            "rake_mean_error_degC",
            "Mean error along the contact",
            "°C",
            rake.mean_error,
            0,
            f"From {_celsius(low)} to {_celsius(high)} along the contact.",
        ),
        _own(
            "contact_length_um",
            "Contact length on the rake face",
            "µm",
            rake.contact_length * 1e6,
            0,
            _contact_text(result),
        ),
        _own(
            "band_width_um",
            "Width of the shear band",
            "µm",
            band.width * 1e6,
            1,
            "Full width at half maximum of the plastic strain rate at one moment, median over the "
            "band's middle half. The paper's error depends on its own, which it does not state.",
        ),
        _own(
            "band_peak_rate_per_s",
            "Greatest plastic strain rate on the shear band",
            "1/s",
            float(np.max(band.rate)),
            -3,
            "The paper's emissivity map takes 30 000 1/s and more for shear band wholly; the "
            f"median over our band's middle half is {_thousands(band.middle_rate)} 1/s.",
        ),
        _own(
            "band_length_um",
            "Length of the shear band",
            "µm",
            result.band.length * 1e6,
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


def _error(key: str, quantity: str, paper: PaperValue, here: float, explanation: str) -> Row:
    return Row(key, quantity, "°C", paper.value, _known(here), 0, explanation, paper.where)


def _share(key: str, quantity: str, paper: PaperValue, here: float, explanation: str) -> Row:
    percent = _known(100 * here)
    return Row(key, quantity, "%", 100 * paper.value, percent, 0, explanation, paper.where)


def _own(key: str, quantity: str, unit: str, here: float, decimals: int, explanation: str) -> Row:
    return Row(key, quantity, unit, None, _known(here), decimals, explanation)


def _known(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _celsius(value: float) -> str:
    return f"{value:.0f} °C".replace("-", "−")


def _thousands(value: float) -> str:
    return f"{round(value, -3):,.0f}".replace(",", " ")
