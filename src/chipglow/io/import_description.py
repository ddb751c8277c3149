"""What the description of an import says: where fields are, what they mean, where to sample."""

import re
from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import create_model, model_validator

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
    OR_NONE,
    Declared,
    Family,
    FileBeside,
    Parameters,
    Section,
    Settings,
    described,
)
from chipglow.quantities.units import Length, Position, Time, Unit, parse_unit
from chipglow.scene.completion import Completion
from chipglow.text import commented_yaml, described_by

IMPORT_SOURCES: Final = Family("import_source")
"""Kinds of sources; those of other packages are sections with their kind and endings, too."""


class UnitsSection(Settings[Units]):
    """Units of the source."""

    length: str = described("m", "Unit of positions and lengths.", "m, mm, um, in, ...")
    time: str = described("s", "Unit of times.", "s, ms, us, ...")
    temperature: str = described("K", "Unit of temperatures.", "K, degC, degF")
    velocity: Annotated[str | None, OR_NONE] = described(
        "none", "Unit of velocities; none: made of length and time.", "none, m/s, mm/s, m/min, ..."
    )
    strain_rate: Annotated[str | None, OR_NONE] = described(
        "none", "Unit of strain rates; none: made of the time.", "none, 1/s, 1/ms, ..."
    )

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

    horizontal: str = described(
        "x",
        "The source's axis along the workpiece's motion toward the tool.",
        "x, y, z, -x, -y, -z",
    )
    vertical: str = described(
        "y", "The source's axis from the cut surface into the chip.", "x, y, z, -x, -y, -z"
    )
    origin_horizontal: Position = described(
        "0 um", "Where the tip of the tool is on the horizontal axis, in the source's coordinates."
    )
    origin_vertical: Position = described("0 um", "The same on the vertical axis.")

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

    file: Annotated[FileBeside | None, OR_NONE] = described("none", "The movie.")
    first: str | int | float = described(
        "", "Value of the first colour, or at the bottom or left of the legend."
    )
    last: str | int | float = described(
        "", "Value of the last colour, or at the top or right of the legend."
    )
    colours: Annotated[str | None, OR_NONE] = described(
        "none",
        "Name of the colour map; none: the legend in the picture is read.",
        "none, rainbow, jet, viridis, ... of matplotlib",
    )
    bands: int = described(0, "Number of the map's bands; 0: it runs without steps.", "0, 2 to 256")
    legend: Annotated[Box | None, OR_NONE] = described(
        "none",
        "Left, top, right and bottom pixel of the legend's colours; none: it is looked for.",
        "none, or [600, 40, 620, 400]",
    )


class MoviesSection(Section):
    """Movies by their field, and how large their pixels are."""

    temperature: FieldMovieSection = described({}, "The movie of the temperature.")
    plastic_strain: Annotated[FieldMovieSection | None, OR_NONE] = described(
        "none", "The movie of the plastic strain."
    )
    plastic_strain_rate: Annotated[FieldMovieSection | None, OR_NONE] = described(
        "none", "The movie of the plastic strain rate."
    )
    pixel: Annotated[Length | None, OR_NONE] = described("none", "Side of a pixel.")
    scale_from: Annotated[Pixel | None, OR_NONE] = described(
        "none", "A point whose distance from another is known, in pixels right and down.",
        "none, or [120, 400]",
    )  # fmt: skip
    scale_to: Annotated[Pixel | None, OR_NONE] = described("none", "The other point.")
    scale_length: Annotated[Length | None, OR_NONE] = described("none", "Their distance.")


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

    files: Annotated[dict[str, FileBeside] | None, OR_NONE] = described(
        "none",
        "Files by the names of fields, in the place of source.",
        "none, or {temperature: T.npy, plastic_strain: strain.npy}",
    )

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

    source: Annotated[FileBeside | None, OR_NONE] = described(
        "none", "The file, or a pattern for several: chip_*.vtu."
    )
    kind: Annotated[Literal["movie", "mesh", "points", "grid"] | None, OR_NONE] = described(
        "none", "What the source is; none: the file's name says it.", "movie, mesh, points, grid"
    )
    fields: dict[str, str] = described(
        {},
        "Names in the source by names of a scene; the usual names are known.",
        "{temperature: NT11, plastic_strain: PEEQ, plastic_strain_rate: ..., velocity: V}",
    )
    units: UnitsSection = described({}, "Units of the source: SI if nothing is said.")
    interval: Annotated[Time | None, OR_NONE] = described(
        "none", "Time from frame to frame; none: as the source says."
    )
    placement: PlacementSection = described({}, "How the source's axes lie in the scene.")
    field_of_view: Declared[View] = described({}, "Where the scene is sampled.")
    tool: Annotated[ToolSection | None, OR_NONE] = described(
        "none", "The tool's outline with its tip at the origin: what is in it is tool."
    )
    completion: Declared[Completion] = described({}, "What stands in for what the source lacks.")
    mesh: MeshSection = described({}, "More of a mesh.")
    movie: MovieSection = described({}, "More of a movie.")
    points: PointsSection = described({}, "More of points.")
    grid: GridSection = described({}, "More of a grid.")

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
        completion = self.completion.build()
        tool = self.tool.build() if self.tool else None
        return Import(
            Isolated(section.source(self), Path(self.source or "movie").name),
            self.field_of_view.build(),
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
    kinds = Annotated[Literal[*parts] | None, OR_NONE]  # type: ignore[valid-type]
    sections = {k: (part, described({}, f"More of {part.title}.")) for k, part in added.items()}
    said = described("none", "What the source is; none: the file's name says it.", ", ".join(parts))
    fields: Any = {"kind": (kinds, said), **sections}
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
