"""Points over time, as of SPH and of the material point method."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from math import isfinite
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources import lammps_dump
from chipglow.io.sources.conventions import (
    COMMON_NAMES,
    Placement,
    Units,
    match_names,
    simple,
)
from chipglow.io.sources.layout import check_times, unit_of
from chipglow.io.sources.point_files import MOST_POINTS, PointFrames, PointTable, open_points
from chipglow.io.sources.source import (
    Source,
    SourceError,
    Survey,
    even_times,
    naming,
    span_of,
)
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH, POSITION, Unit
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.scene.cloud import Cloud, neighbour_distance, sample_cloud
from chipglow.text import Notes

_AXES: Final = "xyz"
_EXTRA: Final[Mapping[str, tuple[str, ...]]] = {
    "x": ("x", "coord_x", "pos_x", "position_x", "points_0", "x_coordinate"),
    "y": ("y", "coord_y", "pos_y", "position_y", "points_1", "y_coordinate"),
    "z": ("z", "coord_z", "pos_z", "position_z", "points_2", "z_coordinate"),
    "part": (
        "part",
        "part_id",
        "partid",
        "type",
        "material",
        "material_id",
        "mat",
        "body",
        "phase",
    ),
    "volume": ("volume", "vol", "particle_volume"),
}
_VELOCITY_Z: Final = ("velocity_z", "velocityz", "v3", "vz", "vel_z")
_FULLEST: Final = 4.0
"""Areas of the points together, at most, by the area of the box around them."""


@dataclass(frozen=True)
class CloudSource(Source, Part):
    """Points over time.

    Parameters
    ----------
    files : str
        A file with a column or list of times, or a path with ``*``: each file is then a frame,
        numbers in their names in order.
    names : mapping
        Name that a field has in the files, by its name in a scene; also of ``x``, ``y``, ``z``,
        ``time``, ``part`` and ``volume``. Those not named are guessed.
    interval : float, optional
        Time between frames in s; comes before times in the files.
    units : Units
        Units of what is in the files; where one is not SI, it comes before what a file says.
    placement : Placement
        How the points lie in the scene.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """

    title: ClassVar[str] = "points"
    # Most files of points have another ending: they are called by their kind.
    endings: ClassVar[tuple[str, ...]] = lammps_dump.ENDINGS
    files: str = ""
    names: Mapping[str, str] = field(default_factory=dict)
    spacing: Annotated[
        float | None,
        Parameter(
            "Distance of neighbours before the cut; none: from the points' volumes or, without "
            "them, from the first frame.",
            LENGTH,
            over=0.0,
        ),
    ] = None
    tool_parts: Annotated[
        tuple[int, ...],
        Parameter("Numbers of the part field that are tool, such as [2]."),
    ] = ()
    depth: Annotated[
        float, Parameter("Middle of the slab that is seen of points in space.", POSITION)
    ] = 0.0
    thickness: Annotated[
        float | None, Parameter("Thickness of that slab; none: all points.", LENGTH, over=0.0)
    ] = None
    interval: float | None = None
    units: Units = field(default_factory=Units)
    placement: Placement = field(default_factory=Placement)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.interval is not None and not (isfinite(self.interval) and self.interval > 0):
            raise ValueError(f"interval: {self.interval!r}, expected over 0")

    @property
    def inputs(self) -> tuple[str, ...]:
        """The path or pattern."""
        return (self.files,)

    def survey(self) -> Survey:
        """Look at what is there; see `Source.survey`."""
        with ExitStack() as stack:
            points = _Points(self, stack)
            clouds = [points.cloud(index) for index in sorted({0, points.files.count - 1})]
            return Survey(
                kind=f"points, {len(clouds[0].places)} in the first frame, {self.files}",
                times=points.times,
                extent=_extent(clouds),
                found=points.found,
                unused=points.unused,
                spacing=float(np.median(clouds[0].spacing)),
                temperatures=_temperatures(clouds, list(points.found)),
                notes=Notes() + points.notes,
            )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one after the other; see `Source.frames`."""
        with ExitStack() as stack:
            points = _Points(self, stack)
            tables = points.files.frames(start)
            for time, (path, table) in zip(points.times[start:], tables, strict=True):
                values, material = sample_cloud(points.cloud_of(path, table), raster)
                fields = dict(zip(points.found, values, strict=True))
                yield SampledFrame(float(time), fields, material)


