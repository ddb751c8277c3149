"""The virtual infrared camera."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Final, Literal
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector import (
    Detector,
    FlatFieldCalibration,
    Lag,
    OperationPoint,
    flat_field_calibration,
)
from chipglow.camera.detector.terms import follows
from chipglow.camera.exposure import Exposure, expose_all
from chipglow.camera.measurement import Measurement
from chipglow.camera.optics import (
    BLURS,
    AnnularAperturePSF,
    OpticsTerm,
    PointSpreadFunction,
    blur,
)
from chipglow.camera.optics.convolution import (
    blur_of_like,
    both_borders,
    both_images_on_pixels,
    image_on_pixels,
    light_from_beyond,
)
from chipglow.camera.optics.sampling import integrate, sensor_raster, whole_raster
from chipglow.camera.optics.terms import Blur
from chipglow.camera.sweep import Check
from chipglow.camera.warning import ChipglowWarning
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import FREQUENCY, LENGTH, TEMPERATURE, TIME, Position
from chipglow.radiometry import Band
from chipglow.radiometry.band import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.scene import Raster, Scene
from chipglow.surface import EmissivityField, Surface

BORDER_TOLERANCE: Final = 1.0
"""Change in K of a pixel from which on it is said that the border of the scene matters."""

_COLD_FLOOR: Final = 373.15
"""Floor in K up to which a round number is probably one of degrees Celsius."""


@dataclass(frozen=True)
class Camera(Part):
    """An infrared camera looking at a scene (Figure 6 of Heigel and Whitenton, 2010).

    The defaults are those of the paper except for the order of blur and pixels; `paper` returns the
    paper's camera.

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
    ] = field(default_factory=AnnularAperturePSF)
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
    lower_limit: Annotated[
        float | None,
        Parameter(
            "Radiance temperatures under this are flagged, not returned; or none.",
            TEMPERATURE,
            least=TABLE_COLDEST,
            most=TABLE_HOTTEST,
        ),
    ] = 573.15
    reflected: Annotated[
        float | None,
        Parameter(
            "Temperature of the surroundings that the surface reflects, or none.",
            TEMPERATURE,
            least=TABLE_COLDEST,
            most=TABLE_HOTTEST,
        ),
    ] = None
    optics: Annotated[
        tuple[OpticsTerm, ...],
        Parameter("What the optics do besides, a list in the order of the light."),
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
        """The camera of the paper's simulation, as far as the paper states it.

        The blur is applied from pixel to pixel (`psf_order` is ``detector``), as in its Figure 6:
        that is what it differs in from `Camera()`, by up to 7 K. The point spread function, which
        the paper prints as a picture only, is an assumption: see `AnnularAperturePSF`. A study's
        camera is this one, unless it says otherwise.
        """
        return cls(psf_order="detector")

    def pixels(self, scene: Raster) -> Raster:
        """Where the pixels lie on a scene.

        Parameters
        ----------
        scene : Raster
            The scene's samples.

        Raises
        ------
        ValueError
            If not one pixel fits, or `shape` reaches beyond the scene.
        """
        return sensor_raster(scene, self.pitch, self.offset, self.shape)

    def in_band(self, band: Band) -> "Camera":
        """The camera with another band: its diffraction is that of the band.

        Parameters
        ----------
        band : Band
            The other band. There is no lower range limit in it: the camera's is of its own band.
        """
        psf = None if self.psf is None else self.psf.in_band(band)
        return replace(self, band=band, psf=psf, lower_limit=None)

    def redrawn(self, number: int) -> "Camera":
        """The camera with other noise of its detector: the seed `number` further on."""
        return replace(self, seed=self.seed + number) if number and self.detector else self

    def calibration(self, shape: tuple[int, int]) -> FlatFieldCalibration | None:
        """The calibration of the detector at this camera's exposure; None without a detector.

        Parameters
        ----------
        shape : tuple of int
            Rows and columns of the pixels.
        """
        if self.detector is None:
            return None
        point = OperationPoint(self.band, self.integration_time, self.frame_rate, self.fill_factor)
        return flat_field_calibration(self.detector, point, shape)

    def frame_times(self, start: float, count: int) -> NDArray[np.float64]:
        """When the frames of a sequence begin.

        Parameters
        ----------
        start : float
            When the first frame begins in s.
        count : int
            Number of frames.

        Returns
        -------
        ndarray
            Times in s, shape (count,).
        """
        return start + np.arange(count) / self.frame_rate

    def row_delays(self, scene: Raster) -> NDArray[np.float64]:
        """How much later than the first row's each sample's integration begins.

        Parameters
        ----------
        scene : Raster
            The scene's samples.

        Returns
        -------
        ndarray
            For each row of samples that of the pixels in which its middle lies, or of the nearest
            ones, in s, shape (y,); 0 with a global shutter.

        Raises
        ------
        ValueError
            If the pixels do not fit the scene, or all their rows take longer than there is between
            frames.
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
        """Time in s from the beginning of the first row's integration to the end of the last's.

        Parameters
        ----------
        scene : Raster
            The scene's samples.
        """
        return self.integration_time + float(self.row_delays(scene).max())

    def lay(self, surface: Surface, scene: Scene) -> EmissivityField:
        """Lay a surface on a scene as this camera sees it, in its band and its surroundings.

        Parameters
        ----------
        surface : Surface
            The surface.
        scene : Scene
            What it is laid on.

        Raises
        ------
        ValueError
            If the surface is none, or the scene lacks what it needs.
        """
        if not isinstance(surface, Surface):
            raise ValueError(
                f"surface: {surface!r}, expected a Surface such as chipglow.CHIP_1 or "
                "UniformSurface(0.6)"
            )
        return surface.on(scene, self.band, self.reflected)

    def expose(self, scene: Scene, surface: Surface, start: float) -> Exposure:
        """Let a scene shine on the camera for one integration time.

        Parameters
        ----------
        scene : Scene
            What is truly there.
        surface : Surface
            Its emissivity.
        start : float
            When the integration begins in s.

        Raises
        ------
        ValueError
            If the surface is none, the integration reaches beyond the scene, or the pixels do not
            fit it.
        """
        (exposure,) = self.expose_fields(scene, (self.lay(surface, scene),), start)
        return replace(exposure, effects=surface.effects)

    def expose_fields(
        self,
        scene: Scene,
        fields: Sequence[EmissivityField],
        start: float,
        check: Check | None = None,
    ) -> tuple[Exposure, ...]:
        """Exposures of a scene with several surfaces: each of its frames is read once.

        Parameters
        ----------
        scene : Scene
            What is truly there.
        fields : sequence of EmissivityField
            The surfaces as this camera sees them (`lay`); one or more.
        start : float
            When the integration of the first row begins in s.
        check : callable, optional
            Called now and then meanwhile; what it raises ends the pass.

        Raises
        ------
        ValueError
            As for `expose`.
        """
        when = start, self.integration_time
        delays = self.row_delays(scene.raster)
        return expose_all(scene, fields, self.band, *when, self.reflected, delays, check)

    def form_measurement(self, exposures: Exposure | Iterable[Exposure]) -> Measurement:
        """Make the frames that the camera reads from exposures.

        Size of source, blur and mean over time are linear and change places: the mean, which an
        exposure holds, is blurred and integrated once. That is equal to the loop of Figure 6, and
        any number of cameras with the same band, integration time and surroundings may develop
        the same exposures.

        Parameters
        ----------
        exposures : Exposure or iterable of Exposure
            What the scene sent, one for each frame.

        Returns
        -------
        Measurement
            As many frames as exposures. Its attribute ``warnings`` says how far the border of the
            scene matters, if it changes a pixel by over `BORDER_TOLERANCE`.

        Raises
        ------
        ValueError
            If there is no exposure, they are of different grids, or the pixels do not fit.

        Notes
        -----
        What is beyond the scene is not known. It is taken to be as at the scene's edge, and the
        light that comes from there (`light_from_beyond`) is what a warning is about: it compares
        with a second assumption, by which each pixel sees beyond the scene the like of what it
        sees within.
        """
        if isinstance(exposures, Exposure):
            exposures = (exposures,)
        starts, frames, alike, effects, sensors = [], [], [], [], None
        for exposure in exposures:
            found = self.pixels(exposure.raster)
            if sensors not in (None, found):
                raise ValueError(f"camera: exposures of different grids, {sensors} and {found}")
            sensors = found
            starts.append(exposure.start)
            effects.append(set(exposure.effects.items()))
            image, like = self._both_images(exposure.mean_radiance, exposure.raster, sensors)
            frames.append(image)
            if like is not None:
                alike.append(like)
        if sensors is None:
            raise ValueError("camera: no exposure to develop, expected 1 or more")
        images, times = np.stack(frames), np.array(starts)
        measured = self._measurement(images, times, sensors)
        measured.data.attrs.update(sorted(set.intersection(*effects)))
        said = list(self._warnings(times))
        if alike:
            other = np.asarray(self.band.temperature(np.stack(alike)), np.float64)
            # Noise is no matter of the border.
            ideal = (
                replace(self, detector=None)._measurement(images, times, sensors)
                if self.detector
                else measured
            )
            said += _border_warning(ideal, other, exposure.raster)
        if said:
            measured.data.attrs["warnings"] = "\n".join(said)
        return measured

    def measure(
        self, scene: Scene, surface: Surface, start: float | Sequence[float] | NDArray[np.float64]
    ) -> Measurement:
        """Measure a scene.

        Parameters
        ----------
        scene : Scene
            What is truly there.
        surface : Surface
            Its emissivity.
        start : float or sequence of float
            When the integration of each frame begins in s; see `frame_times` for a sequence at
            the frame rate.

        Returns
        -------
        Measurement
            As many frames as starts. It states the scene's tool, and in its attributes camera and
            surface: every effect that made it.

        Raises
        ------
        ValueError
            If an integration reaches beyond the scene, or the pixels do not fit it.
        """
        self.pixels(scene.raster)
        fields = (self.lay(surface, scene),)
        measured = self.form_measurement(
            replace(self.expose_fields(scene, fields, at)[0], effects=surface.effects)
            for at in np.atleast_1d(np.asarray(start, dtype=np.float64)).tolist()
        )
        return measured.with_tool(scene.tool) if scene.tool else measured

    def light_from_beyond(self, scene: Raster) -> NDArray[np.float64]:
        """Fraction of the light of every pixel that comes from beyond a scene, where none is known.

        Parameters
        ----------
        scene : Raster
            The scene's samples.

        Returns
        -------
        ndarray
            From 0 to under 1, of the shape of `sensors`; 0 without a point spread function.

        Raises
        ------
        ValueError
            If the pixels do not fit the scene.
        """
        sensors = self.pixels(scene)
        if self.psf is None:
            return np.zeros(sensors.shape)
        if self.psf_order == "optics":
            fraction = light_from_beyond(self.psf, scene.spacing, scene.shape)
            return integrate(fraction, scene, sensors, self._sensitive(scene))
        whole, own = whole_raster(scene, sensors)
        return light_from_beyond(self.psf, self.pitch, whole.shape)[own].copy()

    def form_image(self, radiance: NDArray[np.float64], scene: Raster) -> NDArray[np.float64]:
        """Image of a map of radiance on the pixels: optics, point spread function and footprint.

        Parameters
        ----------
        radiance : ndarray
            Radiance of the scene's samples in W/(m² sr), shape `scene.shape`: the mean over the
            integration time, such as `Exposure.mean_radiance`.
        scene : Raster
            The samples.

        Returns
        -------
        ndarray
            Radiance of every pixel in W/(m² sr), shape `pixels(scene).shape`.

        Raises
        ------
        ValueError
            If the map is not of the raster's shape, holds what is no radiance, or the pixels do
            not fit the scene.
        """
        image = np.asarray(radiance, np.float64)
        if image.shape != scene.shape:
            raise ValueError(f"camera: radiance of shape {image.shape}, expected {scene.shape}")
        if not (np.isfinite(image).all() and (image >= 0).all()):
            raise ValueError("camera: radiance must be finite and 0 W/(m² sr) or more")
        sensors = self.pixels(scene)
        if self.psf is not None and self.psf_order == "optics":
            if not self.optics:
                return image_on_pixels(image, self.psf, scene, sensors, self._sensitive(scene))
            image = blur(image, self.psf, scene.spacing)
        return self._read_out(image, scene, sensors, blur)

    def _both_images(
        self, radiance: NDArray[np.float64], scene: Raster, sensors: Raster
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """Image on the pixels by either rule of what is beyond the scene, if that matters."""
        image = like = radiance
        if self.psf is None and not self.optics:
            return self._read_out(image, scene, sensors, blur), None
        if self.psf is not None and self.psf_order == "optics":
            if not self.optics:
                sensitive = self._sensitive(scene)
                return both_images_on_pixels(image, self.psf, scene, sensors, sensitive)
            image, like = both_borders(image, self.psf, scene.spacing)
        return (
            self._read_out(image, scene, sensors, blur),
            self._read_out(like, scene, sensors, blur_of_like),
        )

    def _read_out(
        self, image: NDArray[np.float64], scene: Raster, sensors: Raster, blurred: Blur
    ) -> NDArray[np.float64]:
        """Radiance of every pixel, `sensors.shape`, from an image behind the optics' own PSF."""
        for term in self.optics:
            image = term.on_samples(image, scene, sensors, blurred)
        image = self._on_pixels(image, scene, sensors, blurred)
        for term in self.optics:
            image = term.on_pixels(image, sensors, self.band)
        return image

    def _on_pixels(
        self, image: NDArray[np.float64], scene: Raster, sensors: Raster, blurred: Blur
    ) -> NDArray[np.float64]:
        """What pixels integrate, in the detector's order with the point spread function."""
        if self.psf is None or self.psf_order == "optics":
            return integrate(image, scene, sensors, self._sensitive(scene))
        # Pixels that are not read out tell what is beyond those that are.
        whole, own = whole_raster(scene, sensors)
        return blurred(integrate(image, scene, whole, self.fill_factor), self.psf, self.pitch)[own]

    def _sensitive(self, scene: Raster) -> float:
        """Fraction of a pixel's square that it integrates: a sample, if the blur did the rest."""
        if not self._blur_has_footprint:
            return self.fill_factor
        return min((scene.spacing / self.pitch) ** 2, 1.0)

    @property
    def _blur_has_footprint(self) -> bool:
        return self.psf is not None and "footprint" in self.psf.includes

    def measurement(
        self, images: NDArray[np.float64], starts: NDArray[np.float64], scene: Raster
    ) -> Measurement:
        """The frames that the camera reads from images that it formed.

        Parameters
        ----------
        images : ndarray
            Radiance in W/(m² sr) as `form_image` gives it, shape (time, y, x).
        starts : ndarray
            When the integration of each began in s, shape (time,).
        scene : Raster
            The samples of the scene that they are images of.
        """
        return self._measurement(images, starts, self.pixels(scene))

    def read(
        self, images: NDArray[np.float64], starts: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.uint8] | None]:
        """What the detector and its calibration make of images.

        Parameters
        ----------
        images : ndarray
            Radiance in W/(m² sr) as `form_image` gives it, shape (time, y, x).
        starts : ndarray
            When the integration of each began in s, shape (time,).

        Returns
        -------
        radiance : ndarray
            As the camera reads it; without a detector the images themselves.
        flags : ndarray or None
            Sums of `Flag`, uint8, of the same shape; None without a detector.
        """
        calibration = self.calibration(images.shape[1:])
        if self.detector is None or calibration is None:
            return images, None
        generators = [self._generator(float(start)) for start in starts]
        counts = self.detector.counts(images, generators, calibration.point, starts)
        return calibration.radiance(counts)

    def _generator(self, start: float) -> np.random.Generator:
        """Noise of the frame that begins then, however many others are read with it."""
        return np.random.default_rng([self.seed, int(np.float64(start + 0.0).view(np.uint64))])

    def _measurement(
        self, images: NDArray[np.float64], starts: NDArray[np.float64], sensors: Raster
    ) -> Measurement:
        radiance, flags = self.read(images, starts)
        return Measurement.from_radiance(
            radiance,
            self.band,
            starts,
            sensors,
            self.lower_limit,
            flags,
            attributes=self._attributes(sensors.shape),
        )

    def _warnings(self, starts: NDArray[np.float64]) -> Iterator[str]:
        """What to know of frames by when they begin, a sentence each."""
        lags = self.detector is not None and any(isinstance(t, Lag) for t in self.detector.terms)
        if lags and not follows(starts, 1 / self.frame_rate).any():
            yield (
                "Lag: no frame comes one time between frames after another, so the frame before is "
                "taken to be as the frame itself: there is no lag in them."
            )

    def _attributes(self, shape: tuple[int, int]) -> dict[str, float | str]:
        """What a measurement does not state of the camera by itself; SI, without what is None."""
        attributes: dict[str, float | str | None] = {
            "offset_right": self.offset[0],
            "offset_down": self.offset[1],
            "fill_factor": self.fill_factor,
            "psf": repr(self.psf),
            "psf_order": self.psf_order,
            "integration_time": self.integration_time,
            "frame_rate": self.frame_rate,
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


def _border_warning(
    measured: Measurement, other: NDArray[np.float64], scene: Raster
) -> Iterator[str]:
    """What the border of the scene may change, beside temperatures under another assumption."""
    change = np.abs(measured.radiance_temperature() - other)
    changed = change > BORDER_TOLERANCE
    if not changed.any():
        return
    (left, right, bottom, top), at = scene.extent, measured.raster
    across = np.minimum(at.x - left, right - at.x)
    down = np.minimum(top - at.y, at.y - bottom)
    reach = np.minimum(across, down[:, None])[changed.any(axis=0)].max()
    yield (
        "The border of the scene: beyond it the surface is taken to be as at the edge. With "
        "the like of what each pixel sees within the scene there instead, "
        f"{100 * changed.mean():.3g} % of the pixels (up to {1e6 * reach:.3g} µm from the "
        f"border) would change by over {BORDER_TOLERANCE:g} K, by {np.nanmax(change):.3g} K at "
        "most."
    )
