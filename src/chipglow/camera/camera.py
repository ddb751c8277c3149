"""The virtual infrared camera."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import lru_cache, partial
from math import exp
from typing import Annotated, Final, Literal
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.flat_field import FlatFieldCalibration, flat_field_calibration
from chipglow.camera.detector.response import (
    ExposureSettings,
    OperationPoint,
    RangeResponse,
    in_tables,
)
from chipglow.camera.detector.terms import EquivalentNoise, Lag, follows, lagged
from chipglow.camera.exposure import Exposure, View, expose, sparse_frames
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.measurement import Measurement
from chipglow.camera.optics.blurs import BLURS
from chipglow.camera.optics.convolution import Beyond, images, without_rounding
from chipglow.camera.optics.image_formation import Gather, ImageFormation, sensitive_fraction
from chipglow.camera.optics.psf import AnnularAperturePSF, PointSpreadFunction
from chipglow.camera.optics.sampling import integrate, sensor_raster, whole_raster
from chipglow.camera.optics.terms import OPTICS_TERMS, OpticsTerm
from chipglow.quantities import Array, Parameter, made_from
from chipglow.quantities.units import LENGTH, TIME, Position
from chipglow.radiometry import Band
from chipglow.scene import Raster, Scene
from chipglow.scene.raster import check_shape
from chipglow.surface import EmissivityField, Surface

BORDER_TOLERANCE: Final = 1.0
"""Pixel change in K above which a border warning is issued."""

PAPER_LIMIT: Final = 573.15
"""Lower range limit in K of the paper's camera."""

_ROUNDING: Final = 1e-13
_FEWEST_SAMPLES: Final = 2.0
"""Samples of the scene in the width of a pixel."""

_SUSPECT_LIMIT: Final = 373.15
"""Lower range limits in K that are probably meant in °C, if round."""


class ChipglowWarning(UserWarning):
    """A valid setting that is probably a mistake, such as °C instead of K."""


@dataclass(frozen=True, kw_only=True)
class CameraSettings(ExposureSettings):
    """Settings of a camera that a study states as `Camera` takes them."""

    pitch: Annotated[
        float, Parameter("Distance between pixels on the scene.", LENGTH, most=1e-2)
    ] = 6e-6
    psf_order: Annotated[
        Literal["optics", "detector"],
        Parameter(
            "optics: blur the samples before the pixels integrate; detector: blur the pixel "
            "values, as the paper does, so that the footprint counts twice."
        ),
    ] = "optics"
    line_time: Annotated[
        float | None,
        Parameter(
            "Rolling shutter: delay between the exposures of successive rows; none: global "
            "shutter.",
            TIME,
        ),
    ] = None
    time_constant: Annotated[
        float | None,
        Parameter(
            "Thermal time constant of a microbolometer, which makes frames lag; none: a photon "
            "detector.",
            TIME,
        ),
    ] = None
    reflected: Annotated[
        float | None, in_tables("Reflected apparent temperature; none: dark surroundings.")
    ] = None
    optics: Annotated[
        tuple[Annotated[OpticsTerm, OPTICS_TERMS], ...],
        Parameter("Other effects of the optics, in the order in which light meets them."),
    ] = ()
    detector: Annotated[
        Detector | None,
        Parameter(
            "Detector with noise, digitiser and calibration; none: an ideal detector.",
            allowed="none, or such as\n"
            "{response: {kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5},\n"
            "full_well: 7e6, bits: 14, terms: [{kind: shot-noise}]}",
        ),
    ] = None


