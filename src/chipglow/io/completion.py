"""From what a source says to a whole scene: what is missing, and what stands in for it."""

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, zoom

from chipglow.io.nearest import extended, fill
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import SPEED, TEMPERATURE, Position
from chipglow.scene.frame import (
    FILLED,
    MATERIAL_COORDINATE_UNITS,
    QUALITY,
    Frame,
    Material,
    SampledFrame,
    SceneError,
)
from chipglow.scene.raster import Raster
from chipglow.scene.regions import in_polygon
from chipglow.scene.tool import Tool

STRAIN_OF_CHIP: Final = 1.0
"""Plastic strain of the chip's region, if a source has no strain."""

_Corner: TypeAlias = tuple[Position, Position]
_VELOCITY: Final = frozenset(("velocity_x", "velocity_y"))

_CHIP_STARTS, _CHIP_ENDS = 0.3, 0.5
"""Plastic strain between which a material starts to move with the chip, and moves with it."""

_MOST_FILLED: Final = 0.5
"""Fraction of filled samples above which it is a warning."""

_FAINTEST: Final = 1e-30
"""Smallest scale of a pattern without light: as float32 it and its inverse are finite."""

_FLOW_FRAMES: Final = 5
"""Number of frames over which the optical flow is computed: little moves from one to the next."""

_FLOW_SAMPLES: Final = 320
"""Most samples across a picture of which the optical flow is computed: it takes seconds else."""


@dataclass(frozen=True)
class Completion(Part):
    """Substitutes for fields that the source lacks.

    Its ``tool`` is an outline: samples in it are tool, whatever the source says.
    """

    surroundings: Annotated[
        float,
        Parameter(
            "Temperature where there is no material, and of a tool that has none.", TEMPERATURE
        ),
    ] = 293.15
    tool: Tool | None = None
    cutting_speed: Annotated[
        float | None,
        Parameter(
            "Speed of the workpiece such as 250 m/min, for a source without velocity.", SPEED
        ),
    ] = None
    chip: Annotated[
        tuple[_Corner, ...] | None,
        Parameter(
            "Corners of the chip, for a source without plastic strain, such as [[-300 um, 0 um], "
            "[-50 um, 0 um], [-50 um, 400 um]]."
        ),
    ] = None
    motion: Annotated[
        Literal["auto", "flow", "none"],
        Parameter(
            "Velocity of a source that has none: flow (the optical flow), none, or auto: the flow "
            "where there is a strain, a chip or a cutting speed."
        ),
    ] = "auto"
    rate_frames: Annotated[
        int,
        Parameter(
            "Frames over which a missing strain rate is taken: more of them make less noise and "
            "more blur.",
            least=1,
            most=20,
        ),
    ] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.chip is not None and len(self.chip) < 3:
            raise ValueError(f"chip: {len(self.chip)} corners, expected 3 or more")
        if self.motion == "none" and self.cutting_speed is not None:
            raise ValueError("motion: 'none' beside a cutting_speed, give only one of them")

    @property
    def memory(self) -> int:
        """Number of earlier frames on which a frame depends."""
        return max(self.rate_frames, _FLOW_FRAMES)

    def fields(self, found: Collection[str], frames: int) -> tuple[str, ...]:
        """Names of the fields of the scene, in their order."""
        has_coordinates = MATERIAL_COORDINATE_UNITS.keys() <= set(found)
        has = {
            "temperature": True,
            "plastic_strain": self._has_strain(found),
            "plastic_strain_rate": self._has_rate(found, frames),
            "velocity_x": self._has_velocity(found),
            "velocity_y": self._has_velocity(found),
            "material": True,
            **dict.fromkeys(MATERIAL_COORDINATE_UNITS, has_coordinates),
            QUALITY: True,
        }
        return tuple(name for name, there in has.items() if there)

    def assumptions(self, found: Collection[str], frames: int) -> Iterator[str]:
        """Yield a sentence for each missing field and its substitute."""
        if _VELOCITY.isdisjoint(found):
            yield f"Velocity: {self._velocity_text(found, frames)}"
        if "plastic_strain" not in found and self.chip is None:
            yield "Plastic strain: none, so no feature of the chip has its own emissivity."
        elif "plastic_strain" not in found:
            yield f"Plastic strain: {STRAIN_OF_CHIP:g} in the chip's outline, 0 elsewhere."
        if "plastic_strain_rate" not in found and self._has_rate(found, frames):
            yield "Plastic strain rate: from the change of the strain along the motion."
        elif "plastic_strain_rate" not in found:
            yield "Plastic strain rate: none, so the shear band has the emissivity of the chip."

    def _velocity_text(self, found: Collection[str], frames: int) -> str:
        if not self._has_velocity(found):
            return "none; completion.motion: flow derives it from the images."
        if self.cutting_speed is None and frames == 1:
            return "0 everywhere, because the scene has one frame and no cutting speed."
        if self.cutting_speed is None:
            return "from the optical flow, which fails where the image has no pattern."
        chip = "0" if frames == 1 else "that of the optical flow"
        return f"the cutting speed where the strain is small, in the chip {chip}."

    def uses_flow(self, found: Collection[str], frames: int) -> bool:
        """Return whether the optical flow may be asked for the velocity."""
        return frames > 1 and _VELOCITY.isdisjoint(found) and self._has_velocity(found)

    def _has_strain(self, found: Collection[str]) -> bool:
        return "plastic_strain" in found or self.chip is not None

    def _has_rate(self, found: Collection[str], frames: int) -> bool:
        taken = "plastic_strain" in found and frames > 1 and self._has_velocity(found)
        return "plastic_strain_rate" in found or taken

    def _has_velocity(self, found: Collection[str]) -> bool:
        if not _VELOCITY.isdisjoint(found):
            return True
        if self.motion == "auto":
            return self.cutting_speed is not None or self._has_strain(found)
        return self.motion == "flow"


