"""Frames of a measurement that are read one by one."""

from abc import ABC, abstractmethod
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import Final

from chipglow.camera import Measurement
from chipglow.io.cameras.formats import recording_times
from chipglow.io.cameras.stacks import Stated
from chipglow.io.sandbox import ReaderProcess
from chipglow.laboratory.recordings.camera_file import Conversion, load_recording
from chipglow.laboratory.recordings.description import MeasurementDescription
from chipglow.quantities import Array, made_from
from chipglow.scene import Raster, Tool
from chipglow.text import Notes

_KEPT: Final = 8
"""Frames that are kept: one who looks at a few needs no file."""


class _Frames(ABC):
    """Frames that are read when they are asked for; the last ones are kept."""

    first: Measurement
    times: Array
    """Start of each frame in s."""

    def __init__(self) -> None:
        self._turn = RLock()
        self._kept: OrderedDict[int, Measurement] = OrderedDict()

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
        """Return one frame."""
        with self._turn:
            if index not in self._kept:
                self._kept[index] = self._read(index)
            self._kept.move_to_end(index)
            if len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
            return self._kept[index]

    @abstractmethod
    def _read(self, index: int) -> Measurement:
        """Read one frame."""


class StoredFrames(_Frames):
    """Frames of a measurement whose data are in memory, or are read by xarray."""

    def __init__(self, measurement: Measurement) -> None:
        super().__init__()
        self.times = measurement.times
        self._data = measurement.data
        self.first = self.measurement(0)

    def _read(self, index: int) -> Measurement:
        return Measurement(self._data.isel(time=[index]).load())


class CameraFrames(_Frames):
    """Frames of a camera file, each read and converted when it is asked for.

    Parameters
    ----------
    description : MeasurementDescription
        The file and how it is converted.
    name : str
        Name in errors.
    process : ReaderProcess, optional
        Process for formats that libraries in C or C++ unpack; a separate one by default.

    Raises
    ------
    ValueError
        If the file is damaged, or a setting is missing or impossible; as `load_measurement`.
    """

    def __init__(
        self, description: MeasurementDescription, name: str, process: ReaderProcess | None = None
    ) -> None:
        super().__init__()
        self._description, self._name = description, name
        self._conversion = Conversion(description)
        self._process = process or ReaderProcess()
        chosen = description.chosen_frames() or slice(None)
        start = chosen.start or 0
        # The first frame alone: its errors name all settings that are missing.
        self.first = self._converted(start)
        with self._process.used():
            stated = made_from(Stated, description)
            times = recording_times(Path(str(description.file)), description.format, stated)
        self._numbers = range(len(times))[chosen]
        self.times = times[chosen]
        self._kept[0] = self.first

    def _read(self, index: int) -> Measurement:
        return self._converted(self._numbers[index])

    def close(self) -> None:
        """End the process that reads the file, if it is running."""
        self._process.close()

    def _converted(self, number: int) -> Measurement:
        """Return the frame of a number in the file."""
        one = replace(self._description, frames=f"{number}:{number + 1}")
        with self._process.used():
            return self._conversion.measurement(load_recording(one), self._name)
