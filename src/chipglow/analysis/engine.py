"""The analysis of a scene: the schedule of its images, the places that are read, the result."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np
import pandas as pd
import xarray as xr

from chipglow.analysis.attribution import AttributionPlan, attribute, read_attribution
from chipglow.analysis.corrected import (
    RAKE_FACE,
    SHEAR_BAND,
    CorrectedWindow,
    CorrectionPlan,
    corrected_windows,
)
from chipglow.analysis.cut import Cut, Progress, cutting_forces, find_cut, lacking, spread_starts
from chipglow.analysis.distribution import PIXEL_PHASE
from chipglow.analysis.heated import heated_objects
from chipglow.analysis.images import CASES
from chipglow.analysis.outside import fractions_outside, outside_warnings
from chipglow.analysis.places import TOUCHING, BandPlace, HottestPlace, Place, RakePlace
from chipglow.analysis.plan import Plan
from chipglow.analysis.read import Schedule, SurfacePlaces, Variables, read, rows_of
from chipglow.analysis.reductions import (
    Headline,
    headline,
    headlines,
    line_error,
    line_psf_portion,
    readings_frame,
)
from chipglow.camera import Camera, Exposure, Flag, GaussianPSF, Measurement
from chipglow.camera.exposure import sparse_frames, surroundings_radiance
from chipglow.camera.measuring import measurement_of
from chipglow.chip import (
    NoContactError,
    NoShearBandError,
    ShearBand,
    chip_metrics,
    contact_length,
    resolution_warnings,
)
from chipglow.quantities import Array, Brief
from chipglow.radiometry import blackbody_radiance
from chipglow.scene import FIELD_UNITS, Frame, Material, Raster, Scene, Tool, sample
from chipglow.scene.frame import FILLED, QUALITY
from chipglow.scene.tool_outline import tool_attributes
from chipglow.surface import EmissivityField, Surface
from chipglow.text import Notes, result_html

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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

_SHOWN_FIELDS: Final = ("temperature", "plastic_strain", "plastic_strain_rate", "material")
_COORDINATES: Final = (
    "place", "quantity", "seen_surface", "textures", "undrawn", "line_surface", "line_textures",
)  # fmt: skip
_KELVIN: Final = {"units": "K"}
_DARK_IMAGE: Final = 0.9
"""Fraction of an image outside the range above which there is a warning; a scene may be cold."""

_LEAST_LIGHT: Final = 1e-30
"""Radiance in W/(m² sr) that a camera shows where the surroundings account for all."""

_Part = TypeVar("_Part")


@dataclass(frozen=True, eq=False, repr=False)
class Analysis(Brief):
    """The error of a camera against its scene.

    Parameters
    ----------
    data : xarray.Dataset
        Every number, in SI units; the methods and `chipglow.analysis.reductions` read it.
    plan : Plan
        The plan of the analysis.
    camera : Camera
        The camera.
    raster : Raster
        The scene's samples.
    frame : Frame
        The scene in the middle of the shown exposure.
    tool : Tool or None
        The scene's tool.
    places : tuple of Place
        Places at which the errors are read in the shown exposure.
    measurements : mapping
        By surface, one frame for each instant.
    cut : Cut or None
        Segments, chip and forces of a cut.
    warnings, missing : tuple of str
        Sentences: what limits the validity of the results; what could not be analysed, and why.
    failed : mapping
        Parts of the analysis that failed, by title, with the reason.
    assumed : tuple of str
        Sentences on assumed settings of scene and study.
    """

    data: xr.Dataset
    plan: Plan
    camera: Camera
    raster: Raster
    frame: Frame
    tool: Tool | None
    places: tuple[Place, ...]
    measurements: Mapping[str, Measurement]
    cut: Cut | None
    warnings: tuple[str, ...]
    missing: tuple[str, ...]
    failed: Mapping[str, str]
    assumed: tuple[str, ...] = ()

    @property
    def surfaces(self) -> tuple[str, ...]:
        """Names of the surfaces with readings; all if nothing is read."""
        seen = set(self.data.seen_surface.values.tolist())
        return tuple(name for name in self.measurements if name in seen) or tuple(self.measurements)

    def headline(self, name: str) -> Headline:
        """Return a reading over all draws, in K, such as ``rake`` or ``band`` of a cut.

        Raises
        ------
        ValueError
            If there is no such reading, or it is unknown in some draw.
        """
        found = headline(self.data, name)
        if found is None:
            known = "; ".join(headlines(self.data)) or "none"
            raise ValueError(
                f"reading: {name!r} is not known in every draw, expected one of: {known}"
            )
        return found

    def line(self, name: str) -> xr.Dataset:
        """Return ``error`` and ``psf_portion`` in K along a line, over the draws and ``point``.

        The coordinate ``distance`` is in m.

        Raises
        ------
        ValueError
            If there is no such line.
        """
        lines = self.data.line.values.tolist() if "line" in self.data.dims else []
        if name not in lines:
            known = "; ".join(lines) or "none"
            raise ValueError(f"line: {name!r} is unknown, expected one of: {known}")
        parts = {
            "error": line_error(self.data, name),
            "psf_portion": line_psf_portion(self.data, name),
        }
        return xr.Dataset({key: part.assign_attrs(units="K") for key, part in parts.items()})

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each reading: reference, error, its scatter, and the PSF's portion."""
        return readings_frame(self.data)

    def plot(self, surface: str | None = None, ax: "Axes | None" = None) -> "Axes":
        """Draw the error of every pixel in the shown exposure, and where errors are read.

        Parameters
        ----------
        surface : str, optional
            Surface, by default the first with readings.
        ax : matplotlib.axes.Axes, optional
            Axes to draw on, new ones by default.

        Raises
        ------
        ValueError
            If there is no such surface.
        """
        from chipglow.analysis.figure import plot_error

        if surface is not None and surface not in self.measurements:
            known = ", ".join(self.measurements)
            raise ValueError(f"surface: {surface!r} is unknown, expected one of {known}")
        return plot_error(self, surface or self.surfaces[0], ax)

    def _repr_html_(self) -> str:
        failed = [f"{title}: failed: {reason}" for title, reason in self.failed.items()]
        notes = Notes(list(self.assumed), [*self.warnings, *self.missing, *failed])
        return result_html("Analysis", self.to_frame(), notes)

    def read_curves(self) -> list[Array]:
        """Return where errors are read in the shown exposure: points in m, of shape (n, 2)."""
        if self.cut is None:
            outlines = (place.outline() for place in self.places)
            return [points for points in outlines if points is not None]
        lines = self.data.isel(exposure=0).sel(line=["rake", "band"])
        points = np.stack([lines.line_x.values, lines.line_y.values], axis=-1)
        return [one[np.isfinite(one).all(axis=1)] for one in points]


