"""The virtual infrared camera."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from chipglow.camera import image, measuring
from chipglow.camera.description import CameraDescription
from chipglow.camera.exposure import Exposure, SpectralView, expose, sparse_frames
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.measurement import Measurement
from chipglow.camera.optics.image_formation import Gather
from chipglow.camera.optics.psf import AnnularAperturePSF
from chipglow.camera.optics.sampling import integrate
from chipglow.quantities import Array
from chipglow.scene import Raster, Scene
from chipglow.surface import EmissivityField, Surface

PAPER_LIMIT: Final = 573.15
"""Lower range limit in K of the paper's camera."""


@dataclass(frozen=True)
class Camera(CameraDescription):
    """An infrared camera (Figure 6 of Heigel and Whitenton, 2010).

    The default camera has no lower range limit. Its point spread function is the diffraction of a
    reflecting objective in the camera's band. `paper` returns the paper's camera.

    Raises
    ------
    ValueError
        If a value is out of its limits; the message names field, value and limits.
    """

    @classmethod
    def paper(cls) -> "Camera":
        """Return the camera of the paper's simulation; values that the paper omits are assumed.

        It measures at or above 300 °C. The blur acts on the pixel values (`psf_order` is
        ``detector``), as in the paper's Figure 6; this changes temperatures by up to 7 K. The point
        spread function is assumed, see `AnnularAperturePSF`.
        """
        return cls(psf=AnnularAperturePSF(), psf_order="detector", lower_limit=PAPER_LIMIT)

    def prepare(self, surface: Surface, scene: Scene) -> EmissivityField:
        """Prepare a surface for a scene, in this camera's band and surroundings."""
        if not isinstance(surface, Surface):
            raise ValueError(
                f"surface: {surface!r} is not a Surface such as chipglow.CHIP_1 or "
                "UniformSurface(0.6)"
            )
        return surface.prepare(scene, self.band, self.reflected)

    def expose(
        self, scene: Scene, surface: Surface, start: float, field: EmissivityField | None = None
    ) -> Exposure:
        """Expose the camera to a scene for one integration time, starting at `start` in s.

        `field` is the surface from `prepare`, if it is known. Raises a ValueError if the scene does
        not cover the integration time or the pixels.
        """
        field = field or self.prepare(surface, scene)
        (exposure,) = self.expose_fields(scene, (field,), start)
        warnings = tuple(surface.origin.warnings(self.band, scene.metal))
        return replace(exposure, effects=surface.effects, warnings=warnings)

    def expose_fields(
        self,
        scene: Scene,
        fields: Sequence[EmissivityField],
        start: float,
        check: Check | None = None,
    ) -> tuple[Exposure, ...]:
        """Expose the camera to several surfaces from `prepare` in one pass; see `expose`."""
        views = [SpectralView(field, self.band, self.reflected) for field in fields]
        return self.expose_views(scene, views, start, check)

    def expose_views(
        self, scene: Scene, views: Sequence[SpectralView], start: float, check: Check | None = None
    ) -> tuple[Exposure, ...]:
        """Expose for the camera's integration time and shutter, in one pass, to several views.

        The views may be in other bands and surroundings than the camera's.
        """
        delays = self.row_delays(scene.raster)
        return expose(scene, views, start, self.integration_time, delays, check)

    def form_measurement(self, exposures: Exposure | Iterable[Exposure]) -> Measurement:
        """Form one frame from each exposure.

        Blur, integration over the pixel and mean over time commute: it equals the loop of Figure 6.
        Beyond the scene, radiance continues as at the edge. The attribute ``warnings`` states where
        pixels change by more than 1 K if the surroundings instead resemble what each
        pixel sees within the scene.
        """
        return measuring.form_measurement(self, exposures)

    def measure(
        self, scene: Scene, surface: Surface, start: float | Sequence[float] | Array
    ) -> Measurement:
        """Measure a scene.

        Parameters
        ----------
        scene : Scene
            The true temperatures.
        surface : Surface
            The emissivity.
        start : float or sequence of float
            Start of each frame's integration in s; `frame_times` returns a sequence at the frame
            rate.

        Returns
        -------
        Measurement
            One frame for each start, with the scene's tool and attributes of camera and surface.
        """
        self.pixels(scene.raster)
        field = self.prepare(surface, scene)
        starts = np.atleast_1d(np.asarray(start, np.float64)).tolist()
        measured = self.form_measurement(self.expose(scene, surface, at, field) for at in starts)
        if sparse := sparse_frames(scene, self.integration_time):
            warnings = filter(None, (measured.data.attrs.get("warnings"), sparse))
            measured.data.attrs["warnings"] = "\n".join(warnings)
        return measured.with_tool(scene.tool) if scene.tool else measured

    def form_image(self, radiance: Array, scene: Raster, gather: Gather = integrate) -> Array:
        """Form the image of a radiance map, see `chipglow.camera.image.form_image`."""
        return image.form_image(self, radiance, scene, gather)

    def light_from_beyond(self, scene: Raster) -> Array:
        """Return the fraction of each pixel's light that comes from beyond a scene, (y, x)."""
        return image.light_from_beyond(self, scene)
