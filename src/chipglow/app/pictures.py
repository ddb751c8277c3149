"""Images, lines and numbers at a state of the controls; states share the stages they agree on."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from math import ceil, nan
from typing import Any, Final, Generic, TypeAlias, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis import ALL, CASES, Distribution, ExposureImages, PointPlace
from chipglow.analysis.distribution import PIXEL_PHASE
from chipglow.analysis.images import PARTS
from chipglow.analysis.looks import Schedule, View, look
from chipglow.app.controls import CURSOR, ERROR_IMAGES, LINES, SCENE_IMAGES, State
from chipglow.app.opening import QUICK_SAMPLES, OpenedMeasurement, OpenedScene, with_samples
from chipglow.camera import Camera, Exposure
from chipglow.camera.sweep import Check
from chipglow.drawing.scales import HEAT, KELVIN, PLAIN, SIGNED, ends, round_limit
from chipglow.radiometry import Band
from chipglow.scene import Material, Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.study import fit
from chipglow.surface import EmissivityField, Surface

Array: TypeAlias = NDArray[np.float64]
_Exposed: TypeAlias = tuple[ExposureImages, Exposure | None]
_Result = TypeVar("_Result")

DISPLAYED: Final = 100_000
"""Samples of the image of the scene on the page."""

_SURFACE: Final = ("surface", "seed")
_EXPOSURE: Final = (
    *_SURFACE, "start", "camera.band", "camera.integration_time", "camera.reflected"
)  # fmt: skip
_ROLLING: Final = (*_EXPOSURE, "camera.pitch", "camera.offset")
"""Beginnings of the paths of controls that change surface and exposure."""


@dataclass(frozen=True, eq=False)
class Panel:
    """An image as a figure shows it, NaN where it is grey."""

    name: str
    unit: str
    values: NDArray[Any]
    raster: Raster
    limits: tuple[float, float]
    colours: str


@dataclass(frozen=True, eq=False)
class Picture:
    """Images over the pixels in K and lines in µm and °C at a state; `quick` marks coarse ones."""

    state: State
    raster: Raster
    data: xr.Dataset  # of a scene that of `error_images`, else ``measured`` and ``flagged``
    panels: dict[str, Panel]
    lines: dict[str, dict[str, Array]]  # ``along``, ``measured`` and ``reference`` by name
    quick: bool = False
    camera: Camera | None = None
    exposure: Exposure | None = None
    parts: Callable[[], xr.Dataset] | None = None  # computes the `error_parts`

    @property
    def lower_limit(self) -> float | None:
        """Lower range limit of the camera in °C."""
        limit = self.camera.lower_limit if self.camera else None
        return None if limit is None else limit - KELVIN


@dataclass(frozen=True, eq=False)
class Readout:
    """Numbers at the cursor in K, and the parts of the error; NaN for those that are unknown."""

    measured: float
    uncertainty: float = nan
    source: str = ""
    flagged: bool = False
    true: float = nan
    emissivity: float = nan
    reference: float = nan
    parts: dict[str, float] | None = None


@dataclass(frozen=True, eq=False)
class Drawn:
    """Measured lines in °C, shape (draw, n), and error at the cursor over phases and textures."""

    state: State
    lines: dict[str, Array]
    error: Distribution | None


class _Cache(dict[Hashable, _Result], Generic[_Result]):
    def __init__(self, size: int) -> None:
        self._size = size

    def result(self, key: Hashable, make: Callable[[], _Result]) -> _Result:
        self[key] = result = self.pop(key) if key in self else make()
        if len(self) > self._size:
            del self[next(iter(self))]
        return result


class SceneModel:
    """Pictures of a scene for one session."""

    def __init__(self, opened: OpenedScene) -> None:
        self.opened, self.controls = opened, opened.controls
        self._bands: _Cache[Band] = _Cache(4)
        self._surfaces: _Cache[tuple[Scene, Surface]] = _Cache(4)
        self._laid: _Cache[list[EmissivityField]] = _Cache(4)
        self._exposures: _Cache[_Exposed] = _Cache(2)
        self._quick_exposures: _Cache[_Exposed] = _Cache(24)
        self._errors: _Cache[xr.Dataset] = _Cache(8)
        self._parts: _Cache[xr.Dataset] = _Cache(2)
        self._images: _Cache[Panel] = _Cache(4)
        self._fields: _Cache[NDArray[np.float32]] = _Cache(2)
        self._displayed = with_samples(opened.scene, DISPLAYED)
        self._displayed_quick = with_samples(opened.scene, QUICK_SAMPLES)

    @property
    def has_quick_look(self) -> bool:
        """Whether a picture of a coarser scene precedes the exact one."""
        return self.opened.coarse is not None

    def is_ready(self, state: State) -> bool:
        """Whether the exact picture takes milliseconds."""
        if self._exposure_key(state) not in self._exposures:
            return False
        camera, coarse = state.study.camera, self.opened.coarse
        kind = camera.psf.kind if camera.psf else ""
        on_samples = camera.psf_order != "detector" and kind == "annular-aperture"
        # A quick look at pixels hardly larger than the coarse samples takes half as long.
        many = on_samples or (coarse is not None and camera.pitch < 1.5 * coarse.raster.spacing)
        if not many:
            return True
        exact = self._camera(state, self.opened.scene)
        return (self._exposure_key(state), exact, False) in self._errors

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return images and lines at a state; `check` is called meanwhile and may raise."""
        quick = quick and self.has_quick_look
        scene, surface = self._on(state, quick)
        camera = self._camera(state, scene, quick)
        images, untextured = self._exposed(scene, surface, camera, state, quick, check)
        key = self._exposure_key(state), camera, quick
        data = self._errors.result(key, lambda: images.errors(camera))

        def parts() -> xr.Dataset:
            return self._parts.result(
                (*key, untextured is None), lambda: images.parts(camera, untextured)
            )

        error = data["case_1"]
        if state.error_image != "total":
            error = parts().get(state.error_image, xr.zeros_like(error))
        raster, exposure = camera.pixels(scene.raster), images.exposure
        shown, label = _unflagged(data, error), ERROR_IMAGES[state.error_image]
        limit = round_limit(shown, 99, 5.0)
        panels = {
            "scene": self._scene_panel(state, exposure, quick),
            "measured": _measured_panel(data, raster),
            "error": Panel(label, "K", shown, raster, (-limit, limit), SIGNED),
        }
        if panels["scene"].unit == "°C":  # both temperatures have the same colours
            (low, high), (least, most) = panels["scene"].limits, panels["measured"].limits
            low = low if camera.lower_limit is None else camera.lower_limit - KELVIN
            limits = min(least, low), max(most, high)
            panels |= {name: replace(panels[name], limits=limits) for name in ("scene", "measured")}
        lines = _lines(state, raster, data)
        return Picture(state, raster, data, panels, lines, quick, camera, exposure, parts)

    def readout(self, picture: Picture) -> Readout:
        assert picture.camera and picture.exposure and picture.parts
        state, at, exposure = picture.state, picture.state.cursor, picture.exposure

        def pixel(name: str) -> float:
            return float(nearest(data[name].values, picture.raster, at))

        def sample_of(name: str) -> float:
            scene = self.opened.scene
            key = self._field_key(state, name, scene, exposure)
            values = self._fields.result(key, lambda: self._field(state, name, scene, exposure))
            return float(nearest(values, scene.raster, at))

        data = picture.parts()
        silent = () if picture.camera.detector else ("detector",)
        names = {"case_1", *PARTS, "texture"}.difference(silent)
        measured = pixel("measured")
        calibration = picture.camera.calibration(picture.raster.shape)
        noisy = calibration is not None and np.isfinite(measured)
        return Readout(
            measured=measured,
            uncertainty=calibration.netd(measured) if calibration and noisy else nan,
            source="noise of one frame" if noisy else "",
            flagged=pixel("flagged") == 1.0,
            true=sample_of("temperature") + KELVIN,
            emissivity=sample_of("emissivity"),
            reference=pixel("reference"),
            parts={name: pixel(name) for name in names if name in data},
        )

    def drawn(
        self, state: State, phases: int, textures: int, progress: Callable[[float], None]
    ) -> Drawn:
        """Return lines and error at the cursor over `phases`² pixel positions and textures."""
        # This is done in another thread than the pictures, whose caches it leaves alone.
        fitted = fit(state.study, self.opened.scene)
        scene, (surface,) = fitted.scene, fitted.surfaces.values()
        camera = state.study.camera.on(scene.raster, state.study.seed)
        cursor = PointPlace(CURSOR, state.cursor)
        places = cursor, *map(state.line, LINES)
        count = textures if surface.redrawn(1) is not surface else 1
        noise = np.arange(count * phases**2).reshape(1, count, phases**2)
        schedule = Schedule(
            starts=np.array([state.start]),
            drawn=(0,),
            shown=0,
            views=(View(CURSOR, [places], noise, ()),),
            phases=phases,
            reference=state.study.analysis.reference,
            effects={ALL: CASES[ALL]},
        )
        laid = {CURSOR: camera.lay(surface.redrawn(0), scene)}
        looked = look(scene, {CURSOR: surface}, laid, camera, schedule, progress)
        reference, measured, _ = np.moveaxis(looked.read[0, 0], -1, 0)
        error = measured - reference
        return Drawn(
            state,
            {
                name: np.concatenate(looked.along[row, 0, :, :, 1]) - KELVIN
                for row, name in enumerate(LINES)
            },
            Distribution(error, ("texture", PIXEL_PHASE)) if np.isfinite(error).all() else None,
        )

    def _exposure_key(self, state: State) -> Hashable:
        """With a rolling shutter the pixels determine when a sample's row is exposed."""
        return state.key(*(_ROLLING if state.study.camera.line_time is not None else _EXPOSURE))

    def _on(self, state: State, quick: bool) -> tuple[Scene, Surface]:
        base = self.opened.coarse if quick else self.opened.scene
        assert base is not None

        def make() -> tuple[Scene, Surface]:
            fitted = fit(state.study, base)
            (surface,) = fitted.surfaces.values()
            return fitted.scene, surface

        return self._surfaces.result((state.key(*_SURFACE), quick), make)

    def _camera(self, state: State, scene: Scene, quick: bool = False) -> Camera:
        """Return the study's camera; if quick, with no pixels finer than the scene's samples."""
        camera = state.study.camera.on(scene.raster, state.study.seed)
        larger = scene.raster.spacing / camera.pitch
        if quick and larger > 1:
            rows, columns = camera.shape or (0, 0)
            shape = (ceil(rows / larger), ceil(columns / larger)) if camera.shape else None
            camera = replace(camera, pitch=scene.raster.spacing, shape=shape)
        limits = camera.band.lower, camera.band.upper
        return replace(camera, band=self._bands.result(limits, lambda: camera.band))

    def _exposed(
        self,
        scene: Scene,
        surface: Surface,
        camera: Camera,
        state: State,
        quick: bool,
        check: Check | None,
    ) -> _Exposed:
        """Return the exposure, and that without texture where it differs and is needed."""
        plain = surface.without_texture()
        both = plain is not surface and (not quick or state.error_image == "texture")
        surfaces = (surface, plain) if both else (surface,)

        def make() -> _Exposed:
            grey = surface.is_grey
            spectral = () if grey else (camera.band.lower, camera.band.upper, camera.reflected)
            laid = self._laid.result(
                (state.key(*_SURFACE), quick, both, spectral),
                lambda: [camera.lay(one, scene) for one in surfaces],
            )
            exposure, *others = camera.expose_fields(scene, laid, state.start, check)
            exposure = replace(exposure, effects=surface.effects)
            images = ExposureImages(exposure, state.study.analysis.reference)
            return images, others[0] if both else None

        key = self._exposure_key(state)
        if quick:
            return self._quick_exposures.result((key, both), make)
        return self._exposures.result(key, make)

    def _scene_panel(self, state: State, exposure: Exposure, quick: bool) -> Panel:
        name, (label, unit) = state.scene_image, SCENE_IMAGES[state.scene_image]
        few = quick and self._field_key(state, name, self._displayed, exposure) not in self._images
        scene = self._displayed_quick if few else self._displayed

        def make() -> Panel:
            values = self._field(state, name, scene, exposure)
            colours = HEAT if unit == "°C" else PLAIN
            title = f"Scene: {label.lower()}"
            return Panel(title, unit, values, scene.raster, ends(values), colours)

        return self._images.result(self._field_key(state, name, scene, exposure), make)

    def _field_key(self, state: State, name: str, scene: Scene, exposure: Exposure) -> Hashable:
        of_surface = name in ("radiance_temperature", "emissivity")
        surface = (self._exposure_key(state), exposure.raster.shape) if of_surface else ()
        return name, scene.raster.shape, self._middle_frame(state), surface

    def _field(
        self, state: State, name: str, scene: Scene, exposure: Exposure
    ) -> NDArray[np.float32]:
        """Return a field in the middle of the exposure in its image's unit; NaN off material."""
        index = self._middle_frame(state)
        values = self._values(state, name, scene, exposure, index).astype(np.float32)
        void = scene.field("material", index) == Material.VOID
        zero = np.float32(KELVIN if SCENE_IMAGES[name][1] == "°C" else 0.0)
        return np.where(void, np.float32(nan), values - zero)

    def _values(
        self, state: State, name: str, scene: Scene, exposure: Exposure, index: int
    ) -> NDArray[np.floating]:
        if name == "speed":
            return np.asarray(np.hypot(*(scene.field(f"velocity_{xy}", index) for xy in "xy")))
        if name == "emissivity":
            _, surface = self._on(state, quick=False)
            return self._camera(state, scene).lay(surface, scene).emissivity(scene.frame(index))
        if name == "radiance_temperature":
            places = np.stack(np.meshgrid(scene.raster.x, scene.raster.y), axis=-1)
            radiance = nearest(exposure.centre_radiance, exposure.raster, places)
            return np.asarray(self._camera(state, scene).band.temperature(radiance))
        return scene.field(name, index)

    def _middle_frame(self, state: State) -> int:
        """Return the index of the frame in the middle of the exposure."""
        return self.opened.scene.frame_at(state.start + state.study.camera.integration_time / 2)


