"""Frames in files of arrays, whose quantity and unit the user states."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Recording
from chipglow.camera.recording import QUANTITIES, Quantity
from chipglow.io.cameras.binary import check_picture, chosen_frames, evenly
from chipglow.io.sources import SourceError
from chipglow.io.sources.arrays import ARRAY_READERS, MOST_ON_A_SIDE, FileArray, open_arrays
from chipglow.io.sources.layout import (
    AXES,
    axes_of,
    check_times,
    coordinate,
    read_frames,
    read_list,
)
from chipglow.quantities.units import CELSIUS, SI, Unit, parse_unit
from chipglow.text import Notes

RECORDING_UNITS: Final[Mapping[str, tuple[Quantity, Unit]]] = {
    "counts": ("counts", SI),
    "W/m2/sr": ("radiance", SI),
    "K": ("temperature", SI),
    "degC": ("temperature", CELSIUS),
}
"""Units of the samples: which quantity has them, and how they become those of a `Recording`."""

_COUNTS: Final = ("count", "counts", "dn", "dl", "adu")


class MissingError(SourceError):
    """A value is needed that neither the file nor the user states."""


@dataclass(frozen=True)
class Stated:
    """Statements of the user on a file without them; see `read_recording`."""

    quantity: str | None = None
    unit: str | None = None
    interval: float | None = None
    dataset: str | None = None
    axes: Sequence[str] | None = None

    def __post_init__(self) -> None:
        for name, known in (("quantity", QUANTITIES), ("unit", RECORDING_UNITS)):
            value = getattr(self, name)
            if value is not None and value not in known:
                raise ValueError(f"{name}: is {value!r}, expected one of {', '.join(known)}")
        if self.interval is not None and not 0 < self.interval < float("inf"):
            raise ValueError(f"interval: is {self.interval!r} s, expected more than 0")
        if self.quantity and self.unit and RECORDING_UNITS[self.unit][0] != self.quantity:
            raise ValueError(f"unit: {self.quantity} is not in {self.unit}")
        if self.axes is not None and sorted(self.axes) not in (sorted(AXES), ["x", "y"]):
            raise ValueError(f"axes: are {', '.join(self.axes)}, expected {', '.join(AXES)}")


def read_stack(path: Path, kind: str, frames: slice | None, stated: Stated) -> Recording:
    """Read frames of an array in a file, or, by a pattern with ``*``, of one file per frame.

    `kind` is the ending of the names of such files; the file's own may be another.
    """
    with ExitStack() as stack:
        arrays = open_arrays(str(path), stack, ARRAY_READERS[kind])
        one = _dataset(path, arrays, stated.dataset)
        notes = Notes() + one.notes
        axes = axes_of(one, stated.axes, notes)
        lengths = dict(zip(axes, one.shape, strict=True))
        check_picture(path, lengths["y"], lengths["x"], MOST_ON_A_SIDE)
        chosen = chosen_frames(path, frames, lengths.get("time", 1), lengths["y"] * lengths["x"])
        unit, times = _unit(one, stated), _times(one, arrays, axes, chosen, stated, notes)
        missing = []
        if unit is None:
            missing.append(
                f"unit: is missing, the file says {one.unit or 'none'}, expected one of "
                f"{', '.join(RECORDING_UNITS)}"
            )
        if times is None:
            missing.append(
                f"give the interval between frames: there are {lengths['time']}, without times"
            )
        if unit is None or times is None:
            raise MissingError(f"{one}: {'; '.join(missing)}")
        signal = _signal(one, axes, chosen)
    quantity, known = unit
    if quantity != "counts":
        # 32 bits hold temperature to 1e-4 K, where the file does not hold more.
        precision = np.float32 if signal.dtype.itemsize <= 4 else np.float64
        signal = (signal.astype(np.float64) * known.scale + known.offset).astype(precision)
    return Recording(
        signal=signal, quantity=quantity, times=times, camera="unknown", notes=notes + one.notes
    )


def _dataset(path: Path, arrays: Mapping[str, FileArray], name: str | None) -> FileArray:
    if name is None:
        # MATLAB keeps lists as matrices of one row or column.
        labels = [
            label
            for label, array in arrays.items()
            if len(array.shape) in (2, 3) and sum(length > 1 for length in array.shape) > 1
        ]
        wrong = "give the dataset with the frames"
    else:
        labels = [label for label in arrays if name in (label, label.rsplit("/", 1)[-1])]
        labels = [name] if name in arrays else labels
        wrong = f"has no dataset {name!r}"
    if len(labels) == 1:
        return arrays[labels[0]]
    listed = ", ".join(f"{name!r} of shape {arrays[name].shape}" for name in sorted(arrays)[:10])
    raise SourceError(f"{path}: {wrong}, it has {listed}")


def _unit(one: FileArray, stated: Stated) -> tuple[Quantity, Unit] | None:
    """Return quantity and unit of the samples, as the user or the file says; None if neither."""
    if stated.unit is not None:
        return RECORDING_UNITS[stated.unit]
    found = _unit_of(one.unit or "")
    if found is None and stated.quantity in ("counts", "radiance"):
        found = RECORDING_UNITS["counts" if stated.quantity == "counts" else "W/m2/sr"]
    if found is not None and stated.quantity not in (None, found[0]):
        raise SourceError(f"{one}: is in {one.unit}, which is not a unit of {stated.quantity}")
    return found


def _unit_of(text: str) -> tuple[Quantity, Unit] | None:
    if text.strip().lower() in _COUNTS:
        return RECORDING_UNITS["counts"]
    bases: tuple[tuple[Quantity, str], ...] = (("temperature", "K"), ("radiance", "W/m^2/sr"))
    for quantity, base in bases:
        with suppress(ValueError):
            return quantity, parse_unit(text, base, quantity)
    return None


def _times(
    one: FileArray,
    arrays: Mapping[str, FileArray],
    axes: tuple[str, ...],
    chosen: range,
    stated: Stated,
    notes: Notes,
) -> NDArray[np.float64] | None:
    """Return times of the chosen frames in s; None if neither the user nor the file says them."""
    if stated.interval is not None:
        return evenly(chosen, stated.interval)
    count = one.shape[axes.index("time")] if "time" in axes else 1
    if count == 1:
        return np.zeros(1)
    dim = one.dims[axes.index("time")] if one.dims else ""
    found = coordinate("time", arrays.values(), None, dim, count)
    if found is None or found.name == one.name:
        return None
    times = check_times(str(found), read_list("time", found, SI, notes))
    if not isfinite(times[-1] - times[0]):
        raise SourceError(f"{found}: is not finite")
    return np.asarray((times - times[0])[list(chosen)])


def _signal(one: FileArray, axes: tuple[str, ...], chosen: range) -> NDArray[Any]:
    """Return samples of the chosen frames, shape (time, y, x)."""
    if abs(chosen.step) == 1:
        first, last = min(chosen[0], chosen[-1]), max(chosen[0], chosen[-1])
        signal = read_frames(one, axes, slice(first, last + 1))[:: chosen.step]
    else:
        parts = [read_frames(one, axes, slice(number, number + 1)) for number in chosen]
        signal = np.concatenate(parts)
    if np.isinf(signal).any():
        raise SourceError(f"{one}: has infinite numbers, expected finite ones or NaN")
    return signal.astype(np.uint8 if signal.dtype.kind == "b" else signal.dtype.newbyteorder("="))
