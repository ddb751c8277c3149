"""The chip's metrics as the report's second table."""

from math import degrees, isfinite, nan

from chipglow.laboratory.chip import ChipMetrics
from chipglow.report.comparison import Row, own_row


def chip_rows(chip: ChipMetrics) -> list[Row]:
    """What describes the chip, in the units of the report.

    Parameters
    ----------
    chip : ChipMetrics
        The chip.
    """
    return [*_segment_rows(chip), *_thickness_rows(chip), *_contact_rows(chip), *_band_rows(chip)]


def _segment_rows(chip: ChipMetrics) -> list[Row]:
    return [
        own_row(
            "segment_frequency_kHz",
            "Segmentation frequency",
            "kHz",
            chip.frequency * 1e-3,
            1,
            "1 over the period of the forces; ± is its standard uncertainty.",
            chip.frequency * chip.period_uncertainty / chip.period * 1e-3,
        ),
        _micrometres(
            "segment_spacing_um",
            "Uncut length of a segment",
            chip.spacing,
            "Period times cutting speed; ± is its standard uncertainty.",
            chip.spacing_uncertainty,
        ),
        _micrometres(
            "chip_spacing_um",
            "Length of a segment along the chip",
            chip.chip_spacing,
            "Period times the chip's speed: from band to band.",
        ),
    ]


def _thickness_rows(chip: ChipMetrics) -> list[Row]:
    return [
        _micrometres(
            "feed_um",
            "Uncut chip thickness",
            chip.feed,
            "From the workpiece at the left of the view.",
        ),
        _micrometres(
            "chip_thickness_um",
            "Chip thickness, mean",
            chip.thickness,
            _scan_text(chip) + " Mean over the chip's length.",
        ),
        _micrometres(
            "chip_peak_um",
            "Chip thickness, peaks",
            chip.peak,
            _segments_text(chip),
            chip.peak_standard_deviation,
        ),
        _micrometres(
            "chip_valley_um",
            "Chip thickness, valleys",
            chip.valley,
            _segments_text(chip),
            chip.valley_standard_deviation,
        ),
        own_row(
            "segmentation_degree_percent",
            "Degree of segmentation",
            "%",
            chip.degree * 100,
            0,
            "Peak less valley, over peak.",
        ),
        own_row(
            "chip_ratio",
            "Chip ratio",
            "",
            chip.ratio,
            2,
            "Uncut chip thickness over the chip's mean thickness.",
        ),
    ]


def _contact_rows(chip: ChipMetrics) -> list[Row]:
    return [
        own_row(
            "chip_speed_m_per_s",
            "Chip speed",
            "m/s",
            chip.chip_speed,
            2,
            "Up the rake face where the thickness is read; ± is the standard deviation over time.",
            chip.chip_speed_standard_deviation,
        ),
        _micrometres(
            "chip_contact_um",
            "Contact length, mean over time",
            chip.contact,
            "From the edge up the rake face."
            if isfinite(chip.contact)
            else "Unknown: the contact reaches the border of the view.",
            chip.contact_standard_deviation,
        ),
    ]


def _band_rows(chip: ChipMetrics) -> list[Row]:
    developed = "While the band is developed: to the surface, and at half its greatest rate or more"
    return [
        own_row(
            "shear_angle_deg",
            "Shear angle",
            "°",
            degrees(chip.shear_angle),
            1,
            f"{developed}. Line through the band's middle half.",
            degrees(chip.shear_angle_standard_deviation),
        ),
        _micrometres(
            "shear_band_width_um",
            "Width of the shear band, mean over time",
            chip.band_width,
            f"{developed}. Full width at half maximum of the strain rate.",
            chip.band_width_standard_deviation,
            decimals=1,
        ),
        own_row(
            "shear_band_rate_per_s",
            "Strain rate of the shear band",
            "1/s",
            chip.band_rate,
            -3,
            "Median over the band's middle half, at its greatest.",
        ),
        own_row(
            "shear_band_strain",
            "Plastic strain of a formed band",
            "",
            chip.band_strain,
            1,
            "The greatest that passes the line of the thickness, median over the middle half of "
            "the valleys' thickness.",
        ),
    ]


def _scan_text(chip: ChipMetrics) -> str:
    if not isfinite(chip.scan.height):
        return "The view cuts the chip at every height on the rake face."
    return f"On the normal to the rake face {chip.scan.height * 1e6:.0f} µm up from the edge."


def _segments_text(chip: ChipMetrics) -> str:
    count = f"{chip.segments} segment{'' if chip.segments == 1 else 's'}"
    return f"Of {count} that passed whole on that normal; one segment has no standard deviation."


def _micrometres(
    key: str,
    quantity: str,
    value: float,
    explanation: str,
    uncertainty: float = nan,
    decimals: int = 0,
) -> Row:
    return own_row(key, quantity, "µm", value * 1e6, decimals, explanation, uncertainty * 1e6)
