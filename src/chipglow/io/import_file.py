"""What the description of an import says: where fields are, what they mean, where to sample."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal

from chipglow.io.importing import Import, View
from chipglow.io.measurement_file import holds
from chipglow.io.sandbox import Isolated
from chipglow.io.sources import Placement, Units
from chipglow.io.sources.cloud import CloudSource
from chipglow.io.sources.conventions import SI_UNITS
from chipglow.io.sources.grid import GridSource
from chipglow.io.sources.mesh import MeshSource
from chipglow.io.sources.mesh_vtk import OTHER_HDF
from chipglow.io.sources.movie import (
    FieldMovie,
    MovieSource,
    NamedMap,
    Pixel,
    metre_per_pixel,
)
from chipglow.io.sources.overlays import Box
from chipglow.io.tool_section import ToolSection
from chipglow.quantities import Family, FileBeside, Parameter, Part, adapter
from chipglow.quantities.units import LENGTH, TIME, parse_unit
from chipglow.scene.completion import Completion
from chipglow.text import commented_yaml, described_by

IMPORT_SOURCES: Final = Family("import_source")
"""Kinds of sources; those of other packages have a title and endings, too."""


@dataclass(frozen=True)
class FieldMovieSection(Part):
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


@dataclass(frozen=True)
class MovieSection(MovieSource):
    """Movies of fields with a colour scale, a movie a field."""

    title: ClassVar[str] = "a movie"
    endings: ClassVar[tuple[str, ...]] = (
        ".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".wmv", ".mpg", ".mpeg", ".gif",
    )  # fmt: skip
    movies: Mapping[str, FieldMovie] = field(default_factory=dict)
    metre_per_pixel: float = 0.0
    temperature: Annotated[FieldMovieSection, Parameter("The movie of the temperature.")] = field(
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

    def __post_init__(self) -> None:
        Part.__post_init__(self)  # the movies follow

    def source(self, whole: "ImportDescription") -> MovieSource:
        """Return the source that this section describes."""
        movies = {}
        for name in ("temperature", "plastic_strain", "plastic_strain_rate"):
            section = getattr(self, name)
            if section is not None:
                movies[name] = _field_movie(name, section, whole)
        return MovieSource(
            movies=movies,
            metre_per_pixel=self._side(),
            frame_interval=whole.interval,
            placement=whole.placement,
            **{name: getattr(self, name) for name in MovieSource.declared()},
        )

    def _side(self) -> float:
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
    colours = NamedMap(section.colours, section.bands) if section.colours else section.legend
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


for _kind, _source in (
    ("movie", MovieSection),
    ("mesh", MeshSource),
    ("points", CloudSource),
    ("grid", GridSource),
):
    IMPORT_SOURCES.add(_kind, _source)


@dataclass(frozen=True)
class ImportDescription(Part):
    """An import: which source, what its fields mean, where they are sampled."""

    source: Annotated[
        FileBeside | None, Parameter("The file, or a pattern for several: chip_*.vtu.")
    ] = None
    kind: Annotated[  # type: ignore[misc]
        Literal["movie", "mesh", "points", "grid"] | None,
        Parameter(
            "What the source is; none: the file's name says it.",
            allowed="movie, mesh, points, grid",
        ),
    ] = None  # type: ignore[assignment]
    fields: Annotated[
        dict[str, str],
        Parameter(
            "Names in the source by names of a scene; the usual names are known.",
            allowed="{temperature: NT11, plastic_strain: PEEQ, plastic_strain_rate: ..., "
            "velocity: V}",
        ),
    ] = field(default_factory=dict)
    units: Annotated[Units, Parameter("Units of the source: SI if nothing is said.")] = field(
        default_factory=Units
    )
    interval: Annotated[
        float | None, Parameter("Time from frame to frame; none: as the source says.", TIME)
    ] = None
    placement: Annotated[Placement, Parameter("How the source's axes lie in the scene.")] = field(
        default_factory=Placement
    )
    field_of_view: Annotated[View, Parameter("Where the scene is sampled.")] = field(
        default_factory=View
    )
    tool: Annotated[
        ToolSection | None,
        Parameter("The tool's outline with its tip at the origin: what is in it is tool."),
    ] = None
    completion: Annotated[Completion, Parameter("What stands in for what the source lacks.")] = (
        field(default_factory=Completion)
    )
    mesh: Annotated[MeshSource, Parameter("More of a mesh.")] = field(default_factory=MeshSource)
    movie: Annotated[MovieSection, Parameter("More of a movie.")] = field(
        default_factory=MovieSection
    )
    points: Annotated[CloudSource, Parameter("More of points.")] = field(
        default_factory=CloudSource
    )
    grid: Annotated[GridSource, Parameter("More of a grid.")] = field(default_factory=GridSource)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.source or self.kind:
            self.build()

    @property
    def file(self) -> str:
        """The source's file or pattern."""
        if self.source is None:
            raise ValueError("source: is missing, expected a file")
        return self.source

    def kind_of_source(self) -> str:
        """Return the kind of the source, as stated or by the file's name."""
        if self.kind is not None:
            return self.kind
        name = Path(self.file).name.lower()
        if name.endswith((".csv", ".tsv")) and _has_header(Path(self.file)):
            return "points"
        if name.endswith(OTHER_HDF) and holds(self.file, ("VTKHDF",)):
            return "mesh"
        for kind, source in IMPORT_SOURCES.parts.items():
            if name.endswith(source.endings):
                return kind
        raise ValueError(f"kind: {name!r} says none, expected {', '.join(IMPORT_SOURCES.kinds)}")

    def build(self) -> Import:
        """Return the import that is described."""
        section = getattr(self, self.kind_of_source())
        is_movie = isinstance(section, MovieSection)
        source = section.source(self) if is_movie else self._source(section)
        completion = self.completion
        tool = self.tool.build() if self.tool else None
        return Import(
            Isolated(source, Path(self.source or "movie").name),
            self.field_of_view,
            replace(completion, tool=tool),
            adapter(type(self)).dump_python(self, mode="json"),
            self._assumptions(),
        )

    def _source(self, section: Any) -> Any:
        """Return a source with what the description states beside its section."""
        said = {
            "files": ("files" in section.declared() and section.files) or self.file,
            "names": self.fields,
            "interval": self.interval,
            "units": self.units,
            "placement": self.placement,
        }
        known = {one.name for one in fields(section)}
        return replace(section, **{name: said[name] for name in said.keys() & known})

    def _assumptions(self) -> dict[str, str]:
        """Return assumptions that apply if the source contains a field, by the field's name."""
        assumptions: dict[str, str] = {}
        units = self.units
        length, time = units.length.text, units.time.text
        if units.velocity is None and (length, time) != ("m", "s"):
            text = f"Velocities are in {length}/{time}, by units.length and units.time."
            assumptions |= {"velocity_x": text, "velocity_y": text}
        if units.strain_rate is None and time != "s":
            assumptions["plastic_strain_rate"] = f"Strain rates are in 1/{time}, from units.time."
        if self.tool is not None or self.movie.tool_colour is not None:
            assumptions["temperature"] = (
                "Where the source has no temperature of the tool, it is "
                f"{self.completion.surroundings - 273.15:g} °C (completion.surroundings)."
            )
        return assumptions


def import_description() -> type[ImportDescription]:
    """Return the class of descriptions, with the sections of the kinds of other packages."""
    parts = IMPORT_SOURCES.parts
    added = {kind: part for kind, part in parts.items() if kind not in ImportDescription.declared()}
    if not added:
        return ImportDescription
    kinds: Any = Literal[*parts]
    known = replace(ImportDescription.parameter("kind"), allowed=", ".join(parts))
    rows: list[Any] = [("kind", Annotated[kinds | None, known], None)]
    for kind, part in added.items():
        section = Annotated[part, Parameter(f"More of {part.title}.")]  # type: ignore[valid-type]
        rows.append((kind, section, field(default_factory=part)))
    made: type[ImportDescription] = make_dataclass(
        "ImportDescription", rows, bases=(ImportDescription,), frozen=True
    )
    return made


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
    """Return a description of an import as YAML, every field with a comment."""
    return commented_yaml(_IMPORT_HEADER, description)


_IMPORT_HEADER: Final = """\
# An import of chipglow. Run it with: chipglow import FILE --out scene.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 0.3 mm, 250 m/min, 391 degC.
# Of the sections that are called by a kind, such as mesh, only that of the source's kind counts.
"""
