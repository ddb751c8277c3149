"""The error of a camera that looks at a cut: at the rake face, at the shear band, and its parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.band_error import BandErrors
from chipglow.analysis.draws import Draws, Site, draw_errors
from chipglow.analysis.error_images import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.rake_error import RakeErrors
from chipglow.analysis.sensitivity import Sensitivity, sensitivity
from chipglow.analysis.starts import other_starts, spread_starts
from chipglow.camera import Camera, Exposure, Measurement
from chipglow.cutting import EnergyHistory
from chipglow.laboratory.chip import (
    ChipMetrics,
    Inertia,
    Instant,
    NoContactError,
    NoShearBandError,
    RakeGrid,
    Segment,
    Segmentation,
    ShearBand,
    chip_metrics,
    inertia,
    rake_grid,
    resolution_warnings,
    segmentation,
)
from chipglow.laboratory.emissivity import HeatedObject
from chipglow.laboratory.emissivity.heated import heated_objects
from chipglow.radiometry import Band
from chipglow.scene import ENERGY_UNITS, Frame, Raster, Scene, Tool, sample
from chipglow.surface import Surface

_USUAL_SPACING: Final = 180e-6
"""Distance of shear bands along a chip in m, where the forces show no period."""

_DEVELOPED: Final = 0.95
"""Rise of a developed band's mean temperature, as a part of the greatest."""

_AROUND: Final = 2
"""Instants from the developed band to the one that still develops, and to the one that moved."""

Progress = Callable[[str, float], None]
"""Called with what is being done and which part of it, from 0 to 1, is done."""


@dataclass(frozen=True)
class Plan:
    """What to analyse.

    Parameters
    ----------
    exposures : int
        Number of exposures, spread evenly over the scene's longest part without a gap.
    phases, textures : int
        How often each headline is drawn anew: positions of the pixels along each axis (3 makes 9),
        and textures of the emissivity. Segments are drawn as many as the scene has parts.
    rake_surface, band_surface : str
        Names of the surfaces whose errors are read at the rake face (the paper: chip 2) and at
        the shear band (the paper: chip 1).
    psf_widths : tuple of float
        Full widths at half maximum of the point spread functions that are compared, in m.
    reference : ReferenceKind
        What the measured temperatures are compared with.
    study : object, optional
        What it is the plan of, such as a `chipglow.study.Study`: for who reports the result.
    line_reach, line_step : float
        Reach of the analysis lines to either side and distance between their points in m.
    touching : float
        Distance from the rake face in m within which chip counts as touching it; by default half
        the paper's pixel.

    Raises
    ------
    ValueError
        If a number is not positive, or there are no widths.
    """

    exposures: int = 9
    phases: int = 3
    textures: int = 5
    rake_surface: str = "chip 2"
    band_surface: str = "chip 1"
    psf_widths: tuple[float, ...] = field(
        default_factory=lambda: tuple(width * 1e-6 for width in range(4, 21))
    )
    reference: ReferenceKind = "maximum"
    study: object = None
    line_reach: float = 60e-6
    line_step: float = 1e-6
    touching: float = 3e-6

    def __post_init__(self) -> None:
        for name in ("exposures", "phases", "textures"):
            if getattr(self, name) < 1:
                raise ValueError(f"plan: {name} is {getattr(self, name)!r}, expected 1 or more")
        if not self.psf_widths or min(self.psf_widths) <= 0:
            raise ValueError(f"plan: psf_widths is {self.psf_widths!r}, expected lengths over 0 m")
        for name in ("line_reach", "line_step", "touching"):
            if not getattr(self, name) > 0:
                raise ValueError(f"plan: {name} is {getattr(self, name)!r}, expected over 0 m")


@dataclass(frozen=True)
class SurfaceResult:
    """What the camera makes of the scene with one surface.

    Parameters
    ----------
    measurement : Measurement
        One frame for each instant.
    rake_grid : RakeGrid or None
        Squares along the rake face in all frames; None if none is usable in any.
    emissivity : ndarray
        In the middle of the developed instant's exposure, on the scene's samples, shape (y, x).
    scene_temperature : ndarray
        Radiance temperature of the scene's samples then in K; NaN where nothing radiates.
    references : ndarray
        What the pixels of every instant are compared with in K, shape (instant, y, x); NaN where
        nothing radiates.
    errors : ErrorImages
        At the developed instant.
    rake : RakeErrors
        At the developed instant.
    band : BandErrors
        At the developed instant.
    warnings : tuple of str
        What to know of the image of the developed instant, a sentence each.
    curves : tuple of ndarray
        Measured radiance temperature along the ridge of every instant in K, whether under the
        camera's lower range limit or not; empty for instants without a band.
    """

    measurement: Measurement
    rake_grid: RakeGrid | None
    emissivity: NDArray[np.float32]
    scene_temperature: NDArray[np.float64]
    references: NDArray[np.float64]
    errors: ErrorImages
    rake: RakeErrors
    band: BandErrors
    warnings: tuple[str, ...]
    curves: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class CuttingForces:
    """Forces per width of cut in N/m over time in s, each of shape (n,), and their segments.

    `unaccounted` is the part of the drive's work that the cutting simulation's energy balance does
    not find again in the end; NaN where the scene has no account.
    """

    time: NDArray[np.float64]
    cutting: NDArray[np.float64]
    thrust: NDArray[np.float64]
    segmentation: Segmentation
    unaccounted: float
    inertia: Inertia