@dataclass(frozen=True)
class Camera(CameraSettings):
    """An infrared camera (Figure 6 of Heigel and Whitenton, 2010).

    The default camera has no lower range limit. Its point spread function is the diffraction of a
    reflecting objective in the camera's band. `paper` returns the paper's camera.

    Raises
    ------
    ValueError
        If a value is out of its limits; the message names field, value and limits.

    Warns
    -----
    ChipglowWarning
        If the lower range limit is probably in °C instead of K.
    """

    band: Annotated[Band, Parameter("Spectral band; the paper's by default.")] = field(
        default_factory=lambda: Band(3.8e-6, 5.1e-6)
    )
    _: KW_ONLY
    shape: Annotated[
        tuple[int, int] | None,
        Parameter(
            "Rows and columns of pixels; None: all whole pixels that fit the scene.", least=1
        ),
    ] = None
    offset: Annotated[
        tuple[Position, Position],
        Parameter(
            "Corner of the first pixel in m, right and down from the scene's upper left corner.",
            least=0.0,
        ),
    ] = (0.0, 0.0)
    psf: Annotated[
        PointSpreadFunction | None,
        Parameter(
            "Point spread function; None: an ideal camera. If it includes the footprint, a pixel "
            "samples the blurred image at its centre instead of integrating it."
        ),
    ] = field(default_factory=partial(AnnularAperturePSF, None))
    lower_limit: Annotated[
        float | None,
        in_tables(
            "Lower range limit: lower radiance temperatures are flagged, not returned; or none."
        ),
    ] = None
    seed: Annotated[
        int,
        Parameter(
            "Seed of the detector noise; a frame's noise depends on the seed and its start time.",
            least=0,
        ),
    ] = 2010

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.psf is not None:
            object.__setattr__(self, "psf", self.psf.for_camera(self.band, None))
        included = self.psf.includes if self.psf else ()
        if included and not set(included) <= {"footprint", *BLURS.kinds}:
            known = ", ".join(("footprint", *BLURS.kinds))
            raise ValueError(f"Camera.psf.includes: {included!r}, only {known} are known")
        if self.psf_order == "detector" and self._blur_has_footprint:
            raise ValueError(
                "Camera.psf_order: must be 'optics', because the point spread function includes "
                "the pixel footprint"
            )
        for name in ("integration_time", "line_time"):
            time = getattr(self, name)
            if time is not None and time > 1 / self.frame_rate:
                raise ValueError(
                    f"Camera.{name}: {time:g} s is longer than the frame period of "
                    f"{1 / self.frame_rate:g} s"
                )
        response = self.detector.response if self.detector else None
        if isinstance(response, RangeResponse) and (self.lower_limit or 0.0) >= response.hottest:
            raise ValueError(
                f"Camera.lower_limit: {self.lower_limit:g} K must be below the upper end of the "
                f"range, {response.hottest:g} K (detector.response.hottest)"
            )
        if (
            self.lower_limit is not None
            and self.lower_limit <= _SUSPECT_LIMIT
            and self.lower_limit % 10 == 0
        ):
            warn(
                f"camera: lower_limit is {self.lower_limit:g} K, which is "
                f"{self.lower_limit - 273.15:g} °C. If {self.lower_limit:g} °C is meant, write "
                f"{self.lower_limit + 273.15:g} K.",
                ChipglowWarning,
                stacklevel=3,
            )

    @classmethod
    def paper(cls) -> "Camera":
        """Return the camera of the paper's simulation; values that the paper omits are assumed.

        It measures at or above 300 °C. The blur acts on the pixel values (`psf_order` is
        ``detector``), as in the paper's Figure 6; this changes temperatures by up to 7 K. The point
        spread function is assumed, see `AnnularAperturePSF`.
        """
        return cls(psf=AnnularAperturePSF(), psf_order="detector", lower_limit=PAPER_LIMIT)

    def pixels(self, scene: Raster) -> Raster:
        """Return the raster of pixels on a scene."""
        return sensor_raster(scene, self.pitch, self.offset, self.shape)

    def in_band(self, band: Band) -> "Camera":
        """Return a copy with another band and its diffraction, without a lower range limit."""
        psf = None if self.psf is None else self.psf.in_band(band)
        return replace(self, band=band, psf=psf, lower_limit=None)

    def redrawn(self, number: int) -> "Camera":
        """Return a copy whose noise seed is increased by `number`."""
        return replace(self, seed=self.seed + number) if number and self.detector else self

    def calibration(self, shape: tuple[int, int]) -> FlatFieldCalibration | None:
        """Return the detector calibration for this many rows and columns; None without detector."""
        if self.detector is None:
            return None
        point = made_from(OperationPoint, self, band=self.band)
        return flat_field_calibration(self.detector, point, shape)

    def frame_times(self, start: float, count: int) -> Array:
        """Return the start times of a sequence of frames in s, shape (count,)."""
        return start + np.arange(count) / self.frame_rate

    def row_delays(self, scene: Raster) -> Array:
        """Return the delay in s of each row of samples, shape (y,): that of the nearest pixels."""
        sensors = self.pixels(scene)
        if self.line_time is None:
            return np.zeros(scene.rows)
        if sensors.rows * self.line_time > 1 / self.frame_rate:
            raise ValueError(
                f"Camera.line_time: {self.line_time:g} s is too long; {sensors.rows} rows within "
                f"the frame period of {1 / self.frame_rate:.4g} s allow at most "
                f"{1 / (self.frame_rate * sensors.rows):.4g} s"
            )
        rows = np.floor((sensors.top - scene.y) / self.pitch)
        return self.line_time * np.clip(rows, 0, sensors.rows - 1)

    def frame_duration(self, scene: Raster) -> float:
        """Return the time in s from the start of the first row to the end of the last row."""
        return self.integration_time + float(self.row_delays(scene).max())

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
        views = [View(field, self.band, self.reflected) for field in fields]
        delays = self.row_delays(scene.raster)
        return expose(scene, views, start, self.integration_time, delays, check)

    def form_measurement(self, exposures: Exposure | Iterable[Exposure]) -> Measurement:
        """Form one frame from each exposure.

        Blur, integration over the pixel and mean over time commute: it equals the loop of Figure 6.
        Beyond the scene, radiance continues as at the edge. The attribute ``warnings`` states where
        pixels change by more than `BORDER_TOLERANCE` if the surroundings instead resemble what each
        pixel sees within the scene.
        """
        images: list[Array] = []
        similar, starts, effects, grids = [], [], [], set()
        warnings: dict[str, None] = {}
        for exposure in [exposures] if isinstance(exposures, Exposure) else exposures:
            scene = exposure.raster
            pixels = self.pixels(scene)
            image, within = self._received(exposure.mean_radiance, scene)
            images.append(self._displayed(image, pixels))
            similar.append(self._displayed(within / (1 - self.light_from_beyond(scene)), pixels))
            starts.append(exposure.start)
            effects.append(set(exposure.effects.items()))
            warnings |= dict.fromkeys(exposure.warnings)
            grids.add(pixels)
        if len(grids) != 1:
            raise ValueError("camera: at least one exposure, all of the same grid, is required")
        measured = self.measurement(np.stack(images), np.array(starts), scene)
        measured.data.attrs.update(sorted(set.intersection(*effects)))
        warnings |= dict.fromkeys(self._sampling_warning(scene))
        warnings |= dict.fromkeys(self._rounding_warning(images[0].shape))
        warnings |= dict.fromkeys(self._lag_warning(measured.times))
        warnings |= dict.fromkeys(self._border_warning(np.stack(images), np.stack(similar), scene))
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

    @lru_cache(maxsize=2)  # noqa: B019 - keeps two cameras
    def light_from_beyond(self, scene: Raster) -> Array:
        """Return the fraction of each pixel's light that comes from beyond a scene, (y, x)."""
        fraction = self._received(np.ones(scene.shape), scene)[1]
        return np.where(fraction < 1 - _ROUNDING, 1 - fraction, 0.0)

    def form_image(self, radiance: Array, scene: Raster, gather: Gather = integrate) -> Array:
        """Form the image of a radiance map on the pixels by optics, PSF and footprint.

        `radiance` in W/(m² sr), on the samples of `scene`, is a mean over the integration time such
        as `Exposure.mean_radiance`. `gather` takes samples, their raster, the raster of the pixels
        and the fill factor; it returns what the pixels receive, such as the mean over each square.
        """
        image = np.asarray(radiance, np.float64)
        check_shape("camera: radiance", image.shape, scene.shape)
        if not (np.isfinite(image).all() and (image >= 0).all()):
            raise ValueError("camera: radiance must be finite and not negative")
        if self.psf is None or self.optics or gather is not integrate:
            return self._displayed(self._collect(image, scene, "edge", gather), self.pixels(scene))
        return self._received(image, scene)[0]

    def image_formation(
        self,
        samples: Raster,
        beyond: Beyond = "edge",
        gather: Gather = integrate,
        pixels: Raster | None = None,
    ) -> ImageFormation:
        """Return the linear map from the radiance of samples to the radiance of the pixels.

        It has an adjoint, for corrections of measured images. Radiance beyond the samples continues
        as at the edge, or is none; `gather` is as in `form_image`. The pixels are those of the
        camera on the samples, unless stated.
        """
        return ImageFormation(
            samples,
            self.pixels(samples) if pixels is None else pixels,
            self.psf,
            self.psf_order == "detector",
            self.fill_factor,
            self.optics,
            beyond,
            gather,
        )

    def _received(self, image: Array, scene: Raster) -> tuple[Array, Array]:
        """Return the received radiance if the scene's edges continue, and if nothing is beyond."""
        if self.psf is None or self.optics:
            return self._collect(image, scene, "edge"), self._collect(image, scene, "nothing")
        pixels = self.pixels(scene)
        if self.psf_order == "optics":
            sensitive = sensitive_fraction(self.psf, self.fill_factor, scene, pixels)
            return images(image, self.psf, scene.spacing, (scene, pixels, sensitive))
        whole, own = whole_raster(scene, pixels)
        received = integrate(image, scene, whole, self.fill_factor)
        edge, nothing = images(received, self.psf, self.pitch)
        return edge[own], nothing[own]

    def _collect(
        self, image: Array, scene: Raster, beyond: Beyond, gather: Gather = integrate
    ) -> Array:
        """Apply point spread function, optics and footprint."""
        received = self.image_formation(scene, beyond, gather).forward(image)
        is_blurred = self.psf is not None or self.optics
        return without_rounding(received) if is_blurred else received

    def _displayed(self, image: Array, pixels: Raster) -> Array:
        """Apply the optics' effects on pixel radiance."""
        for term in self.optics:
            image = term.on_pixels(image, pixels, self.band)
        return image

    @property
    def _blur_has_footprint(self) -> bool:
        return self.psf is not None and "footprint" in self.psf.includes

    def measurement(self, images: Array, starts: Array, scene: Raster) -> Measurement:
        """Return the measurement of images by `form_image` of a scene, shape (time, y, x)."""
        pixels = self.pixels(scene)
        radiance, flags = self.read(images, starts)
        attributes = self._attributes(pixels.shape)
        return Measurement.from_radiance(
            radiance, self.band, starts, pixels, self.lower_limit, flags, attributes=attributes
        )

    def read(self, images: Array, starts: Array) -> tuple[Array, NDArray[np.uint8] | None]:
        """Apply lag, detector and calibration to images (time, y, x); return radiance and flags."""
        if self.time_constant is not None:
            frame_time = 1 / self.frame_rate
            images = lagged(images, starts, frame_time, exp(-frame_time / self.time_constant))
        calibration = self.calibration(images.shape[1:])
        if self.detector is None or calibration is None:
            return images, None
        # The noise of a frame follows from the seed and its start.
        keys = (np.asarray(starts, np.float64) + 0.0).view(np.uint64).tolist()
        generators = [np.random.default_rng([self.seed, key]) for key in keys]
        counts = self.detector.counts(images, generators, calibration.point, starts)
        return calibration.radiance(counts)

    def _sampling_warning(self, scene: Raster) -> Iterator[str]:
        """Yield a warning if the scene's samples are too coarse for blur and footprint."""
        if self.pitch < _FEWEST_SAMPLES * scene.spacing * (1 - 1e-9):
            yield (
                f"The scene's samples are {1e6 * scene.spacing:.3g} µm wide, more than half a "
                f"pixel of {1e6 * self.pitch:.3g} µm: what changes within a sample is missing, and "
                "the errors by pixels and blur may be too small."
            )

    def _rounding_warning(self, shape: tuple[int, int]) -> Iterator[str]:
        """Yield a warning if rounding to counts exceeds the stated NETD."""
        calibration = self.calibration(shape)
        for term in self.detector.terms if self.detector else ():
            if isinstance(term, EquivalentNoise) and calibration is not None:
                kelvins = calibration.rounding / float(self.band.slope(term.temperature))
                if kelvins > term.netd:
                    yield (
                        f"The stated NETD of {1e3 * term.netd:.3g} mK is not reached: rounding to "
                        f"{calibration.detector.bits} bits up to "
                        f"{calibration.full_temperature - 273.15:.0f} °C causes "
                        f"{1e3 * kelvins:.0f} mK at {term.temperature - 273.15:.4g} °C. NETD and "
                        "range must be those of the same setting of the camera."
                    )

    def _lag_warning(self, starts: Array) -> Iterator[str]:
        """Yield warnings if lag is modelled but no frame follows another."""
        if follows(starts, 1 / self.frame_rate).any():
            return
        if self.detector is not None and any(isinstance(t, Lag) for t in self.detector.terms):
            yield (
                "Lag: no two frames are one frame period apart, so each frame is its own "
                "predecessor and shows no lag."
            )
        if self.time_constant is not None:
            yield (
                f"The thermal time constant is {1e3 * self.time_constant:.3g} ms, but no two "
                "frames are one frame period apart: each frame shows its scene in a steady state. "
                "A real camera shows much less of shorter events."
            )

    def _border_warning(self, images: Array, similar: Array, scene: Raster) -> Iterator[str]:
        """Yield a warning if the assumption about the surroundings changes temperatures."""
        kelvins = self.band.temperature(images)
        change = np.abs(kelvins - self.band.temperature(similar))
        change[~(kelvins >= (self.lower_limit or 0.0))] = np.nan
        changed = change > BORDER_TOLERANCE
        if not changed.any():
            return
        pixels, (left, right, bottom, top) = self.pixels(scene), scene.extent
        across = np.minimum(pixels.x - left, right - pixels.x)
        down = np.minimum(top - pixels.y, pixels.y - bottom)
        reach = np.minimum(across, down[:, None])[changed.any(axis=0)].max()
        yield (
            "The border of the scene: beyond it, the radiance at the edge is assumed. If the "
            "surroundings instead resembled what each pixel sees within the scene, "
            f"{100 * changed.mean():.3g} % of the pixels (up to {1e6 * reach:.3g} µm from the "
            f"border) would change by more than {BORDER_TOLERANCE:g} K, by at most "
            f"{np.nanmax(change):.3g} K."
        )

    def _attributes(self, shape: tuple[int, int]) -> dict[str, float | str]:
        """Return the attributes of a measurement that describe the camera, in SI."""
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
                "global" if self.line_time is None else f"rolling, {self.line_time:g} s per row"
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
