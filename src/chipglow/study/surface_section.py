"""The section of the surface: emissivities, the paper's Table 1 by default."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from chipglow.laboratory.emissivity import (
    emissivity_trend,
    measured_features,
    read_emissivity_lines,
    read_emissivity_map,
)
from chipglow.quantities import FileBeside, Parameter, Section
from chipglow.quantities.units import WAVELENGTHS
from chipglow.radiometry import Band
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    DIRECTIONS,
    OXIDES,
    REFLECTIONS,
    SPECTRA,
    SURFACES,
    Direction,
    DirectionalSurface,
    DispersiveSurface,
    Emissivity,
    FeatureSurface,
    FeatureTrends,
    Oxide,
    OxidisedSurface,
    ReflectingSurface,
    SideShape,
    SpectralSurface,
    Surface,
    SurfaceChoice,
)

CHIPS: Final[Mapping[str, FeatureSurface]] = {"chip-1": CHIP_1, "chip-2": CHIP_2}
"""Chips of the paper's Table 1 by the names of a study."""


_FEATURE: Final = {"body": "chip"}
"""Features whose name in a study is another than that of the surface."""


_declared = FeatureSurface.parameter


class ChipSection(Section):
    """Emissivity of one chip."""

    body: Annotated[Emissivity, _declared("chip")]
    shear_band: Annotated[Emissivity, _declared("shear_band")]

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema of the section, or the name of a chip."""
        return {"anyOf": [handler(schema), {"enum": list(CHIPS)}]}

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, data: object) -> object:
        if not isinstance(data, str):
            return data
        if data not in CHIPS:
            raise ValueError(f"{data!r} is unknown, expected one of {', '.join(CHIPS)}")
        chip = CHIPS[data]
        return {"body": chip.chip, "shear_band": chip.shear_band}

    @classmethod
    def of(cls, surface: FeatureSurface) -> Self:
        """Chip of a surface."""
        return cls(body=surface.chip, shear_band=surface.shear_band)


class FeaturesSection(Section):
    """Emissivity of the features of chips: the paper's maps."""

    kind: Annotated[
        Literal["features"],
        Parameter("The emissivity of each feature of a chip, each with its texture."),
    ] = "features"
    chips: Annotated[
        dict[str, ChipSection],
        Parameter(
            "Chips by name, each laid on the same scene. A chip is chip-1 or chip-2 (the paper's "
            "Table 1), or the numbers of its body and shear bands."
        ),
    ] = Field(default={"chip 1": ChipSection.of(CHIP_1), "chip 2": ChipSection.of(CHIP_2)})
    maps: Annotated[
        dict[str, FileBeside],
        Parameter(
            "Emissivity maps by name, files of chipglow emissivity: each is laid on the scene "
            "where its pixels lie, as one more chip. Of several true temperatures each pixel has "
            "its line.",
            allowed="{} or names and files beside this one: {measured: emissivity.nc}",
        ),
    ] = Field(default_factory=dict)
    measured: Annotated[
        dict[str, FileBeside],
        Parameter(
            "Measured chips by name, files of chipglow emissivity: chip body and shear band (and "
            "workpiece and tool, if they are there) by their regions, over the temperature.",
            allowed="{} or names and files beside this one: {heated chip: emissivity.nc}",
        ),
    ] = Field(default_factory=dict)
    workpiece: Annotated[Emissivity, _declared("workpiece")] = FeatureSurface.workpiece
    tool: Annotated[Emissivity, _declared("tool")] = FeatureSurface.tool
    grain: Annotated[float, _declared("grain")] = FeatureSurface.grain
    follow: Annotated[Literal["material", "mean", "none"], _declared("follow")] = "material"
    restore_standard_deviation: Annotated[bool, _declared("restore_standard_deviation")] = True
    spectral: Annotated[
        Annotated[SpectralSurface, SPECTRA] | None,
        Parameter(
            "How all these emissivities depend on the wavelength, for cameras of other bands; or "
            "none: they are grey."
        ),
    ] = None
    measured_in: Annotated[
        tuple[float, float],
        Parameter(
            "Band in which they are as they stand here, where they are not grey.", WAVELENGTHS
        ),
    ] = (3.8e-6, 5.1e-6)
    oxide: Annotated[
        Annotated[Oxide, OXIDES] | None,
        Parameter(
            "Oxide that grows on the material while it is in view, by its temperatures, or none."
        ),
    ] = None
    directional: Annotated[
        Annotated[Direction, DIRECTIONS] | None,
        Parameter(
            "How emissivities depend on the angle at which they are seen, or none: they do not."
        ),
    ] = None
    reflections: Annotated[
        Annotated[SideShape, REFLECTIONS] | None,
        Parameter(
            "Reflections between the rake face and the chip's side, which flowed sideways, or none."
        ),
    ] = None

    @field_validator("chips")
    @classmethod
    def _at_least_one(cls, chips: dict[str, ChipSection]) -> dict[str, ChipSection]:
        if not chips:
            raise ValueError("{} is empty, expected one chip or more, such as chip 1: chip-1")
        return chips

    @model_validator(mode="after")
    def _different_names(self) -> Self:
        for name in self.maps:
            if name in self.chips:
                raise ValueError(f"maps: {name!r} is the name of a chip too, expected another")
        for name in self.measured:
            if name in self.chips or name in self.maps:
                raise ValueError(
                    f"measured: {name!r} is the name of another chip too, expected its own"
                )
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces: the chips, the maps, then the measured chips."""
        return (*self.chips, *self.maps, *self.measured)

    def build(self, seed: int) -> dict[str, Surface]:
        """The surfaces by name."""
        chips = {
            name: self._features(chip.body, chip.shear_band, seed)
            for name, chip in self.chips.items()
        }
        maps = {name: read_emissivity_map(file) for name, file in self.maps.items()}
        measured = {name: self._measured(file, seed) for name, file in self.measured.items()}
        surfaces: dict[str, Surface] = {**chips, **maps, **measured}
        if self.spectral is not None:
            spectrum, band = self.spectral, Band(*self.measured_in)
            surfaces = {
                name: DispersiveSurface(bare, spectrum, band) for name, bare in surfaces.items()
            }
        if self.oxide is not None:
            oxide = self.oxide
            surfaces = {name: OxidisedSurface(bare, oxide) for name, bare in surfaces.items()}
        if self.directional is not None:
            law = self.directional
            surfaces = {name: DirectionalSurface(bare, law) for name, bare in surfaces.items()}
        if self.reflections is None:
            return surfaces
        shape = self.reflections
        return {name: ReflectingSurface(bare, shape) for name, bare in surfaces.items()}

    def _features(self, chip: Emissivity, shear_band: Emissivity, seed: int) -> FeatureSurface:
        shared = FeatureSurface.parameters().keys() & type(self).model_fields.keys()
        values = {name: getattr(self, name) for name in shared}
        return FeatureSurface(chip=chip, shear_band=shear_band, seed=seed, **values)

    def _measured(self, file: str, seed: int) -> FeatureTrends:
        try:
            lines = measured_features(read_emissivity_lines(file))
            trends = {name: emissivity_trend(line) for name, line in lines.items()}
            means = {
                name: Emissivity(trends[name].emissivity, line.standard_deviation)
                for name, line in lines.items()
            }
        except ValueError as error:
            raise ValueError(f"surface.measured: {file}: {error}") from None
        bare = self._features(means["body"], means["shear_band"], seed)
        bare = replace(
            bare,
            workpiece=means.get("workpiece", bare.workpiece),
            tool=means.get("tool", bare.tool),
        )
        return FeatureTrends(
            bare, {_FEATURE.get(name, name): trend for name, trend in trends.items()}
        )


SURFACES.add("features", FeaturesSection)

SurfaceSection = Annotated[FeaturesSection | SurfaceChoice, SURFACES]


def surface_names(section: FeaturesSection | SurfaceChoice) -> tuple[str, ...]:
    """Names of a section's surfaces; a surface that is the only one is called by its kind."""
    return section.names if isinstance(section, FeaturesSection) else (section.kind,)


def surfaces_of(section: FeaturesSection | SurfaceChoice, seed: int) -> dict[str, Surface]:
    """The surfaces of a section by their names."""
    if isinstance(section, FeaturesSection):
        return section.build(seed)
    return {section.kind: section.surface()}
