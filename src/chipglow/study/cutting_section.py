"""The section of the cut: the paper's Table 2 by default."""

from typing import Annotated, Final, Self

from pydantic import ValidationInfo, field_validator, model_validator

from chipglow.cutting import (
    CuttingConditions,
    CuttingSimulation,
    Friction,
    Numerics,
    OutputWindow,
    Surroundings,
    ToolBody,
    is_own_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.cutting.conditions import INITIAL_TEMPERATURE
from chipglow.io import ToolSection
from chipglow.quantities import (
    Declared,
    OrWord,
    Settings,
    beside_the_study,
    described,
)
from chipglow.quantities.units import Length, Position
from chipglow.scene import Raster

_IN_REGION: Final = "the whole scene within the simulated region"


class FieldOfViewSection(Settings[Raster]):
    """Where the scene is sampled. The tip of the tool is near the origin, y points up."""

    left: Position = described("-620 um", "Left edge of the scene.", _IN_REGION)
    top: Position = described("460 um", "Upper edge of the scene.", _IN_REGION)
    spacing: Length = described(
        "2/3 um",
        "Side of a sample. A whole number of them should make camera.pitch: the paper has 9.",
        "over 0 um",
    )
    rows: int = described(810, "Samples from top to bottom.", "1 or more")
    columns: int = described(990, "Samples from left to right.", "1 or more")

    def build(self) -> Raster:
        """The grid of samples."""
        return Raster(self.left, self.top, self.spacing, self.rows, self.columns)


STEADY: Final = "steady"
"""Temperature of a tool that has been cutting for long."""


class CutToolSection(ToolSection):
    """The cutting tool, and how warm it is."""

    temperature: Annotated[float | None, INITIAL_TEMPERATURE, OrWord(STEADY, STEADY)] = described(
        "none",
        "Temperature of the tool when the cut begins; steady: that of a tool that has been\n"
        "cutting for long; none: as cold as the workpiece, as the paper's.",
        f"{INITIAL_TEMPERATURE.limits}; none; or steady",
    )
    body: Declared[ToolBody] = described({}, "What the heat of a steady tool flows through.")

    def start(self) -> float | ToolBody | None:
        """What the simulation takes."""
        given: object = self.temperature
        return self.body.build() if given == STEADY else self.temperature


class CuttingSection(Declared[CuttingConditions]):
    """The cutting simulation; the paper's Table 2."""

    workpiece: str = described(
        "aisi-1045",
        "Material of the workpiece. The command chipglow materials shows them.",
        f"{', '.join(material_names('workpiece'))}; with one of its sets of the\n"
        "flow stress after a slash (aisi-1045/ozel); or a file of your own (steel.yaml)",
    )
    tool: CutToolSection = described({}, "The cutting tool.")
    friction: Declared[Friction] = described({}, "Friction between chip and tool.")
    surroundings: Declared[Surroundings] = described(
        {}, "What the free surfaces of chip, workpiece and tool lose heat to; nothing by default."
    )
    numerics: Declared[Numerics] = described({}, "How finely the cut is computed.")
    window: Declared[OutputWindow] = described({}, "The part of the cut that becomes the scene.")
    field_of_view: FieldOfViewSection = described(
        {}, "Where the scene is sampled: the tool's tip is near the origin, y points up."
    )

    @field_validator("workpiece")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        if is_own_file(name):
            name = beside_the_study(name, info)
        try:
            workpiece(name)
        except OSError as error:
            raise ValueError(f"{name!r}: {error.strerror}, expected a material's file") from None
        return name

    @model_validator(mode="after")
    def _window_within_cut(self) -> Self:
        if self.window.end > self.cutting_length * (1 + 1e-9):
            raise ValueError(
                f"window.end: {self.window.end * 1e3:g} mm is beyond cutting_length, "
                f"expected up to {self.cutting_length * 1e3:g} mm"
            )
        return self

    @property
    def duration(self) -> float:
        """Time in s from the first to the last frame."""
        return float((self.window.end - self.window.start) / self.speed)

    def simulation(self) -> CuttingSimulation:
        """The simulation that this section describes."""
        return CuttingSimulation(
            conditions=self.build(),
            tool=self.tool.build(),
            workpiece=workpiece(self.workpiece),
            tool_material=tool_material(self.tool.material),
            friction=self.friction.build(),
            numerics=self.numerics.build(),
            surroundings=self.surroundings.build(),
            tool_temperature=self.tool.start(),
        )
