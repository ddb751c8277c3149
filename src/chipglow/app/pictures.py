"""Images, lines and numbers at a state of the controls; states share the stages they agree on."""

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from math import ceil, nan, sqrt
from typing import Any, ClassVar, Final, Protocol, TypeAlias, TypeVar, cast, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis import ALL, CASES, Distribution, PointPlace, attribute
from chipglow.analysis.attribution import AttributionReference
from chipglow.analysis.distribution import PIXEL_PHASE
from chipglow.analysis.images import errors_of, exposed_chain, parts_of
from chipglow.analysis.read import Schedule, SurfacePlaces, read
from chipglow.app.controls import (
    CAMERAS,
    CORRECTING,
    CORRECTION,
    CORRECTION_IMAGES,
    CURSOR,
    ERROR_IMAGES,
    LINES,
    REFERENCES,
    SCENE_IMAGES,
    WHOLE,
    Controls,
    ShownStudy,
    State,
)
from chipglow.camera import Camera, Exposure, Measurement
from chipglow.camera.chain import ExposedChain
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.reference import TRUE
from chipglow.correction import (
    Correction,
    Zone,
    correct,
    observed_scene,
    scene_truth,
    surroundings_of,
)
from chipglow.drawing.scales import HEAT, PLAIN, SIGNED, ends, round_limit
from chipglow.io import StoredScene
from chipglow.laboratory.emissivity import PlacesDescription
from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.radiometry import ObjectParameters
from chipglow.scene import Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest
from chipglow.study import fit
from chipglow.surface import Surface
from chipglow.text import Notes

_Exposed: TypeAlias = tuple[ExposedChain, ExposedChain | None]
_Result = TypeVar("_Result")

REFERENCE: Final = "reference_temperature"
"""Variable of a measurement that the app saved: the reference of its pixels in K."""

DISPLAYED: Final = 100_000
"""Samples of the image of the scene on the page."""

_SURFACE: Final = ("surface", "seed")
_EXPOSURE: Final = (
    *_SURFACE, "start", "analysis.reference",
    "camera.band", "camera.integration_time", "camera.reflected",
)  # fmt: skip
_ROLLING: Final = (*_EXPOSURE, "camera.pitch", "camera.offset")
"""Beginnings of the paths of controls that change surface and exposure."""


_HALF: Final = 24
"""Half the side in pixels of the part that is corrected: a correction takes 3 ms a pixel."""

_STEP: Final = 16
"""Pixels by which this part follows the cursor, so that few moves need a new correction."""

_KEPT: Final[Mapping[str, int]] = {
    "errors": 8,
    "parts": 2,
    "correction": 8,
    "contributions": 2,
    "surface": 4,
    "band": 4,
    "laid": 4,
    "quick exposure": 24,
    "exposure": 2,
    "displayed": 1,
    "field": 6,
}
"""Number of kept results by stage: few of large results, many of small or slow ones."""

_HARDLY_LARGER: Final = 1.5
"""Size of a pixel, in coarse samples, below which a quick look takes half as long."""

_LINE_OF: Final = {
    "reference": "true", "corrected": "temperature", "low": "lower", "high": "upper",
}  # fmt: skip
"""Variables of a correction that are drawn along lines, by the names of their curves."""


@dataclass(frozen=True, eq=False, repr=False)
class Panel(Brief):
    """An image as a figure shows it, NaN where it is grey."""

    name: str
    unit: str
    values: NDArray[Any]
    raster: Raster
    limits: tuple[float, float]
    colours: str


