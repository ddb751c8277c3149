"""The measurement error of any scene: images, places that the user names, and how they scatter."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis.distribution import Distribution
from chipglow.analysis.draws import pixel_phases
from chipglow.analysis.error_images import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.old_places import HottestPlace, LinePlace, Place, RakePlace, Reading
from chipglow.analysis.starts import spread_starts
from chipglow.camera import Camera, Exposure, Measurement
from chipglow.laboratory.chip import contact_length
from chipglow.scene import Frame, Line, Material, Raster, Scene, Tool
from chipglow.surface import EmissivityField, Surface

Progress = Callable[[str, float], None]
"""Called with what is being done and which part of it, from 0 to 1, is done."""

CAUSES = ("exposure", "texture", "pixel phase")
"""What is drawn anew: the axes of every `Distribution`."""


@dataclass(frozen=True)
class ScenePlan:
    """What to analyse of a scene.

    Parameters
    ----------
    places : tuple of Place
        Where the error is read, beside the hottest pixel and the rake face.
    exposures : int
        Number of exposures, spread evenly over the scene.
    phases, textures : int
        How often each reading is drawn anew: positions of the pixels along each axis (3 makes 9),
        and textures of the emissivity.
    reference : ReferenceKind
        What the measured temperatures are compared with.
    line_reach, line_step : float
        Reach of the line across the rake face to either side and distance between its points in m.
    touching : float
        Distance from the rake face in m within which material counts as touching it.

    Raises
    ------
    ValueError
        If a number is not positive, or two places have one name.
    """

    places: tuple[Place, ...] = ()
    exposures: int = 9
    phases: int = 3
    textures: int = 5
    reference: ReferenceKind = "maximum"
    line_reach: float = 60e-6
    line_step: float = 1e-6
    touching: float = 3e-6

    def __post_init__(self) -> None:
        for name in ("exposures", "phases", "textures", "line_reach", "line_step", "touching"):
            if not getattr(self, name) > 0:
                raise ValueError(f"plan: {name} is {getattr(self, name)!r}, expected over 0")
        names = [place.name for place in self.places]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"plan: two places have the name {name!r}, expected names apart")


@dataclass(frozen=True, eq=False)
class PlaceErrors:
    """One reading at one place over all draws, in K of radiance temperature.

    Parameters
    ----------
    place, reading : str
        Where, and what is read there.
    reference, error, psf_portion : Distribution
        As in `places.Reading`; axes of `CAUSES`.
    """

    place: str
    reading: str
    reference: Distribution
    error: Distribution
    psf_portion: Distribution


@dataclass(frozen=True, eq=False)
class Profile:
    """Errors along a user's line over the draws of the shown exposure, in K.

    Parameters
    ----------
    name : str
        The line's name.
    line : Line
        Its points; the distance in m counts from its first corner.
    reference, error, psf_portion : ndarray
        One row a draw of texture and pixel phase, shape (draw, n); NaN off the image.
    """

    name: str
    line: Line
    reference: NDArray[np.float64]
    error: NDArray[np.float64]
    psf_portion: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SurfaceErrors:
    """What the camera makes of the scene with one surface.

    Parameters
    ----------
    measurement : Measurement
        One frame for each exposure.
    emissivity : ndarray
        In the middle of the shown exposure, on the scene's samples, shape (y, x).
    scene_temperature : ndarray
        Radiance temperature of the scene's samples then in K; NaN where nothing radiates.
    references : ndarray
        What the pixels of every exposure are compared with in K, shape (exposure, y, x); NaN where
        nothing radiates.
    errors : ErrorImages
        Of the shown exposure.
    readings : tuple of PlaceErrors
        At every place that shows something in every draw.
    profiles : tuple of Profile
        Along every line.
    warnings : tuple of str
        What to know of the shown image, a sentence each.
    """

    measurement: Measurement
    emissivity: NDArray[np.float32]
    scene_temperature: NDArray[np.float64]
    references: NDArray[np.float64]
    errors: ErrorImages
    readings: tuple[PlaceErrors, ...]
    profiles: tuple[Profile, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class SceneErrors:
    """Everything that a report of a scene's measurement error shows.

    Parameters
    ----------
    plan : ScenePlan
        What was analysed.
    places : tuple of Place
        Where: the hottest pixel, the rake face if material touches it, then the user's.
    camera : Camera
        The camera.
    raster : Raster
        The scene's samples.
    tool : Tool or None
        The scene's tool.
    starts : ndarray
        When the exposures begin in s, shape (exposure,).
    shown : int
        Number of the exposure that images show: that in the middle of which the scene is hottest.
    frame : Frame
        The scene in its middle.
    surfaces : mapping
        By the surfaces' names.
    missing : tuple of str
        What a report of a cut would have and this one has not, and why: a sentence each.
    """

    plan: ScenePlan
    places: tuple[Place, ...]
    camera: Camera
    raster: Raster
    tool: Tool | None
    starts: NDArray[np.float64]
    shown: int
    frame: Frame
    surfaces: Mapping[str, SurfaceErrors]
    missing: tuple[str, ...]

    def to_frame(self) -> pd.DataFrame:
        """Every reading at every place with every surface, a row each.

        Returns
        -------
        pandas.DataFrame
            Columns ``surface``, ``place``, ``reading``, ``draws``, and the means over the draws
            ``reference_degC``, ``error_K`` and ``psf_portion_K``, of the error also the
            ``standard_deviation_K`` and the ``least_K`` and ``greatest_K``.
        """
        return pd.DataFrame(
            {
                "surface": name,
                "place": one.place,
                "reading": one.reading,
                "draws": one.error.draws,
                "reference_degC": one.reference.mean - 273.15,
                "error_K": one.error.mean,
                "standard_deviation_K": one.error.standard_deviation,
                "least_K": one.error.range[0],
                "greatest_K": one.error.range[1],
                "psf_portion_K": one.psf_portion.mean,
            }
            for name, surface in self.surfaces.items()
            for one in surface.readings
        )


def scene_errors(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    camera: Camera,
    plan: ScenePlan,
    progress: Progress | None = None,
    missing: Sequence[str] = (),
) -> SceneErrors:
    """Measure any scene, and read the errors of the camera at the user's places.

    Parameters
    ----------
    scene : Scene
        What is truly there. Temperature alone is enough.
    surfaces : mapping
        Surfaces by name.
    camera : Camera
        The camera.
    plan : ScenePlan
        What to analyse.
    progress : callable, optional
        Called with what is being done and how far it is.
    missing : sequence of str
        What of another analysis is not there, for the report.

    Raises
    ------
    ValueError
        If the scene is shorter than an exposure, a place is outside the pixels, or a surface
        cannot be laid on the scene.
    """
    tell = progress or (lambda label, part: None)
    fields = [_textures(surface, scene, camera, plan.textures) for surface in surfaces.values()]
    duration = camera.frame_duration(scene.raster)
    starts = spread_starts(scene, duration, plan.exposures)
    frames = [_middle(scene, float(start), duration) for start in starts]
    hottest = [float(scene.field("temperature", index).max()) for index in frames]
    shown = int(np.argmax(hottest))
    frame = scene.frame(frames[shown])
    places = _places(scene, frame, plan)
    for place in plan.places:
        place.check_within(camera.pixels(scene.raster))
    collected = _collect(scene, fields, camera, plan, starts, shown, places, tell)
    results = {
        name: one.finish(textures[0], scene, frame, camera.redrawn(number), starts, places)
        for number, (name, textures, one) in enumerate(
            zip(surfaces, fields, collected, strict=True)
        )
    }
    return SceneErrors(
        plan=plan,
        places=places,
        camera=camera,
        raster=scene.raster,
        tool=scene.tool,
        starts=starts,
        shown=shown,
        frame=frame,
        surfaces=results,
        missing=(*missing, *_unread(results, places)),
    )


def _textures(surface: Surface, scene: Scene, camera: Camera, count: int) -> list[EmissivityField]:
    """The surface on the scene, then its other textures if it has any."""
    draws = count if surface.redrawn(1) is not surface else 1
    return [camera.lay(surface.redrawn(number), scene) for number in range(draws)]


def _unread(results: Mapping[str, SurfaceErrors], places: Sequence[Place]) -> Iterator[str]:
    """Places of which there is no reading, a sentence each."""
    for name, surface in results.items():
        read = {reading.place for reading in surface.readings}
        for place in places:
            if place.name not in read:
                yield (
                    f"{place.name}, {name}: not read, for in some draw nothing radiates there or "
                    "it is beyond the pixels."
                )


def _middle(scene: Scene, start: float, duration: float) -> int:
    """Number of the frame in the middle of an exposure."""
    after = np.searchsorted(scene.times, start + duration / 2 + 1e-6 * scene.frame_spacing)
    return max(int(after) - 1, 0)


def _places(scene: Scene, frame: Frame, plan: ScenePlan) -> tuple[Place, ...]:
    """The hottest pixel, the rake face if material touches it, then the user's places."""
    found: list[Place] = [HottestPlace()]
    tool = scene.tool
    if tool is not None and not plan.places:
        workpiece = frame.material == Material.WORKPIECE
        contact = contact_length(scene.raster, workpiece, tool, plan.touching)
        if contact > 0:
            found.append(RakePlace("rake face", tool, contact, plan.line_reach, plan.line_step))
    return (*found, *plan.places)