@dataclass(frozen=True, eq=False)
class _Task:
    """A scene and everything that an analysis of it is made with."""

    scene: Scene
    surfaces: Mapping[str, Surface]
    camera: Camera
    plan: Plan
    tell: Progress
    effects: Mapping[str, Collection[str]]
    attribution: AttributionPlan | None = None
    correction: CorrectionPlan | None = None
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        return self.camera.frame_duration(self.scene.raster)

    def attempt(self, title: str, compute: Callable[[], _Part]) -> _Part | None:
        """Return a part of the analysis; if it fails, keep the reason and return None."""
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
    effects: Mapping[str, Collection[str]] = CASES,
    attribution: AttributionPlan | None = None,
    correction: CorrectionPlan | None = None,
) -> Analysis:
    """Measure a scene with a virtual camera, and read the errors.

    Parameters
    ----------
    scene : Scene
        The true fields. Temperature alone is enough.
    surfaces : mapping
        Surfaces by name, such as chip 1 and chip 2.
    camera : Camera
        The camera.
    plan : Plan
        Exposures, draws and places.
    progress : callable, optional
        Called with the current step and the fraction of it that is complete.
    effects : mapping
        The axis ``effects`` of the result: by name the effects that are on, members of `Effect`.
        ``all`` comes first and has all of them; ``without psf`` is required.
    attribution : AttributionPlan, optional
        Effects among which the errors of the shown exposure are divided; None: they are not.
    correction : CorrectionPlan, optional
        Knowledge for correcting the shown exposure of a cut near the cutting edge; None: it
        is not corrected.

    Returns
    -------
    Analysis
        For a scene that shows a cut, as in the paper: the errors at the rake face and in the
        shear band of each segment. Of any other scene, and at places of the plan: the errors there
        in each exposure.

    Raises
    ------
    ValueError
        If the plan names a surface that is not there, the scene is shorter than an exposure, a
        place is outside the pixels, or a surface cannot be applied to the scene.
    """
    tell = progress or (lambda label, part: None)
    task = _Task(scene, surfaces, camera, plan, tell, effects, attribution, correction)
    fields = {name: camera.prepare(surface, scene) for name, surface in surfaces.items()}
    schedule, cut, missing = _schedule(task)
    readings = read(scene, surfaces, fields, camera, schedule, lambda part: tell("camera", part))
    data = readings.data
    measurements = {
        name: measurement_of(
            camera.redrawn(number), data.radiance.values[number], schedule.starts, scene.raster
        )
        for number, name in enumerate(fields)
    }
    middle = scene.frame_at(schedule.starts[schedule.shown] + task.duration / 2)
    frame = cut.segments[0].frame if cut else scene.frame(middle)
    data = data.drop_vars("radiance").assign(
        _scene_variables(task, frame, fields, readings.shown)
        | _image_variables(measurements, schedule.shown)
    )
    data = data.assign(_corrected(camera, data) | _outside(schedule, data, measurements))
    attributed = task.attempt("attribution", lambda: _attribution(task, schedule, data))
    data = data.assign(attributed or {})
    if cut is not None:
        cut = _completed(task, cut, measurements, schedule.shown)
        data = data.assign(_cut_variables(task, cut, measurements))
    data = data.assign_attrs(_attributes(task, schedule, cut))
    data = data.set_coords([name for name in _COORDINATES if name in data])
    exposure = schedule.drawn.index(schedule.shown)
    placed = [(view.surface, place) for view in schedule.views for place in view.places[exposure]]
    return Analysis(
        data=data,
        plan=plan,
        camera=camera,
        raster=scene.raster,
        frame=frame,
        tool=scene.tool,
        places=tuple({place.name: place for _, place in placed}.values()),
        measurements=measurements,
        cut=cut,
        warnings=(
            *_scene_warnings(task, cut),
            *_image_warnings(task, readings.shown),
            *_range_warnings(data, measurements, schedule.shown),
            *_filled_warnings(scene, schedule.starts[schedule.shown], task.duration, placed),
        ),
        missing=(*missing, *_unread(data)),
        failed=task.failed,
    )


