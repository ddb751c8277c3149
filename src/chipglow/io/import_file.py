"""The description of an import: fields, their meaning, and the samples."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from chipglow.io.completion import Completion
from chipglow.io.importing import FieldOfView, Import
from chipglow.io.measurement_file import holds
from chipglow.io.sandbox import Isolated, Sandbox
from chipglow.io.sources import Placement, Units
from chipglow.io.sources.grids.grid import GridSource
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.meshes.vtk import OTHER_HDF
from chipglow.io.sources.movies.movie import MovieSource
from chipglow.io.sources.points.cloud import CloudSource
from chipglow.io.tool_section import ToolSection
from chipglow.quantities import ZERO_CELSIUS, Family, FileBeside, Parameter, Part, adapter
from chipglow.quantities.units import TIME
from chipglow.text import commented_yaml, described_by, has_names_of_columns

IMPORT_SOURCES: Final = Family("import_source")
"""Kinds of sources; those of other packages have a title and endings, too."""


IMPORT_SOURCES.add("movie", MovieSource)
IMPORT_SOURCES.add("mesh", MeshSource)
IMPORT_SOURCES.add("points", CloudSource)
IMPORT_SOURCES.add("grid", GridSource)


@dataclass(frozen=True)
class ImportDescription(Part):
    """An import: which source, what its fields mean, where they are sampled."""

    source: Annotated[
        FileBeside | None, Parameter("The file, or a pattern for several: chip_*.vtu.")
    ] = None
    kind: Annotated[  # type: ignore[misc]
        Literal["movie", "mesh", "points", "grid"] | None,
        Parameter(
            "Kind of the source; none: by the file name.", allowed="movie, mesh, points, grid"
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
    units: Annotated[Units, Parameter("Units of the source: SI by default.")] = field(
        default_factory=Units
    )
    interval: Annotated[
        float | None, Parameter("Time from frame to frame; none: as the source says.", TIME)
    ] = None
    placement: Annotated[Placement, Parameter("How the source's axes lie in the scene.")] = field(
        default_factory=Placement
    )
    field_of_view: Annotated[FieldOfView, Parameter("Samples of the scene.")] = field(
        default_factory=FieldOfView
    )
    tool: Annotated[
        ToolSection | None,
        Parameter("The tool's outline with its tip at the origin: what is in it is tool."),
    ] = None
    completion: Annotated[
        Completion, Parameter("Substitutes for fields that the source lacks.")
    ] = field(default_factory=Completion)
    mesh: Annotated[MeshSource, Parameter("More of a mesh.")] = field(default_factory=MeshSource)
    movie: Annotated[MovieSource, Parameter("More of a movie.")] = field(
        default_factory=MovieSource
    )
    points: Annotated[CloudSource, Parameter("More of points.")] = field(
        default_factory=CloudSource
    )
    grid: Annotated[GridSource, Parameter("More of a grid.")] = field(default_factory=GridSource)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.source or self.kind:
            self.build()

    def kind_of_source(self) -> str:
        """Return the kind of the source, as stated or by the file's name."""
        if self.kind is not None:
            return self.kind
        if self.source is None:
            raise ValueError("source: is missing, expected a file")
        name = Path(self.source).name.lower()
        if name.endswith((".csv", ".tsv")) and has_names_of_columns(Path(self.source)):
            return "points"
        if name.endswith(OTHER_HDF) and holds(self.source, ("VTKHDF",)):
            return "mesh"
        for kind, source in IMPORT_SOURCES.parts.items():
            if name.endswith(source.endings):
                return kind
        raise ValueError(f"kind: {name!r}, expected {', '.join(IMPORT_SOURCES.kinds)}")

    def build(self) -> Import:
        """Return the import that is described."""
        section = getattr(self, self.kind_of_source())
        files = section.own_files or self.source
        if files is None:
            raise ValueError("source: is missing, expected a file")
        stated = {name: getattr(self, name) for name in ("interval", "units", "placement")}
        stated |= {"files": files, "names": self.fields}
        known = {one.name for one in fields(section)}
        source = replace(section, **{name: stated[name] for name in stated.keys() & known})
        return Import(
            Isolated(source, Sandbox(Path(self.source or "movie").name)),
            self.field_of_view,
            replace(self.completion, tool=self.tool.build() if self.tool else None),
            adapter(type(self)).dump_python(self, mode="json"),
            self._assumptions(),
        )

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
                f"{self.completion.surroundings - ZERO_CELSIUS:g} °C (completion.surroundings)."
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
    """Read the description of an import from a YAML file, or create one for a source.

    Parameters
    ----------
    source : str or Path
        A YAML file (.yaml, .yml) that describes an import, or the source itself.
    settings : iterable of str
        Fields that come before those of the file: ``units.length=mm``.

    Raises
    ------
    DescriptionError
        If the file is not YAML or the import is impossible.
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
