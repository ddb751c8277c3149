"""The section of the camera."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, Literal

from pydantic import ValidationInfo, model_validator

from chipglow.camera import (
    BLURS,
    OPTICS_TERMS,
    PSFS,
    AnnularAperturePSF,
    BlurredPSF,
    BlurTerm,
    Camera,
    Detector,
    OperationPoint,
    OpticsTerm,
    PointSpreadFunction,
    PSFChoice,
    lower_range_limit,
)
from chipglow.io.column_file import read_response
from chipglow.quantities import FileBeside, Parameter, Settings
from chipglow.quantities.units import (
    FREQUENCY,
    LENGTH,
    POSITION,
    TEMPERATURE,
    TIME,
    WAVELENGTHS,
)
from chipglow.radiometry import Band
from chipglow.scene import Raster
from chipglow.study.camera_presets import CAMERAS, with_preset
from chipglow.study.scaling import with_pitch

FROM_DETECTOR: Final = "detector"
"""A lower range limit that follows from the detector."""

PSFSection = Annotated[PSFChoice, PSFS]
BlurSection = Annotated[BlurTerm, BLURS]
OpticsTermSection = Annotated[OpticsTerm, OPTICS_TERMS]


class CameraSection(Settings[Camera]):
    """The infrared camera."""

    preset: Annotated[
        str | None,
        Parameter(
            "A camera by name: its data sheet's numbers where this section says nothing. Its "
            "lens's magnification is given beside it.",
            allowed=f"none, {', '.join(CAMERAS)}",
        ),
    ] = None
    band: Annotated[tuple[float, float], Parameter("Spectral band.", WAVELENGTHS)] = (
        3.8e-6,
        5.1e-6,
    )
    response: Annotated[
        FileBeside | None,
        Parameter(
            "Relative spectral response, a CSV file: its first line wavelength_um,response, then "
            "a point a line; it counts within the band.",
            allowed="none, or a file such as response.csv",
        ),
    ] = None
    pitch: Annotated[float, Parameter("Distance between pixels, as seen on the scene.", LENGTH)] = (
        6e-6
    )
    detector_pitch: Annotated[
        float | None,
        Parameter(
            "The same on the detector, of its data sheet, in the place of pitch; with "
            "magnification.",
            LENGTH,
            over=0.0,
        ),
    ] = None
    magnification: Annotated[
        float | None,
        Parameter("Of the lens: a pitch of 15 um at 2.5 is 6 um on the scene.", over=0.0),
    ] = None
    array: Annotated[
        tuple[int, int] | None,
        Parameter(
            "Columns and rows of the detector; none, and where the scene is smaller: as many as "
            "see the scene.",
            allowed="none, or such as [640, 512]",
        ),
    ] = None
    fill_factor: Annotated[float, Parameter("Fraction of a pixel's square that takes light.")] = 1.0
    offset_right: Annotated[
        float, Parameter("First pixel's corner from the scene's left edge.", POSITION)
    ] = 0.0
    offset_down: Annotated[
        float, Parameter("First pixel's corner from the scene's upper edge.", POSITION)
    ] = 0.0
    psf: Annotated[
        PSFSection | None,
        Parameter("Point spread function of the optics, or none."),
    ] = AnnularAperturePSF()
    blur: Annotated[
        tuple[BlurSection, ...],
        Parameter("What spreads light besides, a list: it is part of the point spread function."),
    ] = ()
    optics: Annotated[
        tuple[OpticsTermSection, ...],
        Parameter("What the optics do besides, a list in the order of the light."),
    ] = ()
    psf_order: Annotated[
        Literal["optics", "detector"],
        Parameter(
            "detector (the paper's: on the pixels' values) or optics (on the samples, before the "
            "sensors integrate)."
        ),
    ] = "detector"
    integration_time: Annotated[float, Parameter("Exposure.", TIME)] = 10e-6
    frame_rate: Annotated[float, Parameter("Frames a second.", FREQUENCY)] = 600.0
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
        float | Literal["detector"] | None,
        Parameter(
            "Radiance temperatures under this are flagged, not returned; or none. With a detector "
            "it is the detector's, unless it is said.",
            TEMPERATURE,
            allowed="a temperature, detector or none",
        ),
    ] = 573.15
    reflected: Annotated[
        float | None,
        Parameter(
            "Temperature of the surroundings that the surface reflects, or none.", TEMPERATURE
        ),
    ] = None

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

    @model_validator(mode="before")
    @classmethod
    def _pitch_on_the_scene(cls, data: object, info: ValidationInfo) -> object:
        if not isinstance(data, Mapping):
            return data
        camera = with_pitch(with_preset(data), bool(info.context))
        if camera.get("detector") not in (None, "none"):
            return {"lower_limit": "detector", **camera}
        return camera

    def build(self, seed: int = 2010) -> Camera:
        """The camera, with as many pixels as see the scene.

        Parameters
        ----------
        seed : int
            The study's: of the detector's noise.
        """
        band = self._band()
        detector = self.detector
        return Camera(
            band=band,
            pitch=self.pitch,
            offset=(self.offset_right, self.offset_down),
            fill_factor=self.fill_factor,
            psf=self._psf(band),
            psf_order=self.psf_order,
            integration_time=self.integration_time,
            frame_rate=self.frame_rate,
            line_time=self.line_time,
            lower_limit=self._lower_limit(band, detector),
            reflected=self.reflected,
            optics=self.optics,
            detector=detector,
            seed=seed,
        )

    def on(self, scene: Raster, seed: int = 2010) -> Camera:
        """The camera on a scene, with no more pixels than its detector has.

        Parameters
        ----------
        scene : Raster
            The scene's samples.
        seed : int
            The study's: of the detector's noise.
        """
        camera = self.build(seed)
        if self.array is None:
            return camera
        seen = camera.pixels(scene)
        columns, rows = self.array
        return replace(camera, shape=(min(rows, seen.rows), min(columns, seen.columns)))

    def _lower_limit(self, band: Band, detector: Detector | None) -> float | None:
        if self.lower_limit != FROM_DETECTOR:
            return self.lower_limit
        if detector is None:
            raise ValueError("lower_limit: detector, expected a detector beside it")
        point = OperationPoint(band, self.integration_time, self.frame_rate, self.fill_factor)
        return lower_range_limit(detector, point)

    def _band(self) -> Band:
        response = None if self.response is None else read_response(self.response)
        return Band(*self.band, response)

    def _psf(self, band: Band) -> PointSpreadFunction | None:
        if self.psf is None:
            if self.blur:
                raise ValueError(
                    "blur: stands beside psf: none, expected a point spread function that it is "
                    "part of"
                )
            return None
        psf = self.psf.of_camera(band, self.magnification)
        return BlurredPSF(psf, self.blur) if self.blur else psf