def complete(
    frames: Iterable[SampledFrame], raster: Raster, completion: Completion
) -> Iterator[Frame]:
    """Yield the whole frames of a scene from frames in order of time; a few are in memory.

    The first one's strain rate and optical flow are taken from the second.
    """
    x, y, nowhere = raster.x[None, :], raster.y[:, None], np.zeros(raster.shape, np.bool_)
    chip = in_polygon(completion.chip, x, y) if completion.chip else nowhere
    in_tool = completion.tool.signed_distance(x, y) < 0.0 if completion.tool else nowhere
    history: deque[SampledFrame] = deque(maxlen=completion.memory)
    found: set[str] = set()
    for number, sampled in enumerate(frames):
        found = found or set(sampled.fields)
        now = _prepared(sampled, completion, chip, in_tool)
        if number == 1:
            yield _finished(history[0], [now], raster, completion, found)
        if number > 0:
            yield _finished(now, history, raster, completion, found)
        history.append(now)
    if history and number == 0:
        yield _finished(history[0], [], raster, completion, found)


def _prepared(
    sampled: SampledFrame,
    completion: Completion,
    chip: NDArray[np.bool_],
    in_tool: NDArray[np.bool_],
) -> SampledFrame:
    """Return the frame with its tool and its strain, and with no hole in the material."""
    if "temperature" not in sampled.fields:
        raise SceneError("scene: no sample has a temperature")
    material = np.where(in_tool, np.uint8(Material.TOOL), sampled.material)
    solid = material != Material.VOID
    known = np.isfinite(sampled.fields["temperature"])
    holes = solid & ~known
    tool = material == Material.TOOL
    # A tool that is only drawn has no temperature anywhere; that of the chip is not its own.
    bare = tool & holes if in_tool.any() or not (tool & known).any() else np.zeros_like(tool)
    unknown = int((holes & ~bare).sum())
    if unknown > _MOST_FILLED * max(solid.sum(), 1):
        raise SceneError(
            f"scene: temperature is not known in {unknown} of {solid.sum()} samples of the "
            f"material at {sampled.time:.9g} s, expected less than half"
        )
    fields = {name: _without_holes(values, solid) for name, values in sampled.fields.items()}
    fields["temperature"][bare] = completion.surroundings
    if "plastic_strain" not in fields and completion.chip is not None:
        strain = np.where(chip, np.float32(STRAIN_OF_CHIP), np.float32(0.0))
        fields["plastic_strain"] = np.where(solid, strain, np.float32(np.nan))
    quality = np.zeros(material.shape, np.uint8) if sampled.quality is None else sampled.quality
    quality = np.where(holes, np.uint8(FILLED), quality)
    return SampledFrame(sampled.time, fields, material, quality)