def schedule_of(
    scene: Scene, surfaces: Mapping[str, Surface], camera: Camera, plan: Plan, tell: Progress
) -> Schedule:
    """Return the exposures, places and draws of an analysis."""
    return _schedule(_Task(scene, surfaces, camera, plan, tell, CASES))[0]


def _schedule(task: _Task) -> tuple[Schedule, Cut | None, tuple[str, ...]]:
    """Return the schedule, the cut if the scene shows one, and the missing parts if not."""
    cut, missing = _find_cut(task)
    return _scene_schedule(task) if cut is None else _cut_schedule(task, cut), cut, missing


def _find_cut(task: _Task) -> tuple[Cut | None, tuple[str, ...]]:
    """Return the cut; None and the reasons if the scene shows none or none is wanted."""
    plan, scene = task.plan, task.scene
    if plan.all_places or not plan.cut:
        return None, ()
    if missing := tuple(lacking(scene)):
        return None, missing
    for name in (plan.rake_chip, plan.band_chip):
        if name not in task.surfaces:
            raise ValueError(f"plan: surface {name!r} is not one of {list(task.surfaces)}")
    try:
        return find_cut(scene, task.duration, plan.exposures, task.tell), ()
    except (NoShearBandError, NoContactError) as error:
        return None, (f"Rake face and shear band are not analysed: {error}.",)


def _cut_schedule(task: _Task, cut: Cut) -> Schedule:
    """Return all instants; the segments are drawn, at the rake face and in the shear band."""
    plan = task.plan
    used: tuple[tuple[str, list[list[Place]]], ...] = (
        (
            plan.rake_chip,
            [[RakePlace("rake face", s.tool, s.contact_length)] for s in cut.segments],
        ),
        (plan.band_chip, [[BandPlace("shear band", s.band)] for s in cut.segments]),
    )
    textures = max(_textures(task, name) for name, _ in used)
    shape = len(cut.segments), textures, plan.phases**2, len(used)
    numbers = np.arange(np.prod(shape)).reshape(shape)
    starts = [instant.start for instant in cut.instants]
    return Schedule(
        starts=np.array(starts),
        drawn=tuple(starts.index(segment.start) for segment in cut.segments),
        shown=cut.developed,
        views=tuple(
            SurfacePlaces(name, places, numbers[..., i], _undrawn(task, name))
            for i, (name, places) in enumerate(used)
        ),
        phases=plan.phases,
        reference=plan.reference,
        effects=task.effects,
        vary=[
            partial(replace, psf=GaussianPSF(width), psf_order=order)
            for order in PSF_ORDERS
            for width in plan.psf_widths
        ],
        headlines=HEADLINES,
        cause="segment",
    )


