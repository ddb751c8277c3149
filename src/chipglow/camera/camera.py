"""The virtual infrared camera."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.convolution import blur
from chipglow.camera.exposure import Exposure, expose
from chipglow.camera.measurement import Measurement
from chipglow.camera.psf import AnnularAperturePSF, PointSpreadFunction
from chipglow.camera.sampling import integrate, sensor_raster
from chipglow.radiometry import Band
from chipglow.radiometry.band import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.scene import Raster, Scene
from chipglow.surface import Surface

PSF_ORDERS: Final = ("optics", "sensor")


@dataclass(frozen=True)
class Camera:
    """An infrared camera looking at a scene (Figure 6 of Heigel and Whitenton, 2010).

    Parameters
    ----------
    band : Band
        Spectral band; the paper's 3.8 µm to 5.1 µm by default.
    pitch : float
        Distance between sensors in m, on the scene; the paper's 0.96 mm / 160 by default.
    shape : tuple of int, optional
        Rows and columns of sensors; as many whole sensors as fit the scene by default.
    offset : tuple of float
        Corner of the first sensor in m, right of and down from the scene's upper left corner.
    fill_factor : float
        Share of a sensor's square that is sensitive: a square in its middle.
    psf : PointSpreadFunction, optional
        How the camera spreads a point; None for an ideal camera (the paper's case 2).
    psf_order : {"optics", "sensor"}
        ``optics`` blurs the scene's samples and lets the sensors integrate the blurred image, as
        light does it: the point spread function is that of the optics alone. ``sensor`` is the
        paper's: the sensors integrate the scene, and the blur is applied from sensor to sensor.
        The kernel is then the share of a point's light that each sensor receives, which holds
        the sensor's footprint a second time: the variance of the blur is larger by pitch² / 12.
    integration_time : float
        In s.
    frame_rate : float
        Frames a second.
    floor : float, optional
        Lowest radiance temperature in K that the camera measures; what is under it is flagged.
        The paper's 300 °C by default; None for no floor.
    reflected : float, optional
        Temperature in K of surroundings that the surface reflects (Equation 2); by default
        reflections are left out, as in the paper's simulation (Equation 3).

    Raises
    ------
    ValueError
        If a value is impossible; the message names it and what was expected.
    """

    band: Band = field(default_factory=lambda: Band(3.8e-6, 5.1e-6))
    pitch: float = 6e-6
    shape: tuple[int, int] | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    fill_factor: float = 1.0
    psf: PointSpreadFunction | None = field(default_factory=AnnularAperturePSF)
    psf_order: Literal["optics", "sensor"] = "optics"
    integration_time: float = 10e-6
    frame_rate: float = 600.0
    floor: float | None = 573.15
    reflected: float | None = None

    def __post_init__(self) -> None:
        _expect(0.0 < self.pitch <= 1e-2, "pitch", self.pitch, "over 0 to 1e-2 m; 6 um is 6e-6")
        _expect(
            self.shape is None or (len(self.shape) == 2 and min(self.shape) >= 1),
            "shape",
            self.shape,
            "rows and columns of 1 or more",
        )
        _expect(
            len(self.offset) == 2 and all(isfinite(o) and o >= 0.0 for o in self.offset),
            "offset",
            self.offset,
            "two lengths of 0 m or more",
        )
        _expect(0.0 < self.fill_factor <= 1.0, "fill_factor", self.fill_factor, "over 0 to 1")
        _expect(
            self.psf is None or isinstance(self.psf, PointSpreadFunction),
            "psf",
            self.psf,
            "a PointSpreadFunction, or None",
        )
        _expect(self.psf_order in PSF_ORDERS, "psf_order", self.psf_order, " or ".join(PSF_ORDERS))
        _expect(
            0.0 < self.frame_rate < float("inf"), "frame_rate", self.frame_rate, "over 0 a second"
        )
        _expect(
            0.0 < self.integration_time <= 1 / self.frame_rate,
            "integration_time",
            self.integration_time,
            f"over 0 to {1 / self.frame_rate:g} s, the time between frames",
        )
        for name in ("floor", "reflected"):
            value = getattr(self, name)
            _expect(
                value is None or TABLE_COLDEST <= value <= TABLE_HOTTEST,
                name,
                value,
                f"{TABLE_COLDEST:g} to {TABLE_HOTTEST:g} K, or None",
            )

    def sensors(self, scene: Raster) -> Raster:
        """Where the sensors lie on a scene.

        Parameters
        ----------
        scene : Raster
            The scene's samples.

        Raises
        ------
        ValueError
            If not one sensor fits, or `shape` reaches beyond the scene.
        """
        return sensor_raster(scene, self.pitch, self.offset, self.shape)

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
            If the integration reaches beyond the scene, or the sensors do not fit it.
        """
        self.sensors(scene.raster)
        return expose(
            scene, surface.on(scene), self.band, start, self.integration_time, self.reflected
        )

    def develop(self, exposures: Exposure | Iterable[Exposure]) -> Measurement:
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
            As many frames as exposures.

        Raises
        ------
        ValueError
            If there is no exposure, they are of different grids, or the sensors do not fit.
        """
        if isinstance(exposures, Exposure):
            exposures = (exposures,)
        starts, frames, sensors = [], [], None
        for exposure in exposures:
            found = self.sensors(exposure.raster)
            if sensors not in (None, found):
                raise ValueError(f"camera: exposures of different grids, {sensors} and {found}")
            sensors = found
            starts.append(exposure.start)
            frames.append(self.form_image(exposure))
        if sensors is None:
            raise ValueError("camera: no exposure to develop, expected 1 or more")
        return self._measurement(np.stack(frames), np.array(starts), sensors)

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
            As many frames as starts; it tells the scene's tool.

        Raises
        ------
        ValueError
            If an integration reaches beyond the scene, or the sensors do not fit it.
        """
        self.sensors(scene.raster)
        emissivity = surface.on(scene)
        measured = self.develop(
            expose(scene, emissivity, self.band, at, self.integration_time, self.reflected)
            for at in np.atleast_1d(np.asarray(start, dtype=np.float64)).tolist()
        )
        return measured.with_tool(scene.tool) if scene.tool else measured

    def form_image(self, exposure: Exposure) -> NDArray[np.float64]:
        """Image of an exposure on the pixels: point spread function and detector footprint.

        Parameters
        ----------
        exposure : Exposure
            What the scene sent.

        Returns
        -------
        ndarray
            Radiance of every pixel in W/(m² sr), shape `sensors(exposure.raster).shape`.

        Raises
        ------
        ValueError
            If the pixels do not fit the scene.
        """
        image, raster = exposure.mean_radiance, exposure.raster
        sensors = self.sensors(raster)
        if self.psf is not None and self.psf_order == "optics":
            image = blur(image, self.psf, raster.spacing)
        image = integrate(image, raster, sensors, self.fill_factor)
        if self.psf is not None and self.psf_order == "sensor":
            image = blur(image, self.psf, self.pitch)
        return image

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
        return self._measurement(images, starts, self.sensors(scene))

    def _measurement(
        self, radiance: NDArray[np.float64], starts: NDArray[np.float64], sensors: Raster
    ) -> Measurement:
        return Measurement.from_radiance(
            radiance, self.band, starts, sensors, self.floor, attributes=self._attributes()
        )

    def _attributes(self) -> dict[str, float | str]:
        """What a measurement does not tell of the camera by itself; SI, without what is None."""
        attributes: dict[str, float | str | None] = {
            "offset_right": self.offset[0],
            "offset_down": self.offset[1],
            "fill_factor": self.fill_factor,
            "psf": repr(self.psf),
            "psf_order": self.psf_order,
            "integration_time": self.integration_time,
            "frame_rate": self.frame_rate,
            "reflected": self.reflected,
        }
        return {name: value for name, value in attributes.items() if value is not None}


def _expect(condition: bool, name: str, value: object, expected: str) -> None:
    if not condition:
        raise ValueError(f"camera: {name} is {value!r}, expected {expected}")
