"""Names, units and axes of fields in other programs' files."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, InstanceOf, PlainSerializer, WithJsonSchema

from chipglow.io.sources.source import Source, SourceError, naming
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import POSITION, SI, Unit, is_bare_number, parse_unit
from chipglow.scene import READABLE
from chipglow.scene.frame import FIELD_UNITS, MATERIAL_COORDINATE_UNITS
from chipglow.text import Notes

SI_UNITS: Final[Mapping[str, str]] = {
    **FIELD_UNITS,
    **MATERIAL_COORDINATE_UNITS,
    **dict.fromkeys("xyz", "m"),
    "velocity": "m/s",
    "time": "s",
}
"""SI units of the fields of a scene and of the coordinates; 1 for a dimensionless number."""

COMMON_NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "temperature": (
        "temperature", "temp", "nt11", "nt", "ndtemp", "node_temperature", "nodal_temperature",
        "t", "temperatur", "theta",
    ),
    "plastic_strain": (
        "plastic_strain", "peeq", "effective_plastic_strain", "equivalent_plastic_strain",
        "eff_plastic_strain", "element_shell_effective_plastic_strain",
        "element_solid_effective_plastic_strain", "epeq", "eqplas", "eqps", "strain_effective",
        "effective_strain", "strain",
    ),
    "plastic_strain_rate": (
        "plastic_strain_rate", "erpeq", "peeqr", "effective_plastic_strain_rate",
        "equivalent_plastic_strain_rate", "strain_rate_effective", "effective_strain_rate",
        "strain_rate",
    ),
    "velocity": ("velocity", "node_velocity", "vel", "v", "u_dot"),
    "velocity_x": ("velocity_x", "velocityx", "v1", "vx", "vel_x"),
    "velocity_y": ("velocity_y", "velocityy", "v2", "vy", "vel_y"),
    "material_x": ("material_x",),
    "material_y": ("material_y",),
}  # fmt: skip
"""Names that the major codes give to fields, simplified by `simple`, the surest first."""

FRAME_NAMES: Final = ("frame", "frames", "image", "images")
"""Further names of the axis along time."""

OTHER_NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "time": ("time", "times", "t_s", "t"),
    **{
        axis: (
            axis, f"{axis}_coordinate", f"{axis}c", f"coord_{axis}", f"pos_{axis}",
            f"position_{axis}", f"points_{number}",
        )
        for number, axis in enumerate("xyz")
    },
    "velocity_z": ("velocity_z", "velocityz", "v3", "vz", "vel_z"),
    "part": (
        "part", "part_id", "partid", "parts", "type", "material_id", "materialid", "materialids",
        "material", "mat", "body", "phase", "region", "region_id", "regionid", "object_id",
        "objectid", "elementblockids", "block_id", "gmsh_physical", "cell_tags",
    ),
    "volume": ("volume", "vol", "particle_volume"),
}  # fmt: skip
"""The same for coordinates and other columns."""


def simple(name: str) -> str:
    """Return a name in lower case with words joined by underscores, without a unit in brackets."""
    text = name.split("(")[0].split("[")[0].strip().lower()
    return "_".join("".join(letter if letter.isalnum() else " " for letter in text).split())


_UNIT_IN_BRACKETS: Final = re.compile(r"[\[(]([^\]),;]*)[^\])]*[\])]\s*$")
_UNIT_OF_TEMPERATURE: Final = re.compile(r"[_\s](K|C|F|deg_?[CFK]|(?i:kelvin|celsius))$")


def unit_in_name(label: str, name: str = "") -> str | None:
    """Return the unit that the label of a field states: ``T (degC)``, ``T [K, mean]``, ``T_C``.

    Without brackets it is looked for in temperatures alone: ``v_C`` may be a velocity of the chip.
    """
    stated = _UNIT_IN_BRACKETS.search(label)
    if stated is None and name == "temperature":
        stated = _UNIT_OF_TEMPERATURE.search(label)
    text = stated[1].strip() if stated else ""
    return None if not text or is_bare_number(text) else text


def match_names(
    available: Iterable[str],
    given: Mapping[str, str],
    known: Iterable[str] = READABLE,
    among: Iterable[str] | None = None,
    names: Mapping[str, Sequence[str]] = COMMON_NAMES,
) -> dict[str, str]:
    """Return a source's fields by the names of a scene: those given, then guesses by name."""
    there = sorted(available)
    for ours, theirs in given.items():
        if ours not in names:
            raise SourceError(f"fields: unknown {ours!r}, expected one of {', '.join(names)}")
        if theirs not in there:
            listed = ", ".join(there) or "none"
            raise SourceError(f"fields: {ours}: there is no field {theirs!r}, it has {listed}")
    guessable = there if among is None else sorted(among)
    simplified = {simple(name): name for name in reversed(guessable)}
    result = dict(given)
    for ours in known:
        if ours not in result:
            match = [simplified[name] for name in names[ours] if name in simplified]
            if match and match[0] not in result.values():
                result[ours] = match[0]
    return result


