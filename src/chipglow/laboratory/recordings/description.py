"""Description of a camera file: its contents and how to process them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import isclose
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, ValidationInfo

from chipglow.camera import Recording
from chipglow.camera.recording import RecordingSettings
from chipglow.io.cameras.stacks import Stated
from chipglow.io.column_file import read_response
from chipglow.laboratory.recordings.radiometric_calibration import ImagePosition
from chipglow.quantities import FileBeside, Parameter, Part, beside_the_study, made_from
from chipglow.quantities.units import TEMPERATURE, WAVELENGTHS
from chipglow.radiometry import Band, ObjectParameters
from chipglow.text import Notes, commented_yaml, described_by

_FRAMES: Final = re.compile(r"(\d{0,9}):(\d{0,9})(?::(\d{1,9}))?")


def _limits_or_file(text: Any, info: ValidationInfo) -> Any:
    """Check a band's limits, or complete the path of a response beside the description."""
    if not isinstance(text, str):
        return text
    if text.lower().endswith(".csv"):
        return beside_the_study(text, info)
    WAVELENGTHS.parse_range(text)
    return text


def _mask_or_file(text: Any, info: ValidationInfo) -> Any:
    return text if text == "find" else beside_the_study(text, info)


BandText = Annotated[str, BeforeValidator(_limits_or_file)]
MaskText = Annotated[str, BeforeValidator(_mask_or_file)]


def band_of(text: str) -> Band:
    """Return a band by its limits such as ``3.8-5.1 um`` or the .csv file of its response."""
    if text.lower().endswith(".csv"):
        response = read_response(text)
        return Band(*response.limits, response)
    return Band(*WAVELENGTHS.parse_range(text))


@dataclass(frozen=True)
class ObjectSection(Part, overrides=ObjectParameters):
    """The camera's object parameters, if they are missing or wrong in the file."""

    def applied_to(self, recorded: ObjectParameters | None) -> ObjectParameters | None:
        """Override recorded object parameters by this section."""
        values = ((name, getattr(self, name)) for name in self.declared())
        said: dict[str, float] = {name: value for name, value in values if value is not None}
        return replace(recorded or ObjectParameters(), **said) if said else recorded


@dataclass(frozen=True)
class FlatFieldSection(Part):
    """Files of flat-field sources, such as a blackbody out of focus; `FlatFields` has frames."""

    low: Annotated[
        FileBeside | None,
        Parameter("Frames of a flat-field source: with them every pixel's offset is corrected."),
    ] = None
    high: Annotated[
        FileBeside | None,
        Parameter("Frames of a brighter flat-field source: with both the gain is corrected, too."),
    ] = None
    correct: Annotated[
        bool,
        Parameter("Whether to correct the pixels, or only to find bad pixels with these frames."),
    ] = True


@dataclass(frozen=True)
class CameraFile(Part):
    """Which frames of which file."""

    file: Annotated[
        FileBeside | None,
        Parameter("The camera file; for TIFF, PNG and tables also a pattern: frame_*.tif."),
    ] = None
    format: Annotated[
        str | None,
        Parameter(
            "Kind of the file; none: by its content.", allowed="none, flir, ptw, hcc, tiff, ..."
        ),
    ] = None
    frames: Annotated[
        str | None,
        Parameter(
            "Frames to take, from 0: first:end, first:end:step; none: all.",
            allowed="none, 100:200, ::10",
        ),
    ] = None

    def chosen_frames(self) -> slice | None:
        """Return the frames to take."""
        if self.frames is None:
            return None
        match = _FRAMES.fullmatch(self.frames)
        if match is None or match[3] == "0":
            raise ValueError(f"frames: {self.frames!r}, expected first:end such as 100:200")
        return slice(*(int(number) if number else None for number in match.groups()))


@dataclass(frozen=True)
class MeasurementDescription(ImagePosition, RecordingSettings, Stated, CameraFile):
    """A measurement from a camera file: contents, position, and conversion.

    Band, calibration and bad pixels are texts or names of files here; a `Measurement` has what is
    read from them.
    """

    band: Annotated[
        BandText | None,
        Parameter(
            "Limits of the camera's band, or a table of its response (.csv with the columns "
            "wavelength_um,response); none: that of the calibration or the file.",
            allowed="none, 3.8-5.1 um, response.csv",
        ),
    ] = None
    lower_limit: Annotated[
        float | None,
        Parameter(
            "Radiance temperatures under this are flagged; none: those under the calibration's.",
            TEMPERATURE,
        ),
    ] = None
    calibration: Annotated[
        FileBeside | None,
        Parameter("Calibration of the counts, as chipglow calibrate writes it; none: the maker's."),
    ] = None
    bad_pixels: Annotated[
        MaskText | None,
        Parameter(
            "Table of bad pixels (.csv with the columns column,row, from 0 at the upper left of "
            "the file's image), or find: those that show in the uniform frames.",
            allowed="none, find, bad.csv",
        ),
    ] = None
    object_parameters: Annotated[
        ObjectSection,
        Parameter(
            "The camera's settings for the object; none: from the file. Of temperatures "
            "it is taken back: chipglow takes radiance as the camera received it."
        ),
    ] = field(default_factory=ObjectSection)
    flat_field: Annotated[FlatFieldSection, Parameter("Frames of flat-field sources.")] = field(
        default_factory=FlatFieldSection
    )

    def position(self) -> ImagePosition:
        """Return the position of the image in the coordinates of the cut."""
        return made_from(ImagePosition, self)

    def applied_to(self, recording: Recording) -> Recording:
        """Override a recording by this description."""
        said: dict[str, Any] = {
            **{name: getattr(self, name) for name in RecordingSettings.declared()},
            "band": None if self.band is None else band_of(self.band),
            "object_parameters": self.object_parameters.applied_to(recording.object_parameters),
        }
        said = {name: value for name, value in said.items() if value is not None}
        stated = recording.pitch
        if self.pitch is not None and stated is not None and not isclose(self.pitch, stated):
            remark = (
                f"The file states a pitch of {1e6 * stated:.6g} µm; the given one of "
                f"{1e6 * self.pitch:.6g} µm is used instead."
            )
            said |= {"position": None, "notes": recording.notes + Notes(remarks=[remark])}
        return replace(recording, **said)


def load_description(source: str | Path, settings: Iterable[str] = ()) -> MeasurementDescription:
    """Read the description of a camera file from YAML, or create one for the file itself."""
    return described_by(MeasurementDescription, Path(source), "file", settings)


def measurement_text(description: MeasurementDescription) -> str:
    """Return a description of a camera file as YAML, every field with a comment."""
    return commented_yaml(_HEADER, description)


_HEADER: Final = """\
# A measurement from a camera file. Make it with: chipglow convert FILE --out measurement.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 6 um, 391 degC.
# Fields that are none are taken from the camera file.
"""
