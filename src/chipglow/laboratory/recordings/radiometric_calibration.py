"""Radiometric calibration of a camera's recording."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from chipglow.camera import (
    Calibration,
    FactoryCalibration,
    Flag,
    Measurement,
    NonUniformity,
    Recording,
    replace_bad_pixels,
)
from chipglow.io.sources.plausible import doubt_of_size
from chipglow.quantities import ZERO_CELSIUS, Array, Parameter, Part
from chipglow.radiometry import Band, ObjectParameters
from chipglow.scene import Raster
from chipglow.text import Notes

Mirror: TypeAlias = Literal["none", "horizontal", "vertical"]

_SAME: Final = 0.01
"""Relative difference up to which two integration times or limits of bands are the same."""

_PIXELS_AT_ONCE: Final = 1 << 22
"""Pixels that are converted together: 32 MB for each array in between."""

_FULL_SCALES: Final = tuple(2**bits - 1 for bits in (8, 10, 12, 13, 14, 16))
"""Largest counts of the usual converters, by their bits."""


def _two_numbers(value: object) -> object:
    """Return a text such as 36.5,41.6 as its numbers; all else as it is."""
    if not isinstance(value, str):
        return value
    try:
        return tuple(float(part) for part in value.split(","))
    except ValueError:
        raise ValueError(f"{value!r}, expected two numbers such as 36.5,41.6") from None


Pixels = Annotated[tuple[float, float], BeforeValidator(_two_numbers)]


@dataclass(frozen=True)
class ImagePosition(Part):
    """Position of a camera's image in the coordinates of the cut."""

    quarter_turns: Annotated[
        int,
        Parameter("Quarter turns counter-clockwise that put the image upright.", least=0, most=3),
    ] = 0
    mirror: Annotated[
        Mirror,
        Parameter(
            "After turning: exchange left and right (horizontal) or top and bottom (vertical).",
            allowed="none, horizontal, vertical",
        ),
    ] = "none"
    tip: Annotated[
        Pixels | None,
        Parameter(
            "The tip of the tool, the origin of coordinates, in pixels right and down from the "
            "upper left corner of the image so turned; none: the lower left corner is the origin.",
            allowed="none, [120.5, 88], or 120.5,88",
        ),
    ] = None

    def place(self, frames: NDArray[Any]) -> NDArray[Any]:
        """Turn frames of shape (time, y, x) into the coordinates of the cut."""
        turned = np.rot90(frames, self.quarter_turns, axes=(1, 2))
        if self.mirror == "horizontal":
            turned = turned[:, :, ::-1]
        if self.mirror == "vertical":
            turned = turned[:, ::-1]
        return np.ascontiguousarray(turned)

    def keeps(self, stated: tuple[float, float] | None) -> bool:
        """Return whether the left and upper edge that a file states apply to placed frames."""
        is_turned = self.quarter_turns != 0 or self.mirror != "none"
        return stated is not None and self.tip is None and not is_turned

    def raster(
        self, shape: tuple[int, int], pitch: float, stated: tuple[float, float] | None = None
    ) -> Raster:
        """Return the grid of the pixels of placed frames with a pitch in m.

        `stated` is the left and upper edge in m in coordinates of the file.
        """
        if stated is not None and self.keeps(stated):
            return Raster(*stated, pitch, *shape)
        right, down = (0.0, float(shape[0])) if self.tip is None else self.tip
        return Raster(-right * pitch, down * pitch, pitch, *shape)


def calibrate_recording(
    recording: Recording,
    calibration: Calibration | None = None,
    non_uniformity: NonUniformity | None = None,
    bad_pixels: NDArray[np.bool_] | None = None,
    lower_limit: float | None = None,
    position: ImagePosition | None = None,
) -> Measurement:
    """Convert a recording to a measurement, with the object parameters taken back."""
    position = position or ImagePosition()
    _check_known(recording, calibration)
    calibration = _calibration(recording, calibration)
    band = recording.band if calibration is None else calibration.band
    assert recording.pitch is not None and band is not None
    if non_uniformity is not None and recording.quantity == "temperature":
        raise ValueError(
            "uniform frames: the recording holds temperatures, which are not linear in light, "
            "expected counts or radiance"
        )
    parts = [
        _develop_frames(part, calibration, band, non_uniformity, bad_pixels)
        for part in _parts(recording)
    ]
    developed = [np.concatenate(some) for some in zip(*parts, strict=True)]
    is_read = developed[1] & (Flag.DEAD | Flag.REPLACED) == 0
    radiance, flags = map(position.place, developed)
    if calibration is not None:
        lower_limit = max(lower_limit or 0.0, calibration.lowest) or None
    shape = radiance.shape[1], radiance.shape[2]
    raster = position.raster(shape, recording.pitch, recording.position)
    errors = None if calibration is None else calibration.errors
    attributes = _attributes(recording, calibration, position, is_read)
    return Measurement.from_radiance(
        radiance, band, recording.times, raster, lower_limit, flags, errors, attributes
    )


