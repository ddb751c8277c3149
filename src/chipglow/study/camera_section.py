"""The section of the camera."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from chipglow.camera import (
    BLURS,
    PAPER_LIMIT,
    PSFS,
    AnnularAperturePSF,
    BlurredPSF,
    BlurTerm,
    Camera,
    CameraSettings,
    OperationPoint,
    PointSpreadFunction,
    PSFChoice,
    lower_range_limit,
)
from chipglow.io.column_file import read_response
from chipglow.quantities import SEED, FileBeside, Parameter, Part, made_from, unchecked
from chipglow.quantities.units import COLDEST, LENGTH, POSITION, WAVELENGTHS
from chipglow.radiometry import Band
from chipglow.radiometry.band import PAPER_BAND
from chipglow.scene import Raster
from chipglow.text import read_yaml

_FILE: Final = Path(__file__).with_name("cameras.yaml")
CAMERAS: Final[Mapping[str, Mapping[str, Any]]] = read_yaml(_FILE)
"""Fields of the section by the names of cameras, each with its source."""

_SAME_PITCH: Final = 1e-6
"""Largest relative difference of two pitches that are the same but for rounding."""

_ABOUT: Final = ("source", "windows", "netd")
"""Entries of a camera by name beside fields of the section."""

NEEDED: Final = ("band", "detector_pitch", "frame_rate")
"""Fields that a study must state if the data sheet does not."""

FROM_DETECTOR: Final = "detector"
"""A lower range limit that follows from the detector."""


@dataclass(frozen=True)
class CameraModel(Part):
    """Which camera it is."""

    preset: Annotated[
        str | None,
        Parameter(
            "Named camera (chipglow cameras), whose data sheet supplies the values that this "
            "section omits. State the magnification of the lens, or pitch, separately.",
            allowed=f"none, {', '.join(CAMERAS)}",
        ),
    ] = None
    band: Annotated[tuple[float, float], Parameter("Spectral band.", WAVELENGTHS)] = PAPER_BAND
    response: Annotated[
        FileBeside | None,
        Parameter(
            "Relative spectral response within the band: a CSV file with the header "
            "wavelength_um,response and one point per line.",
            allowed="none, or a file such as response.csv",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class CameraSection(CameraSettings, CameraModel):
    """The infrared camera."""

    psf_order: Literal["optics", "detector"] = "detector"
    detector_pitch: Annotated[
        float | None,
        Parameter(
            "Pixel pitch on the detector, by the data sheet; replaces pitch, with magnification.",
            LENGTH,
            over=0.0,
        ),
    ] = None
    magnification: Annotated[
        float | None,
        Parameter(
            "Magnification of the lens: a pitch of 15 um at 2.5 is 6 um on the scene. Default with "
            "detector_pitch and pitch: their ratio.",
            over=0.0,
        ),
    ] = None
    array: Annotated[
        tuple[int, int] | None,
        Parameter(
            "Columns and rows of the detector, at most as many as cover the scene: fewer see its "
            "centre, unless their offset is stated; none: as many as cover it.",
            least=1,
            allowed="none, or such as [640, 512]",
        ),
    ] = None
    offset_right: Annotated[
        float | None,
        Parameter(
            "First pixel's corner from the scene's left edge; none: 0, or an array narrower than "
            "the scene is centred.",
            POSITION,
            least=0.0,
        ),
    ] = None
    offset_down: Annotated[
        float | None,
        Parameter(
            "First pixel's corner from the scene's upper edge, likewise.", POSITION, least=0.0
        ),
    ] = None
    psf: Annotated[
        Annotated[PSFChoice, PSFS] | None,
        Parameter("Point spread function of the optics, or none."),
    ] = field(default_factory=AnnularAperturePSF)
    blur: Annotated[
        tuple[Annotated[BlurTerm, BLURS], ...],
        Parameter("Other blurs, a list: they are part of the point spread function."),
    ] = ()
    lower_limit: Annotated[
        float | Literal["detector"] | None,
        replace(
            Camera.parameter("lower_limit"),
            meaning="Radiance temperatures below this are flagged, not returned; or none. Default "
            "with a detector: the limit of the detector.",
            allowed=f"{Camera.parameter('lower_limit').limits}; detector; or none",
        ),
    ] = PAPER_LIMIT

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.detector_pitch is not None:
            if "pitch" in self.given:
                self.derive(magnification=self.detector_pitch / self.pitch)
            # A camera by its data sheet: the paper's order would count its footprint twice.
            self.derive(pitch=self._pitch_on_scene(self.detector_pitch), psf_order="optics")
        elif self.magnification is not None and "pitch" in self.given:
            raise ValueError(
                "magnification: cannot be combined with pitch, which is the distance on the scene; "
                "give the distance on the detector as detector_pitch"
            )
        if self.band != PAPER_BAND:
            self.derive(psf=AnnularAperturePSF(wavelength=None), lower_limit=None)
        if self.detector is not None:
            self.derive(lower_limit=FROM_DETECTOR)
        _ = self._camera  # refuses settings that contradict each other

    @classmethod
    def completed(cls, data: Any) -> Any:
        """Return the data, completed by those of the preset."""
        if not isinstance(data, Mapping):
            return data
        name = data.get("preset")
        if name in (None, "none"):
            return data
        if name not in list(CAMERAS):  # a mapping or list has no hash
            known = ", ".join(CAMERAS)
            raise ValueError(f"preset: {name!r} is unknown, expected one of {known}")
        preset = {key: value for key, value in CAMERAS[name].items() if key not in _ABOUT}
        stated = {**preset, **data}
        if "pitch" in data:
            stated.setdefault("detector_pitch", None)
        for one in NEEDED:
            if one not in stated:
                raise ValueError(
                    f"{one}: not stated by the data sheet of {name} that was found; state it"
                )
        return {**preset, **data}

    def _pitch_on_scene(self, detector_pitch: float) -> float:
        """Return the pitch on the scene that follows from the data sheet."""
        if self.magnification is None:
            raise ValueError(
                "magnification: must be given with detector_pitch, or pitch, the distance of the "
                "pixels on the scene"
            )
        pitch = detector_pitch / self.magnification
        if "pitch" in self.given and abs(self.pitch - pitch) > _SAME_PITCH * pitch:
            raise ValueError(
                f"pitch: {LENGTH.text(self.pitch)} contradicts detector_pitch / magnification, "
                f"{LENGTH.text(pitch)}; state only one of them"
            )
        return pitch

    def build(self, seed: int = SEED) -> Camera:
        """Return the camera with its array, or with as many pixels as see a scene.

        `on` also places the array on a scene.
        """
        return unchecked(self._camera, seed=seed)

    def on(self, scene: Raster, seed: int = SEED) -> Camera:
        """Return the camera on a scene, with the pixels of its array that see it, centred."""
        camera = unchecked(self._camera, seed=seed, shape=None)
        if self.array is None:
            return camera
        whole = camera.pixels(scene)
        columns, rows = min(self.array[0], whole.columns), min(self.array[1], whole.rows)
        right, down = camera.offset
        if self.offset_right is None and columns < whole.columns:
            right = (scene.columns * scene.spacing - columns * camera.pitch) / 2
        if self.offset_down is None and rows < whole.rows:
            down = (scene.rows * scene.spacing - rows * camera.pitch) / 2
        return unchecked(camera, shape=(rows, columns), offset=(right, down))

    @cached_property
    def _camera(self) -> Camera:
        """The camera with its whole array."""
        band = Band(*self.band, None if self.response is None else read_response(self.response))
        return made_from(
            Camera,
            self,
            band=band,
            offset=(self.offset_right or 0.0, self.offset_down or 0.0),
            shape=None if self.array is None else self.array[::-1],
            psf=self._psf(band),
            lower_limit=self._lower_limit(band),
        )

    def _lower_limit(self, band: Band) -> float | None:
        if self.lower_limit != FROM_DETECTOR:
            return self.lower_limit
        if self.detector is None:
            raise ValueError("lower_limit: detector requires a detector")
        point = made_from(OperationPoint, self, band=band)
        limit = lower_range_limit(self.detector, point)
        return limit if limit > COLDEST else None

    def _psf(self, band: Band) -> PointSpreadFunction | None:
        if self.psf is None:
            if self.blur:
                raise ValueError("blur: requires a point spread function, got psf: none")
            return None
        psf = self.psf.for_camera(band, self.magnification)
        return BlurredPSF(psf, self.blur) if self.blur else psf