METRE, SECOND = (Unit(1.0, text=text) for text in ("m", "s"))


def _unit(name: str, base: str) -> tuple[Any, ...]:
    """Return how descriptions write a field that holds a unit: as text."""
    return (
        BeforeValidator(
            lambda value: value if isinstance(value, Unit) else parse_unit(str(value), base, name)
        ),
        PlainSerializer(lambda unit: unit.text, return_type=str, when_used="json"),
        WithJsonSchema({"type": "string"}),
    )


@dataclass(frozen=True)
class Units(Part):
    """Units of the source."""

    length: Annotated[
        InstanceOf[Unit],
        *_unit("length", "m"),
        Parameter("Unit of positions and lengths.", allowed="m, mm, um, in, ..."),
    ] = METRE
    time: Annotated[
        InstanceOf[Unit], *_unit("time", "s"), Parameter("Unit of times.", allowed="s, ms, us, ...")
    ] = SECOND
    temperature: Annotated[
        Annotated[InstanceOf[Unit], *_unit("temperature", "K")] | None,
        Parameter(
            "Unit of temperatures; none: as the source says, or K.",
            allowed="none, K, degC, degF, cK, 0.01 K, ...",
        ),
    ] = None
    velocity: Annotated[
        Annotated[InstanceOf[Unit], *_unit("velocity", "m/s")] | None,
        Parameter(
            "Unit of velocities; none: from length and time.", allowed="none, m/s, mm/s, m/min, ..."
        ),
    ] = None
    strain_rate: Annotated[
        Annotated[InstanceOf[Unit], *_unit("strain_rate", "1/s")] | None,
        Parameter("Unit of strain rates; none: from the time.", allowed="none, 1/s, 1/ms, ..."),
    ] = None

    def unit_given(self, name: str) -> Unit | None:
        """Return the unit of a field of a scene; None for temperatures without one."""
        return self.temperature if name == "temperature" else self.of(name)

    def of(self, name: str) -> Unit:
        """Return the unit of a field of a scene in a source that states none."""
        if name == "temperature":
            return self.temperature or SI
        if name.startswith("velocity"):
            return self.velocity or Unit(self.length.scale / self.time.scale)
        if name == "plastic_strain_rate":
            return self.strain_rate or Unit(1.0 / self.time.scale)
        return self.length if name.startswith("material_") else SI


PlacedGrid: TypeAlias = tuple[
    NDArray[np.float64], NDArray[np.float64], Callable[[NDArray[Any]], NDArray[Any]]
]
"""Centres of columns in m, ascending, and of rows, descending; and what turns samples so."""

Floats = TypeVar("Floats", np.float32, np.float64)

Axis: TypeAlias = Literal["x", "y", "z", "-x", "-y", "-z"]
_AXES: Final = ("x", "y", "z")


