"""What is in a scene, in numbers: from a few frames of it, however many it has."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.drawing.frames import shown_frame
from chipglow.scene import FILLED, Frame, Material, Raster, Scene

_SAMPLED: Final = 5
"""Frames over which the greatest and least values of a summary are taken, besides the one shown."""


@dataclass(frozen=True)
class ShownField:
    """A field as it is shown to people.

    Parameters
    ----------
    name : str
        The field's name in a `chipglow.scene.Frame`.
    title : str
        What it is.
    unit : str
        In which it is shown; empty for a plain number.
    scale, offset : float
        The shown number is `scale` times the SI number, plus `offset`.
    """

    name: str
    title: str
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0

    def __call__(self, values: NDArray[np.float32]) -> NDArray[np.float64]:
        """Values in the unit that is shown."""
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
    """Values of a field over the workpiece, in the unit that is shown.

    Parameters
    ----------
    field : ShownField
        The field.
    now : tuple, optional
        Least, median and greatest at the time of the summary; None if no sample of that frame
        shows the workpiece.
    overall : tuple, optional
        Least and greatest over all frames that were read; None if none shows the workpiece.
    """

    field: ShownField
    now: tuple[float, float, float] | None
    overall: tuple[float, float] | None


@dataclass(frozen=True)
class QualitySummary:
    """How far the samples that show material can be trusted, at the time of the summary.

    Parameters
    ----------
    filled : float
        Fraction of those samples whose value is their neighbours'.
    median, percentile_95 : float
        Distance of the other samples' colours from the colour scale in CIE L*a*b*; 0 if all are
        filled.
    """

    filled: float
    median: float
    percentile_95: float


@dataclass(frozen=True)
class SceneSummary:
    """What is in a scene.

    Parameters
    ----------
    raster : Raster
        Where the samples are.
    times : ndarray
        Times of all frames in s.
    index : int
        Number of the frame that the summary is about.
    sampled : tuple of int
        Numbers of all frames that were read.
    fields : tuple of FieldSummary
        Every field of numbers.
    fractions : mapping
        Fraction of the samples that show each material.
    quality : QualitySummary, optional
        None if the scene has no flags of its quality.
    """

    raster: Raster
    times: NDArray[np.float64]
    index: int
    sampled: tuple[int, ...]
    fields: tuple[FieldSummary, ...]
    fractions: Mapping[Material, float]
    quality: QualitySummary | None


def scene_summary(scene: Scene, time: float | None = None) -> SceneSummary:
    """Look at one frame of a scene, and at a few others for the range of its values.

    Parameters
    ----------
    scene : Scene
        Any scene; of one in a file, six frames are read at most.
    time : float, optional
        Time in s of what is looked at, the nearest frame's; the middle one by default.

    Raises
    ------
    ValueError
        If the time is not within the scene.
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
    """Least and greatest value over the workpiece, by field; nothing where there is none."""
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
    """The fields of numbers that a frame has."""
    return [field for field in _FIELDS if getattr(frame, field.name) is not None]


def over_workpiece(field: ShownField, frame: Frame) -> NDArray[np.float64]:
    """Values where the frame shows the workpiece, shape (n,)."""
    return field(getattr(frame, field.name)[frame.material == Material.WORKPIECE])


def quality_of(frame: Frame) -> QualitySummary | None:
    """How far a frame can be trusted, if it says so."""
    if frame.quality is None:
        return None
    flags = frame.quality[frame.material != Material.VOID]
    if flags.size == 0:
        return QualitySummary(0.0, 0.0, 0.0)
    seen = flags[flags != FILLED]
    median, high = np.percentile(seen, (50, 95)) if seen.size else (0.0, 0.0)
    return QualitySummary(1.0 - seen.size / flags.size, float(median), float(high))
