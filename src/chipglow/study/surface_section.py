"""The section of the surface: emissivities, the paper's Table 1 by default."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from chipglow.laboratory.emissivity import (
    measured_features,
    read_emissivity_map,
    read_measured_areas,
)
from chipglow.quantities import OR_NONE, Declared, FileBeside, Section, described
from chipglow.quantities.units import Length, WavelengthRange
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


def _numbers(emissivity: Emissivity) -> dict[str, float]:
    return {"mean": emissivity.mean, "standard_deviation": emissivity.standard_deviation}


OxideSection = Annotated[Declared[Oxide], OXIDES]
SpectralSection = Annotated[Declared[SpectralSurface], SPECTRA]
DirectionalSection = Annotated[Declared[Direction], DIRECTIONS]
ReflectionsSection = Annotated[Declared[SideShape], REFLECTIONS]


class ChipSection(Section):
    """Emissivity of one chip."""

    body: Declared[Emissivity] = Field(description="Body of the segments.")
    shear_band: Declared[Emissivity] = Field(description="Shear bands: the paper's fissures.")

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
        preset = CHIPS[_known_name(data, CHIPS)]
        return {"body": _numbers(preset.chip), "shear_band": _numbers(preset.shear_band)}


class FeaturesSection(Section):
    """Emissivity of the features of chips: the paper's maps."""

    kind: Literal["features"] = described(
        "features",
        "What tells the emissivity: the features of a chip, each with its texture. Other kinds:\n"
        f"{SURFACES.examples}",
    )
    chips: dict[str, ChipSection] = described(
        {"chip 1": "chip-1", "chip 2": "chip-2"},
        "Chips by name, each laid on the same scene. A chip is chip-1 or chip-2 (the paper's\n"
        "Table 1), or the numbers of its body and shear bands.",
    )
    maps: dict[str, FileBeside] = described(
        {},
        "Emissivity maps by name, files of chipglow emissivity: each is laid on the scene where\n"
        "its pixels lie, as one more chip. Of several true temperatures each pixel has its line.",
        "{} or names and files beside this one: {measured: emissivity.nc}",
    )
    measured: dict[str, FileBeside] = described(
        {},
        "Measured chips by name, files of chipglow emissivity: chip body and shear band (and\n"
        "workpiece and tool, if they are there) by their regions, over the temperature.",
        "{} or names and files beside this one: {heated chip: emissivity.nc}",
    )
    workpiece: Declared[Emissivity] = described(
        _numbers(CHIP_1.workpiece), "The uncut workpiece; the paper assumed these numbers."
    )
    tool: Declared[Emissivity] = described(_numbers(CHIP_1.tool), "The tool's side.")
    grain: Length = described("20 um", "Size of a grain of the emissivity's texture.")
    follow: Literal["material", "mean", "none"] = described(
        "material",
        "How textures move: material (each point keeps its own), mean (the paper's shift by the\n"
        "feature's mean velocity) or none.",
    )
    restore_standard_deviation: bool = described(
        True, "Make up for the standard deviation that is lost when a texture is enlarged."
    )
    spectral: Annotated[SpectralSection | None, OR_NONE] = described(
        "none",
        "How all these emissivities depend on the wavelength, for cameras of other bands; or\n"
        f"none: they are grey. Kinds:\n{SPECTRA.examples}",
    )
    measured_in: WavelengthRange = described(
        "3.8-5.1 um", "Band in which they are as they stand here, where they are not grey."
    )
    oxide: Annotated[OxideSection | None, OR_NONE] = described(
        "none",
        "Oxide that grows on the material while it is in view, by its temperatures, or none.\n"
        f"Kinds:\n{OXIDES.examples}",
    )
    directional: Annotated[DirectionalSection | None, OR_NONE] = described(
        "none",
        "How emissivities depend on the angle at which they are seen, or none: they do not.\n"
        f"Kinds:\n{DIRECTIONS.examples}",
    )
    reflections: Annotated[ReflectionsSection | None, OR_NONE] = described(
        "none",
        "Reflections between the rake face and the chip's side, which flowed sideways, or none.\n"
        f"Kinds:\n{REFLECTIONS.examples}",
    )

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
        """The surfaces by name.

        Parameters
        ----------
        seed : int
            Seed of the textures, the same for every chip: they differ by their numbers only.

        Raises
        ------
        ValueError
            If a file is no emissivity map.
        OSError
            If it is not there.
        """
        chips = {
            name: self._features(chip.body.build(), chip.shear_band.build(), seed)
            for name, chip in self.chips.items()
        }
        maps = {name: read_emissivity_map(file) for name, file in self.maps.items()}
        measured = {name: self._measured(file, seed) for name, file in self.measured.items()}
        surfaces: dict[str, Surface] = {**chips, **maps, **measured}
        if self.spectral is not None:
            spectrum, band = self.spectral.build(), Band(*self.measured_in)
            surfaces = {
                name: DispersiveSurface(bare, spectrum, band) for name, bare in surfaces.items()
            }
        if self.oxide is not None:
            oxide = self.oxide.build()
            surfaces = {name: OxidisedSurface(bare, oxide) for name, bare in surfaces.items()}
        if self.directional is not None:
            law = self.directional.build()
            surfaces = {name: DirectionalSurface(bare, law) for name, bare in surfaces.items()}
        if self.reflections is None:
            return surfaces
        shape = self.reflections.build()
        return {name: ReflectingSurface(bare, shape) for name, bare in surfaces.items()}

    def _features(self, chip: Emissivity, shear_band: Emissivity, seed: int) -> FeatureSurface:
        return FeatureSurface(
            chip=chip,
            shear_band=shear_band,
            workpiece=self.workpiece.build(),
            tool=self.tool.build(),
            grain=self.grain,
            follow=self.follow,
            seed=seed,
            restore_standard_deviation=self.restore_standard_deviation,
        )

    def _measured(self, file: str, seed: int) -> FeatureTrends:
        try:
            areas = measured_features(read_measured_areas(file))
            means = {
                name: Emissivity(area.trend.emissivity, area.standard_deviation)
                for name, area in areas.items()
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
            bare, {_FEATURE.get(name, name): area.trend for name, area in areas.items()}
        )


SURFACES.add("features", FeaturesSection)

SurfaceSection = Annotated[FeaturesSection | Declared[SurfaceChoice], SURFACES]


def surface_names(section: FeaturesSection | Declared[SurfaceChoice]) -> tuple[str, ...]:
    """Names of a section's surfaces; a surface that is the only one is called by its kind."""
    return section.names if isinstance(section, FeaturesSection) else (section.kind,)


def surfaces_of(
    section: FeaturesSection | Declared[SurfaceChoice], seed: int
) -> dict[str, Surface]:
    """The surfaces of a section by their names.

    Parameters
    ----------
    section : FeaturesSection or Declared
        The section.
    seed : int
        Seed of the textures.

    Raises
    ------
    ValueError
        If one is not possible.
    OSError
        If a file is not there.
    """
    if isinstance(section, FeaturesSection):
        return section.build(seed)
    return {section.kind: section.build().surface()}


def _known_name(name: str, names: Mapping[str, object]) -> str:
    if name not in names:
        raise ValueError(f"{name!r} is unknown, expected one of {', '.join(names)}")
    return name
