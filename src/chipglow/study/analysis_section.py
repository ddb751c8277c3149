"""The section of the analysis: what is computed from the simulated measurement."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from chipglow.analysis import LinePlace, Place, Plan, PointPlace, RegionPlace
from chipglow.laboratory.emissivity import RegionSection
from chipglow.quantities import Parameter, Settings
from chipglow.quantities.units import Length, Position

PointOfScene = tuple[Position, Position]
Corners = tuple[PointOfScene, ...]


class AnalysisSection(Settings[Plan]):
    """What is computed from the simulated measurement."""

    exposures: Annotated[int, Parameter("Exposures, spread evenly over the scene.", least=1)] = 9
    phases: Annotated[
        int,
        Parameter(
            "Positions of the pixels along each axis, evenly over a pixel, on which each headline "
            "is drawn anew: 3 makes 9.",
            least=1,
        ),
    ] = 3
    textures: Annotated[
        int,
        Parameter(
            "Textures of the emissivity on which each headline is drawn anew: of the study's seed "
            "and those after it.",
            least=1,
        ),
    ] = 5
    rake_chip: Annotated[
        str, Parameter("Chip whose errors are read at the rake face; the paper took its chip 2.")
    ] = "chip 2"
    band_chip: Annotated[
        str, Parameter("Chip whose errors are read at the shear band; the paper took its chip 1.")
    ] = "chip 1"
    reference: Annotated[
        Literal["maximum", "mean", "centre", "true"],
        Parameter(
            "What a pixel's measured temperature is compared with, in its square during the "
            "exposure: the greatest radiance temperature (maximum, the paper's), that of the mean "
            "radiance (mean), that in the middle of both (centre) or the greatest true "
            "temperature (true)."
        ),
    ] = "maximum"
    psf_widths: Annotated[
        tuple[Length, ...],
        Parameter(
            "Full widths at half maximum of Gaussians for which the headline errors are shown."
        ),
    ] = tuple(width / 1e6 for width in range(4, 21))

    points: Annotated[
        dict[str, PointOfScene],
        Parameter(
            "Points by name where the error is read, in the place of rake face and shear band.",
            allowed="{} or positions: {middle of the pool: [0 um, -20 um]}",
        ),
    ] = Field(default_factory=dict)
    lines: Annotated[
        dict[str, Corners],
        Parameter(
            "Lines by name, from corner to corner.",
            allowed="{} or positions: {across: [[-100 um, 0 um], [100 um, 0 um]]}",
        ),
    ] = Field(default_factory=dict)
    regions: Annotated[
        dict[str, RegionSection],
        Parameter(
            "Regions by name: a polygon, a rectangle or a circle.",
            allowed="{} or {pad: {rectangle: [[0 um, 0 um], [100 um, -50 um]]}}; also {circle: "
            "{centre: [0 um, 0 um], radius: 20 um}}",
        ),
    ] = Field(default_factory=dict)

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

    @model_validator(mode="after")
    def _possible_places(self) -> Self:
        self.build()
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
            places=self.places,
        )
