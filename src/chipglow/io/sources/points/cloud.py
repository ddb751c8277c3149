"""Points over time, for example from SPH or the material point method."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import (
    COMMON_NAMES,
    OTHER_NAMES,
    NamedSource,
    match_names,
    simple,
    unit_in_name,
    unit_of,
)
from chipglow.io.sources.points.files import PointTable, open_points
from chipglow.io.sources.points.sampling import Cloud, neighbour_distance, sample_cloud
from chipglow.io.sources.source import SourceError, Survey, check_times, even_times, naming, span_of
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH, POSITION, Unit
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.text import Notes

_AXES: Final = "xyz"
_EXTRA: Final = (*_AXES, "part", "volume")
_FULLEST: Final = 4.0
"""Areas of the points together, at most, by the area of the box around them."""


@dataclass(frozen=True)
class CloudSource(NamedSource, Part):
    """Points over time.

    ``files`` are a file with a column or list of times, or a path with ``*``: each file is then a
    frame. ``names`` maps names in a scene to names in the files; also of ``x``,
    ``y``, ``z``, ``time``, ``part`` and ``volume``; those not named are guessed. An ``interval`` in
    s replaces times in the files, and ``units`` that are not SI those that a file states.
    """

    title: ClassVar[str] = "points"
    files: str = ""
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
        tuple[int, ...], Parameter("Values of the part field that belong to the tool, such as [2].")
    ] = ()
    depth: Annotated[
        float, Parameter("Middle of the slab that is seen of points in space.", POSITION)
    ] = 0.0
    thickness: Annotated[
        float | None, Parameter("Thickness of that slab; none: all points.", LENGTH, over=0.0)
    ] = None

    def survey(self) -> Survey:
        with ExitStack() as stack:
            points = _Points(self, stack)
            last = len(points.tables) - 1
            clouds = [points.cloud(points.tables[index]()) for index in sorted({0, last})]
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
        with ExitStack() as stack:
            points = _Points(self, stack)
            for time, read in zip(points.times[start:], points.tables[start:], strict=True):
                values, material = sample_cloud(points.cloud(read()), raster)
                fields = dict(zip(points.found, values, strict=True))
                yield SampledFrame(float(time), fields, material)


def _extent(clouds: Sequence[Cloud]) -> tuple[float, float, float, float]:
    low = np.min([(c.places - c.spacing[:, None] / 2).min(axis=0) for c in clouds], axis=0)
    high = np.max([(c.places + c.spacing[:, None] / 2).max(axis=0) for c in clouds], axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def _temperatures(clouds: Sequence[Cloud], found: Sequence[str]) -> tuple[float, float] | None:
    """Return the largest temperature twice: samples are means, the smallest need not be seen."""
    if "temperature" not in found:
        return None
    highest = max(span_of(cloud.values[:, found.index("temperature")])[1] for cloud in clouds)
    return highest, highest


class _Points:
    """Open source of points."""

    def __init__(self, source: CloudSource, stack: ExitStack) -> None:
        self._source, self.notes = source, Notes()
        files = open_points(source.files, source.names.get("time"), stack)
        self.tables = files.tables
        """Each reads the points of a frame."""
        if not self.tables:
            raise SourceError(f"{source.files}: has no frame")
        table = self.tables[0]()
        self._extra = _extra_columns(source, table)
        labels = [n for n in table.columns if n not in (*self._extra.values(), files.time_label)]
        self._labels = _field_columns(source, table.path, labels)
        self.found = {
            name: self._labels[own]
            for name in READABLE
            if (own := source.placement.in_file(name)) in self._labels
        }
        """Columns of the fields by their names in the scene."""
        self.unused = tuple(n for n in labels if n not in (*self.found.values(), "time"))
        self._units = {
            name: self._unit(name.replace("_z", "_x"), label, table)
            for name, label in self._labels.items()
        }
        if source.interval is not None or files.times is None:
            self.times = even_times(len(self.tables), source.interval, self.notes)
        else:
            name = f"{table.path}: time"
            unit = unit_of("time", name, files.time_unit, source.units.time, self.notes)
            self.times = check_times(name, files.times * unit.scale)
        self._solid = self._has_depth(table)
        self._spacing = self._find_spacing(table)

    def cloud(self, table: PointTable) -> Cloud:
        """Return points of a table in the scene, in SI."""
        table.check()
        self.notes = self.notes + table.notes.about(Path(table.path).name)
        source, placement = self._source, self._source.placement
        places = self._places(table)
        values = np.stack([self._values(table, name) for name in self.found], axis=1)
        volume = self._volume(table)
        material = self._material(table)
        good = np.isfinite(places).all(axis=1) & np.isfinite(values).all(axis=1)
        where = ""
        if source.thickness is not None:
            good &= np.abs(places[:, placement.depth] - source.depth) <= source.thickness / 2
            axis = _AXES[placement.depth]
            where = f" within {source.thickness / 2:g} m of {axis} = {source.depth:g} m"
        if not good.any():
            raise SourceError(f"{table.path}: has no point with a place and values{where}")
        spacing = volume[good] ** (1 / self._dimension)
        area = volume[good] / (source.thickness or 1.0) if self._solid else volume[good]
        seen = placement.place(places[good])
        # Points that stand for far more area than they lie in are in another unit, likely.
        box, total = float(np.prod(np.ptp(seen, axis=0) + spacing.max())), float(area.sum())
        if not total <= _FULLEST * box:
            raise SourceError(
                f"{table.path}: its points stand for {total:.4g} m^2 but lie in {box:.4g} m^2, "
                "expected another spacing, volume or unit of length"
            )
        with naming(table.path):
            return Cloud(seen, values[good], material[good], spacing, area)

    @property
    def _dimension(self) -> int:
        return 3 if self._solid else 2

    def _unit(self, name: str, label: str, table: PointTable) -> Unit:
        units = self._source.units
        own = units.length if name in _AXES else units.unit_given(name)
        return unit_of(
            name,
            f"{table.path}: {label}",
            table.units.get(label) or unit_in_name(label, name),
            own,
            self.notes,
        )

    def _places(self, table: PointTable) -> NDArray[np.float64]:
        """Return places in m in the file's axes, shape (points, 3)."""
        places = np.zeros((table.count, 3))
        for number, axis in enumerate(_AXES):
            if axis in self._extra:
                label = self._extra[axis]
                places[:, number] = table.numbers(label) * self._unit(axis, label, table).scale
        return places

    def _values(self, table: PointTable, name: str) -> NDArray[np.float64]:
        own = self._source.placement.in_file(name)
        values = table.numbers(self._labels[own])
        values = values * self._units[own].scale + self._units[own].offset
        return self._source.placement.field(name, values)

    def _volume(self, table: PointTable) -> NDArray[np.float64]:
        """Return volumes, or areas in two dimensions, in SI."""
        if self._spacing is not None:
            return np.full(table.count, self._spacing**self._dimension)
        values = table.numbers(self._extra["volume"])
        if not (np.isfinite(values) & (values > 0)).all():
            raise SourceError(f"{table.path}: {self._extra['volume']}: must be positive")
        return values * self._source.units.length.scale**self._dimension

    def _material(self, table: PointTable) -> NDArray[np.uint8]:
        material = np.full(table.count, Material.WORKPIECE, np.uint8)
        if self._source.tool_parts:
            if "part" not in self._extra:
                raise SourceError(f"{table.path}: has no column of parts, say its name as part")
            parts = table.numbers(self._extra["part"])
            material[np.isin(parts, self._source.tool_parts)] = Material.TOOL
        return material

    def _has_depth(self, table: PointTable) -> bool:
        if self._source.thickness is not None:
            return True
        axis = self._source.placement.depth
        depth = self._places(table)[:, axis]
        low, high = float(np.nanmin(depth)), float(np.nanmax(depth))
        if high > low:
            raise SourceError(
                f"{table.path}: {_AXES[axis]} runs from {low:.6g} to {high:.6g} m, expected the "
                "depth and thickness of the slab to be seen"
            )
        return False

    def _find_spacing(self, table: PointTable) -> float | None:
        """Return the distance of neighbours in m; None if every point has its volume."""
        source, spacing = self._source, self._source.spacing
        if spacing is None and "volume" in self._extra:
            return None
        if spacing is None:
            places = self._places(table)
            places = places[np.isfinite(places).all(axis=1)]
            axes = (0, 1, 2) if self._solid else source.placement.axes
            spacing = neighbour_distance(np.ascontiguousarray(places[:, axes]))
            if not spacing > 0:
                raise SourceError(f"{table.path}: its points are in one place, expected spacing")
            self.notes.assumed.append(
                f"Point spacing: distance of neighbours in the first frame, {spacing:.4g} m."
            )
        if source.thickness is not None and source.thickness < spacing:
            raise SourceError(
                f"{table.path}: the slab is {source.thickness:.4g} m thick, expected the points' "
                f"spacing of {spacing:.4g} m or more"
            )
        return spacing


