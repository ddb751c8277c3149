"""From what a camera wrote to a measurement."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import (
    Calibration,
    FactoryCalibration,
    Flag,
    Measurement,
    NonUniformity,
    Recording,
    replace_bad_pixels,
)
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.radiometry import Band, ObjectParameters
from chipglow.scene import Raster
from chipglow.text import Notes

Mirror: TypeAlias = Literal["none", "horizontal", "vertical"]
MIRRORS: Final = ("none", "horizontal", "vertical")

_SAME: Final = 0.01
"""Relative difference up to which two integration times or limits of bands are the same."""
_PIXELS_AT_ONCE: Final = 1 << 22
_FULL_SCALES: Final = tuple(2**bits - 1 for bits in (8, 10, 12, 13, 14, 16))


@dataclass(frozen=True)
class ImagePosition:
    """How a camera's image lies in the coordinates of the cut."""

    quarter_turns: int = 0
    """How often the image is turned by 90° counter-clockwise."""
    mirror: Mirror = "none"
    """After turning: ``horizontal`` exchanges left and right, ``vertical`` top and bottom."""
    tip: tuple[float, float] | None = None
    """Where the tip of the tool, the origin of coordinates, is in the image so turned: pixels
    right of its left edge and down from its upper edge. The lower left corner by default.
    """

    def __post_init__(self) -> None:
        if self.quarter_turns not in (0, 1, 2, 3):
            raise ValueError(f"quarter_turns: is {self.quarter_turns!r}, expected 0, 1, 2 or 3")
        if self.mirror not in MIRRORS:
            raise ValueError(f"mirror: is {self.mirror!r}, expected {', '.join(MIRRORS)}")
        if self.tip is not None and not np.isfinite(self.tip).all():
            raise ValueError(f"tip: is {self.tip!r}, expected two finite numbers of pixels")

    def place(self, frames: NDArray[Any]) -> NDArray[Any]:
        """Frames of shape (time, y, x) as they lie in the coordinates of the cut."""
        turned = np.rot90(frames, self.quarter_turns, axes=(1, 2))
        if self.mirror == "horizontal":
            turned = turned[:, :, ::-1]
        if self.mirror == "vertical":
            turned = turned[:, ::-1]
        return np.ascontiguousarray(turned)

    def raster(self, shape: tuple[int, int], pitch: float) -> Raster:
        """Grid of the pixels of placed frames, for their rows and columns and pitch in m."""
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
    """Make a measurement of what a camera wrote.

    Counts become radiance by the calibration, which needs no object parameters. Radiance is taken
    as the camera received it. Temperatures become the radiance that the camera received: what it
    was set to for the object is taken back (`ObjectParameters.apparent_radiance`).
    """
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
    radiance, flags = (position.place(np.concatenate(some)) for some in zip(*parts, strict=True))
    if calibration is not None:
        lower_limit = max(lower_limit or 0.0, calibration.lowest) or None
    return Measurement.from_radiance(
        radiance,
        band,
        recording.times,
        position.raster((radiance.shape[1], radiance.shape[2]), recording.pitch),
        lower_limit,
        flags,
        None if calibration is None else calibration.errors,
        _attributes(recording, calibration, position),
    )


