"""The scene: what is truly there, as fields on a regular grid over time."""

from collections.abc import Collection, Iterator, Mapping
from copy import copy
from functools import cached_property
from html import escape
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities.units import COLDEST, HOTTEST, ZERO_CELSIUS
from chipglow.scene.frame import (
    FIELD_UNITS,
    FILLED,
    MATERIAL_COORDINATE_UNITS,
    QUALITY,
    Frame,
    Material,
    SceneError,
)
from chipglow.scene.notebook import frames_text
from chipglow.scene.raster import Raster
from chipglow.scene.tool import Tool
from chipglow.scene.tool_outline import stored_tool, tool_attributes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from chipglow.scene.splines import SplineFrame

OVERVIEW_FIELDS: Final = ("temperature", "plastic_strain", "plastic_strain_rate", "material")
"""Fields of `Scene.overview`."""

FORCE_UNITS: Final[Mapping[str, str]] = {
    "cutting_force": "N/m",
    "thrust_force": "N/m",
    "chip_thickness": "m",
}
"""History on `force_time`: forces per width of cut and the chip's thickness; all or none."""

ENERGY_UNITS: Final[Mapping[str, str]] = dict.fromkeys(
    (
        "drive_work",
        "contact_work",
        "kinetic_energy",
        "elastic_energy",
        "plastic_work",
        "friction_work",
        "sharing_loss",
        "expansion_work",
        "moduli_loss",
        "lost_heat",
    ),
    "J/m",
)
"""Energy account on `force_time`, per width of cut and since the start: optional, all or none."""

_LONGEST_STEP: Final = 2.0
"""Time between frames, in the usual one, from which there is a gap."""


def is_gap(steps: NDArray[np.float64], frame_spacing: float) -> NDArray[np.bool_]:
    """Tell which times between frames are gaps: those of over twice the usual one."""
    return np.asarray(steps > _LONGEST_STEP * frame_spacing)