def _field_columns(source: CloudSource, path: str, labels: Sequence[str]) -> dict[str, str]:
    """Return the columns of the fields along the file's axes; a vector gives two components."""
    vectors = {label[:-2] for label in labels if label.endswith("_y")}
    given = {n: label for n, label in source.names.items() if n in COMMON_NAMES}
    vector = given.pop("velocity", None)
    if vector is not None and vector not in vectors:
        raise SourceError(f"{path}: fields: velocity: there is not a vector {vector!r}")
    vector = vector or match_names(vectors, {}, ("velocity",)).get("velocity")
    if vector is not None:
        given = {f"velocity_{axis}": f"{vector}_{axis}" for axis in "xy"} | given
    unknown = sorted(set(source.names) - set(COMMON_NAMES) - {*_EXTRA, "time"})
    if unknown:
        raise SourceError(f"fields: unknown {unknown[0]!r}, expected one of {READABLE}")
    with naming(path):
        found = match_names(labels, given)
    if not found:
        listed = ", ".join(labels[:20]) or "none"
        raise SourceError(f"{path}: no column is known as temperature, it has {listed}")
    third = [n for n in labels if n == f"{vector}_z" or simple(n) in OTHER_NAMES["velocity_z"]]
    if source.placement.depth != 2 and third:
        found["velocity_z"] = sorted(third)[0]
    return found


def _extra_columns(source: CloudSource, table: PointTable) -> dict[str, str]:
    """Return the columns other than the fields of a scene, by their meaning."""
    found: dict[str, str] = {}
    for name in _EXTRA:
        given = source.names.get(name)
        if given is not None and given not in table.columns:
            raise SourceError(f"{table.path}: there is no column {given!r} for {name}")
        match = [label for label in table.columns if simple(label) in OTHER_NAMES[name]]
        if given is not None:
            found[name] = given
        elif match and not (name == "part" and not source.tool_parts):
            found[name] = match[0]
    for axis in source.placement.axes:
        if _AXES[axis] not in found:
            listed = ", ".join(list(table.columns)[:20]) or "none"
            raise SourceError(f"{table.path}: there is no column {_AXES[axis]!r}, it has {listed}")
    table.check()
    return found