def _scene_schedule(task: _Task) -> Schedule:
    """Return exposures spread over the scene, all drawn; the hottest one is shown."""
    plan, scene, duration = task.plan, task.scene, task.duration
    starts = spread_starts(scene, duration, plan.exposures)
    frames = [scene.frame_at(start + duration / 2) for start in starts]
    shown = int(np.argmax([float(scene.field("temperature", i).max()) for i in frames]))
    for place in plan.all_places:
        place.check_within(task.camera.pixels(scene.raster))
    places, views, first = tuple(_places(task, frames[shown])), [], 0
    for name in task.surfaces:
        shape = _textures(task, name), plan.phases**2
        numbers = first + np.arange(np.prod(shape)).reshape(shape)
        numbered = np.stack([numbers] * len(starts))
        views.append(SurfacePlaces(name, [places] * len(starts), numbered, _undrawn(task, name)))
        first += numbers.size
    return Schedule(
        starts=starts,
        drawn=tuple(range(len(starts))),
        shown=shown,
        views=tuple(views),
        phases=plan.phases,
        reference=plan.reference,
        effects=task.effects,
    )


def _textures(task: _Task, name: str) -> int:
    """Return how many textures of a surface are drawn: one if none is random."""
    return task.plan.textures if _is_random(task, name) else 1


def _is_random(task: _Task, name: str) -> bool:
    surface = task.surfaces[name]
    return surface.redrawn(1) is not surface


def _undrawn(task: _Task, name: str) -> tuple[str, ...]:
    """Return the causes of scatter of which the plan has a single value."""
    single = {
        "texture": _is_random(task, name) and task.plan.textures == 1,
        PIXEL_PHASE: task.plan.phases == 1,
    }
    return tuple(cause for cause, holds in single.items() if holds)


def _places(task: _Task, middle: int) -> Iterator[Place]:
    """Yield the hottest pixel, the rake face if material touches it, then the user's places."""
    plan, scene = task.plan, task.scene
    yield HottestPlace()
    if scene.tool is not None and not plan.all_places:
        workpiece = scene.field("material", middle) == Material.WORKPIECE
        contact = contact_length(scene.raster, workpiece, scene.tool, TOUCHING)
        if contact > 0:
            yield RakePlace("rake face", scene.tool, contact)
    yield from plan.all_places


def _completed(task: _Task, cut: Cut, measurements: Mapping[str, Measurement], shown: int) -> Cut:
    """Return the cut with chip, forces, heated objects and correction; each of them may fail."""
    task.tell("chip", 0.0)
    chip = task.attempt("chip metrics", lambda: chip_metrics(task.scene))
    task.tell("chip", 1.0)
    spacing = chip.chip_spacing if chip and isfinite(chip.chip_spacing) else _USUAL_SPACING
    textures, tool = task.plan.textures, cut.segments[0].tool
    heated = task.attempt(
        "heated chips and tool",
        lambda: heated_objects(task.camera, task.surfaces, tool, cut.band_width, spacing, textures),
    )
    forces = task.attempt("forces", lambda: cutting_forces(task.scene))
    cut = replace(cut, chip=chip, forces=forces, heated=heated or (), overview=task.scene.overview)
    frames = {name: Measurement(one.data.isel(time=[shown])) for name, one in measurements.items()}
    corrected = task.attempt("correction", lambda: _corrected_beside_edge(task, cut, frames))
    return replace(cut, corrected=corrected or ())


