"""Images, lines and numbers at a state of the controls; states share the stages they agree on."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
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
from chipglow.quantities import Array
from chipglow.radiometry import Band
from chipglow.scene import Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest
from chipglow.study import fit
from chipglow.surface import EmissivityField, Surface

_Exposed: TypeAlias = tuple[ExposureImages, Exposure | None]
_Result = TypeVar("_Result")

DISPLAYED: Final = 100_000
"""Samples of the image of the scene on the page."""

_SURFACE: Final = ("surface", "seed")
_EXPOSURE: Final = (
    *_SURFACE, "start", "analysis.reference",
    "camera.band", "camera.integration_time", "camera.reflected",
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
    crossings: dict[str, float | None]  # where lines enter the tool in µm
    quick: bool = False
    camera: Camera | None = None
    exposure: Exposure | None = None
    parts: Callable[[], xr.Dataset] | None = None  # computes the `error_parts`
    absent: Mapping[str, str] = field(default_factory=dict)  # why error images are 0 everywhere

    @property
    def lower_limit(self) -> float | None:
        """Lower range limit of the camera in °C."""
        limit = self.camera.lower_limit if self.camera else None
        return None if limit is None else limit - KELVIN

    @property
    def is_blank(self) -> bool:
        """Whether every pixel is flagged."""
        return bool(self.data["flagged"].all())


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
    parts: Mapping[str, float] | None = None


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
        self._fields: _Cache[NDArray[np.float32]] = _Cache(6)
        self._displayed = with_samples(opened.scene, DISPLAYED)
        self._displayed_quick = with_samples(opened.scene, QUICK_SAMPLES)

    @property
    def has_quick_look(self) -> bool:
        """Whether a picture of a coarser scene precedes the exact one."""
        return self.opened.coarse is not None

    def is_ready(self, state: State) -> bool:
        """Whether the exact picture takes milliseconds."""
        key = self._exposure_key(state)
        if key not in self._exposures:
            return False
        camera, coarse = state.study.camera, self.opened.coarse
        on_samples = camera.psf_order != "detector" and (
            camera.psf is not None and camera.psf.kind == "annular-aperture"
        )
        # A quick look at pixels hardly larger than the coarse samples takes half as long.
        if on_samples or (coarse is not None and camera.pitch < 1.5 * coarse.raster.spacing):
            return (key, self._camera(state, self.opened.scene), False) in self._errors
        return True

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return images and lines at a state; `check` is called meanwhile and may raise."""
        quick = quick and self.has_quick_look
        scene, surface = self._on(state, quick)
        camera, shown = self._camera(state, scene, quick), state.study.error_image
        images, untextured = self._exposed(scene, surface, camera, state, quick, check)
        key = self._exposure_key(state), camera, quick
        data = self._errors.result(key, lambda: images.errors(camera))

        def parts() -> xr.Dataset:
            return self._parts.result(
                (*key, untextured is None), lambda: images.parts(camera, untextured)
            )

        error = data["case_1"]
        if shown != "total":
            error = parts().get(shown, xr.zeros_like(error))
        raster, exposure, tool = camera.pixels(scene.raster), images.exposure, scene.tool
        values = _unflagged(data, error)
        limit = round_limit(values, 99, 5.0)
        panels = {
            "scene": self._scene_panel(state, exposure, quick),
            "measured": _measured_panel(data, raster),
            "error": Panel(ERROR_IMAGES[shown], "K", values, raster, (-limit, limit), SIGNED),
        }
        if panels["scene"].unit == "°C":  # both temperatures have the same colours
            limits = panels["scene"].limits
            if np.isfinite(panels["measured"].values).any():
                (low, high), (least, most) = limits, panels["measured"].limits
                low = low if camera.lower_limit is None else camera.lower_limit - KELVIN
                limits = min(least, low), max(most, high)
            panels |= {name: replace(panels[name], limits=limits) for name in ("scene", "measured")}
        lines, crossings = _lines(state, raster, data, tool)
        return Picture(
            state, raster, data, panels, lines, crossings, quick, camera, exposure, parts,
            dict(_absent(state, surface)),
        )  # fmt: skip

    def readout(self, picture: Picture) -> Readout:
        assert picture.camera and picture.exposure and picture.parts
        state, at, exposure = picture.state, picture.state.cursor, picture.exposure
        data, raster, scene = picture.parts(), picture.raster, self.opened.scene
        pixel = {name: float(nearest(image.values, raster, at)) for name, image in data.items()}

        def sample_of(name: str) -> float:
            return float(nearest(self._field(state, name, scene, exposure), scene.raster, at))

        silent = () if picture.camera.detector else ("detector",)
        names = {"case_1", *PARTS, "texture"}.difference(silent)
        calibration = picture.camera.calibration(raster.shape)
        noisy = calibration is not None and np.isfinite(pixel["measured"])
        return Readout(
            measured=pixel["measured"],
            uncertainty=calibration.netd(pixel["measured"]) if calibration and noisy else nan,
            source="noise of one frame" if noisy else "",
            flagged=pixel["flagged"] == 1.0,
            true=sample_of("temperature") + KELVIN,
            emissivity=sample_of("emissivity"),
            reference=pixel["reference"],
            parts={name: pixel[name] for name in names if name in pixel},
        )

    def drawn(
        self, state: State, phases: int, textures: int, progress: Callable[[float], None]
    ) -> Drawn:
        """Return lines and error at the cursor over `phases`² pixel positions and textures."""
        # This is done in another thread than the pictures, whose caches it leaves alone.
        study = state.study
        fitted = fit(study, self.opened.scene)
        scene, (surface,) = fitted.scene, fitted.surfaces.values()
        camera = study.camera.on(scene.raster, study.seed)
        places = PointPlace(CURSOR, state.cursor), *map(state.line, LINES)
        count = textures if surface.redrawn(1) is not surface else 1
        noise = np.arange(count * phases**2).reshape(1, count, phases**2)
        schedule = Schedule(
            starts=np.array([study.start]),
            drawn=(0,),
            shown=0,
            views=(View(CURSOR, [places], noise, ()),),
            phases=phases,
            reference=study.analysis.reference,
            effects={ALL: CASES[ALL]},
        )
        laid = {CURSOR: camera.lay(surface.redrawn(0), scene)}
        looked = look(scene, {CURSOR: surface}, laid, camera, schedule, progress)
        reference, measured, _ = np.moveaxis(looked.read[0, 0], -1, 0)
        error = measured - reference
        lines = {
            name: np.concatenate(looked.along[row, 0, :, :, 1]) - KELVIN
            for row, name in enumerate(LINES)
        }
        is_known = np.isfinite(error).all()
        return Drawn(
            state, lines, Distribution(error, ("texture", PIXEL_PHASE)) if is_known else None
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
        both = plain is not surface and (not quick or state.study.error_image == "texture")

        def make() -> _Exposed:
            spectral = camera.band.lower, camera.band.upper, camera.reflected
            laid = self._laid.result(
                (state.key(*_SURFACE), quick, both, () if surface.is_grey else spectral),
                lambda: [camera.lay(one, scene) for one in (surface, plain)[: 1 + both]],
            )
            exposure, *others = camera.expose_fields(scene, laid, state.study.start, check)
            exposure = replace(exposure, effects=surface.effects)
            images = ExposureImages(exposure, state.study.analysis.reference)
            return images, others[0] if both else None

        key = self._exposure_key(state)
        if quick:
            return self._quick_exposures.result((key, both), make)
        return self._exposures.result(key, make)

    def _scene_panel(self, state: State, exposure: Exposure, quick: bool) -> Panel:
        name, (label, unit) = state.study.scene_image, SCENE_IMAGES[state.study.scene_image]
        few = quick and self._field_key(state, name, self._displayed, exposure) not in self._fields
        scene = self._displayed_quick if few else self._displayed
        values = self._field(state, name, scene, exposure)
        colours = HEAT if unit == "°C" else PLAIN
        return Panel(f"Scene: {label.lower()}", unit, values, scene.raster, ends(values), colours)

    def _field_key(self, state: State, name: str, scene: Scene, exposure: Exposure) -> Hashable:
        of_surface = name in ("radiance_temperature", "emissivity")
        surface = (self._exposure_key(state), exposure.raster.shape) if of_surface else ()
        return name, scene.raster.shape, self._middle_frame(state), surface

    def _field(
        self, state: State, name: str, scene: Scene, exposure: Exposure
    ) -> NDArray[np.float32]:
        """Return a field in the middle of the exposure in its image's unit; NaN off material."""
        index = self._middle_frame(state)

        def make() -> NDArray[np.float32]:
            values = self._values(state, name, scene, exposure, index).astype(np.float32)
            void = scene.field("material", index) == Material.VOID
            zero = np.float32(KELVIN if SCENE_IMAGES[name][1] == "°C" else 0.0)
            return np.where(void, np.float32(nan), values - zero)

        return self._fields.result(self._field_key(state, name, scene, exposure), make)

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
        study = state.study
        return self.opened.scene.frame_at(study.start + study.camera.integration_time / 2)


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
        return Picture(state, raster, data, panels, *_lines(state, raster, data, measurement.tool))

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
        return int(np.abs(self.opened.measurement.times - state.study.start).argmin())


def _absent(state: State, surface: Surface) -> Mapping[str, str]:
    """Return the error images that are 0 everywhere, with the reason."""
    study = state.study
    reasons = {
        "emissivity": study.analysis.reference != "true" and "part of the reference",
        "psf": study.camera.psf is None and "no PSF",
        "texture": surface.without_texture() is surface and "the emissivity has none",
    }
    return {name: reason for name, reason in reasons.items() if reason}


def _lines(
    state: State, raster: Raster, data: xr.Dataset, tool: Tool | None
) -> tuple[dict[str, dict[str, Array]], dict[str, float | None]]:
    """Return temperatures along the lines, and the distances at which these enter the tool."""
    lines: dict[str, dict[str, Array]] = {}
    crossings: dict[str, float | None] = dict.fromkeys(LINES)
    for name in LINES:
        line = state.line(name).line(raster.spacing)
        along = 1e6 * line.distance
        lines[name] = {"along": along} | {
            key: sample(data[key].values, raster, line.points) - KELVIN
            for key in ("measured", "reference")
            if key in data
        }
        crossings[name] = (
            None if tool is None else _zero(along, tool.signed_distance(*line.points.T))
        )
    return lines, crossings


def _zero(along: Array, values: Array) -> float | None:
    """Return where values along a line first change their sign; None if they do not."""
    changes = np.flatnonzero(np.diff(values > 0))
    if not changes.size:
        return None
    pair = slice(changes[0], changes[0] + 2)
    order = np.argsort(values[pair])
    return float(np.interp(0.0, values[pair][order], along[pair][order]))


def _measured_panel(data: xr.Dataset, raster: Raster) -> Panel:
    values = _unflagged(data, data["measured"]) - KELVIN
    limits = ends(values, 0.0, 100.0, 10.0)
    return Panel("Measured radiance temperature", "°C", values, raster, limits, HEAT)


def _unflagged(data: xr.Dataset, image: xr.DataArray) -> Array:
    return np.where(data["flagged"].values, nan, image.values)