@dataclass(frozen=True, eq=False)
class _Collected:
    """What one surface gives, exposure by exposure."""

    shape: tuple[int, int, int]
    images: list[NDArray[np.float64]] = field(default_factory=list)
    references: list[NDArray[np.float64]] = field(default_factory=list)
    shown: list[Exposure] = field(default_factory=list)
    errors: list[ErrorImages] = field(default_factory=list)
    readings: list[Mapping[tuple[str, str], Reading]] = field(default_factory=list)
    profiles: dict[str, list[NDArray[np.float64]]] = field(default_factory=dict)

    def finish(
        self,
        emissivity: EmissivityField,
        scene: Scene,
        frame: Frame,
        camera: Camera,
        starts: NDArray[np.float64],
        places: Sequence[Place],
    ) -> SurfaceErrors:
        """The surface's result."""
        exposure = self.shown[0]
        lines = {place.name: place for place in places if isinstance(place, LinePlace)}
        return SurfaceErrors(
            measurement=camera.measurement(np.stack(self.images), starts, scene.raster),
            emissivity=emissivity.emissivity(frame),
            scene_temperature=np.asarray(camera.band.temperature(exposure.centre_radiance)),
            references=np.stack(self.references),
            errors=self.errors[0],
            readings=tuple(self._distributions()),
            profiles=tuple(
                Profile(
                    name,
                    lines[name].line(camera.pitch),
                    *np.moveaxis(np.array(rows), 1, 0),
                )
                for name, rows in self.profiles.items()
            ),
            warnings=tuple(camera.form_measurement(exposure).notes.warnings),
        )

    def _distributions(self) -> list[PlaceErrors]:
        found = []
        for place, reading in self.readings[0]:
            draws = [draw.get((place, reading)) for draw in self.readings]
            values = np.array(
                [
                    (np.nan,) * 3 if one is None else (one.reference, one.error, one.psf_portion)
                    for one in draws
                ]
            )
            if np.isfinite(values).all():
                shaped = values.T.reshape(3, *self.shape)
                found.append(
                    PlaceErrors(place, reading, *(Distribution(part, CAUSES) for part in shaped))
                )
        return found