def _corrected_beside_edge(
    task: _Task, cut: Cut, frames: Mapping[str, Measurement]
) -> tuple[CorrectedWindow, ...]:
    """Return the corrected parts of the shown exposure; none without a plan or a blur."""
    plan = task.correction
    if plan is None or task.camera.psf is None:
        return ()
    task.tell("correction", 0.0)
    read = {RAKE_FACE: task.plan.rake_chip, SHEAR_BAND: task.plan.band_chip}
    windows = corrected_windows(
        task.scene, task.camera, task.surfaces, frames, cut.segments[0], plan, read, cut.heated
    )
    corrected = tuple(windows)
    task.tell("correction", 1.0)
    return corrected


def _scene_variables(
    task: _Task,
    frame: Frame,
    fields: Mapping[str, EmissivityField],
    exposures: Mapping[str, Exposure],
) -> Variables:
    """Return the scene at the shown exposure, its emissivity and radiance temperature."""
    raster, temperature = task.scene.raster, task.camera.band.temperature
    radiant = [temperature(exposure.centre_radiance) for exposure in exposures.values()]
    known = {name: getattr(frame, name) for name in _SHOWN_FIELDS}
    over = "surface", "y", "x"
    return {
        "y": ("y", raster.y, {"units": "m"}),
        "x": ("x", raster.x, {"units": "m"}),
        **{
            name: (over[1:], values, {"units": FIELD_UNITS[name]})
            for name, values in known.items()
            if values is not None
        },
        "emissivity": (
            over,
            np.stack([laid.emissivity(frame) for laid in fields.values()]),
            {"units": "1"},
        ),
        "scene_radiance_temperature": (over, np.stack(radiant).astype(np.float32), _KELVIN),
    }


def _image_variables(measurements: Mapping[str, Measurement], shown: int) -> Variables:
    every, per_pixel = list(measurements.values()), ("pixel_y", "pixel_x")
    over = "surface", "instant", *per_pixel
    return {
        "radiance_temperature": (over, [one.radiance_temperature() for one in every], _KELVIN),
        "flags": (over, [one.flags for one in every], {"units": "1"}),
        # A detector may flag more than the pixels below the limit.
        "flagged": (
            ("surface", *per_pixel),
            np.stack([~one.usable[shown] for one in every]),
            {"units": "1"},
        ),
    }


def _corrected(camera: Camera, data: xr.Dataset) -> Variables:
    """Return the emissivity to set in the camera, and the temperatures that it then shows.

    It is the median of the surface's emissivity in the upper half of the range of temperatures.
    """
    emissivity, temperature = data.emissivity.values, data.temperature.values
    hot = temperature >= (np.nanmin(temperature) + np.nanmax(temperature)) / 2
    assumed = np.nanmedian(np.where(hot, emissivity, np.nan), axis=(1, 2))
    surfaces = data.surface.values.tolist()
    number = [surfaces.index(name) for name in data.seen_surface.values]
    set_to = assumed[number][:, None, None, None]
    band = camera.band
    reflected = surroundings_radiance(band, camera.reflected)
    measured = data.measured.values[..., 0]
    light = blackbody_radiance(band.radiance(np.nan_to_num(measured)), set_to, reflected)
    shown = np.where(
        np.isfinite(measured), band.temperature(np.maximum(light, _LEAST_LIGHT)), np.nan
    )
    return {
        "set_emissivity": ("surface", assumed, {"units": "1"}),
        "corrected": (data.reference.dims, shown, _KELVIN),
    }


def _outside(
    schedule: Schedule, data: xr.Dataset, measurements: Mapping[str, Measurement]
) -> Variables:
    """Return the fractions of each reading's place outside the range, means over the exposures."""
    fractions = np.full((2, data.sizes["reading"]), np.nan)
    for view in schedule.views:
        one = measurements[view.surface]
        measured = one.radiance_temperature(flagged=True)
        references = data.reference_temperature.sel(surface=view.surface).values
        images = np.where(np.isnan(references), np.nan, measured)
        for number, place in enumerate(view.places[0]):
            every = [
                fractions_outside(places[number], one.flags[instant], images[instant], one.raster)
                for instant, places in zip(schedule.drawn, view.places, strict=True)
            ]
            rows = rows_of(data, view.surface, place)
            fractions[:, rows] = np.mean(every, axis=0)[:, None]
    below, saturated = fractions
    return {
        "below_range": ("reading", below, {"units": "1"}),
        "saturated": ("reading", saturated, {"units": "1"}),
    }


