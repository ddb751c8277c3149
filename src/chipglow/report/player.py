"""A figure of a report's page that can be scrubbed through time, without network."""

from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from json import dumps
from math import floor, log10

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from chipglow.drawing import drawing, scales
from chipglow.quantities.format import quantity_text
from chipglow.report.page import shown
from chipglow.scene import Raster, Tool

_COLOURS = 255


@dataclass(frozen=True)
class View:
    """One quantity through time.

    Parameters
    ----------
    title : str
        What it is; stands above the image.
    frames : ndarray
        Values in the unit, shape (time, y, x); NaN where there is none.
    unit : str
        The unit, as printed.
    limits : tuple of float
        Ends of the colours.
    colours : str
        Name of the colour map.
    alt : str
        What is seen in the still, a sentence.
    """

    title: str
    frames: NDArray[np.float64]
    unit: str
    limits: tuple[float, float]
    colours: str
    alt: str


@dataclass(frozen=True)
class Mark:
    """A curve on all views, points in m of shape (n, 2); of one frame only if it says which."""

    points: NDArray[np.float64]
    kind: str
    frame: int | None = None


@dataclass(frozen=True)
class Player:
    """Views side by side, rows of as many, with one slider for the time.

    Parameters
    ----------
    name, title, caption : str
        As those of other figures.
    views : sequence of View
        Of the same frames.
    columns : int
        Views in a row.
    times : sequence of str
        What the frames show, with units.
    still : int
        Frame that is shown first, without script and in print.
    raster : Raster
        Where the values are.
    tool : Tool, optional
        Drawn on the views.
    marks : sequence of Mark
        Drawn on the views.
    """

    name: str
    title: str
    caption: str
    views: Sequence[View]
    columns: int
    times: Sequence[str]
    still: int
    raster: Raster
    tool: Tool | None = None
    marks: Sequence[Mark] = ()

    @property
    def html(self) -> str:
        """The figure as a part of a page."""
        views = "\n".join(self._view(view) for view in self.views)
        return (
            f'<figure class="player" id="{self.name}" data-times="{escape(dumps(self.times))}">\n'
            f"<h3>{escape(self.title)}</h3>\n{self._drawn_once()}\n"
            f'<div class="views" style="--columns: {self.columns}">\n{views}\n</div>\n'
            f'<div class="time">{self._controls()}'
            f'<p class="when">{escape(self.times[self.still])}</p></div>\n'
            f"<figcaption>{shown(self.caption)}</figcaption></figure>"
        )

    def _view(self, view: View) -> str:
        images = "\n".join(
            f'<img data-frame="{i}"{self._hidden(i)} alt="{escape(self._alt(view, i))}" '
            f'src="{_picture(frame, view)}">'
            for i, frame in enumerate(view.frames)
        )
        low, high = (quantity_text(end, view.unit, 0) for end in view.limits)
        scale = np.linspace(*view.limits, 256)[None]
        return (
            f'<div class="view"><p>{escape(view.title)}</p>\n'
            f'<div class="image" style="aspect-ratio: {self.raster.columns} / {self.raster.rows}">'
            f'\n{images}\n<svg viewBox="{self._box}"><use href="#{self.name}-marks"/></svg></div>\n'
            f'<div class="scale"><span>{low}</span><img alt="Colours from {low} to {high}." '
            f'src="{_picture(scale, view)}"><span>{high}</span></div></div>'
        )

    def _alt(self, view: View, frame: int) -> str:
        return view.alt if frame == self.still else f"{view.title}. {self.times[frame]}"

    def _hidden(self, frame: int | None) -> str:
        return "" if frame in (None, self.still) else ' class="off"'

    def _controls(self) -> str:
        if len(self.times) < 2:
            return ""
        return (
            '<div class="controls" hidden><button type="button">Play</button>'
            f'<input type="range" min="0" max="{len(self.times) - 1}" value="{self.still}" '
            'aria-label="Exposure" autocomplete="off"></div>'
        )

    @property
    def _box(self) -> str:
        left, right, bottom, top = np.array(self.raster.extent) * self._factor
        return f"{left:.1f} {-top:.1f} {right - left:.1f} {top - bottom:.1f}"

    @property
    def _factor(self) -> float:
        return drawing.length_unit(self.raster)[0]

    def _drawn_once(self) -> str:
        """Tool, marks and a scale of length, to which every view refers."""
        return (
            f'<svg class="once" aria-hidden="true"><defs><g id="{self.name}-marks">'
            f"{''.join(self._curves())}{self._length()}</g></defs></svg>"
        )

    def _curves(self) -> Iterator[str]:
        marks = list(self.marks)
        if self.tool is not None:
            marks.insert(0, Mark(self.tool.outline(3e-3), "tool"))
        for mark in marks:
            points = " ".join(f"{x:.1f},{-y:.1f}" for x, y in mark.points * self._factor)
            of_frame = "" if mark.frame is None else f' data-frame="{mark.frame}"'
            yield (
                f"<g{of_frame}{self._hidden(mark.frame)}>"
                f'<polyline class="under" points="{points}"/>'
                f'<polyline class="{mark.kind}" points="{points}"/></g>'
            )

    def _length(self) -> str:
        """A bar of a round length in the corner at the bottom left."""
        factor, unit = drawing.length_unit(self.raster)
        left, right, bottom, top = np.array(self.raster.extent) * factor
        length = _round_down((right - left) / 4)
        x, y, size = left + (right - left) / 25, -bottom - (top - bottom) / 16, (right - left) / 18
        points = f"{x:.1f},{y:.1f} {x + length:.1f},{y:.1f}"
        text = f'x="{x:.1f}" y="{y - size / 2:.1f}" font-size="{size:.1f}"'
        return (
            f'<polyline class="under" points="{points}"/><polyline points="{points}"/>'
            f'<text {text} stroke-width="{size / 6:.2f}">{length:g} {unit}</text>'
        )


def _round_down(length: float) -> float:
    """1, 2 or 5 times a power of ten, up to a length."""
    power = 10.0 ** floor(log10(length))
    return max(step * power for step in (1, 2, 5) if step * power <= length)


def _picture(values: NDArray[np.float64], view: View) -> str:
    """Values as a picture of as many pixels, for an image's source."""
    low, high = view.limits
    part = np.clip((values - low) / (high - low), 0.0, 1.0)
    index = np.where(np.isfinite(values), 1 + np.round(part * (_COLOURS - 1)), 0)
    colours = matplotlib.colormaps[view.colours](np.linspace(0.0, 1.0, _COLOURS))[:, :3]
    palette = np.concatenate([[to_rgb(scales.VOID)], colours])
    image = Image.fromarray(np.nan_to_num(index).astype(np.uint8))
    image.putpalette(np.round(palette * 255).astype(np.uint8).tobytes())
    file = BytesIO()
    image.save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{b64encode(file.getvalue()).decode('ascii')}"
