"""The analysis of a scene: the schedule of its images, the places that are read, the result."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.cut import (
    Progress,
    Segments,
    cutting_forces,
    find_segments,
    lacking,
    middle_frame,
    moments,
    spread_starts,
)
from chipglow.analysis.dataset import (
    assembled,
    drawn_variables,
    history_variables,
    image_variables,
    ridge_variables,
    scene_variables,
)
from chipglow.analysis.images import CASES, Effect
from chipglow.analysis.looks import Looked, Schedule, View, look
from chipglow.analysis.places import BandPlace, HottestPlace, Place, RakePlace
from chipglow.analysis.plan import Plan
from chipglow.analysis.result import Analysis, Cut
from chipglow.camera import Camera, GaussianPSF, Measurement
from chipglow.laboratory.chip import (
    NoContactError,
    NoShearBandError,
    chip_metrics,
    contact_length,
    resolution_warnings,
)
from chipglow.laboratory.emissivity.heated import heated_objects
from chipglow.scene import Frame, Material, Scene
from chipglow.scene.tool_attributes import tool_attributes
from chipglow.surface import Surface

PSF_ORDERS: Final = ("detector", "optics")
"""Where the point spread function acts: on the pixels' grid as in the paper, or before them."""

HEADLINES: Final[Mapping[tuple[str, str], str]] = {
    ("rake face", "mid-contact"): "rake",
    ("rake face", "most negative within two pixels"): "rake_extremum",
    ("rake face", "mean along the contact"): "rake_mean",
    ("shear band", "ridge of strain rate"): "band",
    ("shear band", "ridge of measured temperature"): "band_measured",
    ("shear band", "most negative beside it"): "band_worst",
}
"""Names of the readings of a cut, by place and quantity."""

_USUAL_SPACING: Final = 180e-6
"""Distance of shear bands along a chip in m, if the forces show no period."""

_Part = TypeVar("_Part")


@dataclass(frozen=True, eq=False)
class _Task:
    """A scene and everything that an analysis of it is made with."""

    scene: Scene
    surfaces: Mapping[str, Surface]
    camera: Camera
    plan: Plan
    tell: Progress
    effects: Mapping[str, Effect]
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """How long an exposure lasts in s."""
        return self.camera.frame_duration(self.scene.raster)

    def attempt(self, title: str, compute: Callable[[], _Part]) -> _Part | None:
        """Compute a part of the analysis; if it fails, keep the reason and continue without it."""
        try:
            return compute()
        except ValueError as error:
            self.failed[title] = str(error)
            return None


def analyse(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: Plan,
    progress: Progress | None = None,
    effects: Mapping[str, Effect] = CASES,
) -> Analysis:
    """Measure a scene with a virtual camera, and read the errors.

    Parameters
    ----------
    scene : Scene
        What is truly there. Temperature alone is enough.
    surfaces : mapping
        Surfaces by name, such as chip 1 and chip 2.
    camera : Camera
        The camera.
    plan : Plan
        What to analyse, and where.
    progress : callable, optional
        Called with what is being done and which fraction of it is done.
    effects : mapping
        What the axis ``effects`` of the result holds: by name a function that changes the camera
        and the exposure. ``all`` is the first and changes nothing, ``without psf`` is there too.

    Returns
    -------
    Analysis
        Of a scene that shows a cut, as the paper has it: the errors at the rake face and in the
        shear band of each segment. Of any other scene, and at places of the plan: the errors there
        in each exposure.

    Raises
    ------
    ValueError
        If the plan names a surface that is not there, the scene is shorter than an exposure, a
        place is outside the pixels, or a surface cannot be applied to the scene.
    """
    tell = progress or (lambda label, part: None)
    task = _Task(scene, surfaces, camera, plan, tell, effects)
    fields = {name: camera.lay(surface, scene) for name, surface in surfaces.items()}
    found, missing = _segments(task)
    schedule, frame = _scene_schedule(task) if found is None else _cut_schedule(task, found)
    looked = look(scene, surfaces, fields, camera, schedule, lambda part: tell("camera", part))
    measurements = {
        name: camera.redrawn(number).measurement(np.stack(images), schedule.starts, scene.raster)
        for number, (name, images) in enumerate(looked.images.items())
    }
    cut = None if found is None else _cut(task, found)
    emissivities = [field.emissivity(frame) for field in fields.values()]
    variables = _variables(
        task, schedule, looked, frame, measurements, emissivities, found is not None
    )
    attributes: dict[str, Any] = {
        "shown_instant": schedule.shown,
        "error_reference": plan.reference,
        **(tool_attributes(scene.tool) if scene.tool else {}),
    }
    if cut is not None:
        variables |= ridge_variables(cut.instants, measurements)
        variables |= history_variables(cut.forces, cut.chip)
        attributes |= {"rake_surface": plan.rake_surface, "band_surface": plan.band_surface}
    return Analysis(
        data=assembled(variables, attributes),
        plan=plan,
        camera=camera,
        raster=scene.raster,
        frame=frame,
        tool=scene.tool,
        places=tuple(_shown_places(schedule)),
        measurements=measurements,
        cut=cut,
        warnings=(*(_coarse(task, found) if found else ()), *_of_images(task, looked)),
        missing=(*missing, *_unread(schedule, looked)),
        failed=task.failed,
    )