def _attribution(task: _Task, schedule: Schedule, data: xr.Dataset) -> Variables:
    """Return the contributions of the effects in the shown exposure, and at the readings."""
    plan, shown = task.attribution, schedule.shown
    if plan is None:
        return {}
    every = []
    how = plan.effects, plan.reference, plan.permutations
    for number, surface in enumerate(task.surfaces.values()):
        task.tell("attribution", number / len(task.surfaces))
        camera, start = task.camera.redrawn(number), float(schedule.starts[shown])
        every.append(attribute(task.scene, camera, surface, start, *how))
    task.tell("attribution", 1.0)
    joined = xr.concat(every, "surface", join="outer").rename(y="pixel_y", x="pixel_x")
    variables: Variables = {
        f"attribution_{name}": (one.dims, one.values, one.attrs)
        for name, one in joined.data_vars.items()
    }
    variables["effect"] = "effect", joined.effect.values
    attributions = dict(zip(task.surfaces, every, strict=True))
    return variables | _attribution_at_places(task, schedule, data, attributions)


def _attribution_at_places(
    task: _Task, schedule: Schedule, data: xr.Dataset, attributions: Mapping[str, xr.Dataset]
) -> Variables:
    """Return the contributions of the effects at the readings and along the lines."""
    effects = next(iter(attributions.values())).sizes["effect"]
    at_readings = np.full((data.sizes["reading"], effects + 1), np.nan)
    lines = data.line.values.tolist() if "line" in data.dims else []
    along = np.full((len(lines), effects, data.sizes.get("point", 0)), np.nan)
    exposure, pixels = schedule.drawn.index(schedule.shown), task.camera.pixels(task.scene.raster)
    for number, view in enumerate(schedule.views):
        seen = data.sel(surface=view.surface)
        reference = seen.reference_temperature.values[schedule.shown]
        images = reference, seen.image_measured.values[0]
        for place in view.places[exposure]:
            values, parts_of_lines = read_attribution(
                attributions[view.surface], place, images, pixels
            )
            at_readings[rows_of(data, view.surface, place)] = values
            for name, parts in parts_of_lines.items():
                along[lines.index(schedule.named(number, name)), :, : parts.shape[1]] = parts
    variables: Variables = {
        "attribution_reading": (("reading", "effect"), at_readings[:, :-1], _KELVIN),
        "attribution_reading_gain": ("reading", at_readings[:, -1], _KELVIN),
    }
    if lines:
        variables["attribution_line"] = ("line", "effect", "point"), along, _KELVIN
    return variables


def _cut_variables(task: _Task, cut: Cut, measurements: Mapping[str, Measurement]) -> Variables:
    """Return the ridge, the histories of the cut, and the point spread functions that vary."""
    return {
        **_ridge_variables(cut, measurements),
        **_history_variables(cut),
        "psf_order": ("psf_order", list(PSF_ORDERS)),
        "psf_width": ("psf_width", np.asarray(task.plan.psf_widths), {"units": "m"}),
    }


def _attributes(task: _Task, schedule: Schedule, cut: Cut | None) -> dict[str, Any]:
    plan, tool = task.plan, task.scene.tool
    attributes: dict[str, Any] = {
        "shown_instant": schedule.shown,
        "error_reference": plan.reference,
        **({"attribution_reference": task.attribution.reference} if task.attribution else {}),
        **(tool_attributes(tool) if tool else {}),
    }
    if cut is not None:
        attributes |= {"rake_surface": plan.rake_chip, "band_surface": plan.band_chip}
    return attributes


def _ridge_variables(cut: Cut, measurements: Mapping[str, Measurement]) -> Variables:
    """Return the shear band's ridge in every instant, and what is measured along it."""
    bands = [instant.band for instant in cut.instants]
    length = max(band.ridge.distance.size for band in bands if band is not None)

    def along(read: Callable[[int, ShearBand], Array]) -> Array:
        """Values along the ridges, NaN beyond their ends."""
        values = np.full((len(bands), length), np.nan)
        for i, band in enumerate(bands):
            if band is not None:
                row = read(i, band)
                values[i, : row.size] = row
        return values

    over = "instant", "ridge_point"
    curves = []
    for one in measurements.values():
        # Pixels below the lower limit included.
        frames, pixels = one.band.temperature(one.radiance), one.raster
        curves.append(along(lambda i, band: sample(frames[i], pixels, band.ridge.points)))  # noqa: B023
    temperatures = [instant.temperatures for instant in cut.instants]
    return {
        "ridge_distance": (over, along(lambda i, band: band.ridge.distance), {"units": "m"}),
        "ridge_x": (over, along(lambda i, band: band.ridge.points[:, 0]), {"units": "m"}),
        "ridge_y": (over, along(lambda i, band: band.ridge.points[:, 1]), {"units": "m"}),
        "ridge_strain_rate": (over, along(lambda i, band: band.rate), {"units": "1/s"}),
        "ridge_width": (over, along(lambda i, band: band.widths), {"units": "m"}),
        "ridge_temperature": (over, along(lambda i, band: temperatures[i]), _KELVIN),
        "ridge_radiance_temperature": (("surface", *over), np.stack(curves), _KELVIN),
    }