@dataclass(frozen=True)
class Placement(Part):
    """Axes of the source in the scene, whose x runs along the cut and whose y goes up.

    A negative axis is reversed after the origin is subtracted.
    """

    horizontal: Annotated[
        Axis,
        Parameter(
            "The source's axis along the workpiece's motion toward the tool.",
            allowed="x, y, z, -x, -y, -z",
        ),
    ] = "x"
    vertical: Annotated[
        Axis,
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

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axes[0] == self.axes[1]:
            raise ValueError(f"vertical: {self.vertical!r} is the horizontal axis too")

    @property
    def origin(self) -> tuple[float, float]:
        """Origin of the scene in m along the source's horizontal and vertical axis."""
        return self.origin_horizontal, self.origin_vertical

    @property
    def axes(self) -> tuple[int, int]:
        """Indices of the horizontal and the vertical axis."""
        return _AXES.index(self.horizontal[-1]), _AXES.index(self.vertical[-1])

    @property
    def signs(self) -> tuple[float, float]:
        """1 or -1 for the horizontal and the vertical axis."""
        names = self.horizontal, self.vertical
        first, second = (-1.0 if name.startswith("-") else 1.0 for name in names)
        return first, second

    @property
    def depth(self) -> int:
        """Index of the third axis."""
        return 3 - sum(self.axes)

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions in the scene in m, shape (n, 2), of points of shape (n, 3) in m."""
        return np.asarray((points[:, self.axes] - self.origin) * self.signs)

    def turn(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return components along the scene's x and y, shape (n, 2), of vectors of shape (n, 3)."""
        return np.asarray(vectors[:, self.axes] * self.signs)

    def grid(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> PlacedGrid:
        """Return columns and rows of the scene for those of a file at x and y in m."""
        along, up = (
            ((x, y)[axis] - origin) * sign
            for axis, origin, sign in zip(self.axes, self.origin, self.signs, strict=True)
        )
        columns = slice(None, None, -1 if along[0] > along[-1] else 1)
        rows = slice(None, None, -1 if up[0] < up[-1] else 1)

        def turned(values: NDArray[Any]) -> NDArray[Any]:
            values = values.swapaxes(-1, -2) if self.axes == (1, 0) else values
            return np.ascontiguousarray(values[..., rows, columns])

        return along[columns], up[rows], turned

    def in_file(self, name: str) -> str:
        """Return the name of a field, which may be a component, in the file's axes."""
        if not name.endswith(("_x", "_y")):
            return name
        return name[:-1] + _AXES[self.axes["xy".index(name[-1])]]

    def field(self, name: str, values: NDArray[Floats]) -> NDArray[Floats]:
        """Return values of a field in the scene from values in SI along the axes of the file."""
        if not name.endswith(("_x", "_y")):
            return values
        number = "xy".index(name[-1])
        if name.startswith("material"):
            values = values - self.origin[number]
        return values * self.signs[number]


def unit_of(name: str, label: str, text: str | None, given: Unit | None, notes: Notes) -> Unit:
    """Return and note the unit of a quantity: the one given, else that of the file's text, else SI.

    SI counts as given for temperatures only: other units of a description are SI by default.
    """
    short = label.rsplit(": ", 1)[-1]
    if given is not None and (given != SI or name == "temperature"):
        if text is not None and (own := known_unit(text, name)) != given:
            note_other_unit(short, text, notes, own is not None)
        return given
    if text is None:
        if SI_UNITS[name] != "1":
            notes.assumed.append(f"{short} is in {SI_UNITS[name]}: the file states no unit.")
        return SI
    with naming(label):
        unit = parse_unit(text, SI_UNITS[name], name)
    if unit != SI:
        notes.remarks.append(f"{short} is in {text!r}.")
    return unit


def known_unit(text: str, name: str) -> Unit | None:
    """Return the unit of a text; None if it is none of the quantity."""
    try:
        return parse_unit(text, SI_UNITS[name], name)
    except ValueError:
        return None


def note_other_unit(short: str, text: str | None, notes: Notes, contradicts: bool) -> None:
    """Note that a file states another unit than the one that is given and used.

    It is a warning if the file's text is a unit, which contradicts the given one.
    """
    if text is not None:
        place = notes.warnings if contradicts else notes.remarks
        place.append(f"{short} is in {text!r}; the given unit is used instead.")


@dataclass(frozen=True, kw_only=True)
class PlacedSource(Source):
    """A source whose times and axes an import states."""

    interval: float | None = None
    """Time from frame to frame in s, in place of the times of the files."""
    placement: Placement = field(default_factory=Placement)


@dataclass(frozen=True, kw_only=True)
class NamedSource(PlacedSource):
    """A source whose fields have names and units."""

    names: Mapping[str, str] = field(default_factory=dict)
    """Names in the files by names in a scene."""
    units: Units = field(default_factory=Units)
