"""What the description of an import says: where fields are, what they mean, where to sample."""

import re
from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import Field, create_model, model_validator

from chipglow.io.importing import Import, View
from chipglow.io.sandbox import Isolated
from chipglow.io.sources import Placement, Source, Units, lammps_dump
from chipglow.io.sources.arrays import ARRAY_READERS
from chipglow.io.sources.cloud import CloudSource
from chipglow.io.sources.conventions import SI_UNITS
from chipglow.io.sources.grid import GridSource
from chipglow.io.sources.mesh import MESH_READERS, MeshSource
from chipglow.io.sources.movie import (
    FieldMovie,
    Legend,
    MovieSource,
    NamedMap,
    Pixel,
    metre_per_pixel,
)
from chipglow.io.sources.overlays import Box
from chipglow.io.tool_section import ToolSection
from chipglow.quantities import (
    Family,
    FileBeside,
    Parameter,
    Parameters,
    Section,
    Settings,
)
from chipglow.quantities.units import (
    LENGTH,
    POSITION,
    TIME,
    Unit,
    parse_unit,
)
from chipglow.scene.completion import Completion
from chipglow.text import commented_yaml, described_by

IMPORT_SOURCES: Final = Family("import_source")
"""Kinds of sources; those of other packages are sections with their kind and endings, too."""


class UnitsSection(Settings[Units]):
    """Units of the source."""

    length: Annotated[
        str, Parameter("Unit of positions and lengths.", allowed="m, mm, um, in, ...")
    ] = "m"
    time: Annotated[str, Parameter("Unit of times.", allowed="s, ms, us, ...")] = "s"
    temperature: Annotated[str, Parameter("Unit of temperatures.", allowed="K, degC, degF")] = "K"
    velocity: Annotated[
        str | None,
        Parameter(
            "Unit of velocities; none: made of length and time.",
            allowed="none, m/s, mm/s, m/min, ...",
        ),
    ] = None
    strain_rate: Annotated[
        str | None,
        Parameter("Unit of strain rates; none: made of the time.", allowed="none, 1/s, 1/ms, ..."),
    ] = None

    def build(self) -> Units:
        """The units."""
        return Units(
            length=self._unit("length", "m"),
            time=self._unit("time", "s"),
            temperature=self._unit("temperature", "K"),
            velocity=None if self.velocity is None else self._unit("velocity", "m/s"),
            strain_rate=None if self.strain_rate is None else self._unit("strain_rate", "1/s"),
        )

    def _unit(self, name: str, base: str) -> Unit:
        try:
            return parse_unit(getattr(self, name), base, name)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None


class PlacementSection(Settings[Placement]):
    """How the source's axes lie in the scene, whose x runs along the cut and whose y goes up."""

    horizontal: Annotated[
        str,
        Parameter(
            "The source's axis along the workpiece's motion toward the tool.",
            allowed="x, y, z, -x, -y, -z",
        ),
    ] = "x"
    vertical: Annotated[
        str,
        Parameter(
            "The source's axis from the cut surface into the chip.", allowed="x, y, z, -x, -y, -z"
        ),
    ] = "y"
    origin_horizontal: Annotated[
        float,
        Parameter(
            "Where the tip of the tool is on the horizontal axis, in the source's coordinates.",
            POSITION,
        ),
    ] = 0.0
    origin_vertical: Annotated[float, Parameter("The same on the vertical axis.", POSITION)] = 0.0

    def build(self) -> Placement:
        """The placement."""
        origin = self.origin_horizontal, self.origin_vertical
        return Placement(self.horizontal, self.vertical, origin)