def _segments(task: _Task) -> tuple[Segments | None, tuple[str, ...]]:
    """Segments of a cut; None and the reasons if the scene shows none or none are wanted."""
    plan, scene = task.plan, task.scene
    if plan.places or not plan.cut:
        return None, ()
    if missing := tuple(lacking(scene)):
        return None, missing
    for name in (plan.rake_surface, plan.band_surface):
        if name not in task.surfaces:
            raise ValueError(f"plan: surface {name!r} is not one of {list(task.surfaces)}")
    try:
        found = find_segments(scene, task.duration, plan.exposures, plan.touching, task.tell)
    except (NoShearBandError, NoContactError) as error:
        return None, (f"Rake face and shear band are not analysed: {error}.",)
    return found, ()


def _cut_schedule(task: _Task, found: Segments) -> tuple[Schedule, Frame]:
    plan, surfaces = task.plan, task.surfaces
    reach = plan.line_reach, plan.line_step
    segments = found.segments
    used: list[tuple[str, list[list[Place]]]] = [
        (
            plan.rake_surface,
            [[RakePlace("rake face", one.tool, one.contact_length, *reach)] for one in segments],
        ),
        (plan.band_surface, [[BandPlace("shear band", one.band, *reach)] for one in segments]),
    ]
    random = any(_is_random(surfaces[name]) for name, _ in used)
    textures, phases = plan.textures if random else 1, plan.phases**2
    strides = 2 * textures * phases, 2 * phases, 2
    schedule = Schedule(
        starts=np.array([instant.start for instant in found.instants]),
        drawn=found.drawn,
        shown=found.developed,
        views=tuple(
            View(name, places, textures, number, strides)
            for number, (name, places) in enumerate(used)
        ),
        phases=plan.phases,
        reference=plan.reference,
        effects=task.effects,
        vary=[
            partial(replace, psf=GaussianPSF(width), psf_order=order)
            for order in PSF_ORDERS
            for width in plan.psf_widths
        ],
    )
    return schedule, segments[0].frame


def _scene_schedule(task: _Task) -> tuple[Schedule, Frame]:
    plan, scene, duration = task.plan, task.scene, task.duration
    starts = spread_starts(scene, duration, plan.exposures)
    frames = [middle_frame(scene, float(start), duration) for start in starts]
    shown = int(np.argmax([float(scene.field("temperature", i).max()) for i in frames]))
    frame = scene.frame(frames[shown])
    places = tuple(_places(task, frame))
    for place in plan.places:
        place.check_within(task.camera.pixels(scene.raster))
    views, first = [], 0
    for name, surface in task.surfaces.items():
        textures = plan.textures if _is_random(surface) else 1
        strides = 0, plan.phases**2, 1
        views.append(View(name, [places] * len(starts), textures, first, strides))
        first += textures * plan.phases**2
    schedule = Schedule(
        starts=starts,
        drawn=tuple(range(len(starts))),
        shown=shown,
        views=tuple(views),
        phases=plan.phases,
        reference=plan.reference,
        effects=task.effects,
    )
    return schedule, frame


def _is_random(surface: Surface) -> bool:
    return surface.redrawn(1) is not surface


