"""Correction of measurements with known optics, emissivities and outlines."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from chipglow.camera import Camera, MeasuredPSFFile, Measurement, PSFChoice
from chipglow.camera.optics.psf import AiryAperture
from chipglow.correction import Correction, KnownPart, correct_known, correct_mapped, known_parts
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.scene import Region, Tool
from chipglow.study.camera_section import CAMERAS, CameraSection
from chipglow.surface import MapSurface
from chipglow.text import Notes
from chipglow.uncertainty import Estimate

_LARGEST_MISFIT: Final = 4.0
"""Misfit above which the residuals are more than twice the noise: not by chance."""

_APERTURE: Final = frozenset({"psf", "detector_pitch"})
"""Values of a preset that determine its aperture at a magnification."""


def correct_measured(
    measurement: Measurement,
    psf: PSFChoice,
    emissivities: Mapping[str, EmissivityLine] | EmissivityLine | MapSurface,
    regions: Sequence[Region] = (),
    tool: Tool | None = None,
    *,
    elsewhere: str | None = None,
    surroundings: Estimate | None = None,
    psf_uncertainty: float = 0.0,
    outline_uncertainty: float = 0.0,
    noise: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Correction:
    """Correct a measurement with results of the laboratory.

    Parameters
    ----------
    measurement : Measurement
        Frames of a real or of a simulated camera.
    psf : PSFChoice
        Point spread function, of a file or by its kind.
    emissivities : mapping of str to EmissivityLine, EmissivityLine or MapSurface
        Emissivities by the names of regions or features, one for the whole image, or a map.
    regions : sequence of Region
        Regions with their own emissivity.
    tool : Tool, optional
        The tool in the measurement's coordinates.
    elsewhere : str, optional
        Name of the emissivity outside all regions; see `known_parts`.
    surroundings, psf_uncertainty, outline_uncertainty, noise, progress
        See `chipglow.correct`.

    Raises
    ------
    ValueError
        See `known_parts`, `correct_known` and `correct_mapped`.
    """
    camera, notes = _camera(measurement, psf)
    settings: dict[str, Any] = {
        "surroundings": surroundings,
        "psf_uncertainty": psf_uncertainty,
        "outline_uncertainty": outline_uncertainty,
        "noise": noise,
        "progress": progress,
    }
    if isinstance(emissivities, MapSurface):
        shapes: list[Region | Tool] = [*regions, *([] if tool is None else [tool])]
        result = correct_mapped(measurement, camera, emissivities, shapes, **settings)
    else:
        parts: tuple[KnownPart, ...] = known_parts(emissivities, regions, tool, elsewhere)
        result = correct_known(measurement, camera, parts, **settings)
    return result.with_notes(notes)


def _camera(measurement: Measurement, psf: PSFChoice) -> tuple[Camera, Notes]:
    """Return a camera with the measurement's band and pixels, and the point spread function."""
    band, notes = measurement.band, Notes()
    if isinstance(psf, MeasuredPSFFile) and psf.psf.band is None:
        notes = Notes([f"{psf.file} states no band: it was measured in that of the image."])
    camera = Camera(
        band=band,
        pitch=measurement.raster.spacing,
        fill_factor=float(measurement.data.attrs.get("fill_factor", 1.0)),
        psf=psf.for_camera(band, None),
    )
    return camera, notes


def psf_choice(name: str, pitch: float) -> PSFChoice:
    """Return the point spread function of a file, or of a camera by its name.

    Parameters
    ----------
    name : str
        A name of `chipglow cameras`, or the path of a file of `chipglow psf`.
    pitch : float
        Distance of the pixels on the object in m: with the pitch of the camera's detector it
        gives the magnification.

    Raises
    ------
    ValueError
        If the data sheet of the camera states no aperture, or the file is not valid.
    """
    if name not in CAMERAS:
        return MeasuredPSFFile(name)
    if name not in cameras_with_aperture():
        raise ValueError(f"{name}: its data sheet states no aperture; give a file or another PSF")
    stated = {key: CAMERAS[name][key] for key in _APERTURE}
    section = CameraSection(**stated, pitch=pitch)
    assert isinstance(section.psf, AiryAperture)
    return AiryAperture(numerical_aperture=section.psf.aperture(section.magnification))


def cameras_with_aperture() -> tuple[str, ...]:
    """Return the names of the cameras whose data sheets state aperture and pitch."""
    return tuple(name for name, one in CAMERAS.items() if one.keys() >= _APERTURE)


def misfit_notes(result: Correction) -> Notes:
    """Warn of frames that the zones and the point spread function do not explain."""
    worst = float(result.data["misfit"].max())
    if worst <= _LARGEST_MISFIT:
        return Notes()
    return Notes(
        warnings=[
            f"The corrected image differs from the measured one by {worst**0.5:.2g} times the "
            "noise: an outline, an emissivity or the point spread function is wrong, or the noise "
            "is larger than assumed. The intervals do not contain this."
        ]
    )