class SourceSection(Section):
    """What is said of one kind of source.

    Attributes
    ----------
    kind : str
        Name of the kind, and of its section.
    title : str
        What such sources are, for the comment on the section.
    endings : tuple of str
        Endings of such files' names, in small letters.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    endings: ClassVar[tuple[str, ...]]

    @abstractmethod
    def source(self, whole: "ImportDescription") -> Source:
        """The source that the whole describes."""


class FieldMovieSection(Section):
    """A movie of one field."""

    file: Annotated[FileBeside | None, Parameter("The movie.")] = None
    first: Annotated[
        str | int | float,
        Parameter("Value of the first colour, or at the bottom or left of the legend."),
    ] = ""
    last: Annotated[
        str | int | float,
        Parameter("Value of the last colour, or at the top or right of the legend."),
    ] = ""
    colours: Annotated[
        str | None,
        Parameter(
            "Name of the colour map; none: the legend in the picture is read.",
            allowed="none, rainbow, jet, viridis, ... of matplotlib",
        ),
    ] = None
    bands: Annotated[
        int,
        Parameter("Number of the map's bands; 0: it runs without steps.", allowed="0, 2 to 256"),
    ] = 0
    legend: Annotated[
        Box | None,
        Parameter(
            "Left, top, right and bottom pixel of the legend's colours; none: it is looked for.",
            allowed="none, or [600, 40, 620, 400]",
        ),
    ] = None


class MoviesSection(Section):
    """Movies by their field, and how large their pixels are."""

    temperature: Annotated[FieldMovieSection, Parameter("The movie of the temperature.")] = Field(
        default_factory=FieldMovieSection
    )
    plastic_strain: Annotated[
        FieldMovieSection | None, Parameter("The movie of the plastic strain.")
    ] = None
    plastic_strain_rate: Annotated[
        FieldMovieSection | None, Parameter("The movie of the plastic strain rate.")
    ] = None
    pixel: Annotated[float | None, Parameter("Side of a pixel.", LENGTH)] = None
    scale_from: Annotated[
        Pixel | None,
        Parameter(
            "A point whose distance from another is known, in pixels right and down.",
            allowed="none, or [120, 400]",
        ),
    ] = None
    scale_to: Annotated[Pixel | None, Parameter("The other point.")] = None
    scale_length: Annotated[float | None, Parameter("Their distance.", LENGTH)] = None


@IMPORT_SOURCES.part
class MovieSection(SourceSection, Parameters[MovieSource], MoviesSection):
    """Movies of fields with a colour scale, a movie a field."""

    kind: ClassVar[str] = "movie"
    title: ClassVar[str] = "a movie"
    endings: ClassVar[tuple[str, ...]] = (
        ".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".wmv", ".mpg", ".mpeg", ".gif",
    )  # fmt: skip

    def source(self, whole: "ImportDescription") -> MovieSource:
        """The source that this section describes."""
        movies = {}
        for name in ("temperature", "plastic_strain", "plastic_strain_rate"):
            section = getattr(self, name)
            if section is not None:
                movies[name] = _field_movie(name, section, whole)
        return MovieSource(
            movies=movies,
            metre_per_pixel=self._metre_per_pixel(),
            frame_interval=whole.interval,
            placement=whole.placement.build(),
            **self.values,
        )

    def _metre_per_pixel(self) -> float:
        if self.pixel is not None:
            return self.pixel
        if self.scale_from is None or self.scale_to is None or self.scale_length is None:
            raise ValueError(
                "movie.pixel: is missing, expected the side of a pixel such as 1 um, "
                "or scale_from, scale_to and scale_length"
            )
        return metre_per_pixel(self.scale_from, self.scale_to, self.scale_length)


def _field_movie(name: str, section: FieldMovieSection, whole: "ImportDescription") -> FieldMovie:
    file = section.file or (whole.source if name == "temperature" else None)
    if file is None:
        raise ValueError(f"movie.{name}.file: is missing, expected the name of a movie")
    ends = [_value(f"movie.{name}.{end}", name, getattr(section, end)) for end in ("first", "last")]
    colours = (
        NamedMap(section.colours, section.bands) if section.colours else Legend(section.legend)
    )
    return FieldMovie(Path(file), (ends[0], ends[1]), colours)


def _value(place: str, field: str, value: str | int | float) -> float:
    """SI number of a value of a field with its unit, such as ``1127 degC`` or ``4``."""
    text = str(value)
    if not text.strip():
        raise ValueError(f"{place}: is missing, expected a value such as {_EXAMPLES[field]}")
    number, _, unit = text.strip().partition(" ")
    if not unit and field != "plastic_strain":
        raise ValueError(f"{place}: {text!r} has no unit, expected one such as {_EXAMPLES[field]}")
    try:
        return float(parse_unit(unit, SI_UNITS[field], field).to_si(float(number)))
    except ValueError:
        raise ValueError(
            f"{place}: {text!r}, expected a value such as {_EXAMPLES[field]}"
        ) from None


def _has_header(path: Path) -> bool:
    """Whether a table of text begins with a line of names."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        first = file.readline(10_000).decode("utf-8", "replace").lower()
    words = re.findall(r"[a-z_]+", first)
    return any(word not in ("e", "nan", "inf") for word in words)