def _history_variables(cut: Cut) -> Variables:
    variables: Variables = {}
    if cut.forces:
        history = cut.forces.history
        variables |= {
            "force_time": ("force_time", history.time, {"units": "s"}),
            "cutting_force": ("force_time", history.cutting, {"units": "N/m"}),
            "thrust_force": ("force_time", history.thrust, {"units": "N/m"}),
        }
    if cut.chip:
        scan = cut.chip.scan
        thickness = scan.thickness, {"units": "m", "height": scan.height}
        variables |= {
            "chip_time": ("chip_time", scan.time, {"units": "s"}),
            "chip_thickness": ("chip_time", *thickness),
        }
    return variables


def _scene_warnings(task: _Task, cut: Cut | None) -> Iterator[str]:
    """Yield sentences on the scene and on the emissivity of the surfaces."""
    scene, camera = task.scene, task.camera
    if cut is not None:
        yield from resolution_warnings(scene)
    if sparse := sparse_frames(scene, camera.integration_time):
        yield sparse
    origins = [surface.origin for surface in task.surfaces.values()]
    yield from dict.fromkeys(
        text for one in origins for text in one.warnings(camera.band, scene.metal)
    )


def _image_warnings(task: _Task, exposures: Mapping[str, Exposure]) -> Iterator[str]:
    for number, (name, exposure) in enumerate(exposures.items()):
        for warning in task.camera.redrawn(number).form_measurement(exposure).notes.warnings:
            yield f"Image of {name}. {warning}"


def _range_warnings(
    data: xr.Dataset, measurements: Mapping[str, Measurement], shown: int
) -> Iterator[str]:
    """Yield a sentence for each image and place of which the camera shows too little."""
    for name, one in measurements.items():
        flags = one.flags[shown]
        below, saturated = (
            float(np.mean(flags & flag != 0)) for flag in (Flag.UNDER_RANGE, Flag.SATURATED)
        )
        yield from outside_warnings(f"Image of {name}", below, saturated, _DARK_IMAGE)
    columns = (data[key].values for key in ("place", "seen_surface", "below_range", "saturated"))
    for place, surface, below, saturated in dict.fromkeys(zip(*columns, strict=True)):
        yield from outside_warnings(f"{_capitalised(place)} ({surface})", below, saturated)


def _filled_warnings(
    scene: Scene, start: float, duration: float, read: Sequence[tuple[str, Place]]
) -> Iterator[str]:
    """Yield a sentence for each place near samples without their own temperature."""
    if QUALITY not in scene.data:
        return
    first, last = (scene.frame_at(time) for time in (start, start + duration))
    flags = scene.data[QUALITY].isel(time=slice(first, last + 1)).values
    filled = (flags == FILLED).any(axis=0)
    temperature = np.asarray(scene.field("temperature", first), np.float64)
    for place in {place.name: place for _, place in read}.values():
        fraction = place.covered(filled, temperature, scene.raster)
        if fraction > 0:
            yield (
                f"{_capitalised(place.name)}: {100 * fraction:.0f} % of its samples had no "
                "temperature during the shown exposure and were filled from their neighbours."
            )


def _capitalised(text: str) -> str:
    return text[0].upper() + text[1:]


def _unread(data: xr.Dataset) -> Iterator[str]:
    """Yield a sentence for each place without a reading in all draws."""
    read = {(one.place, one.surface) for one in headlines(data).values()}
    for key in dict.fromkeys(zip(data.place.values, data.seen_surface.values, strict=True)):
        if key not in read:
            yield (
                f"{', '.join(key)}: not read: in some draw nothing radiates there, or it lies "
                "outside the pixels."
            )
