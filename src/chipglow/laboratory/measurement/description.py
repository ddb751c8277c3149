"""What the description of a camera's file says: what it holds, and what has to be done with it."""

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Strict, ValidationInfo

from chipglow.camera import Recording
from chipglow.io.column_file import read_bad_pixels, read_response
from chipglow.laboratory.measurement.radiometric_calibration import ImagePosition
from chipglow.quantities.section import OR_NONE, FileBeside, Section, beside_the_study, described
from chipglow.quantities.units import WAVELENGTHS, Length, Temperature, Time
from chipglow.radiometry import Band, ObjectParameters
from chipglow.text import commented_yaml, described_by

_FRAMES: Final = re.compile(r"(\d{0,9}):(\d{0,9})(?::(\d{1,9}))?")


def _two_numbers(value: object) -> object:
    """A text such as 36.5,41.6 as its numbers; all else as it is."""
    if not isinstance(value, str):
        return value
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError:
        raise ValueError(f"{value!r}, expected two numbers such as 36.5,41.6") from None


Pixels = Annotated[tuple[float, float], Strict(False), BeforeValidator(_two_numbers)]


def _limits_or_file(text: str, info: ValidationInfo) -> str:
    """A band's limits as they are, or the path of a response beside the description."""
    if text.lower().endswith(".csv"):
        return beside_the_study(text, info)
    WAVELENGTHS.parse_range(text)
    return text


def _mask_or_file(text: str, info: ValidationInfo) -> str:
    return text if text == "find" else beside_the_study(text, info)


BandText = Annotated[str, AfterValidator(_limits_or_file)]
MaskText = Annotated[str, AfterValidator(_mask_or_file)]


def band_of(text: str) -> Band:
    """A camera's band, by its limits such as ``3.8-5.1 um`` or by the .csv file of its response.

    Raises
    ------
    ValueError
        If the limits are none, or the file is no table of a response.
    OSError
        If the file cannot be read.
    """
    if text.lower().endswith(".csv"):
        response = read_response(text)
        return Band(*response.limits, response)
    return Band(*WAVELENGTHS.parse_range(text))


class ObjectSection(Section):
    """The camera's settings of the object, where the file does not say them or says them wrong."""

    emissivity: Annotated[float | None, OR_NONE] = described(
        "none", "Emissivity of the object.", "none, or over 0 to 1"
    )
    reflected: Annotated[Temperature | None, OR_NONE] = described(
        "none", "Temperature of the surroundings that the object reflects."
    )
    transmittance: Annotated[float | None, OR_NONE] = described(
        "none", "Transmission of atmosphere and window.", "none, or over 0 to 1"
    )
    atmosphere: Annotated[Temperature | None, OR_NONE] = described(
        "none", "Temperature of atmosphere and window."
    )

    def applied_to(self, recorded: ObjectParameters | None) -> ObjectParameters | None:
        """What the camera was set to: as recorded, but for what is said here."""
        said: dict[str, float] = {name: value for name, value in self if value is not None}
        return replace(recorded or ObjectParameters(), **said) if said else recorded


class FlatFieldSection(Section):
    """Frames of flat-field sources, such as a blackbody out of focus, by the same camera."""

    low: Annotated[FileBeside | None, OR_NONE] = described(
        "none", "Frames of a flat-field source: with them every pixel's offset is corrected."
    )
    high: Annotated[FileBeside | None, OR_NONE] = described(
        "none", "Frames of a brighter flat-field source: with both the gain is corrected, too."
    )
    correct: bool = described(
        True, "Whether to correct the pixels, or only to find bad pixels with these frames."
    )