_EXAMPLES: Final = {
    "temperature": "1127 degC",
    "plastic_strain": "4",
    "plastic_strain_rate": "1e5 1/s",
}


@IMPORT_SOURCES.part
class MeshSection(SourceSection, Parameters[MeshSource]):
    """Finite-element results."""

    kind: ClassVar[str] = "mesh"
    title: ClassVar[str] = "a mesh"
    endings: ClassVar[tuple[str, ...]] = (*MESH_READERS, "d3plot")

    def source(self, whole: "ImportDescription") -> MeshSource:
        """The source that this section describes."""
        return MeshSource(
            path=Path(whole.file),
            names=whole.fields,
            units=whole.units.build(),
            placement=whole.placement.build(),
            interval=whole.interval,
            **self.values,
        )


@IMPORT_SOURCES.part
class PointsSection(SourceSection, Parameters[CloudSource]):
    """Points, as of smoothed particles or material points."""

    kind: ClassVar[str] = "points"
    title: ClassVar[str] = "points"
    # Most files of points have another ending: they are called by their kind.
    endings: ClassVar[tuple[str, ...]] = lammps_dump.ENDINGS

    def source(self, whole: "ImportDescription") -> CloudSource:
        """The source that this section describes."""
        return CloudSource(
            files=whole.file,
            names=whole.fields,
            interval=whole.interval,
            units=whole.units.build(),
            placement=whole.placement.build(),
            **self.values,
        )


@IMPORT_SOURCES.part
class GridSection(SourceSection, Parameters[GridSource]):
    """Arrays on a regular grid."""

    kind: ClassVar[str] = "grid"
    title: ClassVar[str] = "a grid"
    endings: ClassVar[tuple[str, ...]] = tuple(ARRAY_READERS)

    files: Annotated[
        dict[str, FileBeside] | None,
        Parameter(
            "Files by the names of fields, in the place of source.",
            allowed="none, or {temperature: T.npy, plastic_strain: strain.npy}",
        ),
    ] = None

    def source(self, whole: "ImportDescription") -> GridSource:
        """The source that this section describes."""
        return GridSource(
            files=self.files or whole.file,
            names=whole.fields,
            interval=whole.interval,
            units=whole.units.build(),
            placement=whole.placement.build(),
            **self.values,
        )


