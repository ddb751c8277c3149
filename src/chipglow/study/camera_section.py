"""The section of the camera."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, Literal

from pydantic import Strict, model_validator

from chipglow.camera import (
    BLURS,
    OPTICS_TERMS,
    PSFS,
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
from chipglow.quantities import OR_NONE, Declared, FileBeside, Settings, described
from chipglow.quantities.section import OrWord
from chipglow.quantities.units import (
    Frequency,
    Length,
    Position,
    Temperature,
    Time,
    WavelengthRange,
)
from chipglow.radiometry import Band
from chipglow.scene import Raster
from chipglow.study.camera_presets import CAMERAS, with_preset
from chipglow.study.detector_section import DetectorSection
from chipglow.study.scaling import with_pitch

OR_DETECTOR: Final = OrWord("detector", "detector")
"""Annotation of a lower range limit that follows from the detector."""

PSFSection = Annotated[Declared[PSFChoice], PSFS]
BlurSection = Annotated[Declared[BlurTerm], BLURS]
OpticsTermSection = Annotated[Declared[OpticsTerm], OPTICS_TERMS]


class CameraSection(Settings[Camera]):
    """The infrared camera."""

    preset: Annotated[str | None, OR_NONE] = described(
        "none",
        "A camera by name: its data sheet's numbers where this section says nothing. Its lens's\n"
        "magnification is given beside it.",
        f"none, {', '.join(CAMERAS)}",
    )
    band: WavelengthRange = described("3.8-5.1 um", "Spectral band.")
    response: Annotated[FileBeside | None, OR_NONE] = described(
        "none",
        "Relative spectral response, a CSV file: its first line wavelength_um,response, then a\n"
        "point a line; it counts within the band.",
        "none, or a file such as response.csv",
    )
    pitch: Length = described("6 um", "Distance between pixels, as seen on the scene.")
    detector_pitch: Annotated[Length | None, OR_NONE] = described(
        "none",
        "The same on the detector, of its data sheet, in the place of pitch; with magnification.",
        "none, or over 0 um",
    )
    magnification: Annotated[float | None, OR_NONE] = described(
        "none",
        "Of the lens: a pitch of 15 um at 2.5 is 6 um on the scene.",
        "none, or over 0",
    )
    array: Annotated[tuple[int, int] | None, Strict(False), OR_NONE] = described(
        "none",
        "Columns and rows of the detector; none, and where the scene is smaller: as many as see\n"
        "the scene.",
        "none, or such as [640, 512]",
    )
    fill_factor: float = described(1.0, "Fraction of a pixel's square that takes light.")
    offset_right: Position = described("0 um", "First pixel's corner from the scene's left edge.")
    offset_down: Position = described("0 um", "First pixel's corner from the scene's upper edge.")
    psf: Annotated[PSFSection | None, OR_NONE] = described(
        {"kind": "annular-aperture"},
        f"Point spread function of the optics, or none. Kinds:\n{PSFS.examples}",
    )
    blur: Annotated[tuple[BlurSection, ...], Strict(False)] = described(
        [],
        "What spreads light besides, a list: it is part of the point spread function. Kinds:\n"
        f"{BLURS.examples}",
    )
    optics: Annotated[tuple[OpticsTermSection, ...], Strict(False)] = described(
        [],
        "What the optics do besides, a list in the order of the light. Kinds:\n"
        f"{OPTICS_TERMS.examples}",
    )
    psf_order: Literal["optics", "detector"] = described(
        "detector",
        "detector (the paper's: on the pixels' values) or optics (on the samples, before the\n"
        "sensors integrate).",
    )
    integration_time: Time = described("10 us", "Exposure.")
    frame_rate: Frequency = described("600 Hz", "Frames a second.")
    line_time: Annotated[Time | None, OR_NONE] = described(
        "none",
        "Rolling shutter: how much later each row's exposure begins than that of the row above;\n"
        "none: a global shutter, all rows at once.",
        "none, or over 0 us",
    )
    lower_limit: Annotated[Temperature | None, OR_NONE, OR_DETECTOR] = described(
        "300 degC",
        "Radiance temperatures under this are flagged, not returned; or none. With a detector it\n"
        "is the detector's, unless it is said.",
        "a temperature, detector or none",
    )
    reflected: Annotated[Temperature | None, OR_NONE] = described(
        "none", "Temperature of the surroundings that the surface reflects, or none."
    )

    detector: Annotated[DetectorSection | None, OR_NONE] = described(
        "none",
        "Electrons, noise and counts of the detector, and the camera's own calibration; none: the\n"
        "radiance is read as it is.",
        "none, or such as\n"
        "{response: {kind: photon, quantum_efficiency: 0.8, element: 15 um, f_number: 2.5},\n"
        "full_well: 7e6, bits: 14, terms: [{kind: shot-noise}]}",
    )

    @model_validator(mode="before")
    @classmethod
    def _pitch_on_the_scene(cls, data: object) -> object:
        if not isinstance(data, Mapping):
            return data
        camera = with_pitch(with_preset(data))
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
        detector = None if self.detector is None else self.detector.build()
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
            optics=tuple(term.build() for term in self.optics),
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
        limit: object = self.lower_limit
        if limit != OR_DETECTOR.value:
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
        psf = self.psf.build().of_camera(band, self.magnification)
        return BlurredPSF(psf, tuple(one.build() for one in self.blur)) if self.blur else psf