def _without_holes(values: NDArray[np.float32], solid: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return a field that is known everywhere in the material, and NaN elsewhere."""
    known = solid & np.isfinite(values)
    whole = np.where(known, values, np.float32(0.0))
    fill(whole, known, solid & ~known)
    return np.where(solid, whole, np.float32(np.nan))


def _finished(
    now: SampledFrame,
    others: Sequence[SampledFrame],
    raster: Raster,
    completion: Completion,
    found: set[str],
) -> Frame:
    """Return the whole frame; `others` are those before it, or the one after it."""
    names = completion.fields(found, 2 if others else 1)
    fields = {name: now.fields[name] for name in names if name in now.fields}
    if "velocity_x" in names:
        velocity = _velocity(now, others, raster, completion)
        fields |= zip(("velocity_x", "velocity_y"), velocity, strict=True)
        if "plastic_strain_rate" in names and "plastic_strain_rate" not in fields:
            other = others[max(len(others) - completion.rate_frames, 0)]
            strain, before = (frame.fields["plastic_strain"] for frame in (now, other))
            interval, spacing = now.time - other.time, raster.spacing
            rate = strain_rate_along(strain, before, velocity, interval, spacing)
            fields["plastic_strain_rate"] = rate
    whole: dict[str, Any] = {name: _elsewhere(values) for name, values in fields.items()}
    for name in ("plastic_strain", "plastic_strain_rate"):
        if name in whole:
            whole[name] = np.maximum(whole[name], 0.0)
    whole["temperature"] = _elsewhere(fields["temperature"], completion.surroundings)
    return Frame(time=now.time, material=now.material, quality=now.quality, **whole)


_Velocity: TypeAlias = tuple[NDArray[np.float32], NDArray[np.float32]]


def _velocity(
    now: SampledFrame, others: Sequence[SampledFrame], raster: Raster, completion: Completion
) -> _Velocity:
    zero = np.zeros(raster.shape, np.float32)
    known = [now.fields.get(name) for name in ("velocity_x", "velocity_y")]
    if any(values is not None for values in known):
        across, up = (zero if values is None else values for values in known)
        return _elsewhere(across), _elsewhere(up)
    moves = (now.material == Material.WORKPIECE).astype(np.float32)
    speed, chip = completion.cutting_speed or 0.0, moves
    if completion.cutting_speed is not None:
        strain = _elsewhere(now.fields.get("plastic_strain", zero))
        chip = moves * np.clip((strain - _CHIP_STARTS) / (_CHIP_ENDS - _CHIP_STARTS), 0.0, 1.0)
    across, up = zero, zero
    if others and chip.any():
        interval = others[0].time - now.time
        across, up = optical_flow(_pattern(now), _pattern(others[0]), interval, raster.spacing)
    return chip * across + (moves - chip) * np.float32(speed), chip * up


def _pattern(frame: SampledFrame) -> NDArray[np.float32]:
    """Return the field that the optical flow follows: logarithm of strain, or temperature."""
    strain = _elsewhere(frame.fields.get("plastic_strain", frame.fields["temperature"] * 0.0))
    if strain.max() > strain.min():
        return np.log1p(np.maximum(strain, 0.0))
    temperature = frame.fields["temperature"]
    return _elsewhere(temperature - np.nanmin(temperature))


def _elsewhere(values: NDArray[np.float32], value: float = 0.0) -> NDArray[np.float32]:
    """Values with one value where there is no material."""
    return np.where(np.isfinite(values), values, np.float32(value))


def strain_rate_along(
    strain: NDArray[np.float32],
    before: NDArray[np.float32],
    velocity: _Velocity,
    interval: float,
    spacing: float,
) -> NDArray[np.float32]:
    """Return (strain(x) - before(x - v interval)) / interval in 1/s, shape (y, x), 0 or more.

    Strain and rate are NaN without material; the strain before is 0 where it was void.
    """
    rows, columns = np.indices(strain.shape, dtype=np.float32)
    shift = np.float32(interval / spacing)
    origin = rows + velocity[1] * shift, columns - velocity[0] * shift
    there = np.isfinite(before)
    earlier = map_coordinates(extended(before, there), origin, order=3, mode="nearest")
    known = map_coordinates(there.astype(np.float32), origin, order=1, mode="constant") > 0.5
    rate = np.maximum((strain - earlier) / np.float32(interval), 0.0)
    rate[~known & np.isfinite(strain)] = 0.0
    return np.asarray(rate, np.float32)


def optical_flow(
    before: NDArray[np.float32], after: NDArray[np.float32], interval: float, spacing: float
) -> _Velocity:
    """Return the velocity along x and up in m/s by which a pattern moved, shape (y, x) each.

    Total variation with the L1 norm (Zach, Pock and Bischof 2007) by scikit-image, on a picture of
    a few hundred samples. It sees only what has a pattern: a region without one takes on the
    motion of its surroundings.
    """
    from skimage import registration

    factor = min(_FLOW_SAMPLES / max(before.shape), 1.0)
    scale = np.float32(max(float(before.max()), float(after.max()), _FAINTEST))
    small = [zoom(pattern / scale, factor, order=1) for pattern in (before, after)]
    down, right = registration.optical_flow_tvl1(*small, dtype=np.float32)
    back = [_resized(flow, before.shape) for flow in (right, -down)]
    speed = np.float32(spacing * before.shape[1] / small[0].shape[1] / interval)
    return back[0] * speed, back[1] * speed


def _resized(values: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    factors = [new / old for new, old in zip(shape, values.shape, strict=True)]
    return np.asarray(zoom(values, factors, order=1, grid_mode=True, mode="nearest"), np.float32)
