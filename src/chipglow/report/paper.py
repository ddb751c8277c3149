"""What Heigel and Whitenton (2010) found and set: their figures, their Tables 1 and 2."""

from dataclasses import dataclass
from math import degrees
from typing import Final

from chipglow.analysis import StudyResult
from chipglow.study import Study
from chipglow.surface import Emissivity

CITATION: Final = (
    "J. C. Heigel, E. P. Whitenton: The effects of emissivity and camera point spread function on "
    "the temperature measurement of segmented chip formation using infrared thermography. "
    "Proceedings of the ASME International Manufacturing Science and Engineering Conference, 2010."
)


@dataclass(frozen=True)
class PaperValue:
    """A figure of the paper: value in SI units (fractions of 1), and where it stands."""

    value: float
    where: str


@dataclass(frozen=True)
class PaperValues:
    """The figures of Heigel and Whitenton (2010) that a study can be set beside.

    Errors in K of radiance temperature, fractions of 1, the period in s.
    """

    rake_error: PaperValue = PaperValue(-42.0, "abstract; Figure 11a shows about −40")
    rake_psf_fraction: PaperValue = PaperValue(0.45, "abstract; the conclusion says half")
    band_error: PaperValue = PaperValue(-46.0, "abstract, Figure 11b")
    band_psf_fraction: PaperValue = PaperValue(0.15, "abstract; −7 of −46 in Figure 11b")
    band_worst: PaperValue = PaperValue(-120.0, "Simulation measurement error, Figure 11b")
    rake_missing: PaperValue = PaperValue(100.0, "Chip Temperature Near the Tool Rake Face")
    segment_period: PaperValue = PaperValue(90e-6, "Finite element analysis simulation")


PAPER: Final = PaperValues()


def stands_beside(result: StudyResult) -> bool:
    """Whether the paper's figures may stand beside a result: its study cuts and looks as it did."""
    study = result.plan.study
    return isinstance(study, Study) and study.is_papers


TABLE_1: Final = {
    "chip 1 chip body": Emissivity(0.42, 0.07),
    "chip 1 shear band": Emissivity(0.53, 0.05),
    "chip 2 chip body": Emissivity(0.77, 0.03),
    "chip 2 shear band": Emissivity(0.85, 0.02),
    "tool": Emissivity(0.58, 0.06),
}
"""Mean and standard deviation of the emissivity; that of the tool stands in the paper's text."""

QUICK: Final = (
    "For a first look only: --quick cuts with a cell of 20 µm in place of 10 µm, on samples of "
    "1.5 µm in place of 2/3 µm, and makes 16 draws in place of 135. Its errors are somewhat too "
    "small: −61 °C in place of −69 °C at the rake face, −36 °C in place of −37 °C at the centre of "
    "the shear band, −66 °C in place of −72 °C beside it. To quote figures, run without --quick."
)
"""What to know before quoting the quick study; means over the draws of both studies."""


@dataclass(frozen=True)
class EmissivityTexts:
    """A row of Table 1 as printed.

    Parameters
    ----------
    feature : str
        The feature.
    paper, true : str
        Mean ± standard deviation in the paper, and as put into the study.
    mean, standard_deviation : str
        What comes back from the image of a heated object: mean with its standard uncertainty, and
        the standard deviation over its pixels.
    textures : str
        Mean and standard deviation of the means of several textures.
    """

    feature: str
    paper: str
    true: str
    mean: str
    standard_deviation: str
    textures: str


def table_1(result: StudyResult) -> list[EmissivityTexts]:
    """Emissivity of heated chips and tool: in the paper, put in, and found.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    rows = []
    for row in (row for heated in result.heated for row in heated.rows):
        paper = TABLE_1.get(row.feature)
        several = row.means.size > 1
        rows.append(
            EmissivityTexts(
                feature=row.feature,
                paper=_both(paper.mean, paper.standard_deviation) if paper else "–",
                true=_both(row.true.mean, row.true.standard_deviation),
                mean=f"{row.found.mean:.3f} ± {row.found.estimate.standard_uncertainty:.3f}",
                standard_deviation=f"{row.found.standard_deviation:.3f}",
                textures=(
                    f"{row.means.mean():.3f} ± {row.means.std(ddof=1):.3f}" if several else "–"
                ),
            )
        )
    return rows


def table_2(study: Study) -> list[tuple[str, str, str]]:
    """Settings of the cutting simulation: what is set, in the paper, in the study.

    Parameters
    ----------
    study : Study
        A study that cuts.
    """
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


def _both(mean: float, standard_deviation: float) -> str:
    return f"{mean:.2f} ± {standard_deviation:.2f}"
