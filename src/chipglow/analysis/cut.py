"""The cut of a scene: its shear bands, segments, forces and chip."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import nan
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.corrected import CorrectedWindow
from chipglow.analysis.heated import HeatedObject
from chipglow.analysis.places import TOUCHING
from chipglow.chip import (
    ChipMetrics,
    CutHistory,
    Inertia,
    Instant,
    NoContactError,
    NoShearBandError,
    Segment,
    ShearBand,
    cut_history,
    inertia,
)
from chipglow.cutting import EnergyHistory
from chipglow.scene import ENERGY_UNITS, Frame, Scene

Progress: TypeAlias = Callable[[str, float], None]
"""Told what is being done and which fraction of it, 0 to 1, is done."""

_DEVELOPED: Final = 0.95
"""Rise of a developed band's mean temperature, as a fraction of the largest."""

_AROUND: Final = 2
"""Instants from the developed band to the one that still develops, and to the one that moved."""

_NEEDED: Final = {
    "plastic_strain": "plastic strain: the chip is not distinguished from the workpiece",
    "plastic_strain_rate": "plastic strain rate: no shear band is looked for",
    "velocity_x": "velocity: the chip's speed and shape are not measured",
}
"""Fields that the analysis of a cut needs, and what is missing without them."""


@dataclass(frozen=True, eq=False)
class CuttingForces:
    """Forces and segments of a cut, and what limits them."""

    history: CutHistory
    unaccounted: float  # part of the drive's work, NaN without an energy account
    inertia: Inertia


@dataclass(frozen=True, eq=False)
class Cut:
    """Segments, instants, chip and forces that only a cut with a developed band and contact has."""

    instants: tuple[Instant, ...]  # of the longest part without a gap, then one of each other part
    other_parts: int
    developed: int  # the instant with the fully developed band
    segments: tuple[Segment, ...]  # the drawn exposures: the developed one, then the other parts
    moments: tuple[Frame, ...]  # before, with and after the developed band
    chip: ChipMetrics | None = None
    forces: CuttingForces | None = None
    heated: tuple[HeatedObject, ...] = ()
    corrected: tuple[CorrectedWindow, ...] = ()
    overview: Scene | None = None

    @property
    def one_segment(self) -> tuple[Instant, ...]:
        """The instants of the scene's longest part."""
        return self.instants[: len(self.instants) - self.other_parts]

    @property
    def band(self) -> ShearBand:
        """The fully developed shear band."""
        return self.segments[0].band

    @property
    def band_width(self) -> float:
        """Mean width of the segments' shear bands in m."""
        return float(np.nanmean([segment.band_width for segment in self.segments]))


def lacking(scene: Scene) -> Iterator[str]:
    """Yield a sentence for each thing that the scene lacks for the analysis of a cut."""
    if scene.tool is None:
        yield (
            "No rake face is read: the scene has no tool (the section cutting.tool of the study "
            "gives it one)."
        )
    for name, title in _NEEDED.items():
        if name not in scene.fields:
            yield f"The scene has no {title}."


def find_cut(scene: Scene, duration: float, exposures: int, tell: Progress) -> Cut:
    """Return the segments of a cut with a developed shear band, one per part of the scene."""
    starts = spread_starts(scene, duration, exposures)
    others = other_starts(scene, duration)
    instants = []
    for i, start in enumerate((*starts, *others)):
        tell("shear band", i / (len(starts) + len(others)))
        instants.append(Instant.at(scene, float(start), duration))
    tell("shear band", 1.0)
    developed = _developed(scene, instants[: len(starts)])
    segments = [
        Segment.of(scene, instant, duration, TOUCHING)
        for instant in (instants[developed], *instants[len(starts) :])
        if instant.band is not None
    ]
    if not segments[0].contact_length > 0:
        raise NoContactError("rake face: the chip does not touch it in the developed instant")
    around = (developed - _AROUND, developed, developed + _AROUND)
    return Cut(
        instants=tuple(instants),
        other_parts=len(others),
        developed=developed,
        segments=tuple(segment for segment in segments if segment.contact_length > 0),
        moments=tuple(
            scene.frame(scene.frame_at(starts[number] + duration / 2))
            for number in sorted({min(max(number, 0), len(starts) - 1) for number in around})
        ),
    )


def cutting_forces(scene: Scene) -> CuttingForces | None:
    """Return the forces of a cut and their segments, if the scene has them."""
    history, inert = cut_history(scene), inertia(scene)
    if history is None or inert is None:
        return None
    return CuttingForces(history, _unaccounted(scene), inert)


def spread_starts(scene: Scene, duration: float, count: int) -> NDArray[np.float64]:
    """Return starts of `count` exposures or fewer, spread over the scene's longest part."""
    times, spacing = scene.times[scene.longest_block], scene.frame_spacing
    if len(scene.times) == 1:
        return times
    last = times[-1] + spacing - duration
    # A millionth of the duration, or of the time between frames, is rounding.
    if last < times[0] - 1e-6 * duration:
        raise ValueError(
            f"scene: it lasts {1e6 * (times[-1] + spacing - times[0]):.4g} us, "
            f"expected an exposure's {1e6 * duration:.4g} us or more"
        )
    wanted = np.linspace(times[0], max(last, times[0]), count) if count > 1 else times[:1]
    slack = 1e-6 * spacing  # rounding
    nearest_frame = np.searchsorted(times, wanted + slack, side="right") - 1
    return np.asarray(np.unique(times[nearest_frame]), dtype=np.float64)


def middle_start(scene: Scene, duration: float) -> float:
    """Return the start of an exposure in the middle of the scene's longest part."""
    starts = spread_starts(scene, duration, 3)
    return float(starts[len(starts) // 2])


def other_starts(scene: Scene, duration: float) -> list[float]:
    """Return starts of the scene's other parts that are as long as an exposure."""
    starts = []
    for block in scene.blocks:
        first, last = scene.times[block[0]], scene.times[block[-1]]
        lasts = last - first + scene.frame_spacing  # known to a millionth, by rounding
        if block != scene.longest_block and lasts >= duration * (1 - 1e-6):
            starts.append(float(first))
    return starts


def _developed(scene: Scene, instants: list[Instant]) -> int:
    """Return the index of the first instant whose band is near its highest temperature."""
    means = np.array([instant.mean_temperature for instant in instants])
    if np.isnan(means).all():
        raise NoShearBandError("shear band: none is found in any of the exposures")
    rise = means - float(scene.field("temperature", scene.longest_block[0]).min())
    return int(np.argmax(np.nan_to_num(rise) >= _DEVELOPED * np.nanmax(rise)))


def _unaccounted(scene: Scene) -> float:
    """Return the fraction of the drive's work that the energy balance does not explain."""
    if "drive_work" not in scene.data:
        return nan
    account = {name: np.asarray(scene.data[name].values, dtype=np.float64) for name in ENERGY_UNITS}
    return float(EnergyHistory(**account).closing_error[-1])