class Scene:
    """Temperature and, if known, strain, velocity and material over time.

    Parameters
    ----------
    data : xarray.Dataset
        ``temperature``, and any other fields of `FIELD_UNITS`, with dimensions (time, y, x) and a
        ``units`` attribute each; coordinates ``time`` in s, ascending; ``x`` in m, ascending;
        ``y`` in m, descending. The velocity has both components or none.
        Further: ``material_x`` and ``material_y`` in m, where each point was before the cut;
        ``quality``, see `QUALITY`; ``cutting_force`` and ``thrust_force`` in N/m and
        ``chip_thickness`` in m over ``force_time`` in s.

    Raises
    ------
    SceneError
        If the data break the contract; the message names the field, the value and what was
        expected.

    Notes
    -----
    Fields in memory are checked whole. Fields that are read lazily from a file are checked in
    their first and last frame now, and every frame when it is read.
    """

    def __init__(self, data: xr.Dataset) -> None:
        _check_structure(data)
        self.data = data
        last = len(self.times) - 1
        arrays = {name: data[name].variable._data for name in self.fields}
        self._arrays = {name: a for name, a in arrays.items() if isinstance(a, np.ndarray)}
        self.in_memory = len(self._arrays) == len(arrays)
        """Whether all fields are in memory, so that a frame takes no time to read."""
        for index in range(last + 1) if self.in_memory else {0, last}:
            check_frame(self._unchecked(index, None))

    @classmethod
    def from_fields(
        cls,
        raster: Raster,
        times: ArrayLike,
        fields: Mapping[str, ArrayLike],
        tool: Tool | None = None,
        attributes: Mapping[str, Any] | None = None,
    ) -> "Scene":
        """Scene from arrays in SI units.

        Parameters
        ----------
        raster : Raster
            The samples.
        times : array_like
            Times of the frames in s, shape (time,).
        fields : mapping
            Arrays of shape (time, y, x): temperature, and any others of `FIELD_UNITS`,
            `MATERIAL_COORDINATE_UNITS` and `QUALITY`.
        tool : Tool, optional
            The tool's outline, for the analyses that need the rake face.
        attributes : mapping, optional
            Further attributes of the dataset, such as provenance.

        Raises
        ------
        SceneError
            If an array is unknown, missing, of another shape or with values that cannot be; the
            message names the field.
        """
        units = {**FIELD_UNITS, **MATERIAL_COORDINATE_UNITS, QUALITY: "1"}
        unknown = sorted(set(fields) - set(units))
        if unknown:
            raise SceneError(f"scene: unknown field {unknown[0]!r}, expected one of {list(units)}")
        times = np.asarray(times, dtype=np.float64)
        if times.ndim != 1:
            raise SceneError(f"scene: times have shape {times.shape}, expected (time,)")
        shape = (times.size, *raster.shape)
        variables: dict[str, Any] = {}
        for name, values in fields.items():
            stored = _as_stored(name, np.asarray(values), shape)
            variables[name] = ("time", "y", "x"), stored, {"units": units[name]}
        attributes = {**(attributes or {}), **(tool_attributes(tool) if tool else {})}
        return cls(xr.Dataset(variables, raster_coordinates(raster, times), attributes))

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times)

    def __repr__(self) -> str:
        told = frames_text(self.times, self.raster, "samples", self._shown(0))
        return f"<Scene: {told}; {'with' if self.tool else 'without'} tool>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>{self.data._repr_html_()}"

    def celsius(self, frame: int = 0) -> NDArray[np.float64]:
        """Return the temperature of one frame in °C, shape (y, x); meaningless without material."""
        return np.asarray(self._read("temperature", frame), np.float64) - ZERO_CELSIUS

    def plot(self, frame: int = 0, ax: "Axes | None" = None) -> "Axes":
        """Draw the temperature of one frame in °C over x and y in µm, with the tool's outline."""
        from chipglow.scene.figures import plot_image

        time = float(self.times[frame])
        shown = self._shown(frame)
        return plot_image(shown, self.raster, self.tool, "temperature / °C", time, ax)

    def _shown(self, frame: int) -> NDArray[np.float64]:
        """Temperature of one frame in °C, NaN where there is no material."""
        void = self.field("material", frame) == Material.VOID
        return np.where(void, np.nan, self.celsius(frame))

    @cached_property
    def times(self) -> NDArray[np.float64]:
        """Times of the frames in s."""
        return np.asarray(self.data["time"].values, dtype=np.float64)

    @property
    def frame_spacing(self) -> float:
        """Usual time between frames in s: the median; 0 for a single frame."""
        times = self.times
        return float(np.median(np.diff(times))) if len(times) > 1 else 0.0

    def frame_at(self, time: float) -> int:
        """Return the number of the frame that stands for a time in s: the last up to it."""
        rounded = time + 1e-6 * self.frame_spacing  # rounding of times
        return max(int(np.searchsorted(self.times, rounded, side="right")) - 1, 0)

    @property
    def blocks(self) -> list[range]:
        """Ranges of the numbers of frames that follow one another without a gap."""
        gaps = np.flatnonzero(is_gap(np.diff(self.times), self.frame_spacing)) + 1
        bounds = [0, *gaps.tolist(), len(self.times)]
        return [range(first, last) for first, last in pairwise(bounds)]

    @property
    def longest_block(self) -> range:
        """The longest of the `blocks`, the first of equal ones."""
        return max(self.blocks, key=len)

    @cached_property
    def raster(self) -> Raster:
        """The grid of the samples."""
        return raster_of(self.data)

    def void(self) -> NDArray[np.float64]:
        """Return the fraction of each frame's samples without material, shape (time,)."""
        void = [self.field("material", index) == Material.VOID for index in range(len(self))]
        return np.array([one.mean() for one in void])

    def filled(self) -> NDArray[np.float64]:
        """Return the fraction of each frame's material whose values are filled, shape (time,)."""
        if QUALITY not in self.data:
            return np.zeros(len(self))
        fractions = []
        for index in range(len(self)):
            material = self.field("material", index) != Material.VOID
            filled = self.data[QUALITY][index].values[material] == FILLED
            fractions.append(filled.mean() if filled.size else 0.0)
        return np.array(fractions)

    @property
    def metal(self) -> str:
        """The workpiece's metal; empty if the scene does not state it."""
        return str(self.data.attrs.get("metal", ""))

    @property
    def tool(self) -> Tool | None:
        """The tool's outline, if the scene states it."""
        return stored_tool(self.data.attrs)

    @property
    def overview(self) -> "Scene | None":
        """The whole chip at one time, of a cut that was computed by chipglow."""
        if "overview_temperature" not in self.data:
            return None
        names = {name: f"overview_{name}" for name in ("time", "x", "y", *OVERVIEW_FIELDS)}
        data = self.data[list(names.values())].rename({old: new for new, old in names.items()})
        return Scene(data.set_coords("time").expand_dims("time"))

    def with_tool(self, tool: Tool) -> Self:
        """Return the scene with this tool's outline."""
        scene = copy(self)
        scene.data = self.data.assign_attrs(tool_attributes(tool))
        return scene

    @property
    def has_material_coordinates(self) -> bool:
        """Whether the scene says where each point was before the cut."""
        return "material_x" in self.data

    def frame(self, index: int, names: Collection[str] | None = None) -> Frame:
        """Read and check one frame: temperature, material and the named fields, by default all."""
        frame = self._unchecked(index, names)
        if not self.in_memory:
            check_frame(frame)
        return frame

    def _unchecked(self, index: int, names: Collection[str] | None) -> Frame:
        wanted = set(self.fields if names is None else (*names, *_ALWAYS))
        read = (name for name in self.fields if name in wanted)
        fields: dict[str, Any] = {name: self.field(name, index) for name in read}
        fields.setdefault("material", self._workpiece)
        return Frame(time=float(self.times[index]), **fields)

    def frames(
        self, indices: range | None = None, names: Collection[str] | None = None
    ) -> Iterator[Frame]:
        """Yield frames one after the other; `names` as for `frame`."""
        for index in range(len(self.times)) if indices is None else indices:
            yield self.frame(index, names)

    def splines(self, index: int) -> "SplineFrame | None":
        """Return the splines that a frame is sampled from; None for a scene of samples."""
        return None

    def field(self, name: str, index: int) -> NDArray[Any]:
        """Return a field of one frame, unchecked: float32, or uint8 of material and quality."""
        if name == "material" and name not in self.data:
            return self._workpiece
        if name not in self.data:
            raise SceneError(f"scene: has no {name}, which is required here")
        values = self._read(name, index)
        return values if name in _BYTES else np.asarray(values, dtype=np.float32)

    def _read(self, name: str, index: int) -> NDArray[Any]:
        """One field of one frame; a scene in a file has a faster way."""
        if name in self._arrays:
            values: NDArray[Any] = self._arrays[name][index]
            return values
        return np.asarray(self.data[name][index].values)

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that the scene has, in one order."""
        known = (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS, QUALITY)
        return tuple(name for name in known if name in self.data)

    @cached_property
    def _workpiece(self) -> NDArray[np.uint8]:
        """The material of a scene that does not state it."""
        return np.full(self.raster.shape, Material.WORKPIECE, dtype=np.uint8)


_ALWAYS: Final = ("temperature", "material")
_BYTES: Final = ("material", QUALITY)
_VELOCITY: Final = ("velocity_x", "velocity_y")
_MATERIALS: Final = ", ".join(f"{m.value} ({m.name.lower()})" for m in Material)


def _as_stored(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Return an array of this shape in a scene's type; bytes only if nothing is lost."""
    if values.shape != shape:
        raise SceneError(f"scene: {name!r} has shape {values.shape}, expected {shape}: time, y, x")
    if values.dtype.kind not in "biuf":
        raise SceneError(f"scene: {name!r} has type {values.dtype}, expected numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        stored = values.astype(np.uint8 if name in _BYTES else np.float32, copy=False)
    if name in _BYTES and (stored != values).any():
        expected = _MATERIALS if name == "material" else "whole numbers of 0 to 255"
        raise SceneError(
            f"scene: {name} has value {values[stored != values][0]:g}, expected {expected}"
        )
    return stored


def check_frame(frame: Frame) -> None:
    """Check the values of a frame; raise a SceneError that names field, value and expectation."""
    for name in (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS):
        values = getattr(frame, name)
        if name == "material":
            _check_material(values, frame.time)
        elif values is not None:
            _check_field(name, values, frame.time)
    if frame.quality is not None and frame.quality.dtype != np.uint8:
        raise SceneError(
            f"scene: quality has type {frame.quality.dtype} at {frame.time:.9g} s, expected uint8"
        )


def raster_of(data: xr.Dataset, spacing: float | None = None) -> Raster:
    """Return the grid of the samples of a dataset; from several columns without a spacing in m."""
    x, y = data["x"].values, data["y"].values
    if spacing is None:
        spacing = float((x[-1] - x[0]) / (len(x) - 1))
    return Raster(float(x[0]) - spacing / 2, float(y[0]) + spacing / 2, spacing, len(y), len(x))


def raster_coordinates(raster: Raster, times: NDArray[np.float64]) -> dict[str, Any]:
    """Return the coordinates of a scene's or a measurement's dataset, with units."""
    return {
        "time": ("time", times, {"units": "s", "long_name": "time"}),
        "y": ("y", raster.y, {"units": "m", "long_name": "height above the cut surface"}),
        "x": ("x", raster.x, {"units": "m", "long_name": "position along the cut"}),
    }


def _check_structure(data: xr.Dataset) -> None:
    for name in ("time", "y", "x"):
        if name not in data.coords:
            raise SceneError(f"scene: coordinate {name!r} is missing")
        values = np.asarray(data[name].values, dtype=np.float64)
        if not np.isfinite(values).all():
            raise SceneError(f"scene: coordinate {name!r} is not finite everywhere")
        _check_unit(name, data[name], "s" if name == "time" else "m")
    times = data["time"].values
    if times.size < 1 or (np.diff(times) <= 0).any():
        raise SceneError("scene: time must ascend, each frame later than the one before")
    _check_even("x", data["x"].values, ascending=True)
    _check_even("y", data["y"].values, ascending=False)
    if not np.isclose(np.diff(data["x"].values).mean(), -np.diff(data["y"].values).mean()):
        raise SceneError("scene: samples must be square, but the steps of x and y differ")
    if "temperature" not in data:
        raise SceneError("scene: field 'temperature' is missing")
    single = [{name: unit} for name, unit in FIELD_UNITS.items() if name not in _VELOCITY]
    velocity = {name: FIELD_UNITS[name] for name in _VELOCITY}
    for group in (*single, velocity, MATERIAL_COORDINATE_UNITS, FORCE_UNITS, ENERGY_UNITS):
        present = [name for name in group if name in data]
        missing = [name for name in group if name not in data]
        if present and missing:
            raise SceneError(f"scene: {', '.join(missing)} missing, expected with {present[0]!r}")
        for name in present:
            _check_unit(name, data[name], group[name])
    for name in (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS, QUALITY):
        if name in data and data[name].dims != ("time", "y", "x"):
            raise SceneError(
                f"scene: {name!r} has dimensions {data[name].dims}, expected ('time', 'y', 'x')"
            )


def _check_even(name: str, values: NDArray[np.float64], *, ascending: bool) -> None:
    if values.size < 2:
        raise SceneError(f"scene: {name} has {values.size} samples, expected 2 or more")
    steps = np.diff(values) if ascending else -np.diff(values)
    if (steps <= 0).any():
        raise SceneError(
            f"scene: {name} must {'ascend' if ascending else 'descend (row 0 on top)'}"
        )
    # Files may state coordinates with few digits.
    if not np.allclose(steps, steps.mean(), rtol=1e-3):
        raise SceneError(f"scene: {name} must have even steps")


def _check_unit(name: str, values: xr.DataArray, unit: str) -> None:
    found = values.attrs.get("units")
    if found != unit:
        raise SceneError(f"scene: {name!r} has units {found!r}, expected {unit!r}")


def _check_field(name: str, values: NDArray[np.float32], time: float) -> None:
    # Minimum and maximum show NaN and infinity too, in half the time of a search.
    lowest, highest = float(values.min()), float(values.max())
    if not (isfinite(lowest) and isfinite(highest)):
        raise SceneError(f"scene: {name!r} is not finite everywhere at {time:.9g} s")
    if name == "temperature" and not COLDEST <= lowest <= highest <= HOTTEST:
        wrong = lowest if lowest < COLDEST else highest
        # Below the smallest temperature, numbers above −100 are usual temperatures in °C.
        hint = f"; it looks like °C, add {ZERO_CELSIUS}" if -100.0 < wrong < COLDEST else ""
        raise SceneError(
            f"scene: temperature {wrong:.6g} at {time:.9g} s, expected kelvin of "
            f"{COLDEST:g} to {HOTTEST:g}{hint}"
        )
    if name in ("plastic_strain", "plastic_strain_rate") and lowest < 0:
        raise SceneError(f"scene: {name!r} is {lowest:.6g} at {time:.9g} s, expected 0 or more")


def _check_material(values: NDArray[Any], time: float) -> None:
    highest = int(values.max())
    if values.dtype != np.uint8 or highest > max(Material):
        raise SceneError(
            f"scene: material has value {highest} of type {values.dtype} at {time:.9g} s, expected "
            f"uint8 of {_MATERIALS}"
        )
