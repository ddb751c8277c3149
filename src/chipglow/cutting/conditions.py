"""Conditions of a cut: speed, feed, friction, output window, numerics."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Final, Self

from chipglow.quantities import ROUNDING, Parameter, Part, zero_to_one
from chipglow.quantities.units import CUT_LENGTH, HEAT_TRANSFER, LENGTH, SPEED, TEMPERATURE, TIME
from chipglow.scene import Raster

CELLS_NEEDED: Final[Mapping[str, float]] = {
    "feed": 5.0,
    "edge radius": 1.0,
    "length of the nonlocal viscosity": 1.0,
}
"""Cells across each length from which on a smaller cell changes no headline by more than its
uncertainty (``benchmarks/convergence.py``). Of the feed fewer than 15 were not tried."""

INITIAL_TEMPERATURE: Final = Parameter(
    "Temperature of workpiece and tool before the cut.", TEMPERATURE, least=200.0, most=1500.0
)
"""Its limits hold for all that a cut may begin with."""

_FROM_CONTACT: Final = replace(CUT_LENGTH, positive=False)


@dataclass(frozen=True)
class CuttingConditions(Part):
    """Orthogonal cut; Table 2 of Heigel and Whitenton (2010) by default."""

    speed: Annotated[float, Parameter("Cutting speed.", SPEED)] = 250.0 / 60.0
    feed: Annotated[float, Parameter("Feed: thickness of the uncut chip.", CUT_LENGTH)] = 0.3e-3
    cutting_length: Annotated[
        float,
        Parameter(
            "Cutting length, from the first contact. The paper's window ends at 1.958 mm; "
            "segments after it make the scatter of the headlines known.",
            CUT_LENGTH,
        ),
    ] = 2.6e-3
    initial_temperature: Annotated[float, INITIAL_TEMPERATURE] = 293.15


@dataclass(frozen=True)
class Friction(Part):
    """Friction between chip and tool.

    It is of Zorev's kind: Coulomb, limited by the shear strength of the chip. With a
    `thermal_exponent` q the coefficient falls with the temperature T of the chip's surface, as
    Moufki, Molinari and Dudzinski (1998), J. Mech. Phys. Solids 46, 2103 proposed for the mean
    temperature of the contact: μ = μ₀ (1 − (T/T_melt)^q), 0 from T_melt on. The form is as widely
    cited, the paper was not seen. T and T_melt, that of the flow stress, are in K here. The
    contact's thermal `conductance` is in W/(m² K).
    """

    coefficient: Annotated[float, Parameter("Coulomb's coefficient.", least=0.0, most=2.0)] = 0.5
    friction_factor: Annotated[
        float,
        zero_to_one("Limit of the friction stress, as a fraction of the chip's shear flow stress."),
    ] = 1.0
    conductance: float = 1e7  # in W/(m² K)
    thermal_exponent: Annotated[
        float | None,
        Parameter(
            "Exponent q of a coefficient that falls with the temperature T of the chip's surface, "
            "coefficient * (1 - (T / T_melt)^q) with both in K (Moufki et al. 1998).",
            over=0.0,
            most=100.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.conductance < 1e12:  # more than any contact conducts, for a finite number
            raise ValueError(f"conductance: {self.conductance!r} W/(m2 K), expected 0 to 1e12")


@dataclass(frozen=True)
class Surroundings(Part):
    """Surroundings to which free surfaces lose heat; none by default."""

    convection: Annotated[
        float,
        Parameter(
            "Coefficient of the heat transfer to the air, of all free surfaces.",
            HEAT_TRANSFER,
            least=0.0,
            most=1e6,
        ),
    ] = 0.0
    emissivity: Annotated[
        float,
        zero_to_one(
            "Total hemispherical emissivity with which free surfaces cool; not the camera's."
        ),
    ] = 0.0
    temperature: Annotated[
        float, Parameter("Temperature of air and surroundings.", TEMPERATURE, most=1500.0)
    ] = 293.15


@dataclass(frozen=True)
class OutputWindow(Part):
    """The part of the cut that becomes the scene; the paper's by default.

    The delay of the later bands is by the solver's own cuts: the band is hottest 0.2 to 0.25 of the
    time between two valleys after the later one; then its temperature stays within 5 K for an
    exposure's 10 µs.
    """

    start: Annotated[
        float, Parameter("Cutting length at the first frame, under end.", _FROM_CONTACT, least=0.0)
    ] = 1.579e-3
    end: Annotated[float, Parameter("Cutting length at the last frame.", CUT_LENGTH, under=1.0)] = (
        1.958e-3
    )
    interval: Annotated[
        float,
        Parameter(
            "Time between frames; up to the camera's integration_time.", TIME, least=1e-9, most=1e-3
        ),
    ] = 0.2e-6
    later_bands: Annotated[
        int,
        Parameter(
            "Segments after the window of which one exposure is kept, when the shear band is "
            "developed, so that the headlines are drawn from several segments; as many as "
            "cutting_length leaves room for.",
            least=0,
            most=1000,
        ),
    ] = 2
    band_delay: Annotated[
        float,
        zero_to_one(
            "Time after the last valley of the cutting force at which the band is developed, as a "
            "fraction of the time between the last two valleys."
        ),
    ] = 0.22
    band_duration: Annotated[
        float,
        Parameter(
            "Duration of each of them: the camera's integration_time or more.",
            TIME,
            least=1e-9,
            most=1e-3,
        ),
    ] = 10e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.start < self.end:
            start, end = (CUT_LENGTH.text(length) for length in (self.start, self.end))
            raise ValueError(f"start: {start}, expected less than end, {end}")


@dataclass(frozen=True)
class Numerics(Part):
    """Cells, time steps and region of the computation.

    Cutting is slow against the speed of sound, so a heavier material moves in the same way and
    allows a longer time step; heat is not scaled. The computed region reaches `upstream`,
    `downstream`, `depth` and `height` in m: before and behind the edge, under and over the cut.
    """

    cell: Annotated[
        float,
        Parameter(
            "Side of a cell of the grid; halving it takes eight times as long.",
            LENGTH,
            least=0.5e-6,
            most=43.75e-6,
        ),
    ] = 20e-6
    mass_scaling: Annotated[
        float | None,
        Parameter(
            "Factor on the density in the equation of motion, for longer time steps; none: by the "
            "speed, so that the scaled mass makes about 0.5 % of the cutting force.",
            least=1.0,
            most=1e4,
        ),
    ] = None
    courant: Annotated[
        float,
        Parameter(
            "Time step as a fraction of the time that sound takes for a cell.", over=0.0, most=0.6
        ),
    ] = 0.5
    points_per_side: Annotated[
        int, Parameter("Material points along the side of a cell.", least=1, most=4)
    ] = 2
    # Borders of the computed region in m, beyond the heated and strained material.
    upstream: float = 0.75e-3
    downstream: float = 0.55e-3
    depth: float = 0.35e-3
    height: float = 1.2e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("upstream", "downstream", "depth", "height"):
            # Splines at both borders need some cells; 0.1 m is beyond any cut's field of view.
            if not 8 * self.cell <= getattr(self, name) <= 0.1:
                raise ValueError(f"{name}: {getattr(self, name)!r} m, expected 8 cells to 0.1 m")

    def around(self, view: Raster) -> Self:
        """Return them with a region that holds a field of view."""
        left, right, bottom, top = view.extent
        rim = 2 * self.cell
        reach = {"upstream": -left, "downstream": right, "depth": -bottom, "height": top}
        return replace(
            self, **{name: max(getattr(self, name), at + rim) for name, at in reach.items()}
        )


@dataclass(frozen=True, kw_only=True)
class CutSettings(Part):
    """Settings of a `CuttingSimulation` that a study states as it takes them."""

    friction: Annotated[Friction, Parameter("Friction between chip and tool.")] = field(
        default_factory=Friction
    )
    surroundings: Annotated[
        Surroundings,
        Parameter("Surroundings to which chip, workpiece and tool lose heat; none by default."),
    ] = field(default_factory=Surroundings)
    numerics: Annotated[Numerics, Parameter("Cells and time steps of the computation.")] = field(
        default_factory=Numerics
    )


def unresolved(lengths: Mapping[str, float], cell: float) -> tuple[str, ...]:
    """Return a sentence for each length in m, by its name, of fewer than `CELLS_NEEDED` cells.

    0 and NaN are left out: a sharp edge has no radius.
    """
    return tuple(
        f"The {name}, {length * 1e6:.3g} um, is {_cells(length / cell)}, expected "
        f"{CELLS_NEEDED[name]:g} or more: set cutting.numerics.cell to "
        f"{length / CELLS_NEEDED[name] * 1e6:.2g} um."
        for name, length in lengths.items()
        if 0.0 < length < CELLS_NEEDED[name] * cell * (1 - ROUNDING)
    )


def _cells(count: float) -> str:
    text = f"{count:.2g}"
    return f"{text} cell" if text == "1" else f"{text} cells"
