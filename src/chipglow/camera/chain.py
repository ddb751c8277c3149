"""The chain from a scene to the reading of every pixel, with effects switched on and off."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.camera.camera import Camera
from chipglow.camera.effect import EVERY, Effect
from chipglow.camera.exposure import Exposure, SpectralView
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.image import form_image, image_formation
from chipglow.camera.measurement import range_flags
from chipglow.camera.measuring import read_radiance
from chipglow.camera.optics.convolution import blur
from chipglow.camera.optics.image_formation import ImageFormation
from chipglow.camera.optics.psf import PointSpreadFunction
from chipglow.camera.optics.sampling import integrate
from chipglow.camera.reference import (
    TRUE,
    WITHOUT_FOOTPRINT,
    Moment,
    ReferenceKind,
    moment_of,
    reference_temperature,
    still_radiance,
    true_kind,
)
from chipglow.quantities import Array, unchecked
from chipglow.scene import Raster, Scene, sample
from chipglow.surface import EmissivityField, ModifiedSurface, Surface, UniformSurface

_IMAGES_KEPT: Final = 128
"""Images before the detector that are kept: every combination of six effects twice."""

_READINGS_KEPT: Final = 32
"""Readings and references that are kept: a few for each of the cameras of one place."""

OF_THE_SURFACE: Final = frozenset({Effect.EMISSIVITY, Effect.REFLECTION})
"""Effects that a radiance temperature contains, and a true temperature does not."""

_Coalition = frozenset[str]


class PixelReading(NamedTuple):
    """Reading of a camera: temperatures in K and flags of a measurement, each (y, x)."""

    temperature: Array
    flags: NDArray[np.uint8]


class Exposures(NamedTuple):
    """One exposure of a scene: as it is, without reflections, and of a blackbody."""

    seen: Exposure
    unreflecting: Exposure
    black: Exposure


@dataclass(frozen=True, eq=False)
class LightBeyond:
    """Light that reaches the pixels from beyond a part of a scene: it is blurred into the part."""

    image: Array
    """Radiance in W/(m² sr) on some pixels, (y, x); negative where the edge continues too bright"""
    pixels: Raster

    def on(self, pixels: Raster) -> Array:
        """Return the radiance on other pixels, linear between these; 0 beyond them."""
        return np.nan_to_num(sample(self.image, self.pixels, pixels.centres))


@dataclass(frozen=True, eq=False)
class Chain:
    """A camera in front of a scene: from the true temperatures to the reading of every pixel.

    Parameters
    ----------
    camera : Camera
        The camera.
    scene : Scene
        The true fields.
    surface : Surface
        The emissivity.
    field : EmissivityField, optional
        The surface on the scene, from `Camera.prepare`, if it is known.
    beyond : LightBeyond, optional
        Light from beyond a scene that is part of another, with all effects.

    Examples
    --------
    The reading of the paper's case 2, without point spread function::

        Chain(camera, scene, surface).at(start).reading(EVERY - {Effect.PSF})
    """

    camera: Camera
    scene: Scene
    surface: Surface
    field: EmissivityField | None = None
    beyond: LightBeyond | None = None

    @cached_property
    def emissivity(self) -> EmissivityField:
        """The surface on the scene."""
        return self.field or self.camera.prepare(self.surface, self.scene)

    @cached_property
    def image_formation(self) -> ImageFormation:
        """The linear map from the radiance of the scene's samples to that of the pixels."""
        return image_formation(self.camera, self.scene.raster)

    def forward(self, radiance: ArrayLike) -> Array:
        """Return the radiance of the pixels in W/(m² sr), from that of the samples, each (y, x)."""
        return self.image_formation.forward(radiance)

    def adjoint(self, image: ArrayLike) -> Array:
        """Return the adjoint map, from values of the pixels to values of the samples, (y, x)."""
        return self.image_formation.adjoint(image)

    def at(
        self, start: float, reference: ReferenceKind = "maximum", check: Check | None = None
    ) -> "ExposedChain":
        """Expose once, from `start` in s.

        Parameters
        ----------
        start : float
            Start of the integration in s.
        reference : ReferenceKind
            The temperature of a pixel without error.
        check : callable, optional
            Called periodically. An exception raised here ends the computation.

        Raises
        ------
        ValueError
            If the scene does not cover the integration time or the pixels.
        """
        (exposure,) = expose_chains([self], start, check)
        return self.exposed(replace(exposure, effects=self.surface.effects), reference)

    def exposed(
        self, exposure: Exposure, reference: ReferenceKind = "maximum", shares_blur: bool = False
    ) -> "ExposedChain":
        """Return the chain with an exposure that is known.

        `shares_blur` keeps the blurred samples, which cameras that differ in the position of their
        pixels have in common.
        """
        apart = lru_cache(1)(partial(_exposures, self, exposure))
        stages = Stages(exposure, apart, shares_blur, self.beyond)
        return ExposedChain(self.camera, stages, reference, self.reflects)

    @property
    def view(self) -> SpectralView:
        """The surface on the scene in the camera's band and surroundings."""
        return SpectralView(self.emissivity, self.camera.band, self.camera.reflected)

    @property
    def reflects(self) -> bool:
        """Whether surroundings or other surfaces are reflected."""
        return _unreflecting(self.surface) is not self.surface or self.camera.reflected is not None


