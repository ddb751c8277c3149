"""The app without its page: pictures and numbers of a scene at a state of the knobs.

Nothing is computed here that the library does not compute; what depends on what decides how long a
result is kept: surfaces, exposures, images.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from math import ceil, nan
from threading import Lock
from typing import Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import (
    Distribution,
    ErrorImages,
    ErrorParts,
    LinePlace,
    error_images,
    error_parts,
)
from chipglow.analysis.draws import pixel_phases
from chipglow.analysis.error_images import Unblurred
from chipglow.app.knobs import LINES, ControlPanel, Knobs
from chipglow.app.opening import QUICK_SAMPLES, OpenedMeasurement, OpenedScene, with_samples
from chipglow.app.picture import (
    Drawn,
    LineBand,
    LineValues,
    Picture,
    Readout,
    SceneImage,
)
from chipglow.camera import Camera, Exposure
from chipglow.camera.exposure import frame_weights
from chipglow.camera.sweep import Check
from chipglow.radiometry import Band
from chipglow.scene import Material, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.study import Study, fit
from chipglow.surface import EmissivityField, Surface

Progress = Callable[[float], None]

DISPLAYED: Final = 100_000
"""Samples of the scene that the page gets to see."""

_EXPOSURES: Final = 2
_COARSE_EXPOSURES: Final = 24

_Kept = TypeVar("_Kept")


class Kept(Generic[_Kept]):
    """The results that were asked for last, a few; threads may share them."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._found: OrderedDict[Hashable, _Kept] = OrderedDict()
        self._lock = Lock()

    def __contains__(self, key: Hashable) -> bool:
        return key in self._found

    def get(self, key: Hashable, make: Callable[[], _Kept]) -> _Kept:
        """The result of a key, made if it is not there."""
        with self._lock:
            if key not in self._found:
                self._found[key] = make()
                while len(self._found) > self._most:
                    self._found.popitem(last=False)
            self._found.move_to_end(key)
            return self._found[key]


