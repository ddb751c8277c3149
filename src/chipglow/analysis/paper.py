"""The study of Heigel and Whitenton (2010): what they found, and the same analysis of a scene."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.chip import ChipMetrics, chip_metrics
from chipglow.analysis.error import ErrorImages, ReferenceKind, error_images
from chipglow.analysis.inertia import Inertia, inertia
from chipglow.analysis.lines import nearest, sample
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.ridge import NoShearBandError
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import PSF_ORDERS, Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import ShearBand, find_shear_band
from chipglow.camera import Camera, Exposure, Measurement
from chipglow.camera.exposure import expose, frame_weights
from chipglow.cutting import EnergyHistory
from chipglow.radiometry import Band
from chipglow.scene import ENERGY_UNITS, Frame, Material, Raster, Scene, Tool
from chipglow.surface import EmissivityField, Surface

Progress = Callable[[str, float], None]
"""Told what is being done and which part of it, from 0 to 1, is done."""


@dataclass(frozen=True)
class PaperValue:
    """A figure of the paper: value in SI units (shares of 1), and where it stands."""

    value: float
    where: str


@dataclass(frozen=True)
class PaperValues:
    """The figures of Heigel and Whitenton (2010) that a study can be set beside.

    Errors in K of radiance temperature, shares of 1, the period in s.
    """

    rake_error: PaperValue = PaperValue(-42.0, "abstract; Figure 11a shows about -40")
    rake_psf_share: PaperValue = PaperValue(0.45, "abstract; the conclusion says half")
    band_error: PaperValue = PaperValue(-46.0, "abstract, Figure 11b")
    band_psf_share: PaperValue = PaperValue(0.15, "abstract; -7 of -46 in Figure 11b")
    band_worst: PaperValue = PaperValue(-120.0, "Simulation measurement error, Figure 11b")
    segment_period: PaperValue = PaperValue(90e-6, "Finite element analysis simulation")


PAPER: Final = PaperValues()


@dataclass(frozen=True)
class Plan:
    """What to analyse.

    Parameters
    ----------
    instants : int
        Number of exposures, spread evenly over the scene.
    rake_surface, band_surface : str
        Names of the surfaces whose errors are read at the rake face (the paper: chip 2) and at
        the shear band (the paper: chip 1).
    psf_widths : tuple of float
        Full widths at half maximum of the point spread functions that are compared, in m.
    reference : ReferenceKind
        What the measured temperatures are compared with.
    line_reach, line_step : float
        Reach of the analysis lines to either side and distance between their points in m.
    touching : float
        Distance from the rake face in m within which chip counts as touching it; by default half
        the paper's sensor.

    Raises
    ------
    ValueError
        If a number is not positive, or there are no widths.
    """

    instants: int = 9
    rake_surface: str = "chip 2"
    band_surface: str = "chip 1"
    psf_widths: tuple[float, ...] = field(
        default_factory=lambda: tuple(width * 1e-6 for width in range(4, 21))
    )
    reference: ReferenceKind = "maximum"
    line_reach: float = 60e-6
    line_step: float = 1e-6
    touching: float = 3e-6

    def __post_init__(self) -> None:
        if self.instants < 1:
            raise ValueError(f"plan: instants is {self.instants!r}, expected 1 or more")
        if not self.psf_widths or min(self.psf_widths) <= 0:
            raise ValueError(f"plan: psf_widths is {self.psf_widths!r}, expected lengths over 0 m")
        for name in ("line_reach", "line_step", "touching"):
            if not getattr(self, name) > 0:
                raise ValueError(f"plan: {name} is {getattr(self, name)!r}, expected over 0 m")


@dataclass(frozen=True)
class Instant:
    """The shear band during one exposure.

    Parameters
    ----------
    start : float
        When the exposure begins in s.
    band : ShearBand or None
        Ridge of the strain rate's mean over the exposure; None if there is none.
    temperatures : ndarray
        Mean true temperature over the exposure along the ridge in K, shape (n,); NaN outside the
        scene, empty without a band.
    """

    start: float
    band: ShearBand | None
    temperatures: NDArray[np.float64]

    @property
    def mean_temperature(self) -> float:
        """Mean of the temperatures along the ridge in K; NaN without a band."""
        known = self.temperatures[np.isfinite(self.temperatures)]
        return float(known.mean()) if known.size else nan


@dataclass(frozen=True)
class SurfaceResult:
    """What the camera makes of the scene with one surface.

    Parameters
    ----------
    measurement : Measurement
        One frame for each instant.
    emissivity : ndarray
        In the middle of the developed instant's exposure, on the scene's samples, shape (y, x).
    scene_temperature : ndarray
        Radiance temperature of the scene's samples then in K; NaN where nothing radiates.
    errors : ErrorImages
        At the developed instant.
    rake : RakeErrors
        At the developed instant.
    band : BandErrors
        At the developed instant.
    curves : tuple of ndarray
        Measured radiance temperature along the ridge of every instant in K, whether under the
        camera's floor or not; empty for instants without a band.
    rake_motion, band_motion : float
        Error in K that the motion during the exposure alone makes, without size of source and
        point spread function: in the chip at mid-contact, and at the band's middle.
    """

    measurement: Measurement
    emissivity: NDArray[np.float32]
    scene_temperature: NDArray[np.float64]
    errors: ErrorImages
    rake: RakeErrors
    band: BandErrors
    curves: tuple[NDArray[np.float64], ...]
    rake_motion: float
    band_motion: float


@dataclass(frozen=True)
class ForceHistory:
    """Forces per width of cut in N/m over time in s, each of shape (n,), and their segments.

    `unaccounted` is the share of the drive's work that the cutting simulation's energy account does
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
    tool : Tool
        The tool.
    frame : Frame
        The scene in the middle of the developed instant's exposure.
    instants : tuple of Instant
        The shear band over the scene.
    developed : int
        Number of the instant with the fully developed shear band: that with the greatest mean
        temperature along the ridge.
    momentary_band : ShearBand or None
        The band in `frame` alone, which motion does not blur; None if there is none.
    sweep : float
        How far the band's middle moves across itself during the developed exposure, in m; NaN
        where it is not found in both the first and the last frame.
    surfaces : mapping
        Results by the surfaces' names.
    sensitivity : tuple of Sensitivity
        For either order of blur and sensors.
    forces : ForceHistory or None
        If the scene has them.
    chip : ChipMetrics
        Shape, motion and shear band of the chip over the whole scene.
    """

    plan: Plan
    camera: Camera
    raster: Raster
    tool: Tool
    frame: Frame
    instants: tuple[Instant, ...]
    developed: int
    momentary_band: ShearBand | None
    sweep: float
    surfaces: Mapping[str, SurfaceResult]
    sensitivity: tuple[Sensitivity, ...]
    forces: ForceHistory | None
    chip: ChipMetrics

    @property
    def band(self) -> ShearBand:
        """The fully developed shear band."""
        band = self.instants[self.developed].band
        assert band is not None
        return band

    @property
    def rake(self) -> RakeErrors:
        """Errors at the rake face, with the surface that the plan names for it."""
        return self.surfaces[self.plan.rake_surface].rake

    @property
    def band_errors(self) -> BandErrors:
        """Errors at the shear band, with the surface that the plan names for it."""
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
        What is truly there; it must tell its tool.
    surfaces : mapping
        Surfaces by name, such as chip 1 and chip 2.
    camera : Camera
        The camera.
    plan : Plan
        What to analyse.
    progress : callable, optional
        Told what is being done and how far it is.

    Raises
    ------
    ValueError
        If the plan names a surface that is not there, the scene tells no tool, is shorter than an
        exposure or has no shear band or no contact at the rake face.
    """
    _check(scene, surfaces, plan)
    tell = progress or _say_nothing
    starts = _starts(scene, camera.integration_time, plan.instants)
    instants = _instants(scene, camera, starts, tell)
    means = [instant.mean_temperature for instant in instants]
    if np.isnan(means).all():
        raise NoShearBandError("shear band: none is found in any of the exposures")
    developed = int(np.nanargmax(means))
    moment = _Moment.of(scene, camera, plan, instants[developed])
    results, exposures = {}, {}
    for name, surface in surfaces.items():
        results[name], exposures[name] = _measure_surface(
            scene, surface.on(scene), camera, plan, instants, developed, moment, name, tell
        )
    return StudyResult(
        plan=plan,
        camera=camera,
        raster=scene.raster,
        tool=moment.tool,
        frame=moment.frame,
        instants=instants,
        developed=developed,
        momentary_band=moment.momentary_band,
        sweep=moment.sweep,
        surfaces=results,
        sensitivity=_sensitivities(camera, plan, moment, exposures, tell),
        forces=_forces(scene),
        chip=_chip(scene, tell),
    )