class Stages:
    """Exposures of a scene, and what cameras form of them; the last ones are kept."""

    def __init__(
        self,
        exposure: Exposure,
        apart: Callable[[], Exposures] | None = None,
        shares_blur: bool = False,
        beyond: LightBeyond | None = None,
    ) -> None:
        if not isinstance(exposure, Exposure):
            raise ValueError(
                f"exposure: {type(exposure).__name__}, expected an Exposure as Camera.expose "
                "returns: a measurement no longer holds the scene's true temperatures"
            )
        self.exposure = exposure
        sources = partial(_source, exposure, apart)
        blurred = partial(blur, exposure.mean_radiance, spacing=exposure.raster.spacing)
        kept = lru_cache(1)(blurred) if shares_blur else None
        self.radiance = lru_cache(_IMAGES_KEPT)(partial(_formed, sources, kept, beyond))
        self.read = lru_cache(_READINGS_KEPT)(partial(_read, self.radiance, exposure.start))
        self.reference = lru_cache(_READINGS_KEPT)(
            partial(reference_temperature, exposure=exposure)
        )


@dataclass(frozen=True, eq=False)
class ExposedChain:
    """Readings of a camera in one exposure, with some of its effects switched on.

    Effects are members of `Effect`; the kind of a term, such as ``veil`` or ``shot-noise``, names
    one of the terms of `Effect.OPTICS` or `Effect.DETECTOR`. Switched off, an effect is ideal:
    emissivity 1; no surroundings; the instant and the sample of the reference; no blur; none of the
    terms; no full well, saturation or rounding to counts. Without any effect the chain reads the
    true temperature at that instant and sample.
    """

    camera: Camera
    stages: Stages
    reference_kind: ReferenceKind = "maximum"
    reflects: bool = False

    @property
    def exposure(self) -> Exposure:
        """The exposure with all effects."""
        return self.stages.exposure

    @property
    def pixels(self) -> Raster:
        """The pixels on the scene."""
        return self.camera.pixels(self.exposure.raster)

    def through(self, camera: Camera) -> "ExposedChain":
        """Return the chain with another camera of the same band and integration time."""
        return replace(self, camera=camera)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects that are present, in the order of the light."""
        camera, detector = self.camera, self.camera.detector
        absent = {
            Effect.REFLECTION: not self.reflects,
            Effect.PSF: camera.psf is None,
            Effect.OPTICS: not camera.optics,
            Effect.MISREGISTRATION: True,
            Effect.DELAY: True,
            Effect.DETECTOR: detector is None or not detector.terms,
            Effect.DIGITISER: detector is None,
        }
        return tuple(one for one in Effect if not absent.get(one, False))

    @property
    def contained(self) -> _Coalition:
        """Effects that the reference contains."""
        return frozenset() if self.reference_kind.startswith(TRUE) else OF_THE_SURFACE

    def reference(self, kind: ReferenceKind | None = None) -> Array:
        """Return the temperature in K of pixels without error; NaN where nothing radiates."""
        pixels_alone = unchecked(
            self.camera, psf=None, psf_order="optics", optics=(), detector=None
        )
        return self.stages.reference(pixels_alone, kind=kind or self.reference_kind)

    def radiance(self, on: Collection[str] = EVERY) -> Array:
        """Return the radiance of the pixels before the detector in W/(m² sr), (y, x)."""
        acting = self._acting(on)
        return self.stages.radiance(
            self._without_detector(acting),
            _source_name(acting, self.reflects),
            Effect.MOTION in acting,
            Effect.FOOTPRINT in acting,
            moment_of(self.reference_kind),
        )

    def read(self, on: Collection[str] = EVERY) -> PixelReading:
        """Return temperatures and flags, whether flagged pixels or not."""
        acting = self._acting(on)
        if not acting:
            true = self.reference(true_kind(self.reference_kind))
            return PixelReading(true, range_flags(true, self.camera.lower_limit))
        return self.stages.read(
            self._switched(acting),
            _source_name(acting, self.reflects),
            Effect.MOTION in acting,
            Effect.FOOTPRINT in acting,
            moment_of(self.reference_kind),
        )

    def reading(self, on: Collection[str] = EVERY) -> Array:
        """Return the measured temperature in K, (y, x); NaN where the reference has none.

        A pixel below the range limit reads the temperature of its radiance.
        """
        return np.where(np.isnan(self.reference()), np.nan, self.read(on).temperature)

    def stack(self, effects: Mapping[str, Collection[str]]) -> Array:
        """Return the reference, then the readings with each set of effects, (row, y, x)."""
        reference = self.reference()
        is_dark = np.isnan(reference)
        readings = (self.read(on).temperature for on in effects.values())
        return np.stack([reference, *(np.where(is_dark, np.nan, one) for one in readings)])

    def waterfall(self, order: Sequence[Collection[str]]) -> Array:
        """Return the change of the reading in K by each set of effects in turn, (set, y, x).

        The first change is from the reference.
        """
        on: _Coalition = self.contained
        readings = [self.reading(on)]
        for effects in order:
            on |= frozenset(effects)
            readings.append(self.reading(on))
        return np.diff(readings, axis=0)

    def terms_of(self, effect: Effect) -> frozenset[str]:
        """Return the kinds of the camera's terms that are part of an effect."""
        if effect is Effect.OPTICS:
            return frozenset(one.kind for one in self.camera.optics)
        detector = self.camera.detector
        if effect is Effect.DETECTOR and detector is not None:
            return frozenset(one.kind for one in detector.terms)
        return frozenset()

    def _acting(self, on: Collection[str]) -> _Coalition:
        """Return the effects that act, with the kinds of terms in place of their effect."""
        acting = frozenset(on)
        for effect in (Effect.OPTICS, Effect.DETECTOR):
            if effect in acting:
                acting = (acting - {effect}) | self.terms_of(effect)
        return acting & (frozenset(self.effects) | self._kinds)

    @property
    def _kinds(self) -> _Coalition:
        return self.terms_of(Effect.OPTICS) | self.terms_of(Effect.DETECTOR)

    def _without_detector(self, on: _Coalition) -> Camera:
        return unchecked(self._switched(on), detector=None)

    def _switched(self, on: _Coalition) -> Camera:
        """Return the camera with the parts and terms that act."""
        camera, detector = self.camera, self.camera.detector
        if detector is not None:
            terms = tuple(one for one in detector.terms if one.kind in on)
            detector = replace(detector, terms=terms)
            if Effect.DIGITISER not in on:
                detector = detector.undigitised() if terms else None
        psf = camera.psf if Effect.PSF in on else None
        # Parts of a camera that is possible are checked; a check takes longer than a small image.
        return unchecked(
            camera,
            psf=psf,
            # Without a PSF its order does not matter; one value lets cameras share the image.
            psf_order=camera.psf_order if psf else "optics",
            optics=tuple(one for one in camera.optics if one.kind in on),
            detector=detector,
        )


