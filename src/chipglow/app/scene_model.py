"""Pictures of a scene: states of the controls share the stages they agree on."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, nan, sqrt
from typing import Any, ClassVar, Final, TypeAlias, TypeVar, cast, get_args

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
    CORRECTION,
    CORRECTION_IMAGES,
    CURSOR,
    ERROR_IMAGES,
    LINES,
    REFERENCES,
    SCENE_IMAGES,
    Controls,
    State,
)
from chipglow.app.pictures import (
    Corrected,
    Drawn,
    Panel,
    Picture,
    around_cursor,
    crossings_of,
    error_panel,
    error_title,
    lines_of,
    measured_panel,
    nearest_time,
    unflagged,
    values_at,
    with_correction,
)
from chipglow.camera import Camera, Exposure, Measurement
from chipglow.camera.chain import ExposedChain
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.reference import TRUE
from chipglow.correction import correct, observed_scene, scene_truth, surroundings_of
from chipglow.drawing.scales import HEAT, PLAIN, ends
from chipglow.io import StoredScene
from chipglow.laboratory.emissivity import PlacesDescription
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.radiometry import ObjectParameters
from chipglow.scene import Material, Raster, Scene, Tool, sample
from chipglow.scene.lines import nearest
from chipglow.study import fit
from chipglow.study.fitting import Fitted
from chipglow.surface import Surface
from chipglow.text import Notes

_Exposed: TypeAlias = tuple[ExposedChain, ExposedChain | None]
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

_HALF: Final = 24
"""Half the side in pixels of the part that is corrected: a correction takes 3 ms a pixel."""

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


@dataclass(frozen=True, eq=False)
class SceneFrames:
    """Frames of a scene by the camera of a state, computed when they are requested."""

    state: State
    scene: Scene
    times: Array

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return self._camera.pixels(self.scene.raster)

    def kelvins(self, index: int) -> Array:
        """Return the radiance temperature of a frame in K, shape (y, x); NaN out of range."""
        (surface,) = self._fitted.surfaces.values()
        measured = self._camera.measure(self._fitted.scene, surface, float(self.times[index]))
        return np.asarray(measured.radiance_temperature()[0])

    @cached_property
    def _fitted(self) -> Fitted:
        return fit(self.state.study, self.scene)

    @cached_property
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
        values, reference = unflagged(data, error), REFERENCES[state.study.analysis.reference]
        title = error_title(reference) if shown == "total" else ERROR_IMAGES[shown]
        panels = {
            "scene": self._scene_panel(state, exposure),
            "measured": measured_panel(data, raster),
            "error": error_panel(title, values, raster),
        }
        if panels["scene"].unit == "°C":  # both temperatures have the same colours
            limits = panels["scene"].limits
            if np.isfinite(panels["measured"].values).any():
                (low, high), (least, most) = limits, panels["measured"].limits
                low = low if camera.lower_limit is None else camera.lower_limit - ZERO_CELSIUS
                limits = min(least, low), max(most, high)
            panels |= {name: replace(panels[name], limits=limits) for name in ("scene", "measured")}
        picture = Picture(
            state, raster, data, panels, lines_of(state, raster, data),
            crossings_of(state, scene.tool), quick, camera, exposure, parts,
            _absent(state, surface), reference,
        )  # fmt: skip
        if state.second is not None:
            return _with_second(picture, self.picture(state.second, quick, check))
        if state.study.images != CORRECTION:
            return picture
        known = self._caches["correction"].get(self._correction_key(state))
        return with_correction(picture, known, tuple(CORRECTION_IMAGES))

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
            measurement = camera.form_measurement(exposure)
            rows, columns = around_cursor(state, picture.raster, _HALF)
            result = correct(
                measurement.part(rows=rows, columns=columns),
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
        rows, columns = around_cursor(state, camera.pixels(self.scene.raster), _HALF)
        window = rows.start, columns.start
        return self._exposure_key(state), camera, state.study.emissivity_uncertainty, window

    def frames(self, state: State) -> SceneFrames:
        """Return the frames of the state's camera, one for each start that the scene allows."""
        starts = np.array(self.controls.ranges(state)["start"])
        return SceneFrames(state, self.scene, 1e-6 * starts)

    def frame(self, state: State) -> int:
        """Return the index of the frame that begins nearest to the state's start."""
        return nearest_time(self.frames(state).times, state)

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

        numbers = values_at(picture.parts(), raster, at)
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


def with_samples(scene: Scene, count: int, fewer_frames: bool = False) -> Scene:
    """Return a spline scene with at most `count` samples per frame; others as they are."""
    step = ceil(sqrt(scene.raster.rows * scene.raster.columns / count))
    if step < 2 or not isinstance(scene, StoredScene) or scene.lattice is None:
        return scene
    return scene.coarser(step, step if fewer_frames else 1)


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


def _absent(state: State, surface: Surface) -> Mapping[str, str]:
    """Return the error images that are 0 everywhere, with the reason."""
    study = state.study
    reasons = {
        "emissivity": not study.analysis.reference.startswith(TRUE) and "part of the reference",
        "psf": study.camera.psf is None and "no PSF",
        "texture": surface.without_texture() is surface and "the emissivity has none",
    }
    return {name: reason for name, reason in reasons.items() if reason}