def _check_known(recording: Recording, calibration: Calibration | None) -> None:
    """Raise ValueError that names all that is missing for a measurement."""
    missing = []
    if calibration is None and recording.quantity == "counts" and recording.conversion is None:
        missing.append(
            "calibration: is missing, the recording holds counts and no conversion of its maker"
        )
    elif calibration is None and recording.band is None:
        missing.append("band: is missing, expected the camera's band such as 3.8-5.1 um")
    if recording.pitch is None:
        missing.append(
            "pitch: is missing, expected the distance between pixels on the object such as 6 um"
        )
    if missing:
        raise ValueError("; ".join(missing))


def _calibration(recording: Recording, given: Calibration | None) -> Calibration | None:
    if recording.quantity != "counts":
        if given is not None:
            raise ValueError(
                f"calibration: the recording holds {recording.quantity}, expected counts"
            )
        return None
    if given is not None:
        _check_same(recording, given)
        return given
    assert recording.conversion is not None and recording.band is not None
    return FactoryCalibration(
        band=recording.band,
        conversion=recording.conversion,
        integration_time=recording.integration_time,
    )


def _check_same(recording: Recording, calibration: Calibration) -> None:
    """Raise ValueError if a calibration is for something else than the recording."""
    apart = []
    ours, theirs = recording.integration_time, calibration.integration_time
    if ours is not None and theirs is not None and abs(ours - theirs) > _SAME * theirs:
        apart.append((f"an integration time of {1e6 * theirs:g} us", f"{1e6 * ours:g} us"))
    ranges = calibration.range, recording.range
    if None not in ranges and ranges[0] != ranges[1]:
        apart.append((f"the range {ranges[0]!r}", repr(ranges[1])))
    band = recording.band
    if band is not None and not _same_band(band, calibration.band):
        apart.append((f"the band {_band_text(calibration.band)}", _band_text(band)))
    for its, has in apart:
        raise ValueError(
            f"calibration: is for {its}, the recording has {has}, they must be the same"
        )


def _same_band(one: Band, other: Band) -> bool:
    return np.allclose((one.lower, one.upper), (other.lower, other.upper), rtol=_SAME)


def _band_text(band: Band) -> str:
    return f"{1e6 * band.lower:g}-{1e6 * band.upper:g} um"


