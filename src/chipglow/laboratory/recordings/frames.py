"""Frames of a measurement that are read one by one."""

from collections import OrderedDict
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import Final

from chipglow.camera import Measurement
from chipglow.io.cameras.formats import recording_times
from chipglow.io.cameras.stacks import Stated
from chipglow.io.sandbox import ReaderProcess
from chipglow.laboratory.recordings.camera_file import load_recording, measurement_of
from chipglow.laboratory.recordings.description import MeasurementDescription
from chipglow.quantities import Array, made_from
from chipglow.scene import Raster, Tool
from chipglow.text import Notes

_KEPT: Final = 8
"""Frames that are kept: one who looks at a few needs no file."""


class StoredFrames:
    """Frames of a measurement whose data are in memory, or are read by xarray."""

    def __init__(self, measurement: Measurement) -> None:
        self.first = Measurement(measurement.data.isel(time=[0]).load())
        self.times: Array = measurement.times
        self._data = measurement.data

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return self.first.raster

    @property
    def tool(self) -> Tool | None:
        """The tool in the measurement's coordinates."""
        return self.first.tool

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return self.first.notes

    def measurement(self, index: int) -> Measurement:
        """Return one frame."""
        return Measurement(self._data.isel(time=[index]).load())


class CameraFrames:
    """Frames of a camera file, each read and converted when it is asked for.

    Parameters
    ----------
    description : MeasurementDescription
        The file and how it is converted.
    name : str
        Name in errors.
    process : ReaderProcess, optional
        Process for formats that libraries in C or C++ unpack; one of its own by default.

    Raises
    ------
    ValueError
        If the file is damaged, or a setting is missing or impossible; as `load_measurement`.
    """

    def __init__(
        self, description: MeasurementDescription, name: str, process: ReaderProcess | None = None
    ) -> None:
        self._description, self._name = description, name
        self._process, self._turn = process or ReaderProcess(), RLock()
        self._read: OrderedDict[int, Measurement] = OrderedDict()
        chosen = description.chosen_frames() or slice(None)
        start = chosen.start or 0
        # The first frame alone: its errors name all settings that are missing.
        self.first = self._converted(start)
        with self._process.used():
            stated = made_from(Stated, description)
            times = recording_times(Path(str(description.file)), description.format, stated)
        self._numbers = range(len(times))[chosen]
        self.times: Array = times[chosen]
        self._read[0] = self.first

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return self.first.raster

    @property
    def tool(self) -> Tool | None:
        """The tool in the measurement's coordinates."""
        return self.first.tool

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings of the first frame."""
        return self.first.notes

    def measurement(self, index: int) -> Measurement:
        """Return one frame; the last ones are kept."""
        with self._turn:
            if index not in self._read:
                self._read[index] = self._converted(self._numbers[index])
            self._read.move_to_end(index)
            if len(self._read) > _KEPT:
                self._read.popitem(last=False)
            return self._read[index]

    def close(self) -> None:
        """End the process that reads the file, if there is one."""
        self._process.close()

    def _converted(self, number: int) -> Measurement:
        """Return the frame of a number in the file."""
        one = replace(self._description, frames=f"{number}:{number + 1}")
        with self._process.used():
            return measurement_of(one, load_recording(one), self._name)