class ImportDescription(Section):
    """An import: which source, what its fields mean, where they are sampled."""

    source: Annotated[
        FileBeside | None, Parameter("The file, or a pattern for several: chip_*.vtu.")
    ] = None
    kind: Annotated[
        Literal["movie", "mesh", "points", "grid"] | None,
        Parameter(
            "What the source is; none: the file's name says it.",
            allowed="movie, mesh, points, grid",
        ),
    ] = None
    fields: Annotated[
        dict[str, str],
        Parameter(
            "Names in the source by names of a scene; the usual names are known.",
            allowed="{temperature: NT11, plastic_strain: PEEQ, plastic_strain_rate: ..., "
            "velocity: V}",
        ),
    ] = Field(default_factory=dict)
    units: Annotated[UnitsSection, Parameter("Units of the source: SI if nothing is said.")] = (
        Field(default_factory=UnitsSection)
    )
    interval: Annotated[
        float | None, Parameter("Time from frame to frame; none: as the source says.", TIME)
    ] = None
    placement: Annotated[PlacementSection, Parameter("How the source's axes lie in the scene.")] = (
        Field(default_factory=PlacementSection)
    )
    field_of_view: Annotated[View, Parameter("Where the scene is sampled.")] = View()
    tool: Annotated[
        ToolSection | None,
        Parameter("The tool's outline with its tip at the origin: what is in it is tool."),
    ] = None
    completion: Annotated[Completion, Parameter("What stands in for what the source lacks.")] = (
        Completion()
    )
    mesh: Annotated[MeshSection, Parameter("More of a mesh.")] = Field(default_factory=MeshSection)
    movie: Annotated[MovieSection, Parameter("More of a movie.")] = Field(
        default_factory=MovieSection
    )
    points: Annotated[PointsSection, Parameter("More of points.")] = Field(
        default_factory=PointsSection
    )
    grid: Annotated[GridSection, Parameter("More of a grid.")] = Field(default_factory=GridSection)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.source or self.kind:
            self.build()
        return self

    @property
    def file(self) -> str:
        """The source's file or pattern."""
        if self.source is None:
            raise ValueError("source: is missing, expected a file")
        return self.source

    def kind_of_source(self) -> str:
        """What the source is, as said or by the file's name."""
        if self.kind is not None:
            return self.kind
        name = Path(self.file).name.lower()
        if name.endswith((".csv", ".tsv")) and _has_header(Path(self.file)):
            return "points"
        for kind, section in IMPORT_SOURCES.parts.items():
            if name.endswith(section.endings):
                return kind
        raise ValueError(f"kind: {name!r} says none, expected {', '.join(IMPORT_SOURCES.kinds)}")

    def build(self) -> Import:
        """The import that is described."""
        section: SourceSection = getattr(self, self.kind_of_source())
        completion = self.completion
        tool = self.tool.build() if self.tool else None
        return Import(
            Isolated(section.source(self), Path(self.source or "movie").name),
            self.field_of_view,
            replace(completion, tool=tool),
            self.model_dump(mode="json"),
            self._assumptions(),
        )

    def _assumptions(self) -> dict[str, str]:
        """Return assumptions that apply if the source contains a field, by the field's name."""
        assumptions: dict[str, str] = {}
        units = self.units
        if units.velocity is None and (units.length, units.time) != ("m", "s"):
            text = f"Velocities are in {units.length}/{units.time}, by units.length and units.time."
            assumptions |= {"velocity_x": text, "velocity_y": text}
        if units.strain_rate is None and units.time != "s":
            assumptions["plastic_strain_rate"] = (
                f"Strain rates are in 1/{units.time}, from units.time."
            )
        if self.tool is not None or self.movie.tool_colour is not None:
            assumptions["temperature"] = (
                "Where the source has no temperature of the tool, it is "
                f"{self.completion.surroundings - 273.15:g} °C (completion.surroundings)."
            )
        return assumptions


def import_description() -> type[ImportDescription]:
    """What describes an import, with the sections of the kinds that other packages add."""
    parts = IMPORT_SOURCES.parts
    added = {
        kind: part for kind, part in parts.items() if kind not in ImportDescription.model_fields
    }
    if not added:
        return ImportDescription
    known = Parameter(
        "What the source is; none: the file's name says it.", allowed=", ".join(parts)
    )
    fields: Any = {"kind": (Annotated[Literal[*parts] | None, known], None)}
    for kind, part in added.items():
        more = Parameter(f"More of {part.title}.")
        fields[kind] = (Annotated[part, more], Field(default_factory=part))
    return create_model("ImportDescription", __base__=ImportDescription, **fields)


def load_import(source: str | Path, settings: Iterable[str] = ()) -> ImportDescription:
    """Read the description of an import from a YAML file, or make one of a source.

    Parameters
    ----------
    source : str or Path
        A YAML file (.yaml, .yml) that describes an import, or the source itself.
    settings : iterable of str
        Fields that come before those of the file: ``units.length=mm``.

    Raises
    ------
    DescriptionError
        If the file is no YAML or the import is not possible.
    OSError
        If the file cannot be read.
    """
    return described_by(import_description(), Path(source), "source", settings)


def import_text(description: ImportDescription) -> str:
    """A description of an import as YAML, every field with a comment."""
    return commented_yaml(_IMPORT_HEADER, description)


_IMPORT_HEADER: Final = """\
# An import of chipglow. Run it with: chipglow import FILE --out scene.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 0.3 mm, 250 m/min, 391 degC.
# Of the sections that are called by a kind, such as mesh, only that of the source's kind counts.
"""
