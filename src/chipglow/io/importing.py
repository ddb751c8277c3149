"""From a source of fields to a scene file, frame by frame."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from itertools import islice
from math import ceil, isfinite
from pathlib import Path
from time import monotonic
from typing import Annotated, Any, Final

import numpy as np

from chipglow.io.completion import Completion, complete
from chipglow.io.scene_file import SceneWriter
from chipglow.io.sources import Source, SourceError, Survey
from chipglow.io.sources.plausible import check_temperatures, doubt_of_size
from chipglow.io.sources.source import check_times
from chipglow.io.spool import UnfinishedScene, unfinished_scenes
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import COLDEST, HOTTEST, LENGTH, POSITION
from chipglow.scene import Frame, Raster, Scene
from chipglow.text import Notes, needs_extra

SAMPLES_ACROSS: Final = 900
"""Samples along the longer side of a scene by default: as many as in the paper's scene."""

MOST_SAMPLES: Final = 100_000_000
"""Most samples of a frame."""

_CHECKPOINT_INTERVAL: Final = 30.0
"""Seconds between the times at which an import is kept."""

_KEY: Final = "import"


@dataclass(frozen=True)
class FieldOfView(Part):
    """Samples of the scene; by default as in the source."""

    left: Annotated[float | None, Parameter("Left edge.", POSITION)] = None
    right: Annotated[float | None, Parameter("Right edge.", POSITION)] = None
    bottom: Annotated[float | None, Parameter("Lower edge.", POSITION)] = None
    top: Annotated[float | None, Parameter("Upper edge.", POSITION)] = None
    spacing: Annotated[
        float | None,
        Parameter(
            "Side of a sample; none: the source's own, or 900 samples along the longer side.",
            LENGTH,
            over=0.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for low, high in (("left", "right"), ("bottom", "top")):
            first, last = getattr(self, low), getattr(self, high)
            if first is not None and last is not None and not first < last:
                raise ValueError(f"{high}: {last:g} m, expected more than {low}, {first:g} m")

    def raster(self, survey: Survey) -> Raster:
        """Return the samples for a source; refuse a view of nothing and too many samples."""
        given = (self.left, self.right, self.bottom, self.top)
        left, right, bottom, top = (
            there if said is None else said
            for said, there in zip(given, survey.extent, strict=True)
        )
        width, height = right - left, top - bottom
        if not (isfinite(width) and isfinite(height) and width > 0 and height > 0):
            raise SourceError(
                f"{survey.kind}: the view is {_metres((left, right, bottom, top))}, expected an "
                f"area; the source extends over {_metres(survey.extent)}"
            )
        spacing = self.spacing or survey.spacing or max(width, height) / SAMPLES_ACROSS
        samples = (height / spacing) * (width / spacing)
        if not samples <= MOST_SAMPLES:
            raise SourceError(
                f"{survey.kind}: {samples:.3g} samples of {spacing:g} m, expected up to "
                f"{MOST_SAMPLES:.0e}; a larger spacing makes fewer"
            )
        # A millionth of a sample is rounding and needs no further row or column.
        rows, columns = (max(ceil(side / spacing - 1e-6), 2) for side in (height, width))
        raster = Raster(left, top, spacing, rows, columns)
        view, there = raster.extent, survey.extent
        if not all(max(view[i], there[i]) < min(view[i + 1], there[i + 1]) for i in (0, 2)):
            raise SourceError(
                f"{survey.kind}: extends over {_metres(there)}, nothing of which is in view: "
                f"{_metres(view)}"
            )
        return raster


def _metres(extent: tuple[float, float, float, float]) -> str:
    left, right, bottom, top = extent
    return f"x {left:.4g} to {right:.4g} m, y {bottom:.4g} to {top:.4g} m"


@dataclass(frozen=True)
class Import:
    """A source and the description of its import."""

    source: Source
    view: FieldOfView = field(default_factory=FieldOfView)
    completion: Completion = field(default_factory=Completion)
    description: Mapping[str, Any] = field(default_factory=dict)
    """How the source was described, kept with the scene: text and numbers."""
    assumptions: Mapping[str, str] = field(default_factory=dict)
    """Assumptions that apply if the source contains a field, by the field's name."""


@dataclass(frozen=True)
class Prospect:
    """Result of a survey: contents of the source, samples and assumptions."""

    survey: Survey
    raster: Raster
    notes: Notes


def prospect(wanted: Import) -> Prospect:
    """Look at a source and find out what a scene of it would be."""
    survey = wanted.source.survey()
    if survey.times.size == 0:
        raise SourceError(f"{survey.kind}: has no frame, expected 1 or more")
    if not np.isfinite(survey.times).all():
        raise SourceError(f"{survey.kind}: its times are not finite")
    check_times(survey.kind, survey.times)
    if "temperature" not in survey.found:
        raise SourceError(
            f"{survey.kind}: no field is known as temperature, expected fields: "
            f"temperature: NAME with one of {', '.join(survey.unused) or 'none'}"
        )
    raster = wanted.view.raster(survey)
    _check_temperatures(wanted, survey, raster)
    left, right, bottom, top = survey.extent
    assumed = [
        *doubt_of_size("The source", max(right - left, top - bottom), "units.length"),
        *(text for name, text in wanted.assumptions.items() if name in survey.found),
        *wanted.completion.assumptions(survey.found, len(survey.times)),
    ]
    flow = wanted.completion.uses_flow(survey.found, len(survey.times))
    if flow and find_spec("skimage") is None:
        raise SourceError(
            needs_extra(
                "velocity", "scikit-image for the optical flow, as the source has none", "flow"
            )
        )
    return Prospect(survey, raster, survey.notes + Notes(assumed))


def import_scene(
    wanted: Import,
    path: str | os.PathLike[str],
    progress: Callable[[float], None] | None = None,
    *,
    looked: Prospect | None = None,
    resume: UnfinishedScene | None = None,
) -> Prospect:
    """Read a source into a scene file; no more than a few frames are in memory.

    Parameters
    ----------
    wanted : Import
        The source.
    path : path-like
        The file to write; it appears when it is whole.
    progress : callable, optional
        Told the fraction that is done, 0 to 1.
    looked : Prospect, optional
        Result of an earlier `prospect`.
    resume : UnfinishedScene, optional
        Result of `kept_import`, to continue an earlier import of the same source.

    Raises
    ------
    SourceError
        If the source cannot be read.
    SceneError
        If what is read breaks the contract of a scene.
    OSError
        If a file is missing or cannot be written.
    """
    looked = looked or prospect(wanted)
    survey, raster, completion = looked.survey, looked.raster, wanted.completion
    fields = completion.fields(survey.found, len(survey.times))
    key = _key(wanted, looked)
    done = len(resume.frames()[0]) if resume else 0
    attributes = {_KEY: key, **looked.notes.attrs()}
    with SceneWriter(path, raster, completion.tool, attributes, fields, resume=resume) as writer:
        kept = f"{done} frames are kept" if done else ""
        due = monotonic() + _CHECKPOINT_INTERVAL
        try:
            for number, frame in enumerate(_frames(wanted, raster, done), start=done + 1):
                writer.append(frame)
                fraction = number / len(survey.times)
                if progress:
                    progress(min(fraction, 1.0))
                if monotonic() > due:
                    writer.checkpoint({_KEY: np.frombuffer(key.encode(), np.uint8)}, fraction)
                    kept = f"{number} frames are kept"
                    due = monotonic() + _CHECKPOINT_INTERVAL
        except KeyboardInterrupt:
            raise KeyboardInterrupt(kept) from None
    for unfinished in unfinished_scenes(Path(path)):
        unfinished.remove()
    return looked


def kept_import(
    wanted: Import, looked: Prospect, path: str | os.PathLike[str]
) -> UnfinishedScene | None:
    """Find what an earlier run of the same import to a file left at a checkpoint, the furthest."""
    key = np.frombuffer(_key(wanted, looked).encode(), np.uint8)
    for left in unfinished_scenes(Path(path)):
        if left.progress > 0 and np.array_equal(left.state().get(_KEY, []), key):
            return left
    return None


def read_scene(source: Import | Source) -> Scene:
    """Read a source into memory.

    Parameters
    ----------
    source : Import or Source
        The source; all frames must fit into memory. Of a bare source all is read, and what it
        lacks is completed as `Completion` has it by default.

    Raises
    ------
    SourceError, SceneError, OSError
        As `import_scene`.
    """
    wanted = source if isinstance(source, Import) else Import(source)
    looked = prospect(wanted)
    frames = list(_frames(wanted, looked.raster, 0))
    names = [
        name for name, value in vars(frames[0]).items() if name != "time" and value is not None
    ]
    return Scene.from_fields(
        looked.raster,
        [frame.time for frame in frames],
        {name: np.stack([getattr(frame, name) for frame in frames]) for name in names},
        wanted.completion.tool,
        {_KEY: _key(wanted, looked), **looked.notes.attrs()},
    )


def _frames(wanted: Import, raster: Raster, done: int) -> Iterator[Frame]:
    """Yield the frames after those that are done; they depend on some before them."""
    first = max(done - wanted.completion.memory, 0)
    frames = complete(wanted.source.frames(raster, first), raster, wanted.completion)
    seen = done > 0
    for frame in islice(frames, done - first, None):
        lowest, highest = float(frame.temperature.min()), float(frame.temperature.max())
        check_temperatures(f"at {frame.time:.9g} s", lowest, highest, _remedy(wanted))
        seen = seen or bool(frame.material.any())
        yield frame
    if not seen:
        raise SourceError("import: no frame shows material in the field of view")


def _remedy(wanted: Import) -> str:
    """Return what to do about temperatures beyond those of a scene."""
    unit = wanted.description.get("units", {}).get("temperature") or "K, or as the file states"
    return (
        f"units.temperature is {unit}: state another unit, such as degC, degF or cK; for a grid "
        "also scale and offset, or as void_value the number without a meaning"
    )


def _check_temperatures(wanted: Import, survey: Survey, raster: Raster) -> None:
    """Refuse what no import could take: no temperature at all, or what is none in kelvin.

    If only a part of the source is in view, the extreme temperatures need not be.
    """
    if survey.temperatures is None:
        return
    lowest, highest = survey.temperatures
    view, there = np.reshape(raster.extent, (2, 2)), np.reshape(survey.extent, (2, 2))
    beyond = (there - view) * (-1, 1) > 1e-6 * raster.spacing
    if beyond.any():  # part of the source has to be in view, at some temperature in between
        lowest, highest = min(max(lowest, COLDEST), highest), max(min(highest, HOTTEST), lowest)
    check_temperatures(survey.found["temperature"], lowest, highest, _remedy(wanted))


def _key(wanted: Import, looked: Prospect) -> str:
    """Return the inputs by which two imports are equal."""
    raster = vars(looked.raster)
    return json.dumps({**wanted.description, "raster": raster}, sort_keys=True, default=str)
