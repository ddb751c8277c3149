"""Cameras by name: what their data sheets say, with the source."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final


@dataclass(frozen=True)
class CameraPreset:
    """What a source says of a camera.

    Parameters
    ----------
    source : str
        Where it stands.
    fields : mapping
        Fields of a study's section camera, as a YAML file gives them. What the source does not say
        is not there; the lens's magnification never is.
    """

    source: str
    fields: Mapping[str, Any]


CAMERAS: Final[Mapping[str, CameraPreset]] = MappingProxyType(
    {
        "flir-lepton-3": CameraPreset(
            "FLIR Lepton Engineering Datasheet, 500-0659-00-09 rev. 203: 160 x 120, 8 to 14 um, "
            "f/1.1, 14 bit, thermal sensitivity under 50 mK; M5Stack, unit FLIR (K021), Lepton "
            "3.0: pixels of 12 um, 8.7 Hz, range of the high gain -10 to 140 degC",
            {
                "band": "8-14 um",
                "detector_pitch": "12 um",
                "array": [160, 120],
                "psf": {"kind": "airy", "f_number": 1.1},
                "frame_rate": "8.7 Hz",
                "lower_limit": "-10 degC",
                "detector": {
                    "response": {"kind": "range", "hottest": "140 degC"},
                    "gain": 1.0,
                    "bits": 14,
                    "terms": [{"kind": "netd", "netd": "50 mK"}],
                },
            },
        ),
        "flir-a6751": CameraPreset(
            "FLIR A6751, InSb, as github.com/blitzcolo/Quantiloom-dev "
            "(src/libQuantiloom/postprocess/CameraPresets.cpp, d3a6987e) quotes flir.com/products/"
            "a6750-mwir: 640 x 512, 15 um, 3.0 to 5.0 um, f/2.5, up to 125 Hz in the full window, "
            "14 bit, NETD 22 mK typical. It states no well, quantum efficiency, noise or range of "
            "temperatures, so there is no detector here",
            {
                "band": "3-5 um",
                "detector_pitch": "15 um",
                "array": [640, 512],
                "psf": {"kind": "airy", "f_number": 2.5},
                "frame_rate": "125 Hz",
            },
        ),
        "flir-boson-640": CameraPreset(
            "FLIR Boson Thermal Imaging Core, datasheet 102-2013-40 release 340 (pdfslide.us/"
            "documents/flir-boson-thermal-imaging-core.html): uncooled VOx microbolometer, "
            "640 x 512, up to 60 Hz, as low as 40 mK at f/1.0; pixels of 12 um and 8 to 14 um as "
            "the file of Quantiloom-dev above quotes oem.flir.com/products/boson. It states no "
            "range of temperatures, so there is no detector here, and lenses differ",
            {
                "band": "8-14 um",
                "detector_pitch": "12 um",
                "array": [640, 512],
                "frame_rate": "60 Hz",
            },
        ),
        "alpha-nir": CameraPreset(
            "List of infrared cameras of github.com/cameras/camerasIR: FLIR Alpha NIR, InGaAs, "
            "320 x 256, 30 um, 0.9 to 1.7 um",
            {"band": "0.9-1.7 um", "detector_pitch": "30 um", "array": [320, 256]},
        ),
    }
)
"""Cameras by the names of a study. A camera whose data sheet nobody could look at is not here."""


def with_preset(camera: Mapping[str, Any]) -> Mapping[str, Any]:
    """A camera's data with what its preset says and the data do not."""
    name = camera.get("preset")
    if name in (None, "none"):
        return camera
    if not isinstance(name, str) or name not in CAMERAS:
        raise ValueError(f"preset: {name!r} is unknown, expected one of {', '.join(CAMERAS)}")
    return {**CAMERAS[name].fields, **camera}
