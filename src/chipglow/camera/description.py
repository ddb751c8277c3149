"""The description of an infrared camera: its settings, pixels and frame times."""

from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from typing import Annotated, Literal, Self

import numpy as np

from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.flat_field import FlatFieldCalibration, flat_field_calibration
from chipglow.camera.detector.response import (
    ExposureSettings,
    OperationPoint,
    RangeResponse,
    in_tables,
)
from chipglow.camera.optics.blurs import BLURS
from chipglow.camera.optics.psf import AnnularAperturePSF, PointSpreadFunction
from chipglow.camera.optics.sampling import sensor_raster
from chipglow.camera.optics.terms import OPTICS_TERMS, OpticsTerm
from chipglow.quantities import SEED, Array, Parameter, made_from
from chipglow.quantities.units import LENGTH, TIME, Position
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Raster


@dataclass(frozen=True, kw_only=True)
class CameraSettings(ExposureSettings):
    """Settings of a camera that a study states as `Camera` takes them."""

    pitch: Annotated[
        float, Parameter("Distance between pixels on the scene.", LENGTH, least=1e-8, most=1e-2)
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
            "full_well: 7e6, bits: 14, terms: [{kind: shot-noise}]};\n"
            "or the noise of a data sheet alone, at 30 degC: {netd: 20 mK}",
        ),
    ] = None


@dataclass(frozen=True)
class CameraDescription(CameraSettings):
    """All that is stated of a camera; `Camera` is one that measures."""

    band: Annotated[Band, Parameter("Spectral band; the paper's by default.")] = field(
        default_factory=lambda: Band(*PAPER_BAND)
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
    ] = SEED

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.psf is not None:
            object.__setattr__(self, "psf", self.psf.for_camera(self.band, None))
        included = self.psf.includes if self.psf else ()
        if included and not set(included) <= {"footprint", *BLURS.kinds}:
            known = ", ".join(("footprint", *BLURS.kinds))
            raise ValueError(f"Camera.psf.includes: {included!r}, only {known} are known")
        if self.psf_order == "detector" and "footprint" in included:
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

    def pixels(self, scene: Raster) -> Raster:
        """Return the raster of pixels on a scene."""
        return sensor_raster(scene, self.pitch, self.offset, self.shape)

    def in_band(self, band: Band) -> Self:
        """Return a copy with another band and its diffraction, without a lower range limit."""
        psf = None if self.psf is None else self.psf.in_band(band)
        return replace(self, band=band, psf=psf, lower_limit=None)

    def redrawn(self, number: int) -> Self:
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