class SceneModel:
    """Pictures of a scene; one for each session.

    Parameters
    ----------
    opened : OpenedScene
        The scene and the knobs of its study.
    """

    def __init__(self, opened: OpenedScene) -> None:
        self.opened = opened
        self.panel: ControlPanel = opened.panel
        self._bands: Kept[Band] = Kept(4)
        self._fitted: Kept[tuple[Scene, Surface]] = Kept(4)
        self._laid: Kept[list[EmissivityField]] = Kept(4)
        self._exact: Kept[tuple[Exposure, ...]] = Kept(_EXPOSURES)
        self._quick: Kept[tuple[Exposure, ...]] = Kept(_COARSE_EXPOSURES)
        self._images: Kept[SceneImage] = Kept(4)
        self._formed: Kept[NDArray[np.float64]] = Kept(8)
        self._unblurred: Kept[Unblurred] = Kept(8)
        self._errors: Kept[ErrorImages] = Kept(8)
        self._parts: Kept[ErrorParts] = Kept(2)
        self._frames: Kept[tuple[NDArray[np.float32], NDArray[np.float32]]] = Kept(1)
        self._displayed = with_samples(opened.scene, DISPLAYED)
        self._glimpsed = with_samples(opened.scene, QUICK_SAMPLES)

    @property
    def has_quick_look(self) -> bool:
        """Whether the scene is so large that a coarse picture goes before the exact one."""
        return self.opened.coarse is not None

    def turned(self, knobs: Knobs, texts: Mapping[str, str]) -> Knobs:
        """Knobs with some of them set by their text, if a picture can be made of them.

        Raises
        ------
        ValueError
            If not; the message names the knob.
        """
        new = self.panel.changed(knobs, texts)
        try:
            self._check(new)
        except ValueError as error:
            raise ValueError(f"{self.panel.named(texts)}: {error}") from None
        return new

    def _check(self, knobs: Knobs) -> None:
        scene = self.opened.scene
        camera = self._camera(self.panel.study_of(knobs), scene)
        camera.pixels(scene.raster)
        duration = camera.frame_duration(scene.raster)
        frame_weights(scene.times, scene.frame_spacing, knobs.start, duration)

    def is_ready(self, knobs: Knobs) -> bool:
        """Whether the exposure of these knobs is at hand, and an exact picture a matter of ms."""
        if self._exposure_key(knobs) not in self._exact:
            return False
        on_samples = knobs.psf_order != "detector" and knobs.psf == "annular-aperture"
        coarse = self.opened.coarse
        # Of pixels that are hardly larger than the coarse samples a quick look takes half as long.
        many = on_samples or (coarse is not None and knobs.pitch < 1.5 * coarse.raster.spacing)
        return not many or self._image_key(knobs, coarse=False) in self._errors

    def picture(self, knobs: Knobs, quick: bool = False, check: Check | None = None) -> Picture:
        """Images and lines at a state of the knobs.

        Parameters
        ----------
        knobs : Knobs
            The state.
        quick : bool
            Whether to look at the coarse scene, if there is one.
        check : callable, optional
            Called now and then; what it raises ends the work.

        Raises
        ------
        ValueError
            If the state is not possible on this scene.
        """
        coarse = quick and self.opened.coarse is not None
        study = self.panel.study_of(knobs)
        scene, surface = self._on(study, knobs, coarse)
        camera = self._camera(study, scene, coarse)
        exposures = self._exposed(scene, surface, camera, knobs, coarse, check)
        errors = self._image_errors(camera, exposures[0], knobs, coarse)
        picture = Picture(
            knobs=knobs,
            raster=errors.raster,
            measured=errors.measured,
            flagged=errors.flagged,
            lines=line_values(errors, knobs),
            coarse=coarse,
            scene=self._scene_image(study, knobs, exposures[0], coarse),
            errors=errors,
            error=errors.case_1,
            camera=camera,
            exposures=exposures,
        )
        if knobs.error == "total":
            return picture
        return replace(picture, error=getattr(self.parts(picture), knobs.error))

    def _image_errors(
        self, camera: Camera, exposure: Exposure, knobs: Knobs, coarse: bool
    ) -> ErrorImages:
        """As `error_images`, of which what the changed knobs do not matter to is kept."""
        seen, pixels, optics, _ = key = self._image_key(knobs, coarse)
        reference = self.panel.study.analysis.reference
        unblurred = self._unblurred.get(
            (seen, pixels), lambda: Unblurred.of(camera, exposure, reference)
        )
        formed = self._formed.get(
            (seen, pixels, optics),
            lambda: camera.form_image(exposure.mean_radiance, exposure.raster),
        )
        return self._errors.get(key, lambda: replace(unblurred, camera=camera).errors(formed))

    def _image_key(self, knobs: Knobs, coarse: bool) -> tuple[Hashable, ...]:
        """What an image depends on: exposure, pixels, optics and how it is read."""
        return (
            (self._exposure_key(knobs), coarse),
            (knobs.pitch, knobs.offset_right, knobs.offset_down),
            (knobs.psf, knobs.numerical_aperture, knobs.fwhm, knobs.psf_order),
            (knobs.netd, knobs.lower_limit),
        )

    def parts(self, picture: Picture) -> ErrorParts:
        """What makes the errors of a picture."""
        assert picture.camera is not None
        camera, (exposure, *others) = picture.camera, picture.exposures
        return self._parts.get(
            (knobs_key(picture.knobs), picture.coarse),
            lambda: error_parts(
                camera,
                exposure,
                self.panel.study.analysis.reference,
                others[0] if others else None,
            ),
        )

    def readout(self, picture: Picture) -> Readout:
        """Numbers at the cursor of a picture."""
        assert picture.errors is not None and picture.camera is not None
        knobs, errors = picture.knobs, picture.errors
        temperature, emissivity = self._middle(knobs)
        at = knobs.cursor
        measured = float(nearest(errors.measured, errors.raster, at))
        calibration = picture.camera.calibration(errors.raster.shape)
        noisy = calibration is not None and np.isfinite(measured)
        return Readout(
            measured=measured,
            uncertainty=calibration.netd(measured) if calibration and noisy else nan,
            source="noise of one frame" if noisy else "",
            flagged=bool(nearest(errors.flagged, errors.raster, at) == 1.0),
            true=float(nearest(temperature, self.opened.scene.raster, at)),
            emissivity=float(nearest(emissivity, self.opened.scene.raster, at)),
            reference=float(nearest(errors.reference, errors.raster, at)),
            parts=self.parts(picture),
        )

    def drawn(self, knobs: Knobs, phases: int, textures: int, progress: Progress) -> Drawn:
        """Lines and the error at the cursor, drawn anew over pixel phases and textures.

        Parameters
        ----------
        knobs : Knobs
            The state.
        phases, textures : int
            Positions of the pixels along each axis, and textures.
        progress : callable
            Called with how much is done, 0 to 1; what it raises ends the work.
        """
        study = self.panel.study_of(knobs)
        scene, surface = self._on(study, knobs, coarse=False)
        camera = self._camera(study, scene)
        cameras = pixel_phases(camera, phases)
        surfaces = [surface.redrawn(number) for number in range(textures)]
        if surface.redrawn(1) is surface:
            surfaces = surfaces[:1]
        total = len(surfaces) * len(cameras)
        profiles: dict[str, list[LineValues]] = {name: [] for name in LINES}
        at_cursor: list[float] = []
        for number, one in enumerate(surfaces):
            done = number * len(cameras)
            (exposure,) = camera.expose_fields(
                scene,
                (camera.lay(one, scene),),
                knobs.start,
                lambda done=done: progress(done / total),  # type: ignore[misc]
            )
            for phase in cameras:
                looking = phase.redrawn(len(at_cursor))
                errors = error_images(looking, exposure, study.analysis.reference)
                for name, values in line_values(errors, knobs).items():
                    profiles[name].append(values)
                at_cursor.append(float(nearest(errors.case_1, errors.raster, knobs.cursor)))
                progress(len(at_cursor) / total)
        drawn = np.array(at_cursor).reshape(len(surfaces), len(cameras))
        known = bool(np.isfinite(drawn).all())
        return Drawn(
            knobs,
            {name: _line_band(rows) for name, rows in profiles.items()},
            Distribution(drawn, ("texture", "pixel phase")) if known else None,
        )

    def _exposure_key(self, knobs: Knobs) -> Hashable:
        band = knobs.band_lower, knobs.band_upper
        when = knobs.start, knobs.integration_time
        # Of a rolling shutter it is the pixels that say when a sample's row is exposed.
        rolling = self.panel.study.camera.line_time is not None
        rows = (knobs.pitch, knobs.offset_down) if rolling else ()
        return (_surface_key(knobs), band, when, knobs.reflected, rows)

    def _on(self, study: Study, knobs: Knobs, coarse: bool) -> tuple[Scene, Surface]:
        """The scene with its tool, and the surface that is seen."""
        base = self.opened.coarse if coarse else self.opened.scene
        assert base is not None

        def make() -> tuple[Scene, Surface]:
            fitted = fit(study, base)
            (surface,) = fitted.surfaces.values()
            return fitted.scene, surface

        return self._fitted.get((_surface_key(knobs), coarse), make)

    def _camera(self, study: Study, scene: Scene, coarse: bool = False) -> Camera:
        """The study's camera; if coarse, with no pixel finer than the scene's samples.

        Its band is kept, whose tables take longer than an image.
        """
        camera = study.camera.on(scene.raster, study.seed)
        larger = scene.raster.spacing / camera.pitch
        if coarse and larger > 1:
            rows, columns = camera.shape or (0, 0)
            shape = (ceil(rows / larger), ceil(columns / larger)) if camera.shape else None
            camera = replace(camera, pitch=scene.raster.spacing, shape=shape)
        ends = camera.band.lower, camera.band.upper
        return replace(camera, band=self._bands.get(ends, lambda: camera.band))

    def _exposed(
        self,
        scene: Scene,
        surface: Surface,
        camera: Camera,
        knobs: Knobs,
        coarse: bool,
        check: Check | None,
    ) -> tuple[Exposure, ...]:
        """The exposure, and the same without texture where that differs and is needed."""
        plain = surface.without_texture()
        both = plain is not surface and (not coarse or knobs.error == "texture")
        kept = self._quick if coarse else self._exact
        band = knobs.band_lower, knobs.band_upper

        def make() -> tuple[Exposure, ...]:
            seen = (surface, plain) if both else (surface,)
            grey = all(one.in_band(camera.band, camera.reflected) is one for one in seen)
            fields = self._laid.get(
                (_surface_key(knobs), coarse, both, () if grey else (band, knobs.reflected)),
                lambda: [camera.lay(one, scene) for one in seen],
            )
            found = camera.expose_fields(scene, fields, knobs.start, check)
            return tuple(
                replace(exposure, effects=one.effects)
                for exposure, one in zip(found, seen, strict=True)
            )

        key = self._exposure_key(knobs)
        return kept.get((key, both) if coarse else key, make)

    def _scene_image(
        self, study: Study, knobs: Knobs, exposure: Exposure, coarse: bool
    ) -> SceneImage:
        index = _middle_frame(self.opened.scene, knobs)
        of_surface = knobs.shown in ("radiance_temperature", "emissivity")
        seen = (self._exposure_key(knobs), exposure.raster.shape) if of_surface else ()
        exact, quick = ((index, knobs.shown, seen, few) for few in (False, True))
        few = coarse and exact not in self._images
        scene = self._glimpsed if few else self._displayed

        def make() -> SceneImage:
            values = self._shown(study, knobs, exposure, scene, index)
            void = scene.field("material", index) == Material.VOID
            values = np.where(void, np.nan, values).astype(np.float32)
            return SceneImage(knobs.shown, values, scene.raster)

        return self._images.get(quick if few else exact, make)

    def _shown(
        self, study: Study, knobs: Knobs, exposure: Exposure, scene: Scene, index: int
    ) -> NDArray[np.floating]:
        if knobs.shown == "speed":
            velocity = (scene.field(f"velocity_{axis}", index) for axis in "xy")
            return np.asarray(np.hypot(*velocity))
        camera = self._camera(study, scene)
        if knobs.shown == "emissivity":
            _, surface = self._on(study, knobs, coarse=False)
            return camera.lay(surface, scene).emissivity(scene.frame(index))
        if knobs.shown == "radiance_temperature":
            places = np.stack(np.meshgrid(scene.raster.x, scene.raster.y), axis=-1)
            seen = nearest(exposure.centre_radiance, exposure.raster, places)
            return np.asarray(camera.band.temperature(seen))
        return scene.field(knobs.shown, index)

    def _middle(self, knobs: Knobs) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Temperature and emissivity of all samples in the middle of the exposure; NaN for void."""
        study = self.panel.study_of(knobs)
        scene, surface = self._on(study, knobs, coarse=False)
        index = _middle_frame(scene, knobs)

        def make() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            frame = scene.frame(index)
            camera = self._camera(study, scene)
            void = frame.material == Material.VOID
            emissivity = camera.lay(surface, scene).emissivity(frame)
            temperature, emissivity = (
                np.where(void, np.float32(nan), values)
                for values in (frame.temperature, emissivity)
            )
            return temperature, emissivity

        return self._frames.get((index, self._exposure_key(knobs)), make)


class MeasurementModel:
    """Pictures of a measurement: its frames, without any knob of a camera.

    Parameters
    ----------
    opened : OpenedMeasurement
        The measurement.
    """

    has_quick_look = False

    def __init__(self, opened: OpenedMeasurement) -> None:
        self.opened = opened
        self.panel: ControlPanel = opened.panel

    def turned(self, knobs: Knobs, texts: Mapping[str, str]) -> Knobs:
        """Knobs with some of them set by their text; raises as that of a scene."""
        return self.panel.changed(knobs, texts)

    def is_ready(self, knobs: Knobs) -> bool:
        """Whether a picture is a matter of milliseconds: always."""
        return True

    def picture(self, knobs: Knobs, quick: bool = False, check: Check | None = None) -> Picture:
        """The frame that began nearest to the knobs' start."""
        measurement, index = self.opened.measurement, self._index(knobs)
        measured = np.asarray(measurement.data["radiance_temperature"][index].values, np.float64)
        raster = measurement.raster
        lines = {}
        for name in LINES:
            line = LinePlace(name, getattr(knobs, name)).line(raster.spacing)
            values = sample(measured, raster, line.points)
            lines[name] = LineValues(line.distance, values, None, None)
        return Picture(
            knobs=knobs,
            raster=raster,
            measured=measured,
            flagged=~measurement.usable[index],
            lines=lines,
        )

    def readout(self, picture: Picture) -> Readout:
        """The measured temperature at the cursor, with what the calibration leaves uncertain."""
        at, raster = picture.knobs.cursor, picture.raster
        measured = float(nearest(picture.measured, raster, at))
        uncertainty, source = nan, ""
        measurement, index = self.opened.measurement, self._index(picture.knobs)
        if measurement.calibration_errors is not None:
            effects = measurement.calibration_effects(index)
            estimate = measurement.estimate(picture.measured[None], effects[None])
            image = estimate.standard_uncertainty[0]
            uncertainty, source = float(nearest(image, raster, at)), "calibration"
        flagged = bool(nearest(picture.flagged, raster, at) == 1.0)
        return Readout(measured, uncertainty, source, flagged, nan, nan, nan, None)

    def _index(self, knobs: Knobs) -> int:
        return int(np.abs(self.opened.measurement.times - knobs.start).argmin())


