"""What Heigel and Whitenton (2010) published: values, figures, Tables 1 and 2."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import Analysis, Distribution
from chipglow.analysis.distribution import COVERAGE
from chipglow.quantities.format import quantity_text
from chipglow.study import Study
from chipglow.surface import Emissivity

Array = NDArray[np.float64]

CITATION: Final = (
    "J. C. Heigel, E. P. Whitenton: The effects of emissivity and camera point spread function on "
    "the temperature measurement of segmented chip formation using infrared thermography. "
    "Proceedings of the ASME International Manufacturing Science and Engineering Conference, 2010."
)


@dataclass(frozen=True)
class PaperValue:
    """A published value in the unit of the report's row, and its position in the paper."""

    value: float
    where: str


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the paper, and what is the same and different in ours."""

    number: str
    text: str


PAPER: Final[Mapping[str, PaperValue]] = {
    "rake_error_degC": PaperValue(-42.0, "abstract; Figure 11a shows about −40"),
    "rake_psf_fraction_percent": PaperValue(45.0, "abstract; the conclusion says half"),
    "rake_extremum_error_degC": PaperValue(-42.0, "abstract; Figure 11a shows about −40"),
    "rake_extremum_psf_fraction_percent": PaperValue(45.0, "abstract; the conclusion says half"),
    "band_error_degC": PaperValue(-46.0, "abstract, Figure 11b"),
    "band_psf_fraction_percent": PaperValue(15.0, "abstract; −7 of −46 in Figure 11b"),
    "band_measured_error_degC": PaperValue(-46.0, "abstract, Figure 11b"),
    "band_measured_psf_fraction_percent": PaperValue(15.0, "abstract; −7 of −46 in Figure 11b"),
    "band_worst_error_degC": PaperValue(-120.0, "Simulation measurement error, Figure 11b"),
    "segment_period_us": PaperValue(90.0, "Finite element analysis simulation"),
}
"""The values of Heigel and Whitenton (2010) that a study is compared with, by the report's rows."""

RAKE_MISSING: Final = PaperValue(100.0, "Chip Temperature Near the Tool Rake Face")
"""How far the paper's simulated profile is below its measured one at the rake face, in K."""

ROW_TEXTS: Final[Mapping[str, str]] = {
    "rake_psf_fraction_percent": "The paper shows its PSF as an image only.",
    "segment_period_us": "The paper's simulation has another flow stress and softening.",
    "cutting_force_mean_N_per_mm": "The paper gives no forces.",
    "thrust_force_mean_N_per_mm": "The paper gives no forces.",
    "band_width_um": "The paper's error depends on the width of its band, which it does not state.",
}
"""What the paper states about quantities of the report."""

FIGURES: Final[Mapping[str, PaperFigure]] = {
    "psf": PaperFigure(
        "Figure 2",
        "Different: the paper measured its PSF with a knife edge and shows an image without "
        "numbers; ours is calculated.",
    ),
    "heated-chips": PaperFigure(
        "Figure 3",
        "Table 1 lists the values. Same as the paper: temperatures, reflected laboratory of "
        "20 °C, Equation 2. Different: the strip is not a chip; a limit of 300 °C would hide "
        "emissivities of chip 1 below 0.46.",
    ),
    "heated-tool": PaperFigure(
        "Figure 4",
        "Same as the paper: temperature, mean and standard deviation of the emissivity. "
        "Different: the texture is random; the paper's insert has an uneven oxide with a gradient.",
    ),
    "scene": PaperFigure(
        "Figure 5",
        "Same as the paper: the fields, and how strain and strain rate determine the emissivity. "
        "Different: strain follows the material without remeshing, so formed bands stay sharp, "
        "and textures follow every point.",
    ),
    "measurement": PaperFigure(
        "Figure 6", "The paper's figure is the scheme of this calculation; here is its result."
    ),
    "rake-profiles": PaperFigure(
        "Figure 7",
        "Same as the paper: grid, limit, both chips. Different: the size of the squares (the "
        "paper's first centre at 7.5 µm means 15 µm), and our contact reaches the border of the "
        "view. Panel a of the paper is its measurement, whose data are not available.",
    ),
    "dual-spectrum": PaperFigure(
        "Figure 8",
        "Same as the paper: pairs of one moment, tool blacked out. Different: our infrared images "
        "can follow at any interval; the paper's camera takes 600 per second.",
    ),
    "band-curves": PaperFigure(
        "Figure 9",
        "Same as the paper: panels b and c. Different: bands of the paper's simulation have "
        "another length; its panel a is a measurement, whose data are not available.",
    ),
    "error-images": PaperFigure(
        "Figure 10",
        "Same as the paper: definition, cases and panels. Different: our PSF, as the paper shows "
        "its PSF as an image only.",
    ),
    "error-lines": PaperFigure(
        "Figure 11",
        "The published values are drawn as diamonds and as a dashed line. Different: the paper "
        "shows one draw.",
    ),
    "psf-sensitivity": PaperFigure(
        "", "Dashed: published values; the width of the paper's PSF is not stated."
    ),
    "forces": PaperFigure("", "The paper does not show forces."),
}
"""The figures of the paper by the report's figures."""


