"""The virtual infrared camera."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from math import exp
from typing import Annotated, Final, Literal, TypeAlias
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.flat_field import FlatFieldCalibration, flat_field_calibration
from chipglow.camera.detector.response import OperationPoint
from chipglow.camera.detector.terms import Lag, follows, lagged
from chipglow.camera.exposure import Exposure, View, expose, sparse_frames
from chipglow.camera.measurement import Measurement
from chipglow.camera.optics.blurs import BLURS
from chipglow.camera.optics.convolution import Beyond, blur, blurs, images_on_pixels
from chipglow.camera.optics.psf import AnnularAperturePSF, PointSpreadFunction
from chipglow.camera.optics.sampling import integrate, sensor_raster, whole_raster
from chipglow.camera.optics.terms import OpticsTerm
from chipglow.camera.sweep import Check
from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import (
    COLDEST,
    FREQUENCY,
    HOTTEST,
    LENGTH,
    TEMPERATURE,
    TIME,
    Position,
)
from chipglow.radiometry import Band
from chipglow.scene import Raster, Scene
from chipglow.surface import EmissivityField, Surface

BORDER_TOLERANCE: Final = 1.0
"""Change in K of a pixel at which a warning about the border of the scene is given."""

PAPER_LIMIT: Final = 573.15
"""Lower limit in K of the paper's camera."""

Gather: TypeAlias = Callable[[Array, Raster, Raster, float], Array]

_ROUNDING: Final = 1e-13
_COLD_FLOOR: Final = 373.15
"""Floor in K up to which a round number is probably one of degrees Celsius."""


class ChipglowWarning(UserWarning):
    """A setting that is possible, and probably not meant, such as °C where K are due."""


