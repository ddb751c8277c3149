"""The section of the cut: the paper's Table 2 by default."""

from dataclasses import dataclass, field
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, ValidationInfo

from chipglow.cutting import (
    CutSettings,
    CuttingConditions,
    CuttingSimulation,
    OutputWindow,
    ToolBody,
    WorkpieceMaterial,
    is_own_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.cutting.conditions import INITIAL_TEMPERATURE
from chipglow.io import ToolSection
from chipglow.quantities import ROUNDING, Parameter, Part, beside_the_study, made_from
from chipglow.quantities.units import TEMPERATURE
from chipglow.scene import Raster

STEADY: Final = "steady"
"""Temperature of a tool at steady state."""


@dataclass(frozen=True)
class FieldOfViewSection(Raster):
    """Samples of the scene. The tip of the tool is near the origin, y points up.

    By default nine samples along a pixel of 6 µm, over 690 µm × 780 µm about the tip.
    """

    # In m; see above.
    left: float = -650e-6
    top: float = 700e-6
    spacing: float = 2 / 3e6
    rows: int = 1170
    columns: int = 1035

    def build(self) -> Raster:
        return made_from(Raster, self)


@dataclass(frozen=True)
class WindowSection(OutputWindow):
    """The part of the cut that becomes the scene; the paper's by default."""

    def __post_init__(self) -> None:
        # `build` checks the order of the ends, when those that follow from others are known.
        Part.__post_init__(self)

    def build(self) -> OutputWindow:
        return made_from(OutputWindow, self)


@dataclass(frozen=True)
class CutToolSection(ToolSection):
    """The cutting tool, and how warm it is."""

    temperature: Annotated[
        float | Literal["steady"] | None,
        Parameter(
            "Temperature of the tool at the start of the cut; steady: of the steady state; none: "
            "of the workpiece, as in the paper.",
            TEMPERATURE,
            least=INITIAL_TEMPERATURE.least,
            most=INITIAL_TEMPERATURE.most,
            allowed=f"{INITIAL_TEMPERATURE.limits}; none; or steady",
        ),
    ] = None
    body: Annotated[ToolBody, Parameter("Holder and cooling of a steady tool.")] = field(
        default_factory=ToolBody
    )

    def start(self) -> float | ToolBody | None:
        return self.body if self.temperature == STEADY else self.temperature


def _known(name: str, info: ValidationInfo) -> str:
    if is_own_file(name):
        name = beside_the_study(name, info)
    try:
        workpiece(name)
    except OSError as error:
        raise ValueError(f"{name!r}: {error.strerror}, expected a material file") from None
    return name


@dataclass(frozen=True)
class WorkpieceAndTool(CuttingConditions):
    """Workpiece, tool and cutting conditions of a study."""

    workpiece: Annotated[
        str,
        AfterValidator(_known),
        Parameter(
            "Material of the workpiece. The command chipglow materials shows them.",
            allowed=f"{', '.join(material_names('workpiece'))}; with one of its sets of the "
            "flow stress after a slash (aisi-1045/ozel); or your own file (steel.yaml)",
        ),
    ] = "aisi-1045"
    workpiece_factors: Annotated[
        dict[str, float],
        Parameter(
            "Factors on numbers of the workpiece's material, its flow stress and its damage, by "
            "name, for sweeps and uncertainty budgets.",
            allowed="{} or names and factors: {conductivity: 1.05, yield_stress: 0.95}",
        ),
    ] = field(default_factory=dict)
    tool: Annotated[CutToolSection, Parameter("The cutting tool.")] = field(
        default_factory=CutToolSection
    )


@dataclass(frozen=True, kw_only=True)
class CuttingSection(CutSettings, WorkpieceAndTool):
    """The cutting simulation; the paper's Table 2."""

    window: Annotated[WindowSection, Parameter("The part of the cut that becomes the scene.")] = (
        field(default_factory=WindowSection)
    )
    field_of_view: Annotated[
        FieldOfViewSection,
        Parameter(
            "Samples of the scene: the tool's tip is near the origin, y points up. camera.pitch "
            "should be a whole multiple of spacing; the paper has 9."
        ),
    ] = field(default_factory=FieldOfViewSection)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.material()

    def check_window(self) -> None:
        """Raise a ValueError unless the window is a part of the cut."""
        try:
            self.window.build()
        except ValueError as error:
            raise ValueError(f"window: {error}") from None
        if self.window.end > self.cutting_length * (1 + ROUNDING):
            raise ValueError(
                f"window.end: {self.window.end * 1e3:g} mm is beyond cutting_length, "
                f"expected up to {self.cutting_length * 1e3:g} mm"
            )

    def material(self) -> WorkpieceMaterial:
        """Return the workpiece's material, with the factors on its numbers."""
        return workpiece(self.workpiece).scaled(self.workpiece_factors)

    @property
    def duration(self) -> float:
        """Time in s from the first to the last frame."""
        return float((self.window.end - self.window.start) / self.speed)

    def simulation(self) -> CuttingSimulation:
        """Return the simulation of a region that holds the field of view."""
        return made_from(
            CuttingSimulation,
            self,
            conditions=made_from(CuttingConditions, self),
            tool=self.tool.build(),
            workpiece=self.material(),
            tool_material=tool_material(self.tool.material),
            numerics=self.numerics.around(self.field_of_view.build()),
            tool_temperature=self.tool.start(),
        )
