"""The movie of a cut: temperature, plastic strain and strain rate, frame by frame."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Any, Final, cast

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.cutting import CuttingSimulation
from chipglow.drawing import drawing, scales
from chipglow.io import movie_writer
from chipglow.io.movie_file import PALETTE_SIZE
from chipglow.quantities import ROUNDING, ZERO_CELSIUS
from chipglow.scene import Frame, Material, Raster
from chipglow.scene.figures import show_image
from chipglow.scene.tool import DRAWN_FACE

_DPI: Final = 100
"""Pixels per inch."""

_WIDTH: Final = 1320
"""Width of the movie in pixels."""

_PANEL_WIDTH: Final = 300
"""Width of a panel in pixels."""

_LABEL_HEIGHT: Final = 130
"""Height in pixels of title and labels."""

_HEIGHTS: Final = (240, 1080)
"""Smallest and largest height of the movie in pixels."""

_TOOL: Final = "#9ca3af"

_HOT_FRACTION: Final = 0.6
"""Place of the hottest colour from the initial temperature, 0, to the melting point, 1."""

_LARGEST_STRAIN: Final = 5.0
"""Plastic strain of the last colour."""

_DECADES: Final = 3
"""Decades of the colours of the strain rate."""

_HOT_STEP: Final = 50.0
"""The hottest colour is a multiple of this number of °C."""

_GREYS: Final = 30
"""Greys of a movie among its colours: text, tool and edges that are smoothed."""


@dataclass(frozen=True)
class MovieScales:
    """Limits of the colours of a movie, fixed before the cut: K, plastic strain, 1/s."""

    temperature: tuple[float, float]
    strain: tuple[float, float]
    rate: tuple[float, float]

    @classmethod
    def of(cls, simulation: CuttingSimulation) -> "MovieScales":
        conditions = simulation.conditions
        start = conditions.initial_temperature
        hottest = start + _HOT_FRACTION * max(simulation.workpiece.melting_temperature - start, 0.0)
        top = _HOT_STEP * ceil((hottest - ZERO_CELSIUS) / _HOT_STEP + ROUNDING) + ZERO_CELSIUS
        # The scale begins below a tenth of speed over feed, the strain rate of the shear zone.
        decade = floor(log10(0.1 * conditions.speed / conditions.feed) + ROUNDING)
        return cls(
            temperature=(start, top),
            strain=(0.0, _LARGEST_STRAIN),
            rate=(10.0**decade, 10.0 ** (decade + _DECADES)),
        )


class CutPicture:
    """A figure of a simulation's frames: only its images are redrawn for each frame."""

    def __init__(self, raster: Raster, simulation: CuttingSimulation) -> None:
        self._raster, self._tool = raster, simulation.tool
        self._speed = simulation.conditions.speed
        with drawing.style():
            self._build(MovieScales.of(simulation))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the pictures, both even numbers."""
        columns, rows = self._canvas.get_width_height()
        return rows, columns

    def draw(self, frame: Frame) -> NDArray[np.uint8]:
        """Return the picture of a frame as RGB, shape (rows, columns, 3)."""
        solid = frame.material == Material.WORKPIECE
        there = frame.material != Material.VOID
        rate = np.maximum(frame.needed("plastic_strain_rate"), self._slowest)
        for image, values, shown in zip(
            self._images,
            (frame.temperature - np.float32(ZERO_CELSIUS), frame.needed("plastic_strain"), rate),
            (there, solid, solid),
            strict=True,
        ):
            image.set_data(np.ma.masked_where(~shown, values))
        cut = self._speed * frame.time * 1e3
        self._title.set_text(f"{frame.time * 1e6:.1f} µs    cutting length {cut:.3f} mm")
        self._canvas.restore_region(self._background)
        for artist in self._moving:
            self._figure.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def _build(self, ends: MovieScales) -> None:
        high = _LABEL_HEIGHT + _PANEL_WIDTH * self._raster.rows / self._raster.columns
        height = 2 * round(min(max(high, _HEIGHTS[0]), _HEIGHTS[1]) / 2)
        self._figure = Figure(figsize=(_WIDTH / _DPI, height / _DPI), dpi=_DPI, layout="compressed")
        self._canvas = cast(Any, FigureCanvasAgg(self._figure))  # untyped
        self._figure.get_layout_engine().set(w_pad=0.09)  # type: ignore[union-attr, call-arg]
        self._slowest = ends.rate[0]
        low, top = (limit - ZERO_CELSIUS for limit in ends.temperature)
        looks: Any = (
            ("temperature", "temperature / °C", scales.HEAT, (low, top), "max"),
            ("plastic strain", "plastic strain", scales.PLAIN, ends.strain, "max"),
            ("plastic strain rate", "strain rate / (1/s)", scales.RATE, ends.rate, "both"),
        )
        panels = self._figure.subplots(1, 3, sharex=True, sharey=True)
        empty = np.full(self._raster.shape, np.nan, np.float32)
        self._images = []
        for axes, (title, label, colours, limits, extend) in zip(panels, looks, strict=True):
            log = extend == "both"
            image = show_image(axes, empty, self._raster, self._tool, colours, limits, log=log)
            self._figure.colorbar(
                image, ax=axes, label=label, extend=extend, aspect=drawing.BAR_ASPECT
            )
            axes.set_title(title)
            axes.label_outer()
            self._images.append(image)
        for axes in panels[1:]:
            axes.fill(*(self._tool.outline(DRAWN_FACE) * 1e6).T, color=_TOOL, zorder=1.5)
        self._title = self._figure.suptitle(" ", fontsize=11)
        self._moving: list[Artist] = [self._title]
        for axes in panels:
            self._moving += [*axes.images, *axes.patches, *axes.lines]
        for artist in self._moving:
            artist.set_animated(True)
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)


@contextmanager
def cut_movie(
    path: str | os.PathLike[str], raster: Raster, simulation: CuttingSimulation
) -> Iterator[Callable[[Frame], None]]:
    """Write a movie of a cut from the frames that the yielded function takes."""
    picture = CutPicture(raster, simulation)
    with movie_writer(path, picture.shape, _palette()) as append:
        yield lambda frame: append(picture.draw(frame))


def _palette() -> NDArray[np.uint8]:
    """Return the colours of the three scales and greys, as many as a GIF can hold."""
    each = (PALETTE_SIZE - _GREYS) // 3
    maps: list[Any] = [scales.HEAT, scales.PLAIN, scales.RATE]
    colours = [matplotlib.colormaps[name](np.linspace(0.0, 1.0, each))[:, :3] for name in maps]
    plain = np.repeat(np.linspace(0.0, 1.0, _GREYS)[:, None], 3, axis=1)
    return np.asarray(np.round(np.concatenate([*colours, plain]) * 255), dtype=np.uint8)
