"""Images and numbers of a scene or a measurement at a state of the controls, without a page.

The stages of a picture are computed once for all states that agree up to them.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, nan
from threading import Lock
from typing import Final, Generic, TypeAlias, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis import (
    ALL,
    CASES,
    Distribution,
    ExposureImages,
    LinePlace,
    pixel_phases,
)
from chipglow.app.controls import LINES, SCENE_IMAGES, Controls, Stage, State
from chipglow.app.opening import (
    QUICK_SAMPLES,
    Opened,
    OpenedMeasurement,
    OpenedScene,
    with_samples,
)
from chipglow.camera import Camera, Exposure
from chipglow.camera.exposure import frame_weights
from chipglow.camera.sweep import Check
from chipglow.drawing.scales import KELVIN
from chipglow.radiometry import Band
from chipglow.scene import Material, Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.study import fit
from chipglow.surface import EmissivityField, Surface

Array: TypeAlias = NDArray[np.float64]

_Result = TypeVar("_Result")

DISPLAYED: Final = 100_000
"""Samples of the image of the scene on the page."""

_UNITS: Final = {"plastic_strain_rate": " / (1/s)", "speed": " / (m/s)"}


@dataclass(frozen=True, eq=False)
class SceneImage:
    """A field of the scene in SI on few enough samples for a screen; NaN without material."""

    name: str
    values: NDArray[np.float32]
    raster: Raster

    @property
    def is_temperature(self) -> bool:
        """Whether the field is a temperature."""
        return self.name in ("temperature", "radiance_temperature")

    @cached_property
    def shown(self) -> NDArray[np.float32]:
        """Values as the page shows them: temperatures in °C."""
        return self.values - np.float32(KELVIN) if self.is_temperature else self.values

    @property
    def label(self) -> str:
        """Quantity and unit."""
        return SCENE_IMAGES[self.name].lower() + _UNITS.get(
            self.name, " / °C" * self.is_temperature
        )


@dataclass(frozen=True, eq=False)
class LineValues:
    """Radiance temperatures in K along a line; no reference for a measurement."""

    distance: Array
    measured: Array
    reference: Array | None = None


@dataclass(frozen=True, eq=False)
class Picture:
    """Images and lines at a state; `quick` marks those on a coarser scene."""

    state: State
    raster: Raster
    measured: Array
    flagged: NDArray[np.bool_]
    lines: dict[str, LineValues]
    quick: bool = False
    scene: SceneImage | None = None
    images: ExposureImages | None = None
    errors: xr.Dataset | None = None
    error: Array | None = None
    camera: Camera | None = None
    exposures: tuple[Exposure, ...] = ()


@dataclass(frozen=True, eq=False)
class Readout:
    """Numbers at the cursor, temperatures in K; NaN for those that are unknown."""

    measured: float
    uncertainty: float = nan
    source: str = ""
    flagged: bool = False
    true: float = nan
    emissivity: float = nan
    reference: float = nan
    parts: xr.Dataset | None = None


@dataclass(frozen=True, eq=False)
class Drawn:
    """Measured lines in K, shape (draw, n), and error at the cursor over phases and textures."""

    state: State
    lines: dict[str, Array]
    error: Distribution | None


class _Cache(Generic[_Result]):
    """The results of the last few keys; threads may share them."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._results: OrderedDict[Hashable, _Result] = OrderedDict()
        self._lock = Lock()

    def __contains__(self, key: Hashable) -> bool:
        return key in self._results

    def get(self, key: Hashable, make: Callable[[], _Result]) -> _Result:
        """Return the result of a key, which is made if it is not there."""
        with self._lock:
            if key not in self._results:
                self._results[key] = make()
                while len(self._results) > self._size:
                    self._results.popitem(last=False)
            self._results.move_to_end(key)
            return self._results[key]


