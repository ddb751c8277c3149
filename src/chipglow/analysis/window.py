"""Parts of a scene around places, which are exposed instead of the whole scene.

The light that blurs into a part from beyond it is computed with a nominal camera and surface.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from chipglow.analysis.places import Place
from chipglow.camera import Camera
from chipglow.camera.chain import Chain, LightBeyond, expose_chains
from chipglow.quantities import Array
from chipglow.scene import Frame, Raster, Scene
from chipglow.scene.lines import nearest
from chipglow.surface import FeatureTrends, ModifiedSurface, Surface

_BLUR_WIDTHS: Final = 3.0
"""Margin of a window around its place, in full widths at half maximum of the blur."""

_PIXELS: Final = 4.0
"""Further margin in pixels."""


@dataclass(frozen=True, eq=False)
class Window:
    """A place, and the part of a scene around it."""

    place: Place
    surface: str
    scene: Scene
    whole: Raster  # of which the scene is a part
    beyond: LightBeyond | None = None

    def chain(self, camera: Camera, surface: Surface) -> Chain:
        """Return the chain of the part, with the pixels that a camera has on the whole scene."""
        shift = self.scene.raster.left - self.whole.left, self.whole.top - self.scene.raster.top
        if any(shift):
            right, down = np.mod(np.subtract(camera.offset, shift), camera.pitch).tolist()
            camera = replace(camera, offset=(right, down))
        return Chain(camera, self.scene, surface, beyond=self.beyond)


@dataclass(frozen=True)
class Moment:
    """An exposure of a scene from `start` for a duration, within limits, in s.

    A shorter exposure is in the middle of it.
    """

    start: float
    duration: float
    limits: tuple[float, float]

    @classmethod
    def of(cls, scene: Scene, start: float, duration: float) -> Self:
        """Return an exposure within the frames of a scene that have no gap."""
        if len(scene.times) == 1:
            return cls(start, duration, (-np.inf, np.inf))
        block = _block(scene, start)
        end = float(scene.times[block[-1]] + scene.frame_spacing)
        return cls(start, duration, (float(scene.times[block[0]]), end))

    def begin(self, duration: float) -> float:
        """Return the start of an exposure of some duration in the middle of this one."""
        first, last = self.limits
        middle = self.start + (self.duration - duration) / 2
        return max(min(middle, last - duration), first)


@dataclass(frozen=True, eq=False)
class Nominal:
    """A scene with the surfaces and the camera of which single readings vary."""

    scene: Scene
    surfaces: Mapping[str, Surface]
    camera: Camera

    def parts(self, used: Collection[str], moment: Moment) -> "Parts":
        """Return the parts of the scene in an exposure, as it is seen on some surfaces.

        With a rolling shutter, and on a surface that is not local, a part is the whole.
        """
        scene, camera = self.scene, self.camera
        begin = moment.begin(camera.integration_time)
        local = [name for name in used if _is_local(self.surfaces[name])]
        if camera.line_time is not None or not local:
            return Parts(self, begin, {}, ())
        chains = [Chain(camera, scene, self.surfaces[name]) for name in local]
        exposures = expose_chains(chains, begin)
        images = {
            name: chain.exposed(exposure).radiance()
            for name, chain, exposure in zip(local, chains, exposures, strict=True)
        }
        reach, block = camera.integration_time / 2, _block(scene, moment.start)
        # The frames from half an exposure before to half an exposure after it.
        first, last = (scene.frame_at(begin + at * reach) for at in (-1.0, 3.0))
        frames = scene.frames(range(max(first, block[0]), min(last, block[-1]) + 1))
        return Parts(self, begin, images, tuple(frames))


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a scene during the nominal exposure that begins at `start` in s."""

    nominal: Nominal
    start: float
    images: Mapping[str, Array]  # radiance of the pixels of the whole scene, of local surfaces
    frames: Sequence[Frame]  # of an exposure of up to twice the duration

    def window(self, place: Place, surface: str) -> Window:
        """Return the window of a place on a surface."""
        scene, camera = self.nominal.scene, self.nominal.camera
        whole = Window(place, surface, scene, scene.raster)
        part = _around(place, scene.raster, camera) if surface in self.images else None
        if part is None:
            return whole
        window = replace(whole, scene=_cropped(self.frames, scene, part))
        alone = window.chain(camera, self.nominal.surfaces[surface]).at(self.start)
        light = nearest(self.images[surface], camera.pixels(scene.raster), alone.pixels.centres)
        missing = np.nan_to_num(light - alone.radiance())
        return replace(window, beyond=LightBeyond(missing, alone.pixels))


def _block(scene: Scene, start: float) -> range:
    """Return the frames without a gap among which an exposure begins."""
    frame = scene.frame_at(start)
    return next(one for one in scene.blocks if frame in one)


def _is_local(surface: Surface) -> bool:
    """Return whether the emissivity of a sample follows from that sample alone."""
    return not isinstance(surface, ModifiedSurface) or all(
        isinstance(one, FeatureTrends) for one in surface.modifiers
    )


def _around(place: Place, raster: Raster, camera: Camera) -> tuple[slice, slice] | None:
    """Return the rows and columns of a raster around a place; None for all."""
    outline = place.outline()
    if outline is None:
        return None
    points = np.concatenate(
        [outline, *(line.points for line in place.lines(camera.pitch).values())]
    )
    blur = camera.psf.fwhm if camera.psf is not None else 0.0
    margin = (_BLUR_WIDTHS * blur + _PIXELS * camera.pitch) / raster.spacing
    index = (points - [raster.left, raster.top]) * [1, -1] / raster.spacing
    low, high = np.floor(index.min(axis=0) - margin), np.ceil(index.max(axis=0) + margin)
    limits = np.clip([low, high], 0, [raster.columns, raster.rows]).astype(int)
    (left, top), (right, bottom) = limits.tolist()
    return slice(top, bottom), slice(left, right)


def _cropped(frames: Sequence[Frame], scene: Scene, part: tuple[slice, slice]) -> Scene:
    raster, (down, across) = scene.raster, part
    names = [name for name in scene.fields if getattr(frames[0], name, None) is not None]
    if "material" not in names:
        names.append("material")
    corner = raster.left + across.start * raster.spacing, raster.top - down.start * raster.spacing
    shape = down.stop - down.start, across.stop - across.start
    return Scene.from_fields(
        Raster(*corner, raster.spacing, *shape),
        [frame.time for frame in frames],
        {name: np.stack([getattr(frame, name)[part] for frame in frames]) for name in names},
        scene.tool,
    )