@dataclass(frozen=True)
class StudyResult:
    """Everything that a report of the study shows.

    Parameters
    ----------
    plan : Plan
        What was analysed.
    camera : Camera
        The camera.
    raster : Raster
        The scene's samples.
    instants : tuple of Instant
        The shear band over the scene's longest part without a gap, then in each other part.
    other_parts : int
        How many other parts there are.
    developed : int
        Number of the instant with the fully developed shear band: the first of the longest part
        in which the rise of the mean temperature along the ridge is within 5 % of its greatest.
    moments : tuple of Frame
        The scene in the middle of the instants before, with and after the developed band.
    segments : tuple of Segment
        Segments with a developed band: that of the developed instant, then one for each other part
        of the scene.
    surfaces : mapping
        By the surfaces' names: the paper's procedure, which is one draw.
    draws : Draws
        The headline errors over segments, textures and positions of the pixels.
    sensitivity : tuple of Sensitivity
        For either order of blur and pixels.
    heated : tuple of HeatedObject
        Heated chips and tool, and the emissivity that their images give back.
    forces : CuttingForces or None
        If the scene has them.
    chip : ChipMetrics
        Shape, motion and shear band of the chip over the scene's longest part without a gap.
    warnings : tuple of str
        What the grid of the cutting simulation does not resolve.
    """

    plan: Plan
    camera: Camera
    raster: Raster
    instants: tuple[Instant, ...]
    other_parts: int
    developed: int
    moments: tuple[Frame, ...]
    segments: tuple[Segment, ...]
    surfaces: Mapping[str, SurfaceResult]
    draws: Draws
    sensitivity: tuple[Sensitivity, ...]
    heated: tuple[HeatedObject, ...]
    forces: CuttingForces | None
    chip: ChipMetrics
    warnings: tuple[str, ...]

    @property
    def one_segment(self) -> tuple[Instant, ...]:
        """The instants of the scene's longest part: how one band develops."""
        return self.instants[: len(self.instants) - self.other_parts]

    @property
    def segment(self) -> Segment:
        """The segment of the paper's procedure."""
        return self.segments[0]

    @property
    def tool(self) -> Tool:
        """The tool."""
        return self.segment.tool

    @property
    def frame(self) -> Frame:
        """The scene in the middle of the developed instant's exposure."""
        return self.segment.frame

    @property
    def band(self) -> ShearBand:
        """The fully developed shear band."""
        return self.segment.band

    @property
    def rake(self) -> RakeErrors:
        """Errors at the rake face in one draw, with the surface that the plan names for it."""
        return self.surfaces[self.plan.rake_surface].rake

    @property
    def band_errors(self) -> BandErrors:
        """Errors at the shear band in one draw, with the surface that the plan names for it."""
        return self.surfaces[self.plan.band_surface].band


def analyse(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: Plan,
    progress: Progress | None = None,
) -> StudyResult:
    """Measure a scene and analyse the errors as the paper does.

    Parameters
    ----------
    scene : Scene
        What is truly there; it must state its tool.
    surfaces : mapping
        Surfaces by name, such as chip 1 and chip 2.
    camera : Camera
        The camera.
    plan : Plan
        What to analyse.
    progress : callable, optional
        Called with what is being done and how far it is.

    Raises
    ------
    ValueError
        If the plan names a surface that is not there, the scene states no tool, is shorter than an
        exposure or has no shear band or no contact at the rake face.
    """
    _check(scene, surfaces, plan)
    tell = progress or _say_nothing
    duration = camera.frame_duration(scene.raster)
    instants, others, developed = _band_over_time(scene, duration, plan, tell)
    in_longest = instants[: len(instants) - others]
    segments = _segments(scene, duration, plan, instants, others, developed)
    results = _measure(scene, surfaces, camera, plan, instants, developed, segments[0], tell)
    sites = _sites(scene, surfaces, camera, plan, segments, tell)
    chip = _chip(scene, tell)
    band_width = float(np.nanmean([segment.band_width for segment in segments]))
    return StudyResult(
        plan=plan,
        camera=camera,
        raster=scene.raster,
        instants=instants,
        other_parts=others,
        developed=developed,
        moments=_moments(scene, duration, in_longest, developed),
        segments=segments,
        surfaces=results,
        draws=draw_errors(camera, sites, plan.phases, lambda part: tell("draws", part)),
        sensitivity=sensitivity(
            camera,
            [textures[0] for textures in sites],
            plan.psf_widths,
            plan.phases,
            lambda part: tell("width of the point spread function", part),
        ),
        heated=heated_objects(
            camera,
            surfaces,
            segments[0].tool,
            band_width,
            chip.chip_spacing if isfinite(chip.chip_spacing) else _USUAL_SPACING,
            plan.textures,
        ),
        forces=_forces(scene),
        chip=chip,
        warnings=resolution_warnings(scene, band_width),
    )