def stands_beside(study: object, analysis: Analysis) -> bool:
    """Whether an analysis is comparable with the paper: the study cuts and measures as it did."""
    return analysis.cut is not None and isinstance(study, Study) and study.is_papers


def comparison(
    key: str, draws: Distribution | None, unit: str, widths: Array, series: Array | None
) -> str:
    """Return how a row of the report compares with the paper, as sentences.

    `series` are its values with Gaussian PSFs of the widths in m; None if unknown.
    """
    sentences = [ROW_TEXTS.get(key, "")]
    paper = PAPER.get(key)
    if paper and series is not None:
        width, value = crossing(widths, series, paper.value), quantity_text(paper.value, unit, 0)
        sentences.append(
            f"None of them gives the paper's {value}."
            if width is None
            else f"The paper's {value} is reached at {width * 1e6:.3g} µm."
        )
    if paper and draws:
        sentences.append(position(draws, paper.value, unit))
    return " ".join(filter(None, sentences))


def position(draws: Distribution, paper: float, unit: str) -> str:
    """Return where a published value lies among the draws, and whether it differs."""
    if draws.draws < 2:
        return "A single draw does not show whether the paper's value differs."
    low, high = (f"{end:.0f}".replace("-", "−") for end in draws.interval)
    within = "outside" if draws.differs_from(paper) else "within"
    return (
        f"{draws.fraction_below(paper) * 100:.0f} % of our {draws.draws} draws are below the "
        f"paper's value, which lies {within} the {COVERAGE * 100:.0f} % prediction interval for "
        f"one further draw, {low} to {high} {unit}."
    )


def crossing(widths: Array, series: Array, target: float) -> float | None:
    """Return the first width at which a series reaches a value, by linear interpolation."""
    if series.size and series[0] == target:
        return float(widths[0])
    above = series >= target
    changes = np.flatnonzero(above[1:] != above[:-1])
    if changes.size == 0:
        return None
    i = int(changes[0])
    part = (target - series[i]) / (series[i + 1] - series[i])
    return float(widths[i] + part * (widths[i + 1] - widths[i]))


TABLE_1: Final = {
    "chip 1 chip body": Emissivity(0.42, 0.07),
    "chip 1 shear band": Emissivity(0.53, 0.05),
    "chip 2 chip body": Emissivity(0.77, 0.03),
    "chip 2 shear band": Emissivity(0.85, 0.02),
    "tool": Emissivity(0.58, 0.06),
}
"""Published emissivities: mean and standard deviation; the tool's is in the paper's text."""

TABLE_1_TEXT: Final = (
    "Same as the paper: procedure and published values. Different: here the true values are known."
)

TABLE_2_TEXT: Final = (
    "Settings of the cutting simulation. Not legible: the available copy of the paper does not "
    "show this cell."
)

QUICK: Final = (
    "For a first look only: --quick uses a cell of 20 µm instead of 10 µm, samples of 1.5 µm "
    "instead of 2/3 µm, and 16 draws instead of 135. Its errors are somewhat too small: −61 °C "
    "instead of −69 °C at the rake face, −36 °C instead of −37 °C at the centre of the shear band, "
    "−66 °C instead of −72 °C beside it. To quote figures, run without --quick."
)
"""Remark on the quick study; means over the draws of both studies."""


def table_2(study: Study) -> list[tuple[str, str, str]]:
    """Return the settings of the cutting simulation: name, the paper's value, the study's."""
    cutting, tool = study.cutting, study.cutting.tool
    region, window = cutting.numerics, cutting.window
    depth = f"{region.depth * 1e3:g} mm simulated"
    if tool.outline:
        angles = ("from a file", "from a file", "from a file")
    else:
        angles = (
            f"{degrees(tool.rake_angle):g}°",
            f"{degrees(tool.clearance_angle):g}°",
            f"{tool.edge_radius * 1e6:g} µm",
        )
    frames = cutting.duration / window.interval
    return [
        ("Workpiece", "AISI 1045 (200 HB)", cutting.workpiece),
        ("Tool", "carbide, general", tool.material),
        ("Rake angle", "−7°", angles[0].replace("-", "−")),
        ("Clearance angle", "7°", angles[1]),
        ("Edge radius", "20 µm", angles[2]),
        ("Feed", "0.3 mm", f"{cutting.feed * 1e3:g} mm"),
        ("Cutting speed", "250 m/min", f"{cutting.speed * 60:g} m/min"),
        ("Initial temperature", "20 °C", f"{cutting.initial_temperature - 273.15:g} °C"),
        ("Workpiece height", "2 mm", depth),
        ("Cutting length", "not legible", f"{cutting.cutting_length * 1e3:g} mm"),
        (
            "Window",
            "1.579 mm to 1.958 mm",
            f"{window.start * 1e3:g} mm to {window.end * 1e3:g} mm",
        ),
        ("Time between frames", "0.2 µs", f"{window.interval * 1e6:g} µs"),
        ("Frames of the window", "about 455", f"{frames:.0f}"),
        ("Segments after it", "none", f"{window.later_bands}, one exposure each"),
        ("Method", "finite elements, remeshed", "material points"),
        ("Size of elements or cells", "not legible", f"{cutting.numerics.cell * 1e6:g} µm"),
    ]