def _places(task: _Task, frame: Frame) -> Iterator[Place]:
    """The hottest pixel, the rake face if material touches it, then the user's places."""
    plan, scene = task.plan, task.scene
    yield HottestPlace()
    if scene.tool is not None and not plan.places:
        workpiece = frame.material == Material.WORKPIECE
        contact = contact_length(scene.raster, workpiece, scene.tool, plan.touching)
        if contact > 0:
            yield RakePlace("rake face", scene.tool, contact, plan.line_reach, plan.line_step)
    yield from plan.places


def _cut(task: _Task, found: Segments) -> Cut:
    """Chip, forces and heated objects of a cut; each part may fail."""
    task.tell("chip", 0.0)
    chip = task.attempt("chip metrics", lambda: chip_metrics(task.scene))
    task.tell("chip", 1.0)
    spacing = chip.chip_spacing if chip and isfinite(chip.chip_spacing) else _USUAL_SPACING
    heated = task.attempt(
        "heated chips and tool",
        lambda: heated_objects(
            task.camera,
            task.surfaces,
            found.segments[0].tool,
            _band_width(found),
            spacing,
            task.plan.textures,
        ),
    )
    return Cut(
        instants=found.instants,
        other_parts=found.other_parts,
        developed=found.developed,
        segments=found.segments,
        moments=moments(task.scene, task.duration, found),
        chip=chip,
        forces=task.attempt("forces", lambda: cutting_forces(task.scene)),
        heated=heated or (),
    )


def _band_width(found: Segments) -> float:
    return float(np.nanmean([segment.band_width for segment in found.segments]))


def _variables(
    task: _Task,
    schedule: Schedule,
    looked: Looked,
    frame: Frame,
    measurements: Mapping[str, Measurement],
    emissivities: Sequence[NDArray[np.float32]],
    is_cut: bool,
) -> dict[str, Any]:
    camera, names = task.camera, list(task.surfaces)
    exposures, stacks = zip(*(looked.shown[name] for name in names), strict=True)
    measured = np.stack(stacks)
    # A detector may flag more than what is under the limit.
    flags = np.stack([measurements[name].usable[schedule.shown] for name in names])
    variables = {
        "surface": ("surface", names),
        **scene_variables(
            frame,
            task.scene.raster,
            emissivities,
            [np.asarray(camera.band.temperature(one.centre_radiance)) for one in exposures],
        ),
        **image_variables(
            list(measurements.values()),
            [np.stack(looked.references[name]) for name in names],
            measured,
            ~flags,
        ),
        **drawn_variables(
            looked, schedule, HEADLINES if is_cut else {}, "segment" if is_cut else "exposure"
        ),
    }
    if schedule.vary:
        variables["psf_order"] = "psf_order", list(PSF_ORDERS)
        variables["psf_width"] = "psf_width", np.asarray(task.plan.psf_widths), {"units": "m"}
    return variables


def _shown_places(schedule: Schedule) -> Iterator[Place]:
    exposure = schedule.drawn.index(schedule.shown)
    seen: set[str] = set()
    for view in schedule.views:
        for place in view.places[exposure]:
            if place.name not in seen:
                seen.add(place.name)
                yield place


def _coarse(task: _Task, found: Segments) -> tuple[str, ...]:
    """What the grid of the cutting simulation does not resolve."""
    return resolution_warnings(task.scene, _band_width(found))


def _of_images(task: _Task, looked: Looked) -> Iterator[str]:
    """Warnings of the images of the shown exposure."""
    for number, (name, (exposure, _)) in enumerate(looked.shown.items()):
        for warning in task.camera.redrawn(number).form_measurement(exposure).notes.warnings:
            yield f"Image of {name}. {warning}"


def _unread(schedule: Schedule, looked: Looked) -> Iterator[str]:
    """Places of any scene of which there is no reading that all draws have, a sentence each."""
    for number, view in enumerate(schedule.views):
        for place in view.places[0]:
            rows = [
                values[:, : view.textures]
                for (of_view, name, _), values in looked.readings.rows.items()
                if (of_view, name) == (number, place.name)
            ]
            if not any(np.isfinite(row).all() for row in rows):
                yield (
                    f"{place.name}, {view.surface}: not read: in some draw nothing radiates "
                    "there, or it lies outside the pixels."
                )