def _parts(recording: Recording) -> Iterator[Recording]:
    """Yield some frames after the other, as the arrays in between take several times the memory."""
    step = max(_PIXELS_AT_ONCE // recording.signal[0].size, 1)
    for start in range(0, len(recording.times), step):
        some = slice(start, start + step)
        yield replace(recording, signal=recording.signal[some], times=recording.times[some])


def _develop_frames(
    recording: Recording,
    calibration: Calibration | None,
    band: Band,
    non_uniformity: NonUniformity | None,
    bad_pixels: NDArray[np.bool_] | None,
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return radiance in 32 bits, which hold more than counts do, and flags, (time, y, x)."""
    signal, flags = repaired_signal(recording, non_uniformity, bad_pixels)
    if calibration is not None:
        radiance = calibration.radiance(signal)
        if calibration.highest < np.inf:
            flags[radiance > band.radiance(calibration.highest)] |= np.uint8(Flag.SATURATED)
    elif recording.quantity == "radiance":
        radiance = signal
    else:
        settings = recording.object_parameters or ObjectParameters()
        radiance = settings.apparent_radiance(signal, band)
    return radiance.astype(np.float32), flags


def repaired_signal(
    recording: Recording,
    non_uniformity: NonUniformity | None = None,
    bad_pixels: NDArray[np.bool_] | None = None,
) -> tuple[Array, NDArray[np.uint8]]:
    """Return a recording's signal with its pixels corrected, and flags."""
    raw = recording.signal
    signal = raw.astype(np.float64)
    over, under = recording.saturated(), recording.under_range()
    bad = np.zeros(raw.shape[1:], np.bool_) if bad_pixels is None else bad_pixels
    if non_uniformity is not None:
        signal = non_uniformity.apply(signal)
        bad = bad | ~np.isfinite(non_uniformity.gain + non_uniformity.offset)
    flags = np.zeros(raw.shape, np.uint8)
    if bad_pixels is not None or bad.any():
        signal, replaced = replace_bad_pixels(signal, bad)
        over, under = _outside(over, bad, replaced), _outside(under, bad, replaced)
        flags[:, bad & ~replaced] = Flag.DEAD
        flags[:, replaced] = Flag.REPLACED
    flags[over] |= np.uint8(Flag.SATURATED)
    flags[under] |= np.uint8(Flag.UNDER_RANGE)
    signal[~np.isfinite(signal)] = np.nan
    return signal, flags


def _outside(
    outside: NDArray[np.bool_], bad: NDArray[np.bool_], replaced: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Mark a replaced pixel as outside the range if a neighbour is: its median has a bias."""
    trusted = outside & ~bad
    result = trusted.copy()
    for y, x in np.argwhere(replaced):
        around = np.s_[:, max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        result[:, y, x] = trusted[around].any(axis=(1, 2))
    return result


def _attributes(
    recording: Recording,
    calibration: Calibration | None,
    position: ImagePosition,
    is_read: NDArray[np.bool_],
) -> dict[str, float | str]:
    time = recording.integration_time or getattr(calibration, "integration_time", None)
    attributes: dict[str, float | str | None] = {
        "camera": recording.camera,
        "quantity": recording.quantity,
        "fill_factor": recording.fill_factor,
        "integration_time": time,
        "range": recording.range or getattr(calibration, "range", None),
        "calibration": calibration.description if calibration else None,
        "object_parameters": _object_text(recording),
        **_notes(recording, calibration, position, is_read).attrs(),
    }
    return {name: value for name, value in attributes.items() if value not in (None, "")}


def _object_text(recording: Recording) -> str | None:
    """Describe the object parameters of the camera and their use."""
    settings = recording.object_parameters
    if settings is None:
        return None
    became = {
        "counts": "counts do not depend on it",
        "radiance": "the radiance is taken as it is",
        "temperature": "taken back",
    }
    return (
        f"emissivity {settings.emissivity:g}, "
        f"reflected {settings.reflected - ZERO_CELSIUS:g} degC, "
        f"transmittance {settings.transmittance:g}, "
        f"atmosphere {settings.atmosphere - ZERO_CELSIUS:g} degC: {became[recording.quantity]}"
    )


def _notes(
    recording: Recording,
    calibration: Calibration | None,
    position: ImagePosition,
    is_read: NDArray[np.bool_],
) -> Notes:
    quantity, name = recording.quantity, getattr(calibration, "range", None)
    time = getattr(calibration, "integration_time", None)
    assumed = {
        "The temperatures are radiance temperatures, as with an emissivity of 1: the file says "
        "nothing of the object.": quantity == "temperature" and recording.object_parameters is None,
        "The radiance is what the camera received, with nothing corrected for.": (
            quantity == "radiance"
        ),
        "The integration time is the calibration's: the file does not state it.": (
            recording.integration_time is None and time is not None
        ),
        f"The range is the calibration's, {name}: the file does not state it.": (
            recording.range is None and name is not None
        ),
        "No pixel is saturated: neither the file nor the description states the limit.": (
            recording.saturation is None
        ),
        "The origin of coordinates is the image's lower left corner: no tip was given.": (
            position.tip is None and not position.keeps(recording.position)
        ),
    }
    stated = [text for text, applies in assumed.items() if applies]
    size = max(recording.signal.shape[1:]) * (recording.pitch or 0.0)
    stated += doubt_of_size("The image", size, "pitch")
    about_calibration = Notes(warnings=list(calibration.warnings if calibration else ()))
    warnings = Notes(warnings=list(_warnings(recording, calibration, is_read)))
    return recording.notes + Notes(stated) + about_calibration.about("Calibration") + warnings


def _warnings(
    recording: Recording, calibration: Calibration | None, is_read: NDArray[np.bool_]
) -> Iterator[str]:
    """Yield what may be wrong; pixels that are dead or replaced are not read."""
    if calibration is None or calibration.errors is None:
        yield "The uncertainty of the radiance from the calibration is not known."
    band = recording.band if calibration is None else calibration.band
    stated = recording.stated_band
    if band is not None and stated is not None and not _same_band(stated, band):
        source = "description" if calibration is None else "calibration"
        yield (
            f"The file states a band of {_band_text(stated)}, the {source} is for "
            f"{_band_text(band)}; the {source}'s is used."
        )
    signal = recording.signal[is_read]
    is_whole = np.issubdtype(signal.dtype, np.integer)
    if recording.saturation is None and is_whole and signal.size:
        top = int(signal.max())
        count = np.count_nonzero(signal == top)
        if top in _FULL_SCALES and count > 1:
            yield (
                f"{count} values are {top}, the largest of their number of bits: they may be "
                f"saturated (set saturation: {top - 1})."
            )


def flag_fractions(measurement: Measurement) -> dict[Flag, float]:
    """Return the fraction of the pixels of all frames that has each flag."""
    return {flag: float(np.mean(measurement.flags & flag != 0)) for flag in Flag}