class MeasurementModel:
    """Pictures of a measurement: its frames."""

    has_quick_look = False

    def __init__(self, opened: OpenedMeasurement) -> None:
        self.opened, self.controls = opened, opened.controls

    def is_ready(self, state: State) -> bool:
        return True

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        measurement = self.opened.measurement
        index, raster = self._index(state), measurement.raster
        images = {
            "measured": measurement.data["radiance_temperature"][index].values.astype(np.float64),
            "flagged": ~measurement.usable[index],
        }
        data = xr.Dataset({name: (("y", "x"), image) for name, image in images.items()})
        panels = {"measured": _measured_panel(data, raster)}
        return Picture(state, raster, data, panels, _lines(state, raster, data))

    def readout(self, picture: Picture) -> Readout:
        """Return the measured temperature at the cursor with its calibration's uncertainty."""
        at, raster, measurement = picture.state.cursor, picture.raster, self.opened.measurement
        image, index = picture.data["measured"].values, self._index(picture.state)
        measured = float(nearest(image, raster, at))
        flagged = bool(nearest(picture.data["flagged"].values, raster, at) == 1.0)
        if measurement.calibration_errors is None:
            return Readout(measured, flagged=flagged)
        estimate = measurement.estimate(image[None], measurement.calibration_effects(index)[None])
        uncertainty = float(nearest(estimate.standard_uncertainty[0], raster, at))
        return Readout(measured, uncertainty, "calibration", flagged)

    def _index(self, state: State) -> int:
        return int(np.abs(self.opened.measurement.times - state.start).argmin())


def _lines(state: State, raster: Raster, data: xr.Dataset) -> dict[str, dict[str, Array]]:
    lines = {}
    for name in LINES:
        line = state.line(name).line(raster.spacing)
        lines[name] = {"along": 1e6 * line.distance} | {
            key: sample(data[key].values, raster, line.points) - KELVIN
            for key in ("measured", "reference")
            if key in data
        }
    return lines


def _measured_panel(data: xr.Dataset, raster: Raster) -> Panel:
    values = _unflagged(data, data["measured"]) - KELVIN
    limits = ends(values, 0.0, 100.0, 10.0)
    return Panel("Measured radiance temperature", "°C", values, raster, limits, HEAT)


def _unflagged(data: xr.Dataset, image: xr.DataArray) -> Array:
    return np.where(data["flagged"].values, nan, image.values)