class SceneModel:
    """Pictures of a scene for one session."""

    def __init__(self, opened: OpenedScene) -> None:
        self.opened = opened
        self.controls: Controls = opened.controls
        self._bands: _Cache[Band] = _Cache(4)
        self._fitted: _Cache[tuple[Scene, Surface]] = _Cache(4)
        self._fields: _Cache[list[EmissivityField]] = _Cache(4)
        self._exposures: _Cache[tuple[Exposure, ...]] = _Cache(2)
        self._quick_exposures: _Cache[tuple[Exposure, ...]] = _Cache(24)
        self._exposure_images: _Cache[ExposureImages] = _Cache(4)
        self._errors: _Cache[xr.Dataset] = _Cache(8)
        self._parts: _Cache[xr.Dataset] = _Cache(2)
        self._images: _Cache[SceneImage] = _Cache(4)
        self._frames: _Cache[list[NDArray[np.float32]]] = _Cache(1)
        self._displayed = with_samples(opened.scene, DISPLAYED)
        self._displayed_quick = with_samples(opened.scene, QUICK_SAMPLES)

    @property
    def has_quick_look(self) -> bool:
        """Whether a picture of a coarser scene precedes the exact one."""
        return self.opened.coarse is not None

    def changed(self, state: State, texts: dict[str, str]) -> State:
        """Return the state with some controls at other values.

        Raises
        ------
        ValueError
            If the scene has no picture at it; the message names the control.
        """
        new = self.controls.changed(state, texts)
        try:
            scene = self.opened.scene
            camera = self._camera(new, scene)
            camera.pixels(scene.raster)
            duration = camera.frame_duration(scene.raster)
            frame_weights(scene.times, scene.frame_spacing, new.start, duration)
        except ValueError as error:
            raise ValueError(f"{self.controls.named(texts)}: {error}") from None
        return new

    def is_ready(self, state: State) -> bool:
        """Whether the exact picture takes milliseconds."""
        if self._exposure_key(state) not in self._exposures:
            return False
        camera, coarse = state.study.camera, self.opened.coarse
        kind = camera.psf.kind if camera.psf else ""
        on_samples = camera.psf_order != "detector" and kind == "annular-aperture"
        # A quick look at pixels hardly larger than the coarse samples takes half as long.
        many = on_samples or (coarse is not None and camera.pitch < 1.5 * coarse.raster.spacing)
        return not many or (self._key(state, "reading"), False) in self._errors

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return images and lines at a state; `check` is called meanwhile and may raise."""
        quick = quick and self.opened.coarse is not None
        scene, surface = self._on(state, quick)
        camera = self._camera(state, scene, quick)
        exposures = self._exposed(scene, surface, camera, state, quick, check)
        images: ExposureImages = self._exposure_images.get(
            (self._exposure_key(state), state.study.analysis.reference, quick),
            lambda: ExposureImages(exposures[0], state.study.analysis.reference),
        )
        errors = self._errors.get(
            (self._key(state, "reading"), quick), lambda: images.errors(camera)
        )
        raster = camera.pixels(scene.raster)
        measured, reference = errors.measured.values, errors.reference.values
        picture = Picture(
            state=state,
            raster=raster,
            measured=measured,
            flagged=errors.flagged.values,
            lines=line_values(raster, measured, reference, state),
            quick=quick,
            scene=self._scene_image(state, exposures[0], quick),
            images=images,
            errors=errors,
            error=errors.case_1.values,
            camera=camera,
            exposures=exposures,
        )
        if state.error_image == "total":
            return picture
        part = self.parts(picture).get(state.error_image)
        return replace(picture, error=np.zeros_like(measured) if part is None else part.values)

    def parts(self, picture: Picture) -> xr.Dataset:
        """Return the parts of the error of a picture."""
        assert picture.camera is not None and picture.images is not None
        camera, images, (_, *plain) = picture.camera, picture.images, picture.exposures
        return self._parts.get(
            (self._key(picture.state, "reading"), picture.quick, len(picture.exposures)),
            lambda: images.parts(camera, *plain),
        )

    def readout(self, picture: Picture) -> Readout:
        """Return the numbers at the cursor of a picture."""
        assert picture.errors is not None and picture.camera is not None
        state, pixels, raster = picture.state, picture.raster, self.opened.scene.raster
        temperature, emissivity = self._middle(state)
        at = state.cursor
        measured = float(nearest(picture.measured, pixels, at))
        calibration = picture.camera.calibration(pixels.shape)
        noisy = calibration is not None and np.isfinite(measured)
        return Readout(
            measured=measured,
            uncertainty=calibration.netd(measured) if calibration and noisy else nan,
            source="noise of one frame" if noisy else "",
            flagged=bool(nearest(picture.flagged, pixels, at) == 1.0),
            true=float(nearest(temperature, raster, at)),
            emissivity=float(nearest(emissivity, raster, at)),
            reference=float(nearest(picture.errors.reference.values, pixels, at)),
            parts=self.parts(picture),
        )

    def drawn(
        self, state: State, phases: int, textures: int, progress: Callable[[float], None]
    ) -> Drawn:
        """Return lines and error at the cursor at `phases`² positions of the pixels and textures.

        `progress` takes the finished fraction and may raise.
        """
        scene, surface = self._on(state, quick=False)
        camera = self._camera(state, scene)
        cameras = pixel_phases(camera, phases)
        count = textures if surface.redrawn(1) is not surface else 1
        total = count * len(cameras)
        lines: dict[str, list[Array]] = {name: [] for name in LINES}
        at_cursor: list[float] = []
        for number in range(count):
            field = camera.lay(surface.redrawn(number), scene)
            done = number * len(cameras) / total
            (exposure,) = camera.expose_fields(
                scene, (field,), state.start, lambda done=done: progress(done)  # type: ignore[misc]
            )  # fmt: skip
            images = ExposureImages(exposure, state.study.analysis.reference, shares_blur=True)
            for phase in cameras:
                reference, measured = images.stack(phase.redrawn(len(at_cursor)), {ALL: CASES[ALL]})
                pixels = phase.pixels(scene.raster)
                for name, values in line_values(pixels, measured, reference, state).items():
                    lines[name].append(values.measured)
                at_cursor.append(float(nearest(measured - reference, pixels, state.cursor)))
                progress(len(at_cursor) / total)
        error = np.array(at_cursor).reshape(count, len(cameras))
        known = bool(np.isfinite(error).all())
        return Drawn(
            state,
            {name: np.array(rows) for name, rows in lines.items()},
            Distribution(error, ("texture", "pixel phase")) if known else None,
        )

    def _key(self, state: State, last: Stage) -> Hashable:
        return self.controls.key(state, last)

    def _exposure_key(self, state: State) -> Hashable:
        """With a rolling shutter the pixels determine when a sample's row is exposed."""
        rolling = state.study.camera.line_time is not None
        return self._key(state, "pixels" if rolling else "exposure")

    def _on(self, state: State, quick: bool) -> tuple[Scene, Surface]:
        """Return the scene with its tool, and the surface on it."""
        base = self.opened.coarse if quick else self.opened.scene
        assert base is not None

        def make() -> tuple[Scene, Surface]:
            fitted = fit(state.study, base)
            (surface,) = fitted.surfaces.values()
            return fitted.scene, surface

        return self._fitted.get((self._key(state, "surface"), quick), make)

    def _camera(self, state: State, scene: Scene, quick: bool = False) -> Camera:
        """Return the study's camera; if quick, with no pixels finer than the scene's samples.

        Its band is kept, whose tables take longer than an image.
        """
        camera = state.study.camera.on(scene.raster, state.study.seed)
        larger = scene.raster.spacing / camera.pitch
        if quick and larger > 1:
            rows, columns = camera.shape or (0, 0)
            shape = (ceil(rows / larger), ceil(columns / larger)) if camera.shape else None
            camera = replace(camera, pitch=scene.raster.spacing, shape=shape)
        band: Band = self._bands.get((camera.band.lower, camera.band.upper), lambda: camera.band)
        return replace(camera, band=band)

    def _exposed(
        self,
        scene: Scene,
        surface: Surface,
        camera: Camera,
        state: State,
        quick: bool,
        check: Check | None,
    ) -> tuple[Exposure, ...]:
        """Return the exposure, and that without texture where it differs and is needed."""
        plain = surface.without_texture()
        both = plain is not surface and (not quick or state.error_image == "texture")
        surfaces = (surface, plain) if both else (surface,)

        def fields() -> list[EmissivityField]:
            return [camera.lay(one, scene) for one in surfaces]

        def make() -> tuple[Exposure, ...]:
            grey = all(one.in_band(camera.band, camera.reflected) is one for one in surfaces)
            spectral = () if grey else (camera.band.lower, camera.band.upper, camera.reflected)
            laid = self._fields.get((self._key(state, "surface"), quick, both, spectral), fields)
            return tuple(
                replace(exposure, effects=one.effects)
                for exposure, one in zip(
                    camera.expose_fields(scene, laid, state.start, check), surfaces, strict=True
                )
            )

        key = self._exposure_key(state)
        if quick:
            return self._quick_exposures.get((key, both), make)
        return self._exposures.get(key, make)

    def _scene_image(self, state: State, exposure: Exposure, quick: bool) -> SceneImage:
        """Return the image of the scene in the middle of the exposure."""
        index, name = _middle_frame(self.opened.scene, state), state.scene_image
        of_surface = name in ("radiance_temperature", "emissivity")
        shown = (self._exposure_key(state), exposure.raster.shape) if of_surface else ()
        exact, coarser = ((index, name, shown, few) for few in (False, True))
        few = quick and exact not in self._images
        scene = self._displayed_quick if few else self._displayed

        def make() -> SceneImage:
            values = self._scene_values(state, exposure, scene, index)
            void = scene.field("material", index) == Material.VOID
            values = np.where(void, np.nan, values).astype(np.float32)
            return SceneImage(name, values, scene.raster)

        return self._images.get(coarser if few else exact, make)

    def _scene_values(
        self, state: State, exposure: Exposure, scene: Scene, index: int
    ) -> NDArray[np.floating]:
        if state.scene_image == "speed":
            return np.asarray(np.hypot(*(scene.field(f"velocity_{xy}", index) for xy in "xy")))
        if state.scene_image == "emissivity":
            _, surface = self._on(state, quick=False)
            return self._camera(state, scene).lay(surface, scene).emissivity(scene.frame(index))
        if state.scene_image == "radiance_temperature":
            places = np.stack(np.meshgrid(scene.raster.x, scene.raster.y), axis=-1)
            radiance = nearest(exposure.centre_radiance, exposure.raster, places)
            return np.asarray(self._camera(state, scene).band.temperature(radiance))
        return scene.field(state.scene_image, index)

    def _middle(self, state: State) -> list[NDArray[np.float32]]:
        """Return temperature and emissivity in the middle of the exposure; NaN without material."""
        scene, surface = self._on(state, quick=False)
        index = _middle_frame(scene, state)

        def make() -> list[NDArray[np.float32]]:
            frame = scene.frame(index)
            emissivity = self._camera(state, scene).lay(surface, scene).emissivity(frame)
            void = frame.material == Material.VOID
            fields = (frame.temperature, emissivity)
            return [np.where(void, np.float32(nan), values) for values in fields]

        return self._frames.get((index, self._exposure_key(state)), make)