def _check(scene: Scene, surfaces: Mapping[str, Surface], plan: Plan) -> None:
    for name in (plan.rake_surface, plan.band_surface):
        if name not in surfaces:
            raise ValueError(f"plan: surface {name!r} is not one of {list(surfaces)}")
    if scene.tool is None:
        raise ValueError("scene: it does not tell its tool, which the rake face needs")


def _say_nothing(label: str, part: float) -> None:
    pass


def _starts(scene: Scene, duration: float, count: int) -> NDArray[np.float64]:
    """Beginnings of exposures spread over the scene, each at a frame of it."""
    times = scene.times
    last = times[-1] + scene.frame_spacing - duration
    if last < times[0] - 1e-6 * duration:
        raise ValueError(
            f"scene: it lasts {times[-1] + scene.frame_spacing - times[0]:.4g} s, "
            f"expected an exposure's {duration:.4g} s or more"
        )
    wanted = np.linspace(times[0], max(last, times[0]), count) if count > 1 else times[:1]
    nearest_frame = np.searchsorted(times, wanted + 1e-6 * scene.frame_spacing, side="right") - 1
    return np.asarray(np.unique(times[nearest_frame]), dtype=np.float64)


def _instants(
    scene: Scene, camera: Camera, starts: NDArray[np.float64], tell: Progress
) -> tuple[Instant, ...]:
    instants = []
    for i, start in enumerate(starts):
        tell("shear band", i / starts.size)
        instants.append(_instant(scene, camera, float(start)))
    tell("shear band", 1.0)
    return tuple(instants)