def expose_chains(
    chains: Sequence[Chain], start: float, check: Check | None = None
) -> tuple[Exposure, ...]:
    """Expose chains of a scene in one pass; their cameras may differ in the band alone."""
    first = chains[0]
    return first.camera.expose_views(first.scene, [one.view for one in chains], start, check)


def chains_in_bands(surface: Surface, scene: Scene, cameras: Sequence[Camera]) -> tuple[Chain, ...]:
    """Return the chains of a surface by cameras that differ in their band.

    Where the band does not matter to the surface, it is laid on the scene once.
    """
    for camera in cameras:
        if camera.line_time is not None:
            raise ValueError(
                f"camera: line_time is {camera.line_time!r}, expected None where bands are "
                "compared: a global shutter"
            )
    common = surface.prepare(scene) if surface.is_grey else None
    return tuple(Chain(camera, scene, surface, common) for camera in cameras)


def expose_apart(
    chain: Chain, start: float, reference: ReferenceKind = "maximum", check: Check | None = None
) -> ExposedChain:
    """Expose once, with the effects of the surface switched off too, in one pass."""
    exposures = chain.camera.expose_views(chain.scene, _views(chain), start, check)
    stages = Stages(exposures[0], lambda: Exposures(*exposures))
    return ExposedChain(chain.camera, stages, reference, chain.reflects)