class MeasurementModel:
    """Pictures of a measurement: its frames."""

    has_quick_look = False

    def __init__(self, opened: OpenedMeasurement) -> None:
        self.opened = opened
        self.controls: Controls = opened.controls

    def changed(self, state: State, texts: dict[str, str]) -> State:
        """Return the state with some controls at other values."""
        return self.controls.changed(state, texts)

    def is_ready(self, state: State) -> bool:
        """Whether the exact picture takes milliseconds: always."""
        return True

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        measurement, index = self.opened.measurement, self._index(state)
        measured = np.asarray(measurement.data["radiance_temperature"][index].values, np.float64)
        raster, lines = measurement.raster, {}
        for name in LINES:
            line = LinePlace(name, state.line(name)).line(raster.spacing)
            lines[name] = LineValues(line.distance, sample(measured, raster, line.points))
        return Picture(state, raster, measured, ~measurement.usable[index], lines)

    def readout(self, picture: Picture) -> Readout:
        """Return the measured temperature at the cursor with its calibration's uncertainty."""
        at, raster = picture.state.cursor, picture.raster
        measured = float(nearest(picture.measured, raster, at))
        flagged = bool(nearest(picture.flagged, raster, at) == 1.0)
        measurement, index = self.opened.measurement, self._index(picture.state)
        if measurement.calibration_errors is None:
            return Readout(measured, flagged=flagged)
        effects = measurement.calibration_effects(index)
        estimate = measurement.estimate(picture.measured[None], effects[None])
        uncertainty = float(nearest(estimate.standard_uncertainty[0], raster, at))
        return Readout(measured, uncertainty, "calibration", flagged)

    def _index(self, state: State) -> int:
        return int(np.abs(self.opened.measurement.times - state.start).argmin())


Model: TypeAlias = SceneModel | MeasurementModel


def model_of(opened: Opened) -> Model:
    """Return the model of what is open."""
    if isinstance(opened, OpenedMeasurement):
        return MeasurementModel(opened)
    return SceneModel(opened)


def line_values(
    raster: Raster, measured: Array, reference: Array, state: State
) -> dict[str, LineValues]:
    """Return the temperatures along both lines."""
    values = {}
    for name in LINES:
        line = LinePlace(name, state.line(name)).line(raster.spacing)
        along = (sample(image, raster, line.points) for image in (measured, reference))
        values[name] = LineValues(line.distance, *along)
    return values


def _middle_frame(scene: Scene, state: State) -> int:
    """Return the index of the frame in the middle of the exposure."""
    duration = state.study.camera.integration_time
    middle = state.start + duration / 2 + 1e-6 * scene.frame_spacing
    return max(int(np.searchsorted(scene.times, middle, side="right")) - 1, 0)
