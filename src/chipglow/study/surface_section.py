"""The section of the surface: emissivities, the paper's Table 1 by default."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar, Final

from chipglow.laboratory.emissivity import (
    SurfaceFile,
    emissivity_trend,
    measured_features,
    read_emissivity_lines,
    read_emissivity_map,
    read_origin,
)
from chipglow.quantities import FileBeside, Parameter, Part, made_from
from chipglow.quantities.units import WAVELENGTHS
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    DIRECTIONS,
    MODIFIERS,
    OXIDES,
    PAPER_ORIGIN,
    REFLECTIONS,
    SPECTRA,
    SURFACES,
    Direction,
    Dispersion,
    Emissivity,
    FeatureSettings,
    FeatureSurface,
    FeatureTrends,
    Modifier,
    Origin,
    Oxide,
    SideShape,
    SpectralSurface,
    Surface,
)

CHIPS: Final[Mapping[str, FeatureSurface]] = {"chip-1": CHIP_1, "chip-2": CHIP_2}
"""Chips of the paper's Table 1 by the names of a study."""


@dataclass(frozen=True)
class ChipSection(Part):
    """Emissivity of one chip.

    Its fields are those of a `FeatureSurface` that differ from chip to chip; a description calls
    the chip of a chip its body.
    """

    body: Annotated[Emissivity, FeatureSurface.parameter("chip")]
    shear_band: Annotated[Emissivity, FeatureSurface.parameter("shear_band")]

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> Any:
        section = super().__get_pydantic_json_schema__(schema, handler)
        return {"anyOf": [section, {"enum": list(CHIPS)}]}

    @classmethod
    def completed(cls, data: Any) -> Any:
        """Return the data, or those of the paper's chip of this name."""
        if not isinstance(data, str):
            return data
        if data not in CHIPS:
            raise ValueError(f"{data!r} is unknown, expected one of {', '.join(CHIPS)}")
        chip = CHIPS[data]
        return {"body": chip.chip, "shear_band": chip.shear_band}


@dataclass(frozen=True)
class Chips(Part):
    """Chips that are laid on the same scene, each by its name."""

    chips: Annotated[
        dict[str, ChipSection],
        Parameter(
            "Chips by name, each laid on the same scene. A chip is chip-1 or chip-2 (the paper's "
            "Table 1), or the numbers of its body and shear bands."
        ),
    ] = field(
        default_factory=lambda: {
            f"chip {number}": ChipSection(one.chip, one.shear_band)
            for number, one in ((1, CHIP_1), (2, CHIP_2))
        }
    )
    maps: Annotated[
        dict[str, FileBeside],
        Parameter(
            "Emissivity maps by name, files of chipglow emissivity: each is laid on the scene "
            "where its pixels lie, as one more chip. Of several true temperatures each pixel has "
            "its line.",
            allowed="{} or names and files beside this one: {measured: emissivity.nc}",
        ),
    ] = field(default_factory=dict)
    measured: Annotated[
        dict[str, FileBeside],
        Parameter(
            "Measured chips by name, files of chipglow emissivity: chip body and shear band (and "
            "workpiece and tool, if present) by their regions, over the temperature.",
            allowed="{} or names and files beside this one: {heated chip: emissivity.nc}",
        ),
    ] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.chips:
            raise ValueError("chips: {} is empty, must have a chip such as chip 1: chip-1")
        taken = set(self.chips)
        for kind in ("maps", "measured"):
            for name in getattr(self, kind):
                if name in taken:
                    raise ValueError(f"{kind}: {name!r} is the name of another chip too")
            taken |= getattr(self, kind).keys()

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.chips, *self.maps, *self.measured)


@SURFACES.part
@dataclass(frozen=True, kw_only=True)
class FeaturesSection(FeatureSettings, Chips):
    """The emissivity of each feature of a chip, each with its texture."""

    kind: ClassVar[str] = "features"
    spectral: Annotated[
        Annotated[SpectralSurface, SPECTRA] | None,
        Parameter(
            "How all these emissivities depend on the wavelength, for cameras of other bands; or "
            "none: they are grey."
        ),
    ] = None
    measured_in: Annotated[
        tuple[float, float],
        Parameter("Band in which these emissivities were measured.", WAVELENGTHS),
    ] = PAPER_BAND
    measured_on: Annotated[
        str | None,
        Parameter("Metal on which they were measured, such as Ti-6Al-4V; or none: not known."),
    ] = None
    modifiers: Annotated[
        tuple[Annotated[Modifier, MODIFIERS], ...],
        Parameter("Laws of other packages that modify all these emissivities, in order, or []."),
    ] = ()
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

    def build(self, seed: int) -> dict[str, Surface]:
        chips = {
            name: self._features(chip.body, chip.shear_band, seed)
            for name, chip in self.chips.items()
        }
        maps = {name: read_emissivity_map(file) for name, file in self.maps.items()}
        measured = {name: self._measured(file, seed) for name, file in self.measured.items()}
        bare: dict[str, Surface] = {**chips, **maps, **measured}
        spectra = [Dispersion(self.spectral, Band(*self.measured_in))] if self.spectral else []
        over = (self.oxide, self.directional, self.reflections)
        modifiers = [*spectra, *self.modifiers, *(one for one in over if one is not None)]
        return {name: surface.modified(*modifiers) for name, surface in bare.items()}

    def _features(self, chip: Emissivity, shear_band: Emissivity, seed: int) -> FeatureSurface:
        papers = any((chip, shear_band) == (one.chip, one.shear_band) for one in CHIPS.values())
        origin = PAPER_ORIGIN if papers else Origin()
        if "measured_in" in self.given:
            origin = replace(origin, band=self.measured_in)
        if self.measured_on is not None:
            origin = replace(origin, metal=self.measured_on)
        made = {"chip": chip, "shear_band": shear_band, "seed": seed, "origin": origin}
        return made_from(FeatureSurface, self, **made)

    def _measured(self, file: str, seed: int) -> Surface:
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
        bare = replace(bare, origin=read_origin(file))
        workpiece, tool = means.get("workpiece", bare.workpiece), means.get("tool", bare.tool)
        trends = {"chip" if name == "body" else name: trend for name, trend in trends.items()}
        return replace(bare, workpiece=workpiece, tool=tool).modified(FeatureTrends(trends))


SurfaceSection = Annotated[FeaturesSection | Surface | SurfaceFile, SURFACES]


def surface_names(section: FeaturesSection | Surface | SurfaceFile) -> tuple[str, ...]:
    """Return the names of a section's surfaces; a single one is called by its kind."""
    return section.names if isinstance(section, FeaturesSection) else (section.kind,)


def surfaces_of(section: FeaturesSection | Surface | SurfaceFile, seed: int) -> dict[str, Surface]:
    """Return the surfaces of a section by their names."""
    if isinstance(section, FeaturesSection):
        return section.build(seed)
    return {section.kind: section.surface() if isinstance(section, SurfaceFile) else section}
