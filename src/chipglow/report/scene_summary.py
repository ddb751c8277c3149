"""The contents of a scene in numbers, from a few of its frames."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.drawing.frames import shown_frame
from chipglow.scene import FILLED, Frame, Material, Raster, Scene

_SAMPLED: Final = 5
"""Frames whose smallest and largest values a summary includes, besides the one shown."""


@dataclass(frozen=True)
class ShownField:
    """A field of a `chipglow.scene.Frame` as shown: `scale` times the SI value, plus `offset`."""

    name: str
    title: str
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return values in the shown unit."""
        return values.astype(np.float64) * self.scale + self.offset

    @property
    def label(self) -> str:
        """Title and unit, for an axis."""
        unit = f"({self.unit})" if "/" in self.unit else self.unit
        return f"{self.title} / {unit}" if unit else self.title


TEMPERATURE: Final = ShownField("temperature", "temperature", "°C", offset=-273.15)
STRAIN: Final = ShownField("plastic_strain", "plastic strain")
RATE: Final = ShownField("plastic_strain_rate", "strain rate", "1/s")
_FIELDS: Final = (
    TEMPERATURE,
    STRAIN,
    RATE,
    ShownField("velocity_x", "velocity along x", "m/s"),
    ShownField("velocity_y", "velocity along y", "m/s"),
    ShownField("material_x", "x before the cut", "µm", scale=1e6),
    ShownField("material_y", "y before the cut", "µm", scale=1e6),
)


@dataclass(frozen=True)
class FieldSummary:
    """Values of a field over the workpiece in the shown unit; None if no workpiece is visible.

    `now` is minimum, median and maximum at the time of the summary, `overall` minimum and maximum
    over all frames that were read.
    """

    field: ShownField
    now: tuple[float, float, float] | None
    overall: tuple[float, float] | None


@dataclass(frozen=True)
class QualitySummary:
    """Reliability of the samples that show material, at the time of the summary.

    `filled` is the fraction whose value is taken from neighbours; `median` and `percentile_95` are
    the distance of the other samples' colours from the colour scale in CIE L*a*b*.
    """

    filled: float
    median: float
    percentile_95: float


@dataclass(frozen=True)
class SceneSummary:
    """The contents of a scene in the frame `index`; `sampled` are all frames that were read.

    `fractions` are those of the samples that show each material.
    """

    raster: Raster
    times: NDArray[np.float64]
    index: int
    sampled: tuple[int, ...]
    fields: tuple[FieldSummary, ...]
    fractions: Mapping[Material, float]
    quality: QualitySummary | None


def scene_summary(scene: Scene, time: float | None = None) -> SceneSummary:
    """Summarise the frame nearest to a time in s, by default the middle one.

    At most five further frames are read for the range of the values. A time outside the scene
    raises ValueError.
    """
    index = shown_frame(scene.times, time, "scene")
    last = len(scene.times) - 1
    sampled = tuple(sorted({index, *np.linspace(0, last, _SAMPLED).astype(int).tolist()}))
    frame = scene.frame(index)
    limits = [_limits(frame if i == index else scene.frame(i)) for i in sampled]
    return SceneSummary(
        raster=scene.raster,
        times=scene.times,
        index=index,
        sampled=sampled,
        fields=tuple(_fields(frame, limits)),
        fractions={kind: float(np.mean(frame.material == kind)) for kind in Material},
        quality=quality_of(frame),
    )


_Limits: TypeAlias = dict[str, tuple[float, float]]


def _limits(frame: Frame) -> _Limits:
    """Return minimum and maximum over the workpiece, by field; empty without workpiece."""
    values = {field.name: over_workpiece(field, frame) for field in _shown_fields(frame)}
    return {name: (float(v.min()), float(v.max())) for name, v in values.items() if v.size}


def _fields(frame: Frame, limits: list[_Limits]) -> Iterator[FieldSummary]:
    for field in _shown_fields(frame):
        now = over_workpiece(field, frame)
        pairs = [frame_limits[field.name] for frame_limits in limits if frame_limits]
        yield FieldSummary(
            field,
            (float(now.min()), float(np.median(now)), float(now.max())) if now.size else None,
            (min(low for low, _ in pairs), max(high for _, high in pairs)) if pairs else None,
        )


def _shown_fields(frame: Frame) -> list[ShownField]:
    """Return the numeric fields of a frame."""
    return [field for field in _FIELDS if getattr(frame, field.name) is not None]


def over_workpiece(field: ShownField, frame: Frame) -> NDArray[np.float64]:
    """Return the values of the workpiece, shape (n,)."""
    return field(getattr(frame, field.name)[frame.material == Material.WORKPIECE])


def quality_of(frame: Frame) -> QualitySummary | None:
    """Return the reliability of a frame; None if it has no quality flags."""
    if frame.quality is None:
        return None
    flags = frame.quality[frame.material != Material.VOID]
    if flags.size == 0:
        return QualitySummary(0.0, 0.0, 0.0)
    seen = flags[flags != FILLED]
    median, high = np.percentile(seen, (50, 95)) if seen.size else (0.0, 0.0)
    return QualitySummary(1.0 - seen.size / flags.size, float(median), float(high))