def find_segments(
    scene: Scene, duration: float, plan: Plan, progress: Progress | None = None
) -> tuple[Segment, ...]:
    """Segments of a cut's chip with a developed shear band: one for each part of the scene.

    Parameters
    ----------
    scene : Scene
        What is truly there; it must state its tool.
    duration : float
        How long an exposure lasts in s.
    plan : Plan
        How many exposures are looked at, and what counts as touching the tool.
    progress : callable, optional
        Called with what is being done and how far it is.

    Raises
    ------
    ValueError
        If the scene is shorter than an exposure or has no shear band or no contact at the rake
        face.
    """
    tell = progress or _say_nothing
    instants, others, developed = _band_over_time(scene, duration, plan, tell)
    return _segments(scene, duration, plan, instants, others, developed)


def _check(scene: Scene, surfaces: Mapping[str, Surface], plan: Plan) -> None:
    for name in (plan.rake_surface, plan.band_surface):
        if name not in surfaces:
            raise ValueError(f"plan: surface {name!r} is not one of {list(surfaces)}")
    if scene.tool is None:
        raise ValueError("scene: it does not state its tool, which the rake face needs")


def _say_nothing(label: str, part: float) -> None:
    pass


def _band_over_time(
    scene: Scene, duration: float, plan: Plan, tell: Progress
) -> tuple[tuple[Instant, ...], int, int]:
    """Instants of the longest part and of the others, how many these are, the developed one."""
    starts = spread_starts(scene, duration, plan.exposures)
    others = other_starts(scene, duration)
    instants = _instants(scene, duration, (*starts, *others), tell)
    return instants, len(others), _developed(scene, instants[: len(starts)])


def _instants(
    scene: Scene, duration: float, starts: Sequence[float], tell: Progress
) -> tuple[Instant, ...]:
    instants = []
    for i, start in enumerate(starts):
        tell("shear band", i / len(starts))
        instants.append(Instant.at(scene, float(start), duration))
    tell("shear band", 1.0)
    return tuple(instants)


def _developed(scene: Scene, instants: Sequence[Instant]) -> int:
    """Number of the first instant whose band has come near the greatest rise of its temperature.

    From then on the band's temperature hardly changes, but the chip carries it away from the edge:
    the paper takes bands that are "fully developed but not moved".
    """
    means = np.array([instant.mean_temperature for instant in instants])
    if np.isnan(means).all():
        raise NoShearBandError("shear band: none is found in any of the exposures")
    rise = means - float(scene.field("temperature", scene.longest_block[0]).min())
    return int(np.argmax(np.nan_to_num(rise) >= _DEVELOPED * np.nanmax(rise)))


def _moments(
    scene: Scene, duration: float, instants: Sequence[Instant], developed: int
) -> tuple[Frame, ...]:
    """Frames in the middle of instants: the band develops, is developed, has moved on."""
    around = (developed - _AROUND, developed, developed + _AROUND)
    chosen = sorted({min(max(number, 0), len(instants) - 1) for number in around})
    middles = [instants[i].start + duration / 2 for i in chosen]
    numbers = np.searchsorted(scene.times, np.array(middles) + 1e-6 * scene.frame_spacing) - 1
    return tuple(scene.frame(max(int(number), 0)) for number in numbers)


def _segments(
    scene: Scene,
    duration: float,
    plan: Plan,
    instants: Sequence[Instant],
    others: int,
    developed: int,
) -> tuple[Segment, ...]:
    """The developed segment, then those of the scene's other parts that have band and contact."""
    first, *later = [
        Segment.of(scene, instant, duration, plan.touching)
        for instant in (instants[developed], *instants[len(instants) - others :])
        if instant.band is not None
    ]
    if not first.contact_length > 0:
        raise NoContactError("rake face: the chip does not touch it in the developed instant")
    return (first, *(segment for segment in later if segment.contact_length > 0))