@dataclass(frozen=True)
class Camera(Part):
    """An infrared camera looking at a scene (Figure 6 of Heigel and Whitenton, 2010).

    By default it has no lower limit, and its point spread function is the diffraction of a
    reflecting objective in the camera's band; `paper` returns the paper's camera.

    Raises
    ------
    ValueError
        If a value is impossible; the message names it and what was expected.

    Warns
    -----
    ChipglowWarning
        If the lower range limit is so low and round a number of K that °C is probably meant.
    """

    band: Annotated[Band, Parameter("Spectral band; the paper's by default.")] = field(
        default_factory=lambda: Band(3.8e-6, 5.1e-6)
    )
    pitch: Annotated[
        float,
        Parameter("Distance between pixels, as seen on the scene.", LENGTH, over=0.0, most=1e-2),
    ] = 6e-6
    shape: Annotated[
        tuple[int, int] | None,
        Parameter(
            "Rows and columns of pixels; None: as many whole pixels as fit the scene.", least=1
        ),
    ] = None
    offset: Annotated[
        tuple[Position, Position],
        Parameter(
            "Corner of the first pixel in m, right and down from the scene's upper left corner.",
            least=0.0,
        ),
    ] = (0.0, 0.0)
    fill_factor: Annotated[
        float,
        Parameter(
            "Fraction of a pixel's square that takes light: a square in its centre.",
            over=0.0,
            most=1.0,
        ),
    ] = 1.0
    psf: Annotated[
        PointSpreadFunction | None,
        Parameter(
            "Point spread function; None: an ideal camera. One that includes the footprint is of "
            "optics and pixel together: a pixel then reads the blurred image at its centre and "
            "does not integrate again."
        ),
    ] = field(default_factory=partial(AnnularAperturePSF, None))
    psf_order: Annotated[
        Literal["optics", "detector"],
        Parameter(
            "detector (the paper's: on the pixels' values, so that the pixel's footprint counts "
            "twice) or optics (on the samples, before the pixels integrate)."
        ),
    ] = "optics"
    integration_time: Annotated[float, Parameter("Exposure.", TIME, over=0.0)] = 10e-6
    frame_rate: Annotated[float, Parameter("Frames per second.", FREQUENCY, over=0.0)] = 600.0
    line_time: Annotated[
        float | None,
        Parameter(
            "Rolling shutter: how much later each row's exposure begins than that of the row "
            "above; none: a global shutter, all rows at once.",
            TIME,
            over=0.0,
        ),
    ] = None
    time_constant: Annotated[
        float | None,
        Parameter(
            "Thermal time constant of a microbolometer's elements, by which each frame lags; none: "
            "a photon detector, which has none.",
            TIME,
            over=0.0,
        ),
    ] = None
    lower_limit: Annotated[
        float | None,
        Parameter(
            "Radiance temperatures under this are flagged, not returned; or none.",
            TEMPERATURE,
            least=COLDEST,
            most=HOTTEST,
        ),
    ] = None
    reflected: Annotated[
        float | None,
        Parameter(
            "Temperature of the surroundings that the surface reflects, or none.",
            TEMPERATURE,
            least=COLDEST,
            most=HOTTEST,
        ),
    ] = None
    optics: Annotated[
        tuple[OpticsTerm, ...],
        Parameter("Other effects of the optics, a list in the order of the light."),
    ] = ()
    detector: Annotated[
        Detector | None,
        Parameter(
            "Electrons, noise and counts of the detector, and the camera's own calibration; none: "
            "the radiance is read as it is.",
            allowed="none, or such as\n"
            "{response: {kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5},\n"
            "full_well: 7e6, bits: 14, terms: [{kind: shot-noise}]}",
        ),
    ] = None
    seed: Annotated[
        int,
        Parameter(
            "Seed of the detector noise, which depends only on it and the frame's start time.",
            least=0,
        ),
    ] = 2010

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.psf is not None:
            object.__setattr__(self, "psf", self.psf.of_camera(self.band, None))
        included = self.psf.includes if self.psf else ()
        if included and not set(included) <= {"footprint", *BLURS.kinds}:
            known = ", ".join(("footprint", *BLURS.kinds))
            raise ValueError(f"Camera.psf.includes: {included!r}, expected any of {known}")
        if self.psf_order == "detector" and self._blur_has_footprint:
            raise ValueError(
                "Camera.psf_order: 'detector', expected optics: the point spread function includes "
                "the pixel's footprint"
            )
        for name in ("integration_time", "line_time"):
            time = getattr(self, name)
            if time is not None and time > 1 / self.frame_rate:
                raise ValueError(
                    f"Camera.{name}: {time:g} s, expected up to {1 / self.frame_rate:g} s, the "
                    "time between frames"
                )
        if (
            self.lower_limit is not None
            and self.lower_limit <= _COLD_FLOOR
            and self.lower_limit % 10 == 0
        ):
            warn(
                f"camera: lower_limit is {self.lower_limit:g} K, which is "
                f"{self.lower_limit - 273.15:g} °C; if "
                f"{self.lower_limit:g} °C is meant, it is {self.lower_limit + 273.15:g} K.",
                ChipglowWarning,
                stacklevel=3,
            )

    @classmethod
    def paper(cls) -> "Camera":
        """Return the camera of the paper's simulation, as far as the paper states it.

        It measures at or above 300 °C. The blur is applied from pixel to pixel (`psf_order` is
        ``detector``), as in its Figure 6; that changes temperatures by up to 7 K. The point spread
        function, which the paper prints as a picture only, is an assumption: see
        `AnnularAperturePSF`.
        """
        return cls(psf=AnnularAperturePSF(), psf_order="detector", lower_limit=PAPER_LIMIT)

    def pixels(self, scene: Raster) -> Raster:
        """Return the raster of the pixels on a scene."""
        return sensor_raster(scene, self.pitch, self.offset, self.shape)

    def in_band(self, band: Band) -> "Camera":
        """Return the camera with another band and its diffraction, without a lower range limit."""
        psf = None if self.psf is None else self.psf.in_band(band)
        return replace(self, band=band, psf=psf, lower_limit=None)

    def redrawn(self, number: int) -> "Camera":
        """Return the camera with other detector noise: its seed increased by `number`."""
        return replace(self, seed=self.seed + number) if number and self.detector else self

    def calibration(self, shape: tuple[int, int]) -> FlatFieldCalibration | None:
        """Return the detector's calibration for pixels of this shape; None without a detector."""
        if self.detector is None:
            return None
        point = OperationPoint(self.band, self.integration_time, self.frame_rate, self.fill_factor)
        return flat_field_calibration(self.detector, point, shape)

    def frame_times(self, start: float, count: int) -> Array:
        """Return the start times of a sequence of frames in s, shape (count,)."""
        return start + np.arange(count) / self.frame_rate

    def row_delays(self, scene: Raster) -> Array:
        """Return how much later than the first row each row of samples begins to integrate.

        In s, shape (y,): that of the pixels in which the row's middle lies, or of the nearest ones;
        0 with a global shutter.
        """
        sensors = self.pixels(scene)
        if self.line_time is None:
            return np.zeros(scene.rows)
        if sensors.rows * self.line_time > 1 / self.frame_rate:
            raise ValueError(
                f"Camera.line_time: {self.line_time:g} s, expected up to "
                f"{1 / (self.frame_rate * sensors.rows):.4g} s: {sensors.rows} rows within the "
                f"{1 / self.frame_rate:.4g} s between frames"
            )
        rows = np.floor((sensors.top - scene.y) / self.pitch)
        return np.asarray(self.line_time * np.clip(rows, 0, sensors.rows - 1), np.float64)

    def frame_duration(self, scene: Raster) -> float:
        """Return the time in s from the first row's start of integration to the last's end."""
        return self.integration_time + float(self.row_delays(scene).max())

    def lay(self, surface: Surface, scene: Scene) -> EmissivityField:
        """Return a surface laid on a scene, in this camera's band and surroundings."""
        if not isinstance(surface, Surface):
            raise ValueError(
                f"surface: {surface!r}, expected a Surface such as chipglow.CHIP_1 or "
                "UniformSurface(0.6)"
            )
        return surface.on(scene, self.band, self.reflected)

    def expose(self, scene: Scene, surface: Surface, start: float) -> Exposure:
        """Return the exposure of a scene from `start` on, in s, over one integration time.

        A ValueError if the integration reaches beyond the scene, or the pixels do not fit it.
        """
        return self._expose(scene, surface, self.lay(surface, scene), start)

    def _expose(
        self, scene: Scene, surface: Surface, field: EmissivityField, start: float
    ) -> Exposure:
        (exposure,) = self.expose_fields(scene, (field,), start)
        warnings = tuple(surface.origin.doubts(self.band, scene))
        return replace(exposure, effects=surface.effects, warnings=warnings)

    def expose_fields(
        self,
        scene: Scene,
        fields: Sequence[EmissivityField],
        start: float,
        check: Check | None = None,
    ) -> tuple[Exposure, ...]:
        """Return the exposures of several surfaces, laid by `lay`: each frame is read once.

        `start` is when the integration of the first row begins in s; an error that `check`, called
        now and then meanwhile, raises ends the pass.
        """
        views = [View(field, self.band, self.reflected) for field in fields]
        delays = self.row_delays(scene.raster)
        return expose(scene, views, start, self.integration_time, delays, check)

    def form_measurement(self, exposures: Exposure | Iterable[Exposure]) -> Measurement:
        """Return the frames that the camera reads from exposures, one for each.

        Size of source, blur and mean over time are linear and commute: the mean, which an exposure
        holds, is blurred and integrated once. That equals the loop of Figure 6, and any number of
        cameras with the same band, integration time and surroundings may use the same exposures.

        Beyond the scene radiance is taken to be as at the scene's edge. The attribute ``warnings``
        states where a second assumption, that beyond the scene each pixel sees the like of what it
        sees within, changes pixels by over `BORDER_TOLERANCE`.
        """
        images: list[Array] = []
        alike, starts, effects, grids = [], [], [], set()
        warnings: dict[str, None] = {}
        for exposure in [exposures] if isinstance(exposures, Exposure) else exposures:
            scene = exposure.raster
            pixels = self.pixels(scene)
            image, within = self._both(exposure.mean_radiance, scene)
            images.append(self._show(image, pixels))
            alike.append(self._show(within / (1 - self.light_from_beyond(scene)), pixels))
            starts.append(exposure.start)
            effects.append(set(exposure.effects.items()))
            warnings |= dict.fromkeys(exposure.warnings)
            grids.add(pixels)
        if len(grids) != 1:
            raise ValueError("camera: one or more exposures of the same grid are required")
        measured = self.measurement(np.stack(images), np.array(starts), scene)
        measured.data.attrs.update(sorted(set.intersection(*effects)))
        warnings |= dict.fromkeys(self._lag_warning(measured.times))
        warnings |= dict.fromkeys(self._border_warning(np.stack(images), np.stack(alike), scene))
        if warnings:
            measured.data.attrs["warnings"] = "\n".join(warnings)
        return measured

    def measure(
        self, scene: Scene, surface: Surface, start: float | Sequence[float] | Array
    ) -> Measurement:
        """Measure a scene.

        Parameters
        ----------
        scene : Scene
            The true temperatures.
        surface : Surface
            Its emissivity.
        start : float or sequence of float
            Start of each frame's integration in s; see `frame_times` for a sequence at the frame
            rate.

        Returns
        -------
        Measurement
            As many frames as starts, with the scene's tool, and attributes of camera and surface.
        """
        self.pixels(scene.raster)
        field = self.lay(surface, scene)
        measured = self.form_measurement(
            self._expose(scene, surface, field, at)
            for at in np.atleast_1d(np.asarray(start, dtype=np.float64)).tolist()
        )
        if sparse := sparse_frames(scene, self.integration_time):
            known = filter(None, (measured.data.attrs.get("warnings"), sparse))
            measured.data.attrs["warnings"] = "\n".join(known)
        return measured.with_tool(scene.tool) if scene.tool else measured

    @lru_cache(maxsize=2)  # noqa: B019 - of the last cameras
    def light_from_beyond(self, scene: Raster) -> Array:
        """Return the fraction of each pixel's light that comes from beyond a scene, (y, x)."""
        fraction = self._both(np.ones(scene.shape), scene)[1]
        return np.where(fraction < 1 - _ROUNDING, 1 - fraction, 0.0)

    def form_image(self, radiance: Array, scene: Raster, gather: Gather = integrate) -> Array:
        """Return the image of a radiance map on the pixels: optics, PSF and footprint.

        Parameters
        ----------
        radiance : ndarray
            Of the scene's samples in W/(m² sr), shape `scene.shape`: the mean over the integration
            time, such as `Exposure.mean_radiance`.
        scene : Raster
            The samples.
        gather : callable
            Takes samples, their raster, that of the pixels and the fill factor, and returns what
            each pixel receives, such as the mean over its square (`integrate`).

        Returns
        -------
        ndarray
            Radiance of every pixel in W/(m² sr), shape `pixels(scene).shape`.
        """
        image = np.asarray(radiance, np.float64)
        if image.shape != scene.shape:
            raise ValueError(f"camera: radiance of shape {image.shape}, expected {scene.shape}")
        if not (np.isfinite(image).all() and (image >= 0).all()):
            raise ValueError("camera: radiance must be finite and 0 W/(m² sr) or more")
        if self.psf is None or self.optics or gather is not integrate:
            return self._show(self._collect(image, scene, "edge", gather), self.pixels(scene))
        return self._both(image, scene)[0]

    def _both(self, image: Array, scene: Raster) -> tuple[Array, Array]:
        """Return the radiance that the pixels receive, as at the edges or nothing beyond."""
        if self.psf is None or self.optics:
            return self._collect(image, scene, "edge"), self._collect(image, scene, "nothing")
        pixels = self.pixels(scene)
        if self.psf_order == "optics":
            return images_on_pixels(image, self.psf, scene, pixels, self._sensitive(scene))
        whole, own = whole_raster(scene, pixels)
        received = integrate(image, scene, whole, self.fill_factor)
        edge, nothing = blurs(received, self.psf, self.pitch)
        return edge[own], nothing[own]

    def _collect(
        self, image: Array, scene: Raster, beyond: Beyond, gather: Gather = integrate
    ) -> Array:
        """Return the radiance that the pixels receive: point spread function, optics, footprint."""
        pixels, blurred = self.pixels(scene), partial(blur, beyond=beyond)
        if self.psf is not None and self.psf_order == "optics":
            image = blurred(image, self.psf, scene.spacing)
        for term in self.optics:
            image = term.on_samples(image, scene, pixels, blurred)
        if self.psf is None or self.psf_order == "optics":
            return gather(image, scene, pixels, self._sensitive(scene))
        # Pixels that are not read out supply the radiance beyond the others.
        whole, own = whole_raster(scene, pixels)
        return blurred(gather(image, scene, whole, self.fill_factor), self.psf, self.pitch)[own]

    def _show(self, image: Array, pixels: Raster) -> Array:
        """Return the radiance after the optics' effects on the received radiance."""
        for term in self.optics:
            image = term.on_pixels(image, pixels, self.band)
        return image

    def _sensitive(self, scene: Raster) -> float:
        """Return the fraction of a pixel's square that it integrates, less after a footprint."""
        if not self._blur_has_footprint:
            return self.fill_factor
        return min((scene.spacing / self.pitch) ** 2, 1.0)

    @property
    def _blur_has_footprint(self) -> bool:
        return self.psf is not None and "footprint" in self.psf.includes

    def measurement(self, images: Array, starts: Array, scene: Raster) -> Measurement:
        """Return the frames read from images of `form_image` of a scene, shape (time, y, x)."""
        pixels = self.pixels(scene)
        radiance, flags = self.read(images, starts)
        attributes = self._attributes(pixels.shape)
        return Measurement.from_radiance(
            radiance, self.band, starts, pixels, self.lower_limit, flags, attributes=attributes
        )

    def read(self, images: Array, starts: Array) -> tuple[Array, NDArray[np.uint8] | None]:
        """Return radiance and flags of images (time, y, x) after detector and calibration.

        Without a detector the images, with the lag of a thermal time constant, and None.
        """
        if self.time_constant is not None:
            frame_time = 1 / self.frame_rate
            images = lagged(images, starts, frame_time, exp(-frame_time / self.time_constant))
        calibration = self.calibration(images.shape[1:])
        if self.detector is None or calibration is None:
            return images, None
        generators = [self._generator(float(start)) for start in starts]
        counts = self.detector.counts(images, generators, calibration.point, starts)
        return calibration.radiance(counts)

    def _generator(self, start: float) -> np.random.Generator:
        """Return the noise of the frame that begins then, however many others are read with it."""
        return np.random.default_rng([self.seed, int(np.float64(start + 0.0).view(np.uint64))])

    def _lag_warning(self, starts: Array) -> Iterator[str]:
        """Warn where no frame follows another, so that there is no lag."""
        if follows(starts, 1 / self.frame_rate).any():
            return
        if self.detector is not None and any(isinstance(t, Lag) for t in self.detector.terms):
            yield (
                "Lag: no two frames are one frame period apart, so each frame is taken as its own "
                "predecessor: there is no lag in them."
            )
        if self.time_constant is not None:
            yield (
                f"The elements' thermal time constant is {1e3 * self.time_constant:.3g} ms, and no "
                "two frames are one frame period apart: each frame is computed as if its scene had "
                "lasted long. A real one shows far less of what is over sooner."
            )

    def _border_warning(self, images: Array, alike: Array, scene: Raster) -> Iterator[str]:
        """Warn how far another assumption about what is beyond the scene changes temperatures."""
        kelvins = self.band.temperature(images)
        change = np.abs(kelvins - self.band.temperature(alike))
        change[~(kelvins >= (self.lower_limit or 0.0))] = np.nan
        changed = change > BORDER_TOLERANCE
        if not changed.any():
            return
        pixels, (left, right, bottom, top) = self.pixels(scene), scene.extent
        across = np.minimum(pixels.x - left, right - pixels.x)
        down = np.minimum(top - pixels.y, pixels.y - bottom)
        reach = np.minimum(across, down[:, None])[changed.any(axis=0)].max()
        yield (
            "The border of the scene: beyond it the surface is taken to be as at the edge. If the "
            "surroundings instead resembled what each pixel sees within the scene, "
            f"{100 * changed.mean():.3g} % of the pixels (up to {1e6 * reach:.3g} µm from the "
            f"border) would change by over {BORDER_TOLERANCE:g} K, by {np.nanmax(change):.3g} K at "
            "most."
        )

    def _attributes(self, shape: tuple[int, int]) -> dict[str, float | str]:
        """Return the camera's attributes of a measurement, in SI, without those that are None."""
        attributes: dict[str, float | str | None] = {
            "offset_right": self.offset[0],
            "offset_down": self.offset[1],
            "fill_factor": self.fill_factor,
            "psf": repr(self.psf),
            "psf_order": self.psf_order,
            "integration_time": self.integration_time,
            "frame_rate": self.frame_rate,
            "time_constant": self.time_constant,
            "shutter": (
                "global" if self.line_time is None else f"rolling, {self.line_time:g} s a row"
            ),
            "reflected": self.reflected,
            "optics": repr(self.optics) if self.optics else None,
        }
        if calibration := self.calibration(shape):
            attributes |= {
                **calibration.effects,
                "noise_seed": self.seed,
                "netd": calibration.half_netd,
                "netd_temperature": calibration.half_temperature,
            }
        return {name: value for name, value in attributes.items() if value is not None}
