"""Frames in files of arrays, whose quantity and unit the user states."""

from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.camera.recording import SignalKind
from chipglow.io.cameras.binary import chosen_frames, evenly
from chipglow.io.sources import SourceError
from chipglow.io.sources.conventions import note_other_unit
from chipglow.io.sources.grids.arrays import ARRAY_READERS, open_arrays
from chipglow.io.sources.grids.file_array import FileArray
from chipglow.io.sources.grids.layout import (
    ROW_0,
    ArrayNumbers,
    ascends,
    axes_of,
    coordinate,
    even_positions,
    find_fields,
    is_reversed,
    may_be_field,
    read_frames,
    read_list,
    scaled,
    with_lists,
    without,
)
from chipglow.io.sources.plausible import check_sides, check_temperatures, check_tenths
from chipglow.io.sources.source import check_times, span_of
from chipglow.quantities import Parameter
from chipglow.quantities.units import SI, TIME, Unit, parse_unit
from chipglow.scene import Raster
from chipglow.text import Notes

_COUNTS: Final = ("count", "counts", "dn", "dl", "adu")
_BASES: Final[tuple[tuple[SignalKind, str], ...]] = (("temperature", "K"), ("radiance", "W/m^2/sr"))
_EXPECTED: Final = "counts, W/m2/sr, K, degC, degF, cK or another unit of radiance or temperature"
_SQUARE: Final = 0.01
"""Relative difference of columns and rows up to which pixels are square."""


class MissingError(SourceError):
    """A value is needed that neither the file nor the user states."""


def recording_unit(text: str) -> tuple[SignalKind, Unit] | None:
    """Return the quantity of samples with a unit, and the unit; None if it is of neither."""
    if text.strip().lower() in _COUNTS:
        return "counts", Unit(1.0, text=text)
    for quantity, base in _BASES:
        with suppress(ValueError):
            return quantity, parse_unit(text, base, quantity)
    return None


