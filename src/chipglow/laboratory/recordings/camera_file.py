"""Measurements as the laboratory's commands take them."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import (
    LEAST_FRAMES,
    BadPixels,
    Calibration,
    Measurement,
    NonUniformity,
    Recording,
    find_bad_pixels,
)
from chipglow.io import checked_kind, read_measurement
from chipglow.io.cameras import camera_formats, read_recording
from chipglow.io.cameras.formats import find_format
from chipglow.io.cameras.stacks import MissingError, Stated
from chipglow.io.column_file import read_bad_pixels
from chipglow.io.file_kind import MEASURED
from chipglow.io.sources.file_names import files_of
from chipglow.laboratory.recordings.calibration_file import load_calibration
from chipglow.laboratory.recordings.description import MeasurementDescription, load_description
from chipglow.laboratory.recordings.radiometric_calibration import calibrate_recording
from chipglow.quantities import Array
from chipglow.text import DescriptionError
from chipglow.uncertainty.component import MAD_FACTOR

WHOLE: Final = np.s_[:, :]
"""All rows and columns of an image."""

_BLOCKS: Final = 4
"""Blocks along each side of an image whose medians are compared."""

_DEVIATION_LIMIT: Final = 4.0
"""Standard errors beyond which a block's median differs from the typical one."""

_MOST_OUTSIDE: Final = 0.05
"""Fraction of a flat-field source's frames that may be outside the range, as bad pixels are."""


def load_measurement(source: str | Path, settings: Iterable[str] = ()) -> Measurement:
    """Read a measurement, or convert a camera file to one.

    Parameters
    ----------
    source : str or Path
        A NetCDF file of a measurement; a camera file; or a YAML file (.yaml, .yml) that describes a
        camera file.
    settings : iterable of str
        Fields of the description, such as ``band=3.8-5.1 um``, which override a YAML file.
    """
    settings = list(settings)
    kind = checked_kind(source, "a measurement or a camera file", *MEASURED)
    if kind == "measurement":
        for setting in settings:
            raise ValueError(f"--set: {setting!r} describes nothing of a measurement's own file")
        return read_measurement(source)
    described = load_description(source, settings)
    return measurement_of(described, load_recording(described), str(source))


def load_recording(description: MeasurementDescription) -> Recording:
    """Read a camera file and apply its description."""
    if description.file is None:
        raise DescriptionError("file: is missing, expected a camera file")
    try:
        return description.applied_to(_read(description, description.file))
    except MissingError as error:
        missing = [str(error)]
        if description.pitch is None:
            missing.append("pitch: is missing, expected the distance between pixels such as 6 um")
        if description.calibration is None and description.band is None:
            missing.append("calibration (of counts) or band: is missing")
        raise DescriptionError("; ".join(missing)) from None


def _read(description: MeasurementDescription, file: str) -> Recording:
    return read_recording(
        file,
        description.chosen_frames(),
        description.format,
        **{name: getattr(description, name) for name in Stated.declared()},
    )


def measurement_of(
    description: MeasurementDescription, recording: Recording, name: str
) -> Measurement:
    """Convert a recording to a measurement according to its description."""
    return Conversion(description).measurement(recording, name)


@dataclass(frozen=True, eq=False)
class Conversion:
    """Converts recordings of one camera to measurements.

    Calibration, flat fields and bad pixels are read once.
    """

    description: MeasurementDescription
    _bad_pixels: dict[tuple[int, ...], NDArray[np.bool_]] = field(
        init=False, default_factory=dict, repr=False
    )
    """Bad pixels of a table by the shape of an image."""

    def measurement(self, recording: Recording, name: str) -> Measurement:
        """Return the measurement of a recording; `name` is for errors."""
        limit, position = self.description.lower_limit, self.description.position()
        try:
            corrected = self.pixels(recording)
            return calibrate_recording(recording, self.calibration, *corrected, limit, position)
        except ValueError as error:
            raise DescriptionError(f"{name}: {error}") from error

    @cached_property
    def calibration(self) -> Calibration | None:
        """Calibration that the description names."""
        file = self.description.calibration
        return None if file is None else load_calibration(file)

    def pixels(self, recording: Recording) -> tuple[NonUniformity | None, NDArray[np.bool_] | None]:
        """Return the pixel correction and the bad pixels of a recording."""
        section, table = self.description.flat_field, self.description.bad_pixels
        bad = None if table in (None, "find") else self._stated_bad(recording)
        if (fields := self.flat_fields) is None:
            return None, bad
        for name, frames in (("high", fields.high), ("low", fields.low)):
            for problem in () if frames is None else _problems(frames, recording):
                raise ValueError(f"flat_field.{name}: {problem}")
        correction = fields.correction if section.correct else None
        return correction, fields.bad_pixels.mask if table == "find" else bad

    def _stated_bad(self, recording: Recording) -> NDArray[np.bool_]:
        """Return the bad pixels of the table that the description names."""
        rows, columns = recording.signal.shape[1:]
        if (rows, columns) not in self._bad_pixels:
            table = str(self.description.bad_pixels)
            self._bad_pixels[rows, columns] = read_bad_pixels(table, (rows, columns))
        return self._bad_pixels[rows, columns]

    @cached_property
    def flat_fields(self) -> "FlatFields | None":
        """Frames of the flat-field sources that the description names."""
        section = self.description.flat_field
        if section.low is not None:
            # They do not depend on the file and frames that are corrected.
            return read_flat_fields(replace(self.description, file=None, frames=None))
        if section.high is not None or self.description.bad_pixels == "find":
            raise ValueError("flat_field.low: is missing, expected frames of a flat-field source")
        return None


