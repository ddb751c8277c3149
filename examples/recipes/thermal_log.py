"""An import source: a text with a header of four numbers, then temperatures row by row.

An entry point makes `chipglow import` read it; in the pyproject.toml of the package::

    [project.entry-points."chipglow.import_source"]
    thermal_log = "thermal_log:ThermalLog"

The source is read in a subprocess, which imports the module: a class of a notebook does not do.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources import Source, SourceError, Survey
from chipglow.quantities import Parameter, Part
from chipglow.scene import Material, Raster, SampledFrame


@dataclass(frozen=True)
class ThermalLog(Source, Part):
    """Temperatures in degC on a grid whose upper left corner is at 0, 0."""

    title: ClassVar[str] = "a thermal log"
    endings: ClassVar[tuple[str, ...]] = (".tlog",)
    files: str = ""
    offset: Annotated[float, Parameter("Added to the temperatures, in K.")] = 0.0

    def survey(self) -> Survey:
        """Survey the file."""
        values, spacing, interval = self._read()
        count, rows, columns = values.shape
        return Survey(
            kind="thermal log",
            times=interval * np.arange(count),
            extent=(0.0, columns * spacing, -rows * spacing, 0.0),
            found={"temperature": "the numbers"},
            spacing=spacing,
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Return the nearest of the log's samples for each of the scene's."""
        values, spacing, interval = self._read()
        down, across = np.floor(-raster.y / spacing), np.floor(raster.x / spacing)
        rows, columns = down.astype(int), across.astype(int)
        there = np.outer((rows >= 0) & (rows < values.shape[1]), columns >= 0)
        there &= columns < values.shape[2]
        inside = np.ix_(rows.clip(0, values.shape[1] - 1), columns.clip(0, values.shape[2] - 1))
        material = np.where(there, np.uint8(Material.WORKPIECE), np.uint8(Material.VOID))
        for number, frame in enumerate(values[start:], start):
            temperature = np.where(there, frame[inside] + 273.15 + self.offset, np.nan)
            fields = {"temperature": temperature.astype(np.float32)}
            yield SampledFrame(number * interval, fields, material)

    def _read(self) -> tuple[NDArray[np.float64], float, float]:
        """Temperatures of shape (time, y, x), spacing in m, interval in s."""
        numbers = np.fromstring(Path(self.files).read_text(encoding="utf-8"), sep=" ")
        if len(numbers) < 4 or not (numbers[:4] > 0).all():
            raise SourceError(f"{self.files}: no header, expected rows, columns, um and us")
        rows, columns = numbers[:2].astype(int)
        frames, over = divmod(len(numbers) - 4, rows * columns)
        if over or not frames:
            raise SourceError(f"{self.files}: expected whole frames of {rows} x {columns} numbers")
        return numbers[4:].reshape(frames, rows, columns), numbers[2] * 1e-6, numbers[3] * 1e-6