def read_temperature(camera: Camera, radiance: Array, start: float) -> PixelReading:
    """Return what a camera reads of the radiance of its pixels, (y, x), at `start` in s."""
    read, flags = read_radiance(camera, radiance[None], np.array([start]))
    kelvins = np.asarray(camera.band.temperature(read[0]), dtype=np.float64)
    known = None if flags is None else flags[0]
    return PixelReading(kelvins, range_flags(kelvins, camera.lower_limit, known))


def _source_name(on: _Coalition, reflects: bool) -> str:
    """Return which of the `Exposures` shows the surface with some effects."""
    if Effect.EMISSIVITY not in on:
        return "black"
    return "seen" if Effect.REFLECTION in on or not reflects else "unreflecting"


def _source(exposure: Exposure, apart: Callable[[], Exposures] | None, name: str) -> Exposure:
    if name == "seen":
        return exposure
    if apart is None:
        raise ValueError("chain: only the exposure with emissivity and reflection is known")
    return getattr(apart(), name)  # type: ignore[no-any-return]


def _formed(
    source: Callable[[str], Exposure],
    blurred: Callable[[PointSpreadFunction], Array] | None,
    beyond: LightBeyond | None,
    camera: Camera,
    name: str,
    moves: bool,
    has_footprint: bool,
    moment: Moment,
) -> Array:
    """Return the radiance of the pixels before the detector in W/(m² sr)."""
    exposure, psf = source(name), camera.psf
    radiance = exposure.mean_radiance if moves else still_radiance(exposure, moment)
    gather = integrate if has_footprint else WITHOUT_FOOTPRINT[moment]
    is_common = blurred is not None and name == "seen" and moves and has_footprint
    if is_common and psf and camera.psf_order == "optics" and "footprint" not in psf.includes:
        assert blurred is not None
        radiance, camera = blurred(psf), unchecked(camera, psf=None)
    image = form_image(camera, radiance, exposure.raster, gather)
    if beyond is None:
        return image
    return np.maximum(image + beyond.on(camera.pixels(exposure.raster)), 0.0)


def _read(formed: Callable[..., Array], start: float, camera: Camera, *how: object) -> PixelReading:
    undetected = unchecked(camera, detector=None) if camera.detector else camera
    return read_temperature(camera, formed(undetected, *how), start)


def _exposures(chain: Chain, seen: Exposure) -> Exposures:
    others = chain.camera.expose_views(chain.scene, _views(chain)[1:], seen.start)
    return Exposures(seen, *others)


def _views(chain: Chain) -> list[SpectralView]:
    """Return the views of a chain's `Exposures`."""
    scene, band = chain.scene, chain.camera.band
    plain = _unreflecting(chain.surface)
    return [
        chain.view,
        SpectralView(plain.prepare(scene, band), band),
        SpectralView(UniformSurface(1.0).prepare(scene, band), band),
    ]


def _unreflecting(surface: Surface) -> Surface:
    """Return the surface without reflections between tool and chip."""
    if not isinstance(surface, ModifiedSurface):
        return surface
    kept = [one for one in surface.modifiers if one.effect != "reflections"]
    return surface if len(kept) == len(surface.modifiers) else surface.bare.modified(*kept)