def _measure(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: Plan,
    instants: tuple[Instant, ...],
    developed: int,
    segment: Segment,
    tell: Progress,
) -> dict[str, SurfaceResult]:
    """What the camera makes of every instant, with every surface: the paper's procedure."""
    fields = [camera.lay(surface, scene) for surface in surfaces.values()]
    frames: list[list[Exposure]] = []
    images: list[list[NDArray[np.float64]]] = [[] for _ in fields]
    references: list[list[NDArray[np.float64]]] = [[] for _ in fields]
    for i, instant in enumerate(instants):
        tell("camera", i / len(instants))
        exposures = camera.expose_fields(scene, fields, instant.start)
        for image, reference, exposure in zip(images, references, exposures, strict=True):
            image.append(camera.form_image(exposure.mean_radiance, exposure.raster))
            reference.append(reference_temperature(camera, exposure, plan.reference))
        if i == developed:
            frames.append(list(exposures))
    tell("camera", 1.0)
    starts = np.array([instant.start for instant in instants])
    results = {}
    for number, (name, on_scene, exposure, image, reference) in enumerate(
        zip(surfaces, fields, frames[0], images, references, strict=True)
    ):
        looking = camera.redrawn(number)
        measurement = looking.measurement(np.stack(image), starts, scene.raster)
        errors = error_images(looking, exposure, plan.reference)
        site = _site(plan, segment, exposure, exposure)
        results[name] = SurfaceResult(
            measurement=measurement,
            rake_grid=_rake_grid(measurement, segment.tool),
            emissivity=on_scene.emissivity(segment.frame),
            scene_temperature=np.asarray(camera.band.temperature(exposure.centre_radiance)),
            references=np.stack(reference),
            errors=errors,
            rake=site.rake_errors(errors),
            band=site.band_errors(errors),
            warnings=tuple(looking.form_measurement(exposure).notes.warnings),
            curves=_curves(camera.band, measurement, instants),
        )
    return results


def _rake_grid(measurement: Measurement, tool: Tool) -> RakeGrid | None:
    try:
        return rake_grid(measurement, tool)
    except ValueError:  # no square is whole in the image, or all are under its lower limit
        return None


def _sites(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: Plan,
    segments: tuple[Segment, ...],
    tell: Progress,
) -> list[list[Site]]:
    """Exposures of every segment with every texture: each segment's frames are read once."""
    used = [surfaces[name] for name in (plan.rake_surface, plan.band_surface)]
    random = any(surface.redrawn(1) is not surface for surface in used)
    textures = plan.textures if random else 1
    fields = [camera.lay(s.redrawn(k), scene) for k in range(textures) for s in used]
    sites = []
    for i, segment in enumerate(segments):
        tell("segments and textures", i / len(segments))
        exposures = camera.expose_fields(scene, fields, segment.start)
        sites.append(
            [
                _site(plan, segment, rake, band)
                for rake, band in zip(exposures[::2], exposures[1::2], strict=True)
            ]
        )
    tell("segments and textures", 1.0)
    return sites


def _site(plan: Plan, segment: Segment, rake: Exposure, band: Exposure) -> Site:
    return Site(
        rake_exposure=rake,
        band_exposure=band,
        contact_length=segment.contact_length,
        tool=segment.tool,
        band=segment.band,
        half_length=plan.line_reach,
        step=plan.line_step,
        reference=plan.reference,
    )


def _curves(
    band: Band, measurement: Measurement, instants: tuple[Instant, ...]
) -> tuple[NDArray[np.float64], ...]:
    frames = np.asarray(band.temperature(measurement.radiance))
    return tuple(
        sample(frame, measurement.raster, instant.band.ridge.points)
        if instant.band is not None
        else np.zeros(0)
        for frame, instant in zip(frames, instants, strict=True)
    )


def _chip(scene: Scene, tell: Progress) -> ChipMetrics:
    tell("chip", 0.0)
    chip = chip_metrics(scene)
    tell("chip", 1.0)
    return chip


def _forces(scene: Scene) -> CuttingForces | None:
    if "cutting_force" not in scene.data:
        return None
    time, cutting, thrust = (
        np.asarray(scene.data[name].values, dtype=np.float64)
        for name in ("force_time", "cutting_force", "thrust_force")
    )
    segments = segmentation(time, cutting, thrust)
    inert = inertia(scene)
    assert inert is not None
    return CuttingForces(time, cutting, thrust, segments, _unaccounted(scene), inert)


def _unaccounted(scene: Scene) -> float:
    """Fraction of the drive's work that the energy balance does not find again, at the end."""
    if "drive_work" not in scene.data:
        return nan
    account = {name: np.asarray(scene.data[name].values, dtype=np.float64) for name in ENERGY_UNITS}
    return float(EnergyHistory(**account).closing_error[-1])
