"""The section of the analysis: what is computed from the simulated measurement."""

from typing import Annotated, Literal, Self

from pydantic import Strict, field_validator, model_validator

from chipglow.analysis import LinePlace, Plan, PointPlace, RegionPlace, ScenePlan
from chipglow.analysis.old_places import Place
from chipglow.laboratory.emissivity import RegionSection
from chipglow.quantities import Settings, described
from chipglow.quantities.units import Length, Position

PointOfScene = Annotated[tuple[Position, Position], Strict(False)]
Corners = Annotated[tuple[PointOfScene, ...], Strict(False)]


class AnalysisSection(Settings[Plan]):
    """What is computed from the simulated measurement."""

    exposures: int = described(9, "Exposures, spread evenly over the scene.")
    phases: int = described(
        3,
        "Positions of the pixels along each axis, evenly over a pixel, on which each headline is\n"
        "drawn anew: 3 makes 9.",
        "1 or more",
    )
    textures: int = described(
        5,
        "Textures of the emissivity on which each headline is drawn anew: of the study's seed and\n"
        "those after it.",
        "1 or more",
    )
    rake_chip: str = described(
        "chip 2", "Chip whose errors are read at the rake face; the paper took its chip 2."
    )
    band_chip: str = described(
        "chip 1", "Chip whose errors are read at the shear band; the paper took its chip 1."
    )
    reference: Literal["maximum", "mean", "centre", "true"] = described(
        "maximum",
        "What a pixel's measured temperature is compared with, in its square during the exposure:\n"
        "the greatest radiance temperature (maximum, the paper's), that of the mean radiance\n"
        "(mean), that in the middle of both (centre) or the greatest true temperature (true).",
    )
    psf_widths: Annotated[tuple[Length, ...], Strict(False)] = described(
        [f"{width} um" for width in range(4, 21)],
        "Full widths at half maximum of Gaussians for which the headline errors are shown.",
    )

    points: dict[str, PointOfScene] = described(
        {},
        "Points by name where the error is read, in the place of rake face and shear band.",
        "{} or positions: {middle of the pool: [0 um, -20 um]}",
    )
    lines: dict[str, Corners] = described(
        {},
        "Lines by name, from corner to corner.",
        "{} or positions: {across: [[-100 um, 0 um], [100 um, 0 um]]}",
    )
    regions: dict[str, RegionSection] = described(
        {},
        "Regions by name: a polygon, a rectangle or a circle.",
        "{} or {pad: {rectangle: [[0 um, 0 um], [100 um, -50 um]]}}; also\n"
        "{circle: {centre: [0 um, 0 um], radius: 20 um}}",
    )

    @field_validator("reference", mode="before")
    @classmethod
    def _true_is_a_word(cls, reference: object) -> object:
        return "true" if reference is True else reference  # YAML reads it as a truth value

    @property
    def places(self) -> tuple[Place, ...]:
        """Where the user wants the error to be read."""
        return (
            *(PointPlace(name, point) for name, point in self.points.items()),
            *(LinePlace(name, corners) for name, corners in self.lines.items()),
            *(RegionPlace(name, one.region(name)) for name, one in self.regions.items()),
        )

    def scene_plan(self) -> ScenePlan:
        """What to analyse of a scene that is no cut, or at the user's places."""
        return ScenePlan(
            places=self.places,
            exposures=self.exposures,
            phases=self.phases,
            textures=self.textures,
            reference=self.reference,
        )

    @model_validator(mode="after")
    def _possible_places(self) -> Self:
        self.scene_plan()
        return self

    def build(self) -> Plan:
        """What to analyse."""
        return Plan(
            exposures=self.exposures,
            phases=self.phases,
            textures=self.textures,
            rake_surface=self.rake_chip,
            band_surface=self.band_chip,
            psf_widths=self.psf_widths,
            reference=self.reference,
        )
