"""The figures of the page: images with linked ranges and cursors, and temperatures along lines."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any, Final

import numpy as np
from bokeh.models import (
    BoxAnnotation,
    CDSView,
    ColorBar,
    ColumnDataSource,
    CrosshairTool,
    HoverTool,
    Label,
    Legend,
    LegendItem,
    LinearColorMapper,
    Range1d,
    Span,
    WheelZoomTool,
    glyphs,
)
from bokeh.palettes import Cividis256, Inferno256, RdBu11, interp_palette
from bokeh.plotting import figure

from chipglow.app.controls import CORRECTION_IMAGES, CURSOR, LINES
from chipglow.app.pictures import Drawn, Panel, Picture
from chipglow.drawing.scales import HEAT, PLAIN, SIGNED
from chipglow.quantities import Array
from chipglow.scene import Raster, Tool
from chipglow.scene.tool import DRAWN_FACE

MICRONS: Final = 1e6
"""Micrometres in a metre: axes are in micrometres."""

PALETTES: Final = {HEAT: Inferno256, PLAIN: Cividis256, SIGNED: interp_palette(RdBu11, 256)}
"""The colours of other figures; importing Matplotlib takes long."""

TITLES: Final = {
    "scene": "Scene: true temperature / °C",
    "measured": "Measured radiance temperature / °C",
    "error": "Error / K",
    "second": "Second camera / °C",
    "corrected": "Corrected temperature / °C",
    "half_width": f"{CORRECTION_IMAGES['half_width']} / K",
    "true": "True temperature / °C",
}

TEXT: Final = {"light": "#16191d", "dark": "#e8eaed"}
"""Colours of text by theme."""

_VOID, _GRID = (128, 128, 128, 0.2), (128, 128, 128, 0.35)
"""Colours on light and dark ground, which shows through."""

LINE_COLOURS: Final = {"rake_line": "#56B4E9", "band_line": "#E69F00"}
_MEASURED: Final = "#2b7fd0"
_REFERENCE: Final = "#7d858f"
_CORRECTED: Final = "#c2571a"

_BORDER: Final = 54
"""Pixels on the left of a figure for its labels, the same for all, so that they are aligned."""

_PADDING: Final = 4
"""Pixels around a figure."""

_LINE_HEIGHT: Final = 150
"""Initial height in pixels of a figure of the temperatures along a line."""

_NOTHING: Final = np.full((1, 1), np.nan)

_SIDE: Final = 180
"""Initial size of a frame in pixels; page.js fits the figures to the page."""


@dataclass(frozen=True, eq=False)
class Overlay:
    """A glyph that all images draw of the same data.

    The images share glyph, data and view. A figure's own methods add further glyphs, one for each
    state of a selection; the more models a page has, the longer it takes to open.
    """

    source: ColumnDataSource
    glyph: Any
    level: str = "glyph"
    _view: CDSView = field(init=False, default_factory=CDSView, repr=False)

    def draw_on(self, one: Any) -> Any:
        """Draw it on a figure and return its renderer."""
        return one.add_glyph(self.source, self.glyph, view=self._view, level=self.level)


class Image:
    """A figure of an image with its colour bar."""

    def __init__(self, name: str, ranges: dict[str, Range1d], labelled: bool) -> None:
        self.figure = one = _figure(name, TITLES[name], _SIDE, output_backend="canvas", **ranges)
        empty = {"image": [np.zeros((2, 2), np.float32)], "x": [0], "y": [0], "dw": [1], "dh": [1]}
        self.source = ColumnDataSource(empty, name=f"{name}_image")
        one.background_fill_color = _VOID
        self.mapper = LinearColorMapper(
            palette=PALETTES[HEAT], low=0.0, high=1.0, nan_color=(0, 0, 0, 0.0)
        )
        self._shown, self._colours = np.zeros(0), HEAT
        names: dict[str, Any] = {key: key for key in empty}
        image = glyphs.Image(**names, color_mapper=self.mapper)
        drawn = one.add_glyph(self.source, image)
        self.bar = ColorBar(
            color_mapper=self.mapper, height=10, padding=2, margin=0, background_fill_color=None
        )
        one.add_layout(self.bar, "below")
        tips = [("", "@image{0.0[00]}"), ("x, y", "$x{0.0}, $y{0.0} µm")]
        wheel = WheelZoomTool()
        one.add_tools(HoverTool(renderers=[drawn], tooltips=tips, attachment="above"), wheel)
        one.toolbar.active_scroll = wheel
        one.grid.visible = False
        one.xaxis.ticker.desired_num_ticks = 4  # up to five images stand in a row
        one.xaxis.axis_label = "x / µm"
        one.yaxis.axis_label = "y / µm"
        self.label(labelled)

    def label(self, labelled: bool) -> None:
        """Show or hide the axis on the left: only the first image of a page has one."""
        self.figure.yaxis.visible = labelled
        self.figure.min_border_left = _BORDER if labelled else _PADDING

    def show(self, panel: Panel) -> None:
        """Show an image; Bokeh has its rows from the bottom."""
        self.figure.title.text = f"{panel.name} / {panel.unit}" if panel.unit else panel.name
        low, high = panel.limits
        self.mapper.update(low=low, high=high)
        # Bokeh checks each of 256 colours, which takes longer than all else.
        if self._colours != panel.colours:
            self._colours = panel.colours
            self.mapper.palette = PALETTES[panel.colours]
        if self._shown is panel.values:
            return
        self._shown = panel.values
        left, right, bottom, top = (MICRONS * edge for edge in panel.raster.extent)
        # One pixel represents an image without values, such as one that is not yet corrected.
        values = panel.values if np.isfinite(panel.values).any() else _NOTHING
        self.source.data = {
            "image": [np.ascontiguousarray(values[::-1], np.float32)],
            "x": [left],
            "y": [bottom],
            "dw": [right - left],
            "dh": [top - bottom],
        }


class Line:
    """A figure of the temperatures along a line; the page fills its curves, see page.js."""

    def __init__(self, name: str, title: str, with_reference: bool) -> None:
        self.figure = one = _figure(name, title, _LINE_HEIGHT)
        curves = ("measured", "reference") if with_reference else ("measured",)
        source = ColumnDataSource(
            {"along": [], "measured": [], "reference": [], "corrected": []}, name=f"{name}_values"
        )
        self.band = ColumnDataSource({"along": [], "low": [], "high": []})
        self._marked: tuple[bool, float | None, float | None] | None = None
        self.under_range = BoxAnnotation(
            level="underlay", line_color=None, fill_color="#808080", fill_alpha=0.2, visible=False
        )
        colour = LINE_COLOURS[name]
        self.face = Span(dimension="height", line_color=_REFERENCE, line_dash="dotted", location=0)
        self.face_label = Label(
            x=0, y=2, y_units="screen", text=" tool's face", text_font_size="11px",
            text_color=_REFERENCE,
        )  # fmt: skip
        one.add_layout(Span(dimension="height", line_color=colour, line_width=3, location=0))
        for mark in (self.under_range, self.face, self.face_label):
            one.add_layout(mark)
        shade = glyphs.VArea(x="along", y1="low", y2="high", fill_color=_MEASURED, fill_alpha=0.25)
        self.shade = one.add_glyph(self.band, shade)
        looks: dict[str, dict[str, Any]] = {
            "reference": {"line_dash": "dashed", "line_color": _REFERENCE},
            "measured": {"line_color": _MEASURED},
            "corrected": {"line_color": _CORRECTED},
        }
        drawn = {
            key: one.add_glyph(source, glyphs.Line(x="along", y=key, line_width=2, **looks[key]))
            for key in (*reversed(curves), "corrected")
        }
        items = {
            key: LegendItem(label={"value": key}, renderers=[curve]) for key, curve in drawn.items()
        }
        self.corrected, self.corrected_item = drawn["corrected"], items["corrected"]
        self.corrected.visible = self.corrected_item.visible = False
        self.reference_item, self.measured_item = items.get("reference"), items["measured"]
        self.legend = Legend(
            items=list(items.values()), orientation="horizontal", padding=0, margin=0, spacing=10,
            glyph_height=12, label_text_font_size="11px", border_line_color=None,
            background_fill_color=None,
        )  # fmt: skip
        one.add_layout(self.legend, "above")
        tips = [("distance", "@along{0.0} µm"), *((key, f"@{key}{{0.0}} °C") for key in curves)]
        one.add_tools(HoverTool(tooltips=tips, mode="vline", renderers=[drawn["measured"]]))
        one.x_range.range_padding = 0.02  # of the range on each side
        one.xaxis.axis_label = "distance / µm"
        one.yaxis.axis_label = "temperature / °C"
        one.min_border_left = _BORDER + 6
        one.title.text_font_size = "12px"

    def show(self, limit: float | None, highest: float, crossing: float | None) -> None:
        """Mark the range limit and where the line enters the tool, and remove the draws."""
        top = None if limit is None or limit > highest else limit
        if self._marked != (marked := (limit is not None, top, crossing)):
            self._marked = marked
            # Bokeh then searches all models of the page, which takes longer than all else.
            self.under_range.update(top=top, visible=limit is not None)
            self.face.update(location=crossing or 0.0, visible=crossing is not None)
            self.face_label.update(x=crossing or 0.0, visible=crossing is not None)
        if len(self.band.data["along"]):
            self.band.data = {"along": [], "low": [], "high": []}

    def show_corrected(self, curves: Mapping[str, Array]) -> None:
        """Show or hide a third curve: the corrected temperature with its interval, or a camera."""
        is_shown, is_known = "corrected" in curves, "low" in curves
        self.corrected.visible = self.corrected_item.visible = is_shown
        label = "corrected" if is_known else "second camera"
        self.corrected_item.label = {"value": label}
        first = "first camera" if is_shown and not is_known else "measured"
        self.measured_item.label = {"value": first}
        if self.reference_item is not None:
            self.reference_item.label = {"value": "true" if is_known else "reference"}
            self.reference_item.visible = is_known or not is_shown
        self.shade.glyph.fill_color = _CORRECTED if is_known else _MEASURED
        if is_known:
            inside = np.isfinite(curves["low"]) & np.isfinite(curves["high"])
            self.band.data = {key: curves[key][inside] for key in ("along", "low", "high")}


class Figures:
    """All figures of a page."""

    def __init__(self, raster: Raster, tool: Tool | None, images: tuple[str, ...]) -> None:
        along = LINES if "scene" in images else dict.fromkeys(LINES, "along the line")
        left, right, bottom, top = self.extent = tuple(MICRONS * edge for edge in raster.extent)
        # The wheel zooms out to three times the image at most.
        ranges = {
            "x_range": Range1d(left, right, bounds=(2 * left - right, 2 * right - left)),
            "y_range": Range1d(bottom, top, bounds=(2 * bottom - top, 2 * top - bottom)),
        }
        self.images = {name: Image(name, ranges, name == images[0]) for name in images}
        self.lines = {
            name: Line(name, f"Temperature {where}", "error" in images)
            for name, where in along.items()
        }
        self.all = {name: one.figure for name, one in (self.images | self.lines).items()}
        # Above the images, which a move of the pointer does not paint again, nor tell Python.
        spans = [
            Span(dimension=one, line_color="#808080", line_width=1, level="overlay", syncable=False)
            for one in ("height", "width")
        ]
        overlays = [*_tool_overlay(tool), *_place_overlays()]
        for one in self.images.values():
            one.figure.add_tools(CrosshairTool(overlay=spans))
            for overlay in overlays:
                overlay.draw_on(one.figure)
        self.set_theme("light")

    def show(self, picture: Picture) -> None:
        """Show the images of a picture, and no draws."""
        for number, (name, panel) in enumerate(picture.panels.items()):
            self.images[name].show(panel)
            self.images[name].label(number == 0)
        for name, line in self.lines.items():
            highest = np.nanmax([*picture.lines[name]["measured"], -np.inf])
            line.show(picture.lower_limit, float(highest), picture.crossings.get(name))
            line.show_corrected(picture.lines[name])

    def show_drawn(self, picture: Picture, drawn: Drawn) -> None:
        for name, line in self.lines.items():
            along, draws = picture.lines[name]["along"], drawn.lines[name]
            known = np.isfinite(draws).all(axis=0)
            low, high = draws[:, known].min(axis=0), draws[:, known].max(axis=0)
            line.band.data = {"along": along[known], "low": low, "high": high}
            line.shade.glyph.fill_color = _MEASURED

    def set_theme(self, theme: str) -> None:
        text = TEXT[theme]
        for one in self.all.values():
            one.title.text_color = text
            one.axis.axis_label_text_color = one.axis.major_label_text_color = text
            one.axis.axis_line_color = one.axis.major_tick_line_color = text
        for image in self.images.values():
            image.bar.major_label_text_color = text
        for line in self.lines.values():
            line.legend.label_text_color = text


def _figure(name: str, title: str, height: int, **given: Any) -> Any:
    one = figure(
        name=f"{name}_figure", title=title, frame_width=_SIDE, frame_height=height, tools="",
        toolbar_location=None, min_border=_PADDING, background_fill_color=None,
        border_fill_color=None, outline_line_color=_GRID, **given,
    )  # fmt: skip
    one.grid.grid_line_color = _GRID
    one.axis.minor_tick_line_color = None
    return one


def _tool_overlay(tool: Tool | None) -> list[Overlay]:
    """Return the outline of the tool, if there is one."""
    if tool is None:
        return []
    x, y = (MICRONS * tool.outline(DRAWN_FACE).T).tolist()
    rows = {"xs": [x, x], "ys": [y, y], "colour": ["white", "black"], "width": [2.4, 1.2]}
    return [Overlay(ColumnDataSource(rows), outlined())]


def _place_overlays() -> list[Overlay]:
    """Return lines, their ends and the cursor, which page.js places.

    All are drawn in two widths (pixels) and colours, to be seen on any ground.
    """
    colours = list(LINE_COLOURS.values())
    lines = ColumnDataSource(haloed([[], []], [[], []], colours), name="lines")
    unknown = {"x": [nan] * 4, "y": [nan] * 4}
    ends = ColumnDataSource(unknown | {"colour": np.repeat(colours, 2).tolist()}, name="ends")
    crosses = {"x": [nan] * 2, "y": [nan] * 2, "colour": ["black", "white"], "width": [4.0, 1.8]}
    cursor = ColumnDataSource(crosses, name=CURSOR)
    end = glyphs.Scatter(size=9, line_color="black", fill_color="colour", line_width=1.2)
    cross = glyphs.Scatter(marker="cross", size=15, line_color="colour", line_width="width")
    return [Overlay(lines, outlined()), Overlay(ends, end), Overlay(cursor, cross, "overlay")]


def haloed(
    xs: list[list[float]], ys: list[list[float]], colours: list[str]
) -> dict[str, list[Any]]:
    """Return the columns of lines and of wider black ones under them."""
    count = len(colours)
    widths = count * [3.4] + count * [1.8]  # pixels
    return {"xs": 2 * xs, "ys": 2 * ys, "colour": count * ["black"] + colours, "width": widths}


def outlined() -> glyphs.MultiLine:
    """Return the glyph of lines with a colour and a width each."""
    return glyphs.MultiLine(line_color="colour", line_width="width")