def uniform_counts(
    source: str | Path, settings: Iterable[str] = (), region: tuple[slice, slice] = WHOLE
) -> tuple[float, float]:
    """Return the mean counts of a blackbody's recording, and by how many a block differs."""
    description = load_description(source, settings)
    recording = load_recording(description)
    try:
        if recording.quantity != "counts":
            raise ValueError(f"holds {recording.quantity}, expected counts")
        correction, bad = Conversion(description).pixels(recording)
        signal = recording.signal.astype(np.float64)
        if correction is not None:
            signal = correction.apply(signal)
        good = np.isfinite(signal[:, *region]).all(axis=0)
        if bad is not None:
            good &= ~bad[region]
        if not good.any():
            raise ValueError("the region contains no good pixel")
        for wrong, problem in (
            (recording.saturated(), "saturated, expected a darker object"),
            (recording.under_range(), "below the camera's range, expected a brighter object"),
        ):
            if fraction := float(np.mean(wrong[:, *region][:, good])):
                raise ValueError(f"{fraction:.2%} of it is {problem}")
    except ValueError as error:
        raise DescriptionError(f"{source}: {error}") from error
    signal = signal[:, *region]
    image = np.where(good, signal.mean(axis=0), np.nan)
    return float(signal[:, good].mean()), _unevenness(image)


def _unevenness(image: Array) -> float:
    """Return the largest difference of a block's median from the typical one; 0 within noise."""
    strips = np.array_split(image, min(_BLOCKS, len(image)))
    blocks = [part for one in strips for part in np.array_split(one, _BLOCKS, axis=1)]
    values = [block[np.isfinite(block)] for block in blocks if np.isfinite(block).any()]
    medians = np.array([np.median(one) for one in values])
    spreads = [MAD_FACTOR * np.median(np.abs(one - np.median(one))) for one in values]
    # The standard error of a median is 1.25 times that of the mean.
    errors = 1.25 * np.median(spreads) / np.sqrt([one.size for one in values])
    away = np.abs(medians - np.median(medians))
    return float(np.max(away, where=away > _DEVIATION_LIMIT * errors, initial=0.0))


@dataclass(frozen=True, eq=False)
class FlatFields:
    """Frames of one or two flat-field sources."""

    low: Recording
    high: Recording | None

    @cached_property
    def correction(self) -> NonUniformity:
        if self.high is None:
            return NonUniformity.one_point(self.low.signal)
        return NonUniformity.two_point(self.low.signal, self.high.signal)

    @cached_property
    def bad_pixels(self) -> BadPixels:
        frames = self.low.signal
        if len(frames) < LEAST_FRAMES:
            raise ValueError(
                f"flat_field.low: {len(frames)} frames, expected {LEAST_FRAMES} or more to find "
                "bad pixels in"
            )
        return find_bad_pixels(frames, None if self.high is None else self.high.signal)


def read_flat_fields(description: MeasurementDescription) -> FlatFields:
    """Read the frames of the flat-field sources that a description names, once for each content."""
    section = description.flat_field
    names = [name for name in (section.low, section.high) if name is not None]
    return _read_flat_fields(description, tuple(map(_digest, names)))


@lru_cache(maxsize=1)
def _read_flat_fields(description: MeasurementDescription, _: tuple[str, ...]) -> FlatFields:
    section = description.flat_field
    high = None if section.high is None else _uniform(description, section.high)
    return FlatFields(_uniform(description, str(section.low)), high)


def _digest(name: str) -> str:
    """Return a hash of the content of a file, a pattern of files or a folder."""
    total = sha256()
    for file in files_of(Path(name)):
        for part in sorted(file.rglob("*")) if file.is_dir() else [file]:
            if part.is_file():
                with part.open("rb") as content:
                    total.update(str(part).encode() + file_digest(content, "sha256").digest())
    return total.hexdigest()


def _uniform(description: MeasurementDescription, file: str) -> Recording:
    if camera_formats()[find_format(Path(file))].states_quantity:
        # This file states the settings that a description gives for a recording.
        return read_recording(file)
    return _read(description, file)


def _problems(uniform: Recording, recording: Recording) -> Iterator[str]:
    """Yield the reasons why frames of a flat-field source are of no use for a recording."""
    if uniform.quantity != recording.quantity:
        yield f"holds {uniform.quantity}, expected {recording.quantity} as the recording"
    if uniform.stored != recording.stored:
        yield (
            f"is stored along {uniform.stored}, the recording along {recording.stored}: their "
            "pixels may differ, write both files with the same axes and coordinates"
        )
    theirs, ours = uniform.integration_time, recording.integration_time
    # Files round the times that they state.
    if theirs is not None and ours is not None and not np.isclose(theirs, ours, rtol=0.01):
        yield (
            f"has an integration time of {1e6 * theirs:g} us, the recording {1e6 * ours:g} us, "
            "they must be the same"
        )
    same_range = replace(
        uniform, saturation=recording.saturation, least_signal=recording.least_signal
    )
    for outside, problem in (
        (same_range.saturated(), "saturated, expected a darker flat-field source"),
        (same_range.under_range(), "below the range, expected a brighter flat-field source"),
    ):
        if (fraction := float(np.mean(outside))) > _MOST_OUTSIDE:
            yield f"{fraction:.0%} of it is {problem}"
