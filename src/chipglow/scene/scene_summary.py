"""The contents of a scene in numbers, from a few of its frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.drawing.scales import shown_frame
from chipglow.quantities import ZERO_CELSIUS, Brief
from chipglow.scene.frame import FILLED, Frame, Material
from chipglow.scene.scene import Scene

_SAMPLED: Final = 5
"""Frames whose smallest and largest values a summary includes, besides the one shown."""


class _Field(NamedTuple):
    """How a field of a frame is shown: `scale` times the SI value, plus `offset`."""

    title: str
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0


_FIELDS: Final = {
    "temperature": _Field("temperature", "°C", offset=-ZERO_CELSIUS),
    "plastic_strain": _Field("plastic strain"),
    "plastic_strain_rate": _Field("strain rate", "1/s"),
    "velocity_x": _Field("velocity along x", "m/s"),
    "velocity_y": _Field("velocity along y", "m/s"),
    "material_x": _Field("x before the cut", "µm", scale=1e6),
    "material_y": _Field("y before the cut", "µm", scale=1e6),
}


class QualitySummary(NamedTuple):
    """Fraction of samples taken from neighbours, and colour distances of the others."""

    filled: float
    median: float  # distance to the colour scale in CIE L*a*b*
    percentile_95: float


@dataclass(frozen=True, repr=False)
class SceneSummary(Brief):
    """The contents of a scene in the frame `index`; `sampled` are all frames that were read."""

    index: int
    sampled: tuple[int, ...]
    fields: pd.DataFrame  # minimum, median and maximum over the workpiece; overall: of all frames
    fractions: Mapping[Material, float]  # of the samples
    quality: QualitySummary | None


def scene_summary(scene: Scene, time: float | None = None) -> SceneSummary:
    """Summarise the frame nearest to a time in s, by default the middle one."""
    index = shown_frame(scene.times, time, "scene")
    last = len(scene.times) - 1
    sampled = tuple(sorted({index, *np.linspace(0, last, _SAMPLED).astype(int).tolist()}))
    frame = scene.frame(index)
    names = [name for name in _FIELDS if getattr(frame, name) is not None]
    ends: dict[str, list[float]] = {name: [] for name in names}
    for i in sampled:
        one = frame if i == index else scene.frame(i)
        for name in names:
            values = _over_workpiece(name, one)
            ends[name] += [float(values.min()), float(values.max())] if values.size else []
    fields = {name: _values(name, frame, ends[name]) for name in names}
    return SceneSummary(
        index=index,
        sampled=sampled,
        fields=pd.DataFrame.from_dict(fields, orient="index"),
        fractions={kind: float(np.mean(frame.material == kind)) for kind in Material},
        quality=_quality(frame),
    )


def _values(name: str, frame: Frame, ends: list[float]) -> dict[str, object]:
    now, field = _over_workpiece(name, frame), _FIELDS[name]
    least, median, largest = np.percentile(now, (0, 50, 100)) if now.size else (np.nan,) * 3
    return {
        "field": field.title,
        "unit": field.unit,
        "least": least,
        "median": median,
        "greatest": largest,
        "overall": (min(ends), max(ends)) if ends else (),
    }


def _over_workpiece(name: str, frame: Frame) -> NDArray[np.float64]:
    """Return the values of a field over the workpiece as shown, shape (n,)."""
    values: NDArray[np.float32] = getattr(frame, name)[frame.material == Material.WORKPIECE]
    return values.astype(np.float64) * _FIELDS[name].scale + _FIELDS[name].offset


def _quality(frame: Frame) -> QualitySummary | None:
    """Return the reliability of a frame; None if it has no quality flags."""
    if frame.quality is None:
        return None
    flags = frame.quality[frame.material != Material.VOID]
    if flags.size == 0:
        return QualitySummary(0.0, 0.0, 0.0)
    seen = flags[flags != FILLED]
    median, high = np.percentile(seen, (50, 95)) if seen.size else (0.0, 0.0)
    return QualitySummary(1.0 - seen.size / flags.size, float(median), float(high))