class MeasurementDescription(Section):
    """A measurement of a camera's file: what it holds, how it lies, what is done with it."""

    file: Annotated[FileBeside | None, OR_NONE] = described(
        "none", "The camera's file; of TIFF and tables also a pattern: frame_*.tif."
    )
    format: Annotated[str | None, OR_NONE] = described(
        "none", "What the file is; none: known by its content.", "none, flir, ptw, hcc, tiff, ..."
    )
    frames: Annotated[str | None, OR_NONE] = described(
        "none",
        "Frames to take, from 0: first:end, first:end:step; none: all.",
        "none, 100:200, ::10",
    )
    dataset: Annotated[str | None, OR_NONE] = described(
        "none", "Which array of the file, if it has several."
    )
    axes: Annotated[tuple[str, ...] | None, Strict(False), OR_NONE] = described(
        "none", "Order of the array's axes; none: as the file says.", "none, or [time, y, x]"
    )
    quantity: Annotated[Literal["counts", "radiance", "temperature"] | None, OR_NONE] = described(
        "none",
        "What the numbers are, for files that do not say it.",
        "none, counts, radiance, temperature",
    )
    unit: Annotated[str | None, OR_NONE] = described(
        "none", "Their unit, for files that do not say it.", "none, counts, W/m2/sr, K, degC"
    )
    interval: Annotated[Time | None, OR_NONE] = described(
        "none", "Time from frame to frame; none: as the file says."
    )
    camera: Annotated[str | None, OR_NONE] = described(
        "none", "Which camera, for readers; none: as the file says."
    )
    band: Annotated[BandText | None, OR_NONE] = described(
        "none",
        "Limits of the camera's band, or a table of its response (.csv with the columns\n"
        "wavelength_um,response); none: that of the calibration or the file.",
        "none, 3.8-5.1 um, response.csv",
    )
    pitch: Annotated[Length | None, OR_NONE] = described(
        "none", "Distance between pixels on the object; none: as the file says."
    )
    fill_factor: Annotated[float | None, OR_NONE] = described(
        "none",
        "Portion of a pixel's square that takes light; none: not stated, 1 is assumed for an edge.",
        "none, or over 0 to 1",
    )
    quarter_turns: int = described(
        0, "Quarter turns counter-clockwise that put the image upright.", "0 to 3"
    )
    mirror: Literal["none", "horizontal", "vertical"] = described(
        "none",
        "After turning: exchange left and right (horizontal) or top and bottom (vertical).",
        "none, horizontal, vertical",
    )
    tip: Annotated[Pixels | None, OR_NONE] = described(
        "none",
        "The tip of the tool, the origin of coordinates, in pixels right and down from the upper\n"
        "left corner of the image so turned; none: the lower left corner is the origin.",
        "none, [120.5, 88], or 120.5,88",
    )
    integration_time: Annotated[Time | None, OR_NONE] = described(
        "none", "Integration time; none: as the file says."
    )
    range: Annotated[str | None, OR_NONE] = described(
        "none", "Measuring range of the camera by its name; none: not stated."
    )
    saturation: Annotated[float | None, OR_NONE] = described(
        "none", "Greatest number in the file that is not saturated; none: as the file says."
    )
    lower_limit: Annotated[Temperature | None, OR_NONE] = described(
        "none", "Radiance temperatures under this are flagged; none: those under the calibration's."
    )
    calibration: Annotated[FileBeside | None, OR_NONE] = described(
        "none",
        "Calibration of the counts, as chipglow calibrate writes it; none: the maker's.",
    )
    bad_pixels: Annotated[MaskText | None, OR_NONE] = described(
        "none",
        "Table of bad pixels (.csv with the columns column,row, from 0 at the upper left of the\n"
        "file's image), or find: those that show in the uniform frames.",
        "none, find, bad.csv",
    )
    object_parameters: ObjectSection = described(
        {},
        "What the camera was set to for the object; none: as the file says. Of temperatures it is\n"
        "taken back: chipglow takes radiance as the camera received it.",
    )
    flat_field: FlatFieldSection = described({}, "Frames of flat-field sources.")

    def chosen_frames(self) -> slice | None:
        """The frames to take."""
        if self.frames is None:
            return None
        match = _FRAMES.fullmatch(self.frames)
        if match is None or match[3] == "0":
            raise ValueError(f"frames: {self.frames!r}, expected first:end such as 100:200")
        return slice(*(int(number) if number else None for number in match.groups()))

    def position(self) -> ImagePosition:
        """How the image lies in the coordinates of the cut."""
        return ImagePosition(self.quarter_turns, self.mirror, self.tip)

    def known_band(self) -> Band | None:
        """The band, if it is said."""
        return None if self.band is None else band_of(self.band)

    def applied_to(self, recording: Recording) -> Recording:
        """What the file says, but for what is said here."""
        said: dict[str, Any] = {
            "camera": self.camera,
            "band": self.known_band(),
            "pitch": self.pitch,
            "fill_factor": self.fill_factor,
            "integration_time": self.integration_time,
            "range_name": self.range,
            "saturation": self.saturation,
            "object_parameters": self.object_parameters.applied_to(recording.object_parameters),
        }
        return replace(
            recording, **{name: value for name, value in said.items() if value is not None}
        )

    def listed_bad_pixels(self, shape: tuple[int, int]) -> NDArray[np.bool_] | None:
        """The bad pixels of the table, if there is one, for an image of these rows and columns."""
        if self.bad_pixels in (None, "find"):
            return None
        return read_bad_pixels(Path(str(self.bad_pixels)), shape)


def load_description(source: str | Path, settings: Iterable[str] = ()) -> MeasurementDescription:
    """Read the description of a camera's file from a YAML file, or make one of the file.

    Parameters
    ----------
    source : str or Path
        A YAML file (.yaml, .yml) that describes a camera's file, or the camera's file itself.
    settings : iterable of str
        Fields that come before those of the YAML file: ``band=3.8-5.1 um``.

    Raises
    ------
    DescriptionError
        If the file is no YAML or the description is not possible.
    OSError
        If the file cannot be read.
    """
    return described_by(MeasurementDescription, Path(source), "file", settings)


def measurement_text(description: MeasurementDescription) -> str:
    """A description of a camera's file as YAML, every field with a comment."""
    return commented_yaml(_HEADER, description)


_HEADER: Final = """\
# A measurement of a camera's file. Make it with: chipglow convert FILE --out measurement.nc
# Quantities carry their unit, in any unit of their kind: 10 us, 6 um, 391 degC.
# What is none is as the camera's file says.
"""