def _instant(scene: Scene, camera: Camera, start: float) -> Instant:
    duration = camera.integration_time
    indices, weights = frame_weights(scene.times, scene.frame_spacing, start, duration)
    rate = _mean(scene, "plastic_strain_rate", indices, weights)
    workpiece = scene.data["material"][indices[len(indices) // 2]].values == Material.WORKPIECE
    assert scene.tool is not None
    try:
        band = find_shear_band(scene.raster, rate, workpiece, scene.tool)
    except NoShearBandError:
        return Instant(start, None, np.zeros(0))
    temperature = _mean(scene, "temperature", indices, weights)
    return Instant(start, band, sample(temperature, scene.raster, band.ridge.points))


def _mean(
    scene: Scene, field_name: str, indices: range, weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    total = np.zeros(scene.raster.shape)
    for index, weight in zip(indices, weights, strict=True):
        total += weight * scene.data[field_name][index].values
    return total


@dataclass(frozen=True)
class _Moment:
    """The scene at the developed instant, and where its errors are read."""

    frame: Frame
    tool: Tool
    band: ShearBand
    contact: float
    momentary_band: ShearBand | None
    sweep: float

    @classmethod
    def of(cls, scene: Scene, camera: Camera, plan: Plan, instant: Instant) -> "_Moment":
        assert scene.tool is not None and instant.band is not None
        duration = camera.integration_time
        indices, _ = frame_weights(scene.times, scene.frame_spacing, instant.start, duration)
        frame = scene.frame(indices[len(indices) // 2])
        workpiece = frame.material == Material.WORKPIECE
        return cls(
            frame=frame,
            tool=scene.tool,
            band=instant.band,
            contact=contact_length(scene.raster, workpiece, scene.tool, plan.touching),
            momentary_band=_momentary_band(scene.raster, frame, scene.tool),
            sweep=_sweep(scene, indices, instant.band),
        )


def _momentary_band(raster: Raster, frame: Frame, tool: Tool) -> ShearBand | None:
    workpiece = frame.material == Material.WORKPIECE
    try:
        return find_shear_band(raster, frame.plastic_strain_rate, workpiece, tool)
    except NoShearBandError:
        return None


def _sweep(scene: Scene, indices: range, band: ShearBand) -> float:
    """Travel of the greatest strain rate on the line across the band's middle."""
    line = band.across(40e-6, scene.raster.spacing / 2)
    places = []
    for index in (indices[0], indices[-1]):
        rate = scene.data["plastic_strain_rate"][index].values
        values = np.nan_to_num(sample(rate, scene.raster, line.points))
        inside = 0 < values.argmax() < values.size - 1
        places.append(float(line.distance[values.argmax()]) if inside else nan)
    return abs(places[1] - places[0])


def _measure_surface(
    scene: Scene,
    emissivity: EmissivityField,
    camera: Camera,
    plan: Plan,
    instants: tuple[Instant, ...],
    developed: int,
    moment: _Moment,
    name: str,
    tell: Progress,
) -> tuple[SurfaceResult, Exposure]:
    kept: list[Exposure] = []

    def exposures() -> Iterator[Exposure]:
        for i, instant in enumerate(instants):
            tell(f"camera, {name}", i / len(instants))
            exposure = _expose(scene, emissivity, camera, instant.start)
            if i == developed:
                kept.append(exposure)
            yield exposure

    measurement = camera.develop(exposures())
    tell(f"camera, {name}", 1.0)
    exposure = kept[0]
    errors = error_images(camera, exposure, plan.reference)
    reach, step = plan.line_reach, plan.line_step
    in_chip = moment.tool.rake_point(moment.contact / 2)
    in_chip = in_chip + 1.5 * scene.raster.spacing * np.array(moment.tool.rake_normal)
    middle = moment.band.ridge.points[moment.band.middle]
    result = SurfaceResult(
        measurement=measurement,
        emissivity=emissivity.emissivity(moment.frame),
        scene_temperature=np.asarray(camera.band.temperature(exposure.centre_radiance)),
        errors=errors,
        rake=rake_errors(errors, moment.contact, moment.tool, reach, step),
        band=band_errors(errors, moment.band, reach, step),
        curves=_curves(camera.band, measurement, instants),
        rake_motion=_motion_error(camera.band, exposure, in_chip),
        band_motion=_motion_error(camera.band, exposure, middle),
    )
    return result, exposure


def _expose(scene: Scene, emissivity: EmissivityField, camera: Camera, start: float) -> Exposure:
    duration = camera.integration_time
    return expose(scene, emissivity, camera.band, start, duration, camera.reflected)


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


def _motion_error(band: Band, exposure: Exposure, point: NDArray[np.float64]) -> float:
    """Mean over the exposure less its peak, as radiance temperatures, at one sample."""
    mean = nearest(exposure.mean_radiance, exposure.raster, point)
    peak = nearest(exposure.peak_radiance, exposure.raster, point)
    return float(band.temperature(mean)) - float(band.temperature(peak))


def _sensitivities(
    camera: Camera,
    plan: Plan,
    moment: _Moment,
    exposures: Mapping[str, Exposure],
    tell: Progress,
) -> tuple[Sensitivity, ...]:
    setting = Setting(
        rake_exposure=exposures[plan.rake_surface],
        band_exposure=exposures[plan.band_surface],
        contact_length=moment.contact,
        tool=moment.tool,
        band=moment.band,
        half_length=plan.line_reach,
        step=plan.line_step,
        reference=plan.reference,
    )
    results = []
    for i, order in enumerate(PSF_ORDERS):
        tell("width of the point spread function", i / len(PSF_ORDERS))
        results.append(sensitivity(camera, setting, plan.psf_widths, order))
    tell("width of the point spread function", 1.0)
    return tuple(results)


def _chip(scene: Scene, tell: Progress) -> ChipMetrics:
    tell("chip", 0.0)
    chip = chip_metrics(scene)
    tell("chip", 1.0)
    return chip


def _forces(scene: Scene) -> ForceHistory | None:
    if "cutting_force" not in scene.data:
        return None
    time, cutting, thrust = (
        np.asarray(scene.data[name].values, dtype=np.float64)
        for name in ("force_time", "cutting_force", "thrust_force")
    )
    segments = segmentation(time, cutting, thrust)
    inert = inertia(scene)
    assert inert is not None
    return ForceHistory(time, cutting, thrust, segments, _unaccounted(scene), inert)


def _unaccounted(scene: Scene) -> float:
    """Share of the drive's work that the energy account does not find again, at the end."""
    if "drive_work" not in scene.data:
        return nan
    account = {name: np.asarray(scene.data[name].values, dtype=np.float64) for name in ENERGY_UNITS}
    return float(EnergyHistory(**account).closing_error[-1])
