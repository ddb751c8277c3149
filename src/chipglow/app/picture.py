"""What the page shows at one state of its knobs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import Distribution, ErrorImages, ErrorParts
from chipglow.app.knobs import SHOWN, Knobs
from chipglow.camera import Camera, Exposure
from chipglow.drawing.scales import KELVIN
from chipglow.scene import Raster


@dataclass(frozen=True, eq=False)
class SceneImage:
    """What is truly there, on few enough samples for a screen.

    Parameters
    ----------
    name : str
        Which quantity, of `chipglow.app.knobs.SHOWN`.
    values : ndarray
        In SI, shape (y, x); NaN where there is no material.
    raster : Raster
        The samples.
    """

    name: str
    values: NDArray[np.float32]
    raster: Raster

    @property
    def is_temperature(self) -> bool:
        """Whether the quantity is one, and is shown in °C."""
        return self.name in ("temperature", "radiance_temperature")

    @cached_property
    def shown(self) -> NDArray[np.float32]:
        """Values as people read them: temperatures in °C."""
        return self.values - np.float32(KELVIN) if self.is_temperature else self.values

    @property
    def label(self) -> str:
        """Quantity and unit."""
        units = {"plastic_strain_rate": " / (1/s)", "speed": " / (m/s)"}
        return SHOWN[self.name].lower() + units.get(self.name, " / °C" * self.is_temperature)


@dataclass(frozen=True, eq=False)
class LineValues:
    """Temperatures along one of the lines.

    Parameters
    ----------
    distance : ndarray
        From its first end in m, shape (n,).
    measured : ndarray
        Radiance temperature in K; NaN off the image.
    reference, psf_portion : ndarray or None
        What it is compared with, and the point spread function's part of the error, in K; None of
        a measurement.
    """

    distance: NDArray[np.float64]
    measured: NDArray[np.float64]
    reference: NDArray[np.float64] | None
    psf_portion: NDArray[np.float64] | None


@dataclass(frozen=True, eq=False)
class Picture:
    """Images and lines at one state of the knobs.

    Parameters
    ----------
    knobs : Knobs
        The state.
    raster : Raster
        The pixels.
    measured : ndarray
        Radiance temperature in K, whether flagged or not, shape (y, x).
    flagged : ndarray of bool
        Pixels that the camera marks as unusable.
    lines : dict
        Values by the names of `chipglow.app.knobs.LINES`.
    coarse : bool
        Whether it is a quick look on few samples: its numbers are not final.
    scene : SceneImage or None
        None of a measurement, as all that follows.
    errors : ErrorImages or None
        Errors of the pixels.
    error : ndarray or None
        The error, or the part of it, that the knobs ask for, in K, shape (y, x).
    camera : Camera or None
        The camera.
    exposures : tuple of Exposure
        What reached it, and the same without texture if that was asked for.
    """

    knobs: Knobs
    raster: Raster
    measured: NDArray[np.float64]
    flagged: NDArray[np.bool_]
    lines: dict[str, LineValues]
    coarse: bool = False
    scene: SceneImage | None = None
    errors: ErrorImages | None = None
    error: NDArray[np.float64] | None = None
    camera: Camera | None = None
    exposures: tuple[Exposure, ...] = ()


@dataclass(frozen=True, eq=False)
class Readout:
    """Numbers at the cursor; NaN where there is none.

    Parameters
    ----------
    measured, uncertainty : float
        Radiance temperature in K, and its standard uncertainty from what is known: noise of the
        detector, calibration. NaN where nothing makes it uncertain.
    source : str
        What the uncertainty is of; empty without one.
    flagged : bool
        Whether the camera marks the pixel as unusable.
    true, emissivity, reference : float
        Temperature of the scene's sample in the middle of the exposure in K, its emissivity, and
        what the measured temperature is compared with.
    parts : ErrorParts or None
        Of the whole image; None of a measurement.
    """

    measured: float
    uncertainty: float
    source: str
    flagged: bool
    true: float
    emissivity: float
    reference: float
    parts: ErrorParts | None


@dataclass(frozen=True, eq=False)
class LineBand:
    """A line over all draws: measured radiance temperature and error in K, shape (draw, n)."""

    measured: NDArray[np.float64]
    error: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Lines and the error at the cursor over positions of the pixels and textures.

    Parameters
    ----------
    knobs : Knobs
        The state that they are drawn about.
    lines : dict
        By the names of `chipglow.app.knobs.LINES`.
    error : Distribution or None
        At the cursor; None where some draw shows nothing there.
    """

    knobs: Knobs
    lines: dict[str, LineBand]
    error: Distribution | None