@dataclass(frozen=True)
class Stated(ArrayNumbers):
    """Statements of the user on a file without them; see `read_recording`."""

    quantity: Annotated[
        SignalKind | None,
        Parameter(
            "Quantity of the numbers, for files that do not state it.",
            allowed="none, counts, radiance, temperature",
        ),
    ] = None
    unit: Annotated[
        str | None,
        Parameter(
            "Their unit, instead of the one that the file states.",
            allowed="none, counts, W/m2/sr, K, degC, degF, cK, 0.01 K, ...",
        ),
    ] = None
    interval: Annotated[
        float | None, Parameter("Time from frame to frame; none: as the file says.", TIME)
    ] = None
    dataset: Annotated[str | None, Parameter("Which array of the file, if it has several.")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        unit = None if self.unit is None else recording_unit(self.unit)
        if self.unit is not None and unit is None:
            raise ValueError(f"unit: is {self.unit!r}, expected {_EXPECTED}")
        if unit is not None and self.quantity not in (None, unit[0]):
            raise ValueError(f"unit: {self.quantity} is not in {self.unit}")


def read_stack(path: Path, kind: str, frames: slice | None, stated: Stated) -> Recording:
    """Read frames of an array in a file, or, by a pattern with ``*``, of one file per frame.

    `kind` is the ending of the names of such files; the file's own may be another.
    """
    with ExitStack() as stack:
        notes = Notes()
        arrays = with_lists(open_arrays(str(path), stack, ARRAY_READERS[kind]))
        image = _Image(arrays, path, stated, notes)
        one, (rows, columns) = image.array, image.sides
        check_sides(one, rows, columns)
        chosen = chosen_frames(path, frames, image.count, rows * columns)
        unit, times = _unit(one, stated, notes), image.times(chosen)
        missing = []
        if unit is None:
            missing.append(
                f"unit: is missing, the file says {one.unit or 'none'}, expected {_EXPECTED}"
            )
        if times is None:
            missing.append(
                f"give the interval between frames: there are {image.count}, without times"
            )
        if unit is None or times is None:
            raise MissingError(f"{one}: {'; '.join(missing)}")
        signal = image.upright(_signal(one, image.axes, chosen, stated.void_value))
        raster = image.raster()
    quantity, known = unit
    return Recording(
        signal=_in_si(one, signal, quantity, known, stated),
        quantity=quantity,
        times=times,
        camera="unknown",
        pitch=None if raster is None else raster.spacing,
        position=None if raster is None else (raster.left, raster.top),
        stored=image.stored,
        notes=notes + one.notes,
    )


def stack_times(path: Path, kind: str, stated: Stated) -> NDArray[np.float64]:
    """Return the times of all frames in s; see `read_stack`."""
    with ExitStack() as stack:
        arrays = with_lists(open_arrays(str(path), stack, ARRAY_READERS[kind]))
        image = _Image(arrays, path, stated, Notes())
        times = image.times(range(image.count))
        if times is None:
            raise MissingError(f"{image.array}: give the interval between frames")
        return times


class _Image:
    """Array of frames in a file, and its coordinates."""

    def __init__(
        self, arrays: Mapping[str, FileArray], path: Path, stated: Stated, notes: Notes
    ) -> None:
        self._stated, self._notes = stated, notes
        self.array = one = _dataset(path, arrays, stated, notes)
        self._others = [array for array in arrays.values() if array.name != one.name]
        self.axes = axes_of(one, stated.axes, notes, self._others)
        self._lengths = dict(zip(self.axes, one.shape, strict=True))
        self.sides = self._lengths["y"], self._lengths["x"]
        self.count = self._lengths.get("time", 1)
        self._y, self._x = self._coordinate("y"), self._coordinate("x")
        self._is_upward, self._is_leftward = (
            is_reversed(axis, one, notes) if found is None else ascends(found) == (axis == "y")
            for axis, found in (("y", self._y), ("x", self._x))
        )
        if self._y is None and not self._is_upward:
            notes.assumed.append(ROW_0.format("upper"))

    @property
    def stored(self) -> str:
        """Order and directions of rows and columns in the file, with a minus if reversed."""
        signs = {"y": "-" * self._is_upward, "x": "-" * self._is_leftward}
        return ", ".join(signs[axis] + axis for axis in self.axes if axis != "time")

    def _coordinate(self, axis: str) -> FileArray | None:
        dims = dict(zip(self.axes, self.array.dims, strict=False))
        length = self._lengths[axis]
        return coordinate(axis, self._others, length, dims.get(axis, ""), self._notes)

    def upright(self, frames: NDArray[Any]) -> NDArray[Any]:
        """Return frames of shape (time, y, x) with the upper row and the left column first."""
        rows = slice(None, None, -1 if self._is_upward else 1)
        columns = slice(None, None, -1 if self._is_leftward else 1)
        return np.ascontiguousarray(frames[:, rows, columns])

    def raster(self) -> Raster | None:
        """Return where the pixels are by the coordinates; None, with the reason, if nowhere."""
        if self._x is None or self._y is None:
            return None
        try:
            x = even_positions("x", self._x, SI, self._notes)
            y = even_positions("y", self._y, SI, self._notes)
        except SourceError as error:
            self._notes.warnings.append(f"The coordinates are not used but for directions: {error}")
            return None
        across, down = (float(np.ptp(one)) / (one.size - 1) for one in (x, y))
        if abs(across - down) > _SQUARE * down:
            raise SourceError(
                f"{self.array}: pixels of {1e6 * across:.6g} um x {1e6 * down:.6g} um, expected "
                "square ones; chipglow import resamples others"
            )
        return Raster(
            float(x.min()) - across / 2, float(y.max()) + across / 2, across, y.size, x.size
        )

    def times(self, chosen: range) -> NDArray[np.float64] | None:
        """Return times of frames in s; None if neither the user nor the file says them."""
        if self._stated.interval is not None:
            return evenly(chosen, self._stated.interval)
        if self.count == 1:
            return np.zeros(1)
        found = self._coordinate("time")
        if found is None:
            return None
        times = check_times(str(found), read_list("time", found, SI, self._notes))
        if not isfinite(times[-1] - times[0]):
            raise SourceError(f"{found}: is not finite")
        return np.asarray((times - times[0])[list(chosen)])


def _dataset(
    path: Path, arrays: Mapping[str, FileArray], stated: Stated, notes: Notes
) -> FileArray:
    name, every = stated.dataset, arrays.values()
    if name is None:
        # MATLAB keeps lists as matrices of one row or column.
        images = {
            label: array
            for label, array in arrays.items()
            if len(array.shape) in (2, 3)
            and sum(length > 1 for length in array.shape) > 1
            and may_be_field(array, every)
        }
        labels = list(images)
        if len(labels) > 1 and _is_temperature(stated):
            with suppress(SourceError):
                labels = [find_fields(images, {}, ("temperature",), notes)["temperature"].name]
                notes.assumed.append(f"The temperature is {labels[0]} among {', '.join(images)}.")
        wrong = "give the dataset with the frames" if images else "no array has 2 or 3 axes"
    else:
        labels = [label for label in arrays if name in (label, label.rsplit("/", 1)[-1])]
        labels = [name] if name in arrays else labels
        wrong = f"has no dataset {name!r}"
    if len(labels) == 1:
        return arrays[labels[0]]
    listed = ", ".join(f"{name!r} of shape {arrays[name].shape}" for name in sorted(arrays)[:10])
    raise SourceError(f"{path}: {wrong}, it has {listed}")


def _is_temperature(stated: Stated) -> bool:
    """Return whether a file may hold temperatures according to the user's statements."""
    unit = recording_unit(stated.unit or "")
    return stated.quantity in (None, "temperature") and (unit is None or unit[0] == "temperature")


def _unit(one: FileArray, stated: Stated, notes: Notes) -> tuple[SignalKind, Unit] | None:
    """Return quantity and unit of the samples, as the user or the file says; None if neither."""
    if stated.unit is not None:
        found = recording_unit(stated.unit)
        assert found is not None  # Stated refuses others
        quantity, _ = found
        own = recording_unit(one.unit or "")
        if own is not None and quantity == "counts" != own[0]:
            raise SourceError(
                f"{one}: the file states values in {one.unit}, which are not counts; leave out unit"
            )
        if own != found:
            note_other_unit(one.short, one.unit, notes, own is not None)
        return found
    found = recording_unit(one.unit or "")
    if found is None and stated.quantity in ("counts", "radiance"):
        found = recording_unit("counts" if stated.quantity == "counts" else "W/m2/sr")
        note_other_unit(one.short, one.unit, notes, contradicts=False)
    if found is not None and stated.quantity not in (None, found[0]):
        raise SourceError(f"{one}: is in {one.unit}, which is not a unit of {stated.quantity}")
    return found


def _signal(
    one: FileArray, axes: tuple[str, ...], chosen: range, void_value: float | None
) -> NDArray[Any]:
    """Return samples of the chosen frames, shape (time, y, x)."""
    if abs(chosen.step) == 1:
        first, last = min(chosen[0], chosen[-1]), max(chosen[0], chosen[-1])
        signal = read_frames(one, axes, slice(first, last + 1))[:: chosen.step]
    else:
        parts = [read_frames(one, axes, slice(number, number + 1)) for number in chosen]
        signal = np.concatenate(parts)
    signal = without(signal, void_value)
    if np.isinf(signal).any():
        raise SourceError(f"{one}: has infinite numbers, expected finite ones or NaN")
    return signal.astype(np.uint8 if signal.dtype.kind == "b" else signal.dtype.newbyteorder("="))


def _in_si(
    one: FileArray, signal: NDArray[Any], quantity: SignalKind, known: Unit, stated: Stated
) -> NDArray[Any]:
    """Return samples as a `Recording` has them; refuse temperatures that cannot be."""
    if quantity == "counts":
        if not (stated.scale is None and stated.offset is None):
            raise SourceError(
                f"{one}: scale and offset are for temperature and radiance, not counts"
            )
        return signal
    unit = scaled(known, stated.scale, stated.offset)
    # 32 bits hold temperature to 1e-4 K, where the file does not hold more.
    precision = np.float32 if signal.dtype.itemsize <= 4 else np.float64
    values = (signal.astype(np.float64) * unit.scale + unit.offset).astype(precision)
    if quantity == "temperature":
        remedy = (
            f"the unit is {known.text}: state another one such as degC or cK, or scale and offset, "
            "or as void_value the number without a meaning"
        )
        check_temperatures(str(one), *span_of(values), remedy)
        if known == SI and stated.scale is None:
            check_tenths(str(one), values)
    return values