def model_of(opened: OpenedScene | OpenedMeasurement) -> SceneModel | MeasurementModel:
    """The model of what is open."""
    if isinstance(opened, OpenedMeasurement):
        return MeasurementModel(opened)
    return SceneModel(opened)


def line_values(errors: ErrorImages, knobs: Knobs) -> dict[str, LineValues]:
    """Temperatures along both lines of the knobs."""
    found = {}
    for name in LINES:
        place = LinePlace(name, getattr(knobs, name))
        reference, error, portion = place.profile(errors)
        distance = place.line(errors.raster.spacing).distance
        found[name] = LineValues(distance, reference + error, reference, portion)
    return found


def knobs_key(knobs: Knobs) -> Knobs:
    """The knobs without those that no image of the camera depends on."""
    none = (0.0, 0.0)
    return replace(
        knobs, shown="", error="", cursor=none, rake_line=(none, none), band_line=(none, none)
    )


def _surface_key(knobs: Knobs) -> Hashable:
    own = knobs.body_mean, knobs.body_deviation, knobs.band_mean, knobs.band_deviation
    return knobs.surface, own, knobs.emissivity, knobs.seed


def _middle_frame(scene: Scene, knobs: Knobs) -> int:
    """Number of the frame that stands for the middle of the exposure."""
    middle = knobs.start + knobs.integration_time / 2 + 1e-6 * scene.frame_spacing
    return max(int(np.searchsorted(scene.times, middle, side="right")) - 1, 0)


def _line_band(rows: list[LineValues]) -> LineBand:
    measured = np.array([row.measured for row in rows])
    reference = np.array([row.reference for row in rows])
    return LineBand(measured, measured - reference)