def _extent(clouds: list[Cloud]) -> tuple[float, float, float, float]:
    low = np.min([(c.places - c.spacing[:, None] / 2).min(axis=0) for c in clouds], axis=0)
    high = np.max([(c.places + c.spacing[:, None] / 2).max(axis=0) for c in clouds], axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _temperatures(clouds: list[Cloud], found: list[str]) -> tuple[float, float] | None:
    """The greatest temperature twice: samples are means, so that the least need not be seen."""
    if "temperature" not in found:
        return None
    number = found.index("temperature")
    highest = max(span_of(cloud.values[:, number])[1] for cloud in clouds)
    return highest, highest


class _Points:
    """A source that is open: which column is what, and what a point stands for."""

    def __init__(self, source: CloudSource, stack: ExitStack) -> None:
        self._source = source
        self.notes = Notes()
        self.files: PointFrames = open_points(source.files, source.names.get("time"), stack)
        if self.files.count < 1:
            raise SourceError(f"{source.files}: has no frame")
        path, table = self.files.frame(0)
        self._extra = _extra_columns(source, path, table)
        self._find_fields(path, table)
        self._units = {
            name: self._unit(path, name, label, table) for name, label in self._labels.items()
        }
        self.times = self._times(path)
        self._solid = self._has_depth(path, table)
        self._spacing = self._find_spacing(path, table)

    def cloud(self, index: int) -> Cloud:
        """Points of a frame in the scene."""
        return self.cloud_of(*self.files.frame(index))

    def cloud_of(self, path: str, table: PointTable) -> Cloud:
        """Points of a table in the scene, in SI."""
        source, placement = self._source, self._source.placement
        solid = self._places(path, table)
        values = np.stack([self._value(path, table, name) for name in self.found], axis=1)
        volume = self._volume(path, table)
        material = self._material(path, table)
        good = np.isfinite(solid).all(axis=1) & np.isfinite(values).all(axis=1)
        if source.thickness is not None:
            good &= np.abs(solid[:, placement.depth] - source.depth) <= source.thickness / 2
        if not good.any():
            raise SourceError(f"{path}: has no point with a place and values{self._where}")
        dimension = 3 if self._solid else 2
        spacing = volume[good] ** (1 / dimension)
        area = volume[good] / (source.thickness or 1.0) if self._solid else volume[good]
        places = placement.place(solid[good])
        self._check_filling(path, places, spacing, area)
        with naming(path):
            return Cloud(places, values[good], material[good], spacing, area)

    @property
    def _where(self) -> str:
        source = self._source
        if source.thickness is None:
            return ""
        axis = _AXES[source.placement.depth]
        return f" within {source.thickness / 2:g} m of {axis} = {source.depth:g} m"

    def _find_fields(self, path: str, table: PointTable) -> None:
        """Columns of the fields: in the scene (`found`), and by what they are in the file."""
        source = self._source
        used = set(self._extra.values())
        labels = [label for label in table.columns if label not in (*used, self.files.time_label)]
        vectors = {label[:-2] for label in labels if label.endswith("_y")}
        given = {n: label for n, label in source.names.items() if n in COMMON_NAMES}
        vector = given.pop("velocity", None)
        if vector is not None and vector not in vectors:
            raise SourceError(f"{path}: fields: velocity: there is no vector {vector!r}")
        if vector is None:
            vector = match_names(vectors, {}, ("velocity",)).get("velocity")
        if vector is not None:
            for letter in "xy":
                given.setdefault(f"velocity_{letter}", f"{vector}_{letter}")
        unknown = sorted(set(source.names) - set(COMMON_NAMES) - set(_EXTRA) - {"time"})
        if unknown:
            raise SourceError(f"fields: unknown {unknown[0]!r}, expected one of {READABLE}")
        with naming(path):
            self._labels = match_names(labels, given, READABLE)
        if not self._labels:
            listed = ", ".join(labels[:20]) or "none"
            raise SourceError(f"{path}: no column is known as temperature, it has {listed}")
        third = {f"{vector}_z"} | {n for n in labels if simple(n) in _VELOCITY_Z}
        if source.placement.depth != 2 and third & set(labels):
            self._labels["velocity_z"] = sorted(third & set(labels))[0]
        self.found = {
            name: self._labels[own]
            for name in READABLE
            if (own := source.placement.in_file(name)) in self._labels
        }
        self.unused = tuple(n for n in labels if n not in self.found.values() and n != "time")

    def _unit(self, path: str, name: str, label: str, table: PointTable) -> Unit:
        own = self._source.units.of(name)
        known = name.replace("_z", "_x")
        return unit_of(known, f"{path}: {label}", table.units.get(label), own, self.notes)

    def _times(self, path: str) -> NDArray[np.float64]:
        source = self._source
        if source.interval is not None or self.files.times is None:
            return even_times(self.files.count, source.interval, self.notes)
        name = f"{path}: time"
        unit = unit_of("time", name, self.files.time_unit, source.units.time, self.notes)
        return check_times(name, self.files.times * unit.scale)

    def _places(self, path: str, table: PointTable) -> NDArray[np.float64]:
        """Places in m in the file's axes, shape (points, 3)."""
        places = np.zeros((len(next(iter(table.columns.values()))), 3))
        for number, axis in enumerate(_AXES):
            label = self._extra.get(axis)
            if label is not None:
                own, text = self._source.units.length, table.units.get(label)
                unit = unit_of(axis, f"{path}: {label}", text, own, self.notes)
                places[:, number] = _column(path, table, label) * unit.scale
        return places

    def _value(self, path: str, table: PointTable, name: str) -> NDArray[np.float64]:
        placement = self._source.placement
        own = placement.in_file(name)
        values = _column(path, table, self._labels[own])
        values = values * self._units[own].scale + self._units[own].offset
        return placement.field(name, values)

    def _volume(self, path: str, table: PointTable) -> NDArray[np.float64]:
        """Volume, or area in two dimensions, in SI."""
        count = len(next(iter(table.columns.values())))
        dimension = 3 if self._solid else 2
        if self._spacing is not None:
            return np.full(count, self._spacing**dimension)
        values = _column(path, table, self._extra["volume"])
        if not (np.isfinite(values) & (values > 0)).all():
            raise SourceError(f"{path}: {self._extra['volume']}: expected over 0 everywhere")
        return values * self._source.units.length.scale**dimension

    def _material(self, path: str, table: PointTable) -> NDArray[np.uint8]:
        count = len(next(iter(table.columns.values())))
        if not self._source.tool_parts:
            return np.full(count, Material.WORKPIECE, np.uint8)
        if "part" not in self._extra:
            raise SourceError(f"{path}: has no column of parts, say its name as part")
        parts = _column(path, table, self._extra["part"])
        tool = np.isin(parts, self._source.tool_parts)
        return np.where(tool, np.uint8(Material.TOOL), np.uint8(Material.WORKPIECE))

    def _has_depth(self, path: str, table: PointTable) -> bool:
        if self._source.thickness is not None:
            return True
        depth = self._places(path, table)[:, self._source.placement.depth]
        low, high = (float(limit) for limit in (np.nanmin(depth), np.nanmax(depth)))
        if high > low:
            axis = _AXES[self._source.placement.depth]
            raise SourceError(
                f"{path}: {axis} runs from {low:.6g} to {high:.6g} m, expected the depth and "
                "thickness of the slab to be seen"
            )
        return False

    def _find_spacing(self, path: str, table: PointTable) -> float | None:
        """Distance of neighbours in m; None if every point has its volume."""
        source = self._source
        spacing = source.spacing
        if spacing is None and "volume" in self._extra:
            return None
        if spacing is None:
            places = self._places(path, table)
            places = places[np.isfinite(places).all(axis=1)]
            axes = (0, 1, 2) if self._solid else source.placement.axes
            spacing = neighbour_distance(np.ascontiguousarray(places[:, axes]))
            if not spacing > 0:
                raise SourceError(f"{path}: its points are in one place, expected spacing")
            self.notes.assumed.append(
                f"The point spacing is that of neighbours in the first frame, {spacing:.4g} m."
            )
        if source.thickness is not None and source.thickness < spacing:
            raise SourceError(
                f"{path}: the slab is {source.thickness:.4g} m thick, expected the points' "
                f"spacing of {spacing:.4g} m or more"
            )
        return spacing

    def _check_filling(
        self,
        path: str,
        places: NDArray[np.float64],
        spacing: NDArray[np.float64],
        area: NDArray[np.float64],
    ) -> None:
        """Refuse points that stand for far more area than they lie in: another unit, likely."""
        box = float(np.prod(np.ptp(places, axis=0) + spacing.max()))
        total = float(area.sum())
        if not total <= _FULLEST * box:
            raise SourceError(
                f"{path}: its points stand for {total:.4g} m^2 but lie in {box:.4g} m^2, "
                "expected another spacing, volume or unit of length"
            )


def _extra_columns(source: CloudSource, path: str, table: PointTable) -> dict[str, str]:
    """Columns that are no fields of a scene, by what they are."""
    found: dict[str, str] = {}
    for name, guesses in _EXTRA.items():
        given = source.names.get(name)
        if given is not None:
            if given not in table.columns:
                raise SourceError(f"{path}: there is no column {given!r} for {name}")
            found[name] = given
            continue
        match = [label for label in table.columns if simple(label) in guesses]
        if match and not (name == "part" and not source.tool_parts):
            found[name] = match[0]
    for axis in source.placement.axes:
        if _AXES[axis] not in found:
            listed = ", ".join(list(table.columns)[:20]) or "none"
            raise SourceError(f"{path}: there is no column {_AXES[axis]!r}, it has {listed}")
    lengths = {len(values) for values in table.columns.values()}
    if len(lengths) > 1 or not 0 < max(lengths) <= MOST_POINTS:
        raise SourceError(
            f"{path}: columns of {sorted(lengths)} points, expected one number from 1 to "
            f"{MOST_POINTS}"
        )
    return found


def _column(path: str, table: PointTable, label: str) -> NDArray[np.float64]:
    values = np.asarray(table.numbers(path, label), np.float64)
    if len(values) != len(next(iter(table.columns.values()))):
        raise SourceError(f"{path}: {label} has {len(values)} points, others have more or fewer")
    return values