@dataclass(frozen=True)
class CorrectedPixel:
    """A corrected pixel: temperatures in K (NaN: unknown), expanded uncertainty, and by source."""

    temperature: float
    expanded_uncertainty: float
    true: float
    contributions: Mapping[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Corrected(Brief):
    """A part of an image, corrected, and its true temperature in K if it is known."""

    correction: Correction
    true: Array | None = None
    frame: int = 0

    @property
    def data(self) -> xr.Dataset:
        """The frame of the correction."""
        return self.correction.data.isel(time=self.frame)

    @cached_property
    def images(self) -> Mapping[str, Array]:
        """The images of `CORRECTION_IMAGES` that are known: temperatures in °C, others in K."""
        kelvins = np.asarray(self.data["temperature"].values, np.float64)
        images = {
            "corrected": kelvins - ZERO_CELSIUS,
            "half_width": self.correction.half_width(self.frame),
        }
        if self.true is not None:
            images["true"] = np.where(np.isnan(kelvins), nan, self.true) - ZERO_CELSIUS
            images["error"] = kelvins - self.true
        return images

    def at(self, place: tuple[float, float]) -> CorrectedPixel | None:
        """Return the pixel at x and y in m; None without a corrected temperature."""
        try:
            estimate = self.correction.at(place, self.frame)
        except ValueError:
            return None
        budget = self.correction.budget(place, self.frame)
        true = nan
        if self.true is not None:
            true = float(nearest(self.true, self.correction.raster, place))
        return CorrectedPixel(
            float(estimate.values),
            float(estimate.expanded_uncertainty()),
            true,
            dict(zip(budget.cause, budget.standard_uncertainty, strict=True)),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Picture(Brief):
    """Images over the pixels in K and lines in µm and °C at a state; `quick` marks coarse ones."""

    state: State
    raster: Raster
    data: xr.Dataset  # of a scene that of `error_images`, else ``measured`` and ``flagged``
    panels: dict[str, Panel]
    lines: dict[str, dict[str, Array]]  # ``along``, ``measured`` and ``reference`` by name
    crossings: dict[str, float]  # distances at which lines enter the tool in µm
    quick: bool = False
    camera: Camera | None = None
    exposure: Exposure | None = None
    parts: Callable[[], xr.Dataset] | None = None  # computes the `error_parts`
    absent: Mapping[str, str] = field(default_factory=dict)  # why error images are 0 everywhere
    reference: str = ""  # label of the reference
    corrected: Corrected | None = None
    second: Panel | None = None  # image of the second camera

    @property
    def lower_limit(self) -> float | None:
        """Lower range limit of the camera in °C."""
        limit = self.camera.lower_limit if self.camera else None
        return None if limit is None else limit - ZERO_CELSIUS


@dataclass(frozen=True, eq=False, repr=False)
class Drawn(Brief):
    """Measured lines in °C, shape (draw, n), and error at the cursor over phases and textures."""

    state: State
    lines: dict[str, Array]
    error: Distribution | None


@dataclass(frozen=True, eq=False)
class SceneFrames:
    """Frames that the camera of a state makes of a scene, computed when they are asked for."""

    state: State
    scene: Scene
    times: Array

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return self._camera.pixels(self.scene.raster)

    def kelvins(self, index: int) -> Array:
        """Return the radiance temperature of a frame in K, shape (y, x); NaN out of range."""
        fitted = fit(self.state.study, self.scene)
        (surface,) = fitted.surfaces.values()
        measured = self._camera.measure(fitted.scene, surface, float(self.times[index]))
        return np.asarray(measured.radiance_temperature()[0])

    @property
    def _camera(self) -> Camera:
        study = self.state.study
        return study.camera.on(self.scene.raster, study.seed)


@dataclass(eq=False)
class SceneModel:
    """A scene, the controls of its study, and pictures; each session has a copy."""

    name: str
    scene: Scene
    coarse: Scene | None  # with fewer samples, for a quick look before the exact picture
    controls: Controls
    file: str | None  # the scene as a saved study names it; None for the study's cut
    source: str = ""
    """The file as a session names it."""
    places: PlacesDescription | None = None
    """Places and view of the session that was opened."""
    images: ClassVar[tuple[str, ...]] = (
        "scene", "measured", "second", "corrected", "half_width", "true", "error",
    )  # fmt: skip
    notes: ClassVar[Notes] = Notes()
    _caches: dict[str, dict[Hashable, Any]] = field(
        init=False, default_factory=lambda: defaultdict(dict), repr=False
    )

    @property
    def raster(self) -> Raster:
        return self.scene.raster

    @property
    def tool(self) -> Tool | None:
        return self.scene.tool

    def shown(self, state: State) -> tuple[str, ...]:
        """Return the names of the images at a state."""
        if state.study.images == CORRECTION:
            return ("measured", *CORRECTION_IMAGES)
        third = "second" if state.study.images == CAMERAS else "error"
        return ("scene", "measured", third)

    def is_ready(self, state: State) -> bool:
        """Return whether the exact picture needs no quick look, as it takes milliseconds."""
        if self.coarse is None:
            return True
        if state.second is not None and not self.is_ready(state.second):
            return False
        key, camera = self._exposure_key(state), state.study.camera
        kind = camera.psf.kind if camera.psf else ""
        on_samples = camera.psf_order != "detector" and kind == "annular-aperture"
        is_slow = on_samples or camera.pitch < _HARDLY_LARGER * self.coarse.raster.spacing
        exact = key, self._camera(state, self.scene), False
        is_known = exact in self._caches["errors"]
        return key in self._caches["exposure"] and (is_known or not is_slow)

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return images and lines at a state; `check` is called meanwhile and may raise."""
        quick = quick and self.coarse is not None
        scene, surface = self._on(state, quick)
        camera, shown = self._camera(state, scene, quick), state.study.error_image
        exposed = self._exposed(scene, surface, camera, state, quick, check)
        images, untextured = (one and one.through(camera) for one in exposed)
        assert images is not None
        key = self._exposure_key(state), camera, quick
        data = self._kept("errors", key, lambda: errors_of(images))

        def parts() -> xr.Dataset:
            of = *key, untextured is None
            return self._kept("parts", of, lambda: parts_of(images, untextured))

        error = data["case_1"]
        if shown != "total":
            error = parts().get(shown, xr.zeros_like(error))
        raster, exposure = camera.pixels(scene.raster), images.exposure
        values, reference = _unflagged(data, error), REFERENCES[state.study.analysis.reference]
        title = _error_title(reference) if shown == "total" else ERROR_IMAGES[shown]
        panels = {
            "scene": self._scene_panel(state, exposure),
            "measured": _measured_panel(data, raster),
            "error": _error_panel(title, values, raster),
        }
        if panels["scene"].unit == "°C":  # both temperatures have the same colours
            limits = panels["scene"].limits
            if np.isfinite(panels["measured"].values).any():
                (low, high), (least, most) = limits, panels["measured"].limits
                low = low if camera.lower_limit is None else camera.lower_limit - ZERO_CELSIUS
                limits = min(least, low), max(most, high)
            panels |= {name: replace(panels[name], limits=limits) for name in ("scene", "measured")}
        picture = Picture(
            state, raster, data, panels, _lines(state, raster, data),
            _crossings(state, scene.tool), quick, camera, exposure, parts, _absent(state, surface),
            reference,
        )  # fmt: skip
        if state.second is not None:
            return _with_second(picture, self.picture(state.second, quick, check))
        if state.study.images != CORRECTION:
            return picture
        known = self._caches["correction"].get(self._correction_key(state))
        return _with_correction(picture, known, tuple(CORRECTION_IMAGES))

    def needs(self, state: State) -> str:
        """Return what a correction still needs: nothing, as the scene states it."""
        return ""

    def corrected(self, picture: Picture, check: Callable[[float], None]) -> Picture:
        """Return an exact picture with its corrected image around the cursor.

        `check` takes the completed fraction.
        """
        assert picture.camera and picture.exposure
        state, camera, exposure = picture.state, picture.camera, picture.exposure

        def make() -> Corrected:
            scene, surface = self._on(state, quick=False)
            start, known = exposure.start, state.study.emissivity_uncertainty
            observed = observed_scene(scene, camera, surface, start, known)
            check(0.0)
            data = camera.form_measurement(exposure).data
            rows, columns = _around_cursor(state, picture.raster, _HALF)
            result = correct(
                Measurement(data.isel(y=rows, x=columns)),
                camera,
                observed,
                surroundings=surroundings_of(camera),
                progress=check,
            )
            return Corrected(result, scene_truth(result, scene, camera, observed, start))

        self._kept("correction", self._correction_key(state), make)
        return self.picture(state)

    def _correction_key(self, state: State) -> Hashable:
        camera = self._camera(state, self.scene)
        rows, columns = _around_cursor(state, camera.pixels(self.scene.raster), _HALF)
        window = rows.start, columns.start
        return self._exposure_key(state), camera, state.study.emissivity_uncertainty, window

    def frames(self, state: State) -> SceneFrames:
        """Return the frames of the state's camera, one for each start that the scene allows."""
        starts = np.array(self.controls.ranges(state)["start"])
        return SceneFrames(state, self.scene, 1e-6 * starts)

    def frame(self, state: State) -> int:
        """Return the index of the frame that begins nearest to the state's start."""
        return _nearest_time(self.frames(state).times, state)

    def measurement_of(self, picture: Picture) -> Measurement:
        """Return what the camera measures in a picture's exposure."""
        assert picture.camera and picture.exposure
        return picture.camera.form_measurement(picture.exposure)

    def numbers(self, picture: Picture) -> dict[str, float]:
        """Return the numbers at the cursor in K: those of the `error_parts`, and of the scene."""
        assert picture.camera and picture.exposure and picture.parts
        state, at, exposure = picture.state, picture.state.cursor, picture.exposure
        camera, raster, scene = picture.camera, picture.raster, self.scene

        def sample_of(name: str) -> float:
            return float(nearest(self._field(state, name, scene, exposure), scene.raster, at))

        numbers = _at(picture.parts(), raster, at)
        if camera.detector is None:
            del numbers["detector"]
        if not camera.optics:
            del numbers["optics"]
        if "emissivity" in picture.absent:
            del numbers["emissivity"]
        calibration = camera.calibration(raster.shape)
        if calibration and np.isfinite(numbers["measured"]):
            numbers["uncertainty"] = calibration.netd(numbers["measured"])
        if picture.second is not None:
            pixel = nearest(picture.second.values, picture.second.raster, at)
            numbers["second"] = float(pixel) + ZERO_CELSIUS
            shown = nearest(picture.panels["measured"].values, raster, at)
            numbers["first"] = float(shown) + ZERO_CELSIUS
        numbers["sample temperature"] = sample_of("temperature") + ZERO_CELSIUS
        numbers["sample emissivity"] = sample_of("emissivity")
        return numbers

    def contributions(self, picture: Picture, check: Check) -> dict[str, float]:
        """Return the contribution of each effect to the error at the cursor in K.

        There are none out of range, and for a reference that `attribute` does not have.
        """
        assert picture.camera and picture.exposure
        state, camera, start = picture.state, picture.camera, picture.exposure.start
        against = cast(AttributionReference, state.study.analysis.reference)
        flagged = nearest(picture.data["flagged"].values, picture.raster, state.cursor)
        if against not in get_args(AttributionReference) or flagged:
            return {}
        scene, surface = self._on(state, quick=False)
        data = self._kept(
            "contributions",
            (self._exposure_key(state), camera),
            lambda: attribute(scene, camera, surface, start, reference=against, check=check),
        )
        values = (nearest(one, picture.raster, state.cursor) for one in data.contribution.values)
        return dict(zip(data.effect.values.tolist(), map(float, values), strict=True))

    def drawn(
        self, state: State, phases: int, textures: int, progress: Callable[[float], None]
    ) -> Drawn:
        """Return lines and error at the cursor over `phases`² pixel positions and textures."""
        # This is done in another thread than the pictures, whose caches it leaves alone.
        study = state.study
        fitted = fit(study, self.scene)
        scene, (surface,) = fitted.scene, fitted.surfaces.values()
        camera = study.camera.on(scene.raster, study.seed)
        places = PointPlace(CURSOR, state.cursor), *map(state.line, LINES)
        count = textures if surface.redrawn(1) is not surface else 1
        noise = np.arange(count * phases**2).reshape(1, count, phases**2)
        schedule = Schedule(
            starts=np.array([study.start]),
            drawn=(0,),
            shown=0,
            views=(SurfacePlaces(CURSOR, [places], noise, ()),),
            phases=phases,
            reference=study.analysis.reference,
            effects={ALL: CASES[ALL]},
        )
        laid = {CURSOR: camera.prepare(surface.redrawn(0), scene)}
        data = read(scene, {CURSOR: surface}, laid, camera, schedule, progress).data
        seen = data.isel(exposure=0, effects=0)
        error = (seen.measured - seen.reference).values[0]
        lines = {
            name: np.concatenate(seen.line_measured.sel(line=line).values) - ZERO_CELSIUS
            for name, line in LINES.items()
        }
        is_known = np.isfinite(error).all()
        return Drawn(
            state, lines, Distribution(error, ("texture", PIXEL_PHASE)) if is_known else None
        )

    def _kept(self, stage: str, key: Hashable, make: Callable[[], _Result]) -> _Result:
        """Return the result of a stage, of which the last ones are kept."""
        cache: dict[Hashable, _Result] = self._caches[stage]
        cache[key] = result = cache.pop(key) if key in cache else make()
        if len(cache) > _KEPT[stage]:
            del cache[next(iter(cache))]
        return result

    def _exposure_key(self, state: State) -> Hashable:
        """With a rolling shutter the pixels determine when a sample's row is exposed."""
        return state.key(*(_ROLLING if state.study.camera.line_time is not None else _EXPOSURE))

    def _on(self, state: State, quick: bool) -> tuple[Scene, Surface]:
        base = self.coarse if quick else self.scene
        assert base is not None

        def make() -> tuple[Scene, Surface]:
            fitted = fit(state.study, base)
            (surface,) = fitted.surfaces.values()
            return fitted.scene, surface

        return self._kept("surface", (state.key(*_SURFACE), quick), make)

    def _camera(self, state: State, scene: Scene, quick: bool = False) -> Camera:
        """Return the study's camera; if quick, with no pixels finer than the scene's samples."""
        camera = state.study.camera.on(scene.raster, state.study.seed)
        larger = scene.raster.spacing / camera.pitch
        if quick and larger > 1:
            rows, columns = camera.shape or (0, 0)
            shape = (ceil(rows / larger), ceil(columns / larger)) if camera.shape else None
            camera = replace(camera, pitch=scene.raster.spacing, shape=shape)
        limits = camera.band.lower, camera.band.upper
        return replace(camera, band=self._kept("band", limits, lambda: camera.band))

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
            laid = self._kept(
                "laid",
                (state.key(*_SURFACE), quick, both, () if surface.is_grey else spectral),
                lambda: [camera.prepare(one, scene) for one in (surface, plain)[: 1 + both]],
            )
            exposure, *others = camera.expose_fields(scene, laid, state.study.start, check)
            exposure = replace(exposure, effects=surface.effects)
            reference = state.study.analysis.reference
            images = exposed_chain(camera, exposure, reference)
            return images, exposed_chain(camera, others[0], reference) if both else None

        key = self._exposure_key(state)
        if quick:
            return self._kept("quick exposure", (key, both), make)
        return self._kept("exposure", key, make)

    def _scene_panel(self, state: State, exposure: Exposure) -> Panel:
        name = state.study.scene_image
        scene = self._kept("displayed", "", lambda: with_samples(self.scene, DISPLAYED))
        label, unit, _ = SCENE_IMAGES[name]
        values = self._field(state, name, scene, exposure)
        colours = HEAT if unit == "°C" else PLAIN
        return Panel(f"Scene: {label.lower()}", unit, values, scene.raster, ends(values), colours)

    def _field(
        self, state: State, name: str, scene: Scene, exposure: Exposure
    ) -> NDArray[np.float32]:
        """Return a field in the middle of the exposure in its image's unit; NaN off material."""
        study, of_surface = state.study, name in ("radiance_temperature", "emissivity")
        index = self.scene.frame_at(study.start + study.camera.integration_time / 2)
        surface = (self._exposure_key(state), exposure.raster.shape) if of_surface else ()

        def make() -> NDArray[np.float32]:
            values = self._values(state, name, scene, exposure, index).astype(np.float32)
            void = scene.field("material", index) == Material.VOID
            zero = np.float32(ZERO_CELSIUS if SCENE_IMAGES[name][1] == "°C" else 0.0)
            return np.where(void, np.float32(nan), values - zero)

        return self._kept("field", (name, scene.raster.shape, index, surface), make)

    def _values(
        self, state: State, name: str, scene: Scene, exposure: Exposure, index: int
    ) -> NDArray[np.floating]:
        if name == "speed":
            return np.asarray(np.hypot(*(scene.field(f"velocity_{xy}", index) for xy in "xy")))
        if name == "emissivity":
            _, surface = self._on(state, quick=False)
            return self._camera(state, scene).prepare(surface, scene).emissivity(scene.frame(index))
        if name == "radiance_temperature":
            radiance = nearest(exposure.centre_radiance, exposure.raster, scene.raster.centres)
            return np.asarray(self._camera(state, scene).band.temperature(radiance))
        return scene.field(name, index)


class _FramesModel(ABC):
    """Frames whose true temperature is not known."""

    coarse: ClassVar[None] = None

    @property
    @abstractmethod
    def images(self) -> tuple[str, ...]:
        """Names of the images."""

    def shown(self, state: State) -> tuple[str, ...]:
        """Return the names of the images at a state: always all."""
        return self.images

    def needs(self, state: State) -> str:
        """Return what a correction still needs, in words; empty if nothing."""
        return ""

    @property
    @abstractmethod
    def times(self) -> Array:
        """Times of the frames in s."""

    @property
    @abstractmethod
    def raster(self) -> Raster:
        """Grid of the pixels."""

    @abstractmethod
    def kelvins(self, index: int) -> Array:
        """Return the radiance temperature of a frame in K, shape (y, x); NaN out of range."""

    def frames(self, state: State) -> "_FramesModel":
        """Return the frames, which do not depend on the state."""
        return self

    def frame(self, state: State) -> int:
        """Return the index of the frame that began nearest to the state's start."""
        return _nearest_time(self.times, state)

    def contributions(self, picture: Picture, check: Check) -> dict[str, float]:
        """Return nothing: an error is not known without the truth."""
        return {}


class MeasuredFrames(Protocol):
    """Frames of a measurement, each read when it is asked for."""

    first: Measurement
    times: Array

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""

    def measurement(self, index: int) -> Measurement:
        """Return one frame."""


@dataclass(eq=False)
class MeasurementModel(_FramesModel):
    """Frames of a measurement, their controls, and pictures; each session has a copy."""

    name: str
    measured: MeasuredFrames
    controls: Controls
    description: str = ""
    """YAML of a camera file's settings."""
    source: str = ""
    """The file as a session names it."""
    places: PlacesDescription | None = None
    """Places and view of the session that was opened."""
    _last: dict[int, tuple[xr.Dataset, dict[str, Panel], str]] = field(
        init=False, default_factory=dict, repr=False
    )
    _corrected: dict[Hashable, Corrected] = field(init=False, default_factory=dict, repr=False)

    @property
    def times(self) -> Array:
        return self.measured.times

    @property
    def raster(self) -> Raster:
        return self.measured.first.raster

    @property
    def tool(self) -> Tool | None:
        return self.measured.first.tool

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return self.measured.notes

    def kelvins(self, index: int) -> Array:
        return np.asarray(self.measured.measurement(index).radiance_temperature()[0])

    @property
    def images(self) -> tuple[str, ...]:
        """Names of the images."""
        error = ("error",) if REFERENCE in self.measured.first.data else ()
        return ("measured", "corrected", "half_width", *error)

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        data, panels, label = self._shown(self.frame(state))
        raster = self.raster
        picture = Picture(
            state, raster, data, panels, _lines(state, raster, data),
            _crossings(state, self.tool), reference=label,
        )  # fmt: skip
        known = self._corrected.get(self._key(state))
        return _with_correction(picture, known, ("corrected", "half_width"))

    def _shown(self, index: int) -> tuple[xr.Dataset, dict[str, Panel], str]:
        """Return data and images of a frame, the last one again, and the label of its reference."""
        if index in self._last:
            return self._last[index]
        measurement = self.measured.measurement(index)
        raster, reference = measurement.raster, measurement.data.get(REFERENCE)
        # The error is stated of pixels out of range too, as it is for a scene.
        measured = measurement.radiance_temperature(flagged=reference is not None)[0]
        images, label = {"measured": measured, "flagged": ~measurement.usable[0]}, ""
        if reference is not None:
            images["reference"] = reference[0].values
            images["case_1"] = measured - images["reference"]
            label = REFERENCES.get(str(reference.attrs.get("reference")), "reference")
        data = xr.Dataset({name: (("y", "x"), image) for name, image in images.items()})
        panels = {"measured": _measured_panel(data, raster)}
        if reference is not None:
            values = _unflagged(data, data["case_1"])
            panels["error"] = _error_panel(_error_title(label), values, raster)
        self._last = {index: (data, panels, label)}
        return self._last[index]

    def needs(self, state: State) -> str:
        """Return what a correction still needs, in words; empty if nothing."""
        study, band = state.study, "band_lower" in self.measured.first.data.attrs
        missing = {
            "the emissivity": study.emissivity is None,
            "the point spread function (PSF)": study.camera.psf is None,
            "the camera's band": not band,
        }
        return " and ".join(name for name, is_missing in missing.items() if is_missing)

    def corrected(self, picture: Picture, check: Callable[[float], None]) -> Picture:
        """Return a picture with the corrected image; `check` takes the completed fraction."""
        state = picture.state
        study, measurement = state.study, self.measured.measurement(self.frame(state))
        rows, columns = self._part(state)
        camera = self._camera(study, measurement)
        whole = Zone("image", study.emissivity, None, study.emissivity_uncertainty)
        result = correct(
            Measurement(measurement.data.isel(y=rows, x=columns)),
            camera,
            [whole],
            surroundings=surroundings_of(camera),
            progress=check,
        )
        self._corrected[self._key(state)] = Corrected(result)
        while len(self._corrected) > _KEPT["correction"]:
            del self._corrected[next(iter(self._corrected))]
        return self.picture(state)

    def _camera(self, study: ShownStudy, measurement: Measurement) -> Camera:
        """Return the camera of the measurement, with the optics of the page."""
        stated = study.camera
        return Camera(
            band=measurement.band,
            pitch=measurement.raster.spacing,
            fill_factor=float(measurement.data.attrs.get("fill_factor", 1.0)),
            psf=None if stated.psf is None else stated.psf.for_camera(measurement.band, None),
            reflected=stated.reflected,
        )

    def _part(self, state: State) -> tuple[slice, slice]:
        size = state.study.corrected_part
        if size == WHOLE:
            rows, columns = self.raster.shape
            return slice(0, rows), slice(0, columns)
        return _around_cursor(state, self.raster, int(size) // 2)

    def _key(self, state: State) -> Hashable:
        rows, columns = self._part(state)
        return state.key(*CORRECTING), self.frame(state), rows.start, columns.start

    def measurement_of(self, picture: Picture) -> Measurement:
        """Return the frame of a picture."""
        return self.measured.measurement(self.frame(picture.state))

    def numbers(self, picture: Picture) -> dict[str, float]:
        """Return the numbers at the cursor in K, with the calibration's uncertainty if known."""
        numbers = _at(picture.data, picture.raster, picture.state.cursor)
        frame = self.measured.measurement(self.frame(picture.state))
        if frame.calibration_errors is not None:
            row, column = _pixel(picture.raster, picture.state.cursor)
            pixel = Measurement(frame.data.isel(y=[row], x=[column]))
            pixel.band = frame.band  # which has its table of radiance already
            values = np.full((1, 1, 1), numbers["measured"])
            estimate = pixel.estimate(values, pixel.calibration_effects(0)[None])
            numbers["uncertainty"] = float(estimate.standard_uncertainty[0, 0, 0])
        return numbers


@dataclass(eq=False)
class CorrectionModel(_FramesModel):
    """A correction that `chipglow correct` wrote, its controls, and its frames as pictures."""

    name: str
    correction: Correction
    controls: Controls
    source: str = ""
    """The file as a session names it."""
    places: PlacesDescription | None = None
    """Places and view of the session that was opened."""
    tool: ClassVar[None] = None
    _last: dict[int, tuple[Corrected, xr.Dataset, Panel]] = field(
        init=False, default_factory=dict, repr=False
    )

    @property
    def raster(self) -> Raster:
        return self.correction.raster

    @property
    def images(self) -> tuple[str, ...]:
        """Names of the images."""
        return ("measured", "corrected", "half_width")

    @property
    def times(self) -> Array:
        return np.asarray(self.correction.data["time"].values, np.float64)

    def kelvins(self, index: int) -> Array:
        return np.asarray(self.correction.data["measured"][index].values, np.float64)

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return self.correction.notes

    def picture(self, state: State, quick: bool = False, check: Check | None = None) -> Picture:
        """Return the frame that began nearest to the state's start."""
        raster, index = self.raster, self.frame(state)
        if index not in self._last:
            corrected = Corrected(self.correction, frame=index)
            measured = corrected.data["measured"].values
            data = xr.Dataset(
                {"measured": (("y", "x"), measured), "flagged": (("y", "x"), np.isnan(measured))}
            )
            self._last = {index: (corrected, data, _measured_panel(data, raster))}
        corrected, data, panel = self._last[index]
        picture = Picture(
            state, raster, data, {"measured": panel}, _lines(state, raster, data), {},
            corrected=corrected,
        )  # fmt: skip
        return _with_correction(picture, corrected, ("corrected", "half_width"))

    def measurement_of(self, picture: Picture) -> None:
        """Return nothing: a correction states no radiance."""

    def numbers(self, picture: Picture) -> dict[str, float]:
        """Return the measured temperature at the cursor in K."""
        return _at(picture.data, picture.raster, picture.state.cursor)


def _nearest_time(times: Array, state: State) -> int:
    return int(np.abs(times - state.study.start).argmin())


Model: TypeAlias = SceneModel | MeasurementModel | CorrectionModel


def with_samples(scene: Scene, count: int, fewer_frames: bool = False) -> Scene:
    """Return a spline scene with at most `count` samples per frame; others as they are."""
    step = ceil(sqrt(scene.raster.rows * scene.raster.columns / count))
    if step < 2 or not isinstance(scene, StoredScene) or scene.lattice is None:
        return scene
    return scene.coarser(step, step if fewer_frames else 1)


def _around_cursor(state: State, pixels: Raster, half: int) -> tuple[slice, slice]:
    """Return the rows and columns of pixels that are corrected; the cursor is well inside."""
    x, y = state.cursor
    places = (pixels.top - y) / pixels.spacing, (x - pixels.left) / pixels.spacing
    middles = (round(place / _STEP) * _STEP for place in places)
    return tuple(  # type: ignore[return-value]
        slice(max(middle - half, 0), min(middle + half, count))
        for middle, count in zip(middles, pixels.shape, strict=True)
    )


def _with_second(picture: Picture, other: Picture) -> Picture:
    """Return the images of scene and two cameras on one scale.

    The cameras show temperatures by the emissivities that are set in them.
    """
    first, second = (
        replace(_set_panel(one), name=f"{name} camera{_set_text(one)}")
        for one, name in ((picture, "First"), (other, "Second"))
    )
    scene = picture.panels["scene"]
    shown = [first, second, *([scene] if scene.unit == "°C" else [])]
    limits = min(one.limits[0] for one in shown), max(one.limits[1] for one in shown)
    first, second = (replace(one, limits=limits) for one in (first, second))
    scene = replace(scene, limits=limits) if scene.unit == "°C" else scene
    panels = {"scene": scene, "measured": first, "second": second}
    lines = {}
    for name, curves in picture.lines.items():
        line = picture.state.line(name).line(picture.raster.spacing)
        measured, of_second = (sample(one.values, one.raster, line.points) for one in shown[:2])
        unknown = np.full_like(measured, nan)
        lines[name] = {
            "along": curves["along"], "measured": measured, "reference": unknown,
            "corrected": of_second,
        }  # fmt: skip
    return replace(picture, panels=panels, lines=lines, second=second)


def _set_panel(picture: Picture) -> Panel:
    """Return the temperatures that a camera shows by the emissivity that is set in it."""
    study, panel, camera = picture.state.study, picture.panels["measured"], picture.camera
    if study.set_emissivity == 1.0:
        return panel
    assert camera is not None
    reflected = float(surroundings_of(camera).values)
    known = ObjectParameters(emissivity=study.set_emissivity, reflected=reflected)
    radiance = camera.band.radiance(panel.values + ZERO_CELSIUS)
    values = known.temperature(radiance, camera.band) - ZERO_CELSIUS
    return replace(panel, values=values, limits=ends(values, 0.0, 100.0, 10.0))


def _set_text(picture: Picture) -> str:
    emissivity = picture.state.study.set_emissivity
    return "" if emissivity == 1.0 else f", emissivity {emissivity:g}"


def _with_correction(
    picture: Picture, corrected: Corrected | None, names: tuple[str, ...]
) -> Picture:
    """Return the picture with its measured image, and those of a correction by their names.

    They are grey where not known.
    """
    measured = picture.panels["measured"]
    raster = corrected.correction.raster if corrected else picture.raster
    known = corrected.images if corrected else {}
    images = {name: known.get(name, _unknown(raster.shape)) for name in names}
    low, high = measured.limits
    temperature = images["corrected"]
    if np.isfinite(temperature).any():
        low, high = min(low, np.nanmin(temperature)), max(high, np.nanmax(temperature))
    panels = {"measured": replace(measured, limits=(low, high))}
    for name, image in images.items():
        title = CORRECTION_IMAGES[name]
        if name == "error":
            panels[name] = _error_panel(title, image, raster)
        elif name == "half_width":
            limits = 0.0, round_limit(image, 98, 5.0)
            panels[name] = Panel(title, "K", image, raster, limits, PLAIN)
        else:
            panels[name] = Panel(title, "°C", image, raster, (low, high), HEAT)
    lines = {
        name: curves | _corrected_line(picture, corrected, name)
        for name, curves in picture.lines.items()
    }
    others = {name: panel for name, panel in picture.panels.items() if name not in panels}
    kept = {} if "scene" in others else others
    return replace(picture, panels=panels | kept, lines=lines, corrected=corrected)


@lru_cache(maxsize=2)
def _unknown(shape: tuple[int, int]) -> Array:
    """Return an image without values; the same one again, which a page then has already."""
    return np.full(shape, nan)


def _corrected_line(picture: Picture, corrected: Corrected | None, name: str) -> dict[str, Array]:
    """Return the corrected temperature along a line, its interval and the true one in °C."""
    if corrected is None:
        unknown = np.full_like(picture.lines[name]["along"], nan)
        return {"reference": unknown} if "scene" in picture.panels else {}
    data = corrected.data
    if corrected.true is not None:
        data = data.assign(true=(("y", "x"), corrected.true))
    line = picture.state.line(name).line(picture.raster.spacing)
    return {
        key: sample(data[variable].values, corrected.correction.raster, line.points) - ZERO_CELSIUS
        for key, variable in _LINE_OF.items()
        if variable in data
    }


def _pixel(raster: Raster, at: tuple[float, float]) -> tuple[int, int]:
    """Return row and column of the pixel at x and y in m."""
    row = int((raster.top - at[1]) / raster.spacing)
    column = int((at[0] - raster.left) / raster.spacing)
    return min(max(row, 0), raster.rows - 1), min(max(column, 0), raster.columns - 1)


def _at(data: xr.Dataset, raster: Raster, at: tuple[float, float]) -> dict[str, float]:
    return {str(name): float(nearest(one.values, raster, at)) for name, one in data.items()}


def _absent(state: State, surface: Surface) -> Mapping[str, str]:
    """Return the error images that are 0 everywhere, with the reason."""
    study = state.study
    reasons = {
        "emissivity": not study.analysis.reference.startswith(TRUE) and "part of the reference",
        "psf": study.camera.psf is None and "no PSF",
        "texture": surface.without_texture() is surface and "the emissivity has none",
    }
    return {name: reason for name, reason in reasons.items() if reason}


def _lines(state: State, raster: Raster, data: xr.Dataset) -> dict[str, dict[str, Array]]:
    lines = {}
    for name in LINES:
        line = state.line(name).line(raster.spacing)
        lines[name] = {"along": 1e6 * line.distance} | {
            key: sample(data[key].values, raster, line.points) - ZERO_CELSIUS
            for key in ("measured", "reference")
            if key in data
        }
    return lines


def _crossings(state: State, tool: Tool | None) -> dict[str, float]:
    """Return the distances in µm at which lines enter the tool."""
    found = {}
    for name in LINES if tool is not None else ():
        line = state.line(name).line(1e-6)  # m between points, finer than a pixel of the figure
        depth = tool.signed_distance(*line.points.T)  # type: ignore[union-attr]
        if depth.min() < 0 < depth.max():
            found[name] = float(1e6 * line.distance[np.abs(depth).argmin()])
    return found


def _measured_panel(data: xr.Dataset, raster: Raster) -> Panel:
    values = _unflagged(data, data["measured"]) - ZERO_CELSIUS
    limits = ends(values, 0.0, 100.0, 10.0)
    return Panel("Measured radiance temperature", "°C", values, raster, limits, HEAT)


def _error_title(reference: str) -> str:
    return f"Error against {reference[0].lower()}{reference[1:]}"


def _error_panel(title: str, values: Array, raster: Raster) -> Panel:
    limit = round_limit(values, 99, 5.0)
    return Panel(title, "K", values, raster, (-limit, limit), SIGNED)


def _unflagged(data: xr.Dataset, image: xr.DataArray) -> Array:
    return np.where(data["flagged"].values, nan, image.values)