def _collect(
    scene: Scene,
    fields: Sequence[Sequence[EmissivityField]],
    camera: Camera,
    plan: ScenePlan,
    starts: NDArray[np.float64],
    shown: int,
    places: Sequence[Place],
    tell: Progress,
) -> list[_Collected]:
    """Images and readings of every exposure, texture and pixel phase; frames are read once each."""
    cameras = pixel_phases(camera, plan.phases)
    collected = [_Collected((len(starts), len(textures), len(cameras))) for textures in fields]
    flat = [one for textures in fields for one in textures]
    for i, start in enumerate(starts):
        tell("camera", i / len(starts))
        exposures = iter(camera.expose_fields(scene, flat, float(start)))
        number = count()
        for surface, (one, textures) in enumerate(zip(collected, fields, strict=True)):
            of_surface = [next(exposures) for _ in textures]
            first = of_surface[0]
            one.images.append(camera.form_image(first.mean_radiance, scene.raster))
            one.references.append(reference_temperature(camera, first, plan.reference))
            if i == shown:
                looking = camera.redrawn(surface)
                one.shown.append(first)
                one.errors.append(error_images(looking, first, plan.reference))
            for exposure in of_surface:
                for phase in cameras:
                    errors = error_images(phase.redrawn(next(number)), exposure, plan.reference)
                    _read(one, errors, places, i == shown)
    tell("camera", 1.0)
    return collected


def _read(one: _Collected, errors: ErrorImages, places: Sequence[Place], shown: bool) -> None:
    one.readings.append(
        {
            (place.name, reading): value
            for place in places
            for reading, value in place.read(errors).items()
        }
    )
    for place in places:
        if shown and isinstance(place, LinePlace):
            one.profiles.setdefault(place.name, []).append(place.profile(errors))