def _check_known(recording: Recording, calibration: Calibration | None) -> None:
    """Raise ValueError that names all that is missing for a measurement."""
    missing = []
    counts = recording.quantity == "counts" and recording.conversion is None
    if calibration is None and counts:
        missing.append(
            "calibration: is missing, the recording holds counts and no conversion of its maker, "
            "expected a calibration"
        )
    elif calibration is None and recording.band is None:
        missing.append(
            "band: is missing, the file does not say it, expected the camera's band such as "
            "3.8-5.1 um"
        )
    if recording.pitch is None:
        missing.append(
            "pitch: is missing, the file does not say it, expected the distance between pixels "
            "on the object such as 6 um"
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
    ours, theirs = recording.integration_time, calibration.integration_time
    if ours is not None and theirs is not None and abs(ours - theirs) > _SAME * theirs:
        raise ValueError(
            f"calibration: is for an integration time of {1e6 * theirs:g} us, the recording has "
            f"{1e6 * ours:g} us, expected the same"
        )
    ranges = recording.range_name, calibration.range_name
    if None not in ranges and ranges[0] != ranges[1]:
        raise ValueError(
            f"calibration: is for the range {ranges[1]!r}, the recording has {ranges[0]!r}, "
            "expected the same"
        )
    band = recording.band
    if band is not None and not np.allclose(
        (band.lower, band.upper), (calibration.band.lower, calibration.band.upper), rtol=_SAME
    ):
        raise ValueError(
            f"calibration: is for the band {_band_text(calibration.band)}, the recording has "
            f"{_band_text(band)}, expected the same"
        )


def _band_text(band: Band) -> str:
    return f"{1e6 * band.lower:g}-{1e6 * band.upper:g} um"


def _parts(recording: Recording) -> Iterator[Recording]:
    """Some frames after the other: the numbers in between take several times the memory."""
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
    """Radiance in 32 bits, which hold more than counts do, and flags, of shape (time, y, x)."""
    signal, flags = repaired_signal(recording, non_uniformity, bad_pixels)
    radiance = _radiance(recording, calibration, band, signal)
    if calibration is not None and calibration.highest < np.inf:
        flags[radiance > band.radiance(calibration.highest)] |= np.uint8(Flag.SATURATED)
    return radiance.astype(np.float32), flags


def repaired_signal(
    recording: Recording,
    non_uniformity: NonUniformity | None = None,
    bad_pixels: NDArray[np.bool_] | None = None,
) -> tuple[Array, NDArray[np.uint8]]:
    """A recording's signal with its pixels corrected."""
    raw = recording.signal
    signal = raw.astype(np.float64)
    over = np.zeros(raw.shape, np.bool_)
    if recording.saturation is not None:
        over = raw > recording.saturation
    bad = np.zeros(raw.shape[1:], np.bool_) if bad_pixels is None else bad_pixels
    if non_uniformity is not None:
        signal = non_uniformity.apply(signal)
        bad = bad | ~np.isfinite(non_uniformity.gain + non_uniformity.offset)
    flags = np.zeros(raw.shape, np.uint8)
    if bad_pixels is not None or bad.any():
        signal, replaced = replace_bad_pixels(signal, bad)
        over = _over(over, bad, replaced)
        flags[:, bad & ~replaced] = Flag.DEAD
        flags[:, replaced] = Flag.REPLACED
    flags[over] |= np.uint8(Flag.SATURATED)
    signal[~np.isfinite(signal)] = np.nan
    return signal, flags


def _over(
    over: NDArray[np.bool_], bad: NDArray[np.bool_], replaced: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """A replaced pixel is saturated if a neighbour is: its median cannot be trusted."""
    trusted = over & ~bad
    result = trusted.copy()
    for y, x in np.argwhere(replaced):
        around = np.s_[:, max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        result[:, y, x] = trusted[around].any(axis=(1, 2))
    return result


def _radiance(
    recording: Recording,
    calibration: Calibration | None,
    band: Band,
    signal: Array,
) -> Array:
    if calibration is not None:
        return calibration.radiance(signal)
    if recording.quantity == "radiance":
        return signal
    settings = recording.object_parameters or ObjectParameters()
    return settings.apparent_radiance(signal, band)


def _attributes(
    recording: Recording,
    calibration: Calibration | None,
    position: ImagePosition,
) -> dict[str, float | str]:
    attributes: dict[str, float | str | None] = {
        "camera": recording.camera,
        "quantity": recording.quantity,
        "fill_factor": recording.fill_factor,
        "integration_time": _known(recording, calibration, "integration_time"),
        "range": _known(recording, calibration, "range_name"),
        "calibration": calibration.description if calibration else None,
        "object_parameters": _object_text(recording),
        **_notes(recording, calibration, position).attrs(),
    }
    return {name: value for name, value in attributes.items() if value not in (None, "")}


def _known(recording: Recording, calibration: Calibration | None, name: str) -> Any:
    """Value of the file or, without one, of the calibration."""
    said = getattr(recording, name)
    return getattr(calibration, name, None) if said is None else said


def _object_text(recording: Recording) -> str | None:
    """What the camera was set to for the object, and what became of it."""
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
) -> Notes:
    about_calibration = Notes(warnings=list(calibration.warnings if calibration else ()))
    return (
        recording.notes
        + Notes(list(_assumed(recording, calibration, position)))
        + about_calibration.about("Calibration")
        + Notes(warnings=list(_warnings(recording, calibration)))
    )


def _assumed(
    recording: Recording, calibration: Calibration | None, position: ImagePosition
) -> Iterator[str]:
    settings = recording.object_parameters
    if recording.quantity == "temperature" and settings is None:
        yield (
            "The temperatures are radiance temperatures, as with an emissivity of 1: the file says "
            "nothing of the object."
        )
    if recording.quantity == "radiance":
        yield "The radiance is what the camera received, with nothing corrected for."
    if calibration is not None:
        times = recording.integration_time, calibration.integration_time
        if times[0] is None and times[1] is not None:
            yield "The integration time is the calibration's: the file does not say it."
        if recording.range_name is None and calibration.range_name is not None:
            yield (
                f"The range is the calibration's, {calibration.range_name}: the file does not say "
                "it."
            )
    if recording.saturation is None:
        yield "No pixel is saturated: neither the file nor the description says from where on."
    if position.tip is None:
        yield "The origin of coordinates is the image's lower left corner: no tip was given."


def _warnings(recording: Recording, calibration: Calibration | None) -> Iterator[str]:
    if calibration is None or calibration.errors is None:
        yield "The uncertainty of the radiance from the calibration is not known."
    signal = recording.signal
    if recording.saturation is None and np.issubdtype(signal.dtype, np.integer):
        top = int(signal.max())
        count = np.count_nonzero(signal == top)
        if top in _FULL_SCALES and count > 1:
            yield (
                f"{count} values are {top}, the greatest of their number of bits: they may be "
                f"saturated (saturation: {top - 1} says so)."
            )


def flag_fractions(measurement: Measurement) -> dict[Flag, float]:
    """Fraction of the pixels of all frames that has each flag."""
    return {flag: float(np.mean(measurement.flags & flag != 0)) for flag in Flag}
