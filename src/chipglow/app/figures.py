"""The figures of the page: images with linked ranges and cursors, and temperatures along lines."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from bokeh.models import (
    BoxAnnotation,
    ColorBar,
    ColumnDataSource,
    CrosshairTool,
    CustomJS,
    CustomJSHover,
    CustomJSTickFormatter,
    HoverTool,
    LinearColorMapper,
    Range1d,
    Span,
    WheelZoomTool,
)
from bokeh.palettes import Cividis256, Inferno256, RdBu11, interp_palette
from bokeh.plotting import figure
from numpy.typing import NDArray

from chipglow.app.knobs import CURSOR, ERRORS, LINE_NAMES, LINES, Knobs, Point
from chipglow.app.picture import Drawn, LineValues, Picture
from chipglow.drawing.scales import HEAT, KELVIN, PLAIN, SIGNED, ends, round_limit
from chipglow.scene import Raster, Tool

MICRONS: Final = 1e6
PALETTES: Final = {
    HEAT: Inferno256,
    PLAIN: Cividis256,
    SIGNED: interp_palette(RdBu11, 256),
}
"""As in other figures; Matplotlib itself takes long to import."""

IMAGES: Final = ("scene", "measured", "error")

_THEMES: Final = {
    "light": {"ground": "#ffffff", "text": "#16191d", "grid": "#d7dbe0", "void": "#e5e7eb"},
    "dark": {"ground": "#14171c", "text": "#e8eaed", "grid": "#39414b", "void": "#2b313a"},
}
LINE_COLOURS: Final = {"rake_line": "#56B4E9", "band_line": "#E69F00"}
_MEASURED: Final = "#2b7fd0"
_REFERENCE: Final = "#7d858f"
"""Seen on light and dark ground: a glyph's colour that changes comes back from notebooks."""

_TITLES: Final = {
    "scene": "Scene: true temperature / °C",
    "measured": "Measured radiance temperature / °C",
    "error": "Error / K",
}

_BORDER: Final = 46
_LEAST_FRAME: Final = 180

_WITH_UNIT: Final = """
// The tick in the middle of a bar has the unit, which is in the image's title.
const unit = (title.text.split(" / ")[1] ?? "").replace(/[()]/g, "");
const large = Math.max(...ticks) >= 1e5;
const text = large ? tick.toExponential().replace("e+", "e") : String(Number(tick.toPrecision(6)));
const middle = index === Math.floor(ticks.length / 2);
return text.replace("-", "−") + (middle && unit ? " " + unit : "");
"""

_VALUE: Final = """
// The value under the pointer with the unit of the image's title.
const found = source.data.image[0][special_vars.image_index?.flat_index];
if (!Number.isFinite(found)) return missing;
const unit = (title.text.split(" / ")[1] ?? "").replace(/[()]/g, "");
return `${Number(found.toPrecision(4))} ${unit}`.replace("-", "−");
"""

_DRAG: Final = """
// Drag: the end of a line, the cursor, or else the view.
const px = (x_range.end - x_range.start) / frame.inner_width;
const near = (x, y) => Math.hypot(x - cb_obj.x, y - cb_obj.y) / px < 12;
if (cb_obj.event_name === "panstart") {
  grip.held = null;
  for (const source of [...lines, cursor]) {
    const { x, y } = source.data;
    for (let i = 0; i < x.length; i++) if (near(x[i], y[i])) grip.held = [source, i];
    if (grip.held) break;
  }
  grip.last = [cb_obj.sx, cb_obj.sy];
} else if (cb_obj.event_name === "pan" && grip.held) {
  const [source, i] = grip.held;
  const x = Array.from(source.data.x), y = Array.from(source.data.y);
  x[i] = Math.round(10 * Math.min(Math.max(cb_obj.x, extent[0]), extent[1])) / 10;
  y[i] = Math.round(10 * Math.min(Math.max(cb_obj.y, extent[2]), extent[3])) / 10;
  source.data = { x, y };
} else if (cb_obj.event_name === "pan" && grip.last) {
  const dx = (grip.last[0] - cb_obj.sx) * px, dy = (cb_obj.sy - grip.last[1]) * px;
  grip.last = [cb_obj.sx, cb_obj.sy];
  x_range.setv({ start: x_range.start + dx, end: x_range.end + dx });
  y_range.setv({ start: y_range.start + dy, end: y_range.end + dy });
} else if (cb_obj.event_name === "panend") {
  grip.held = grip.last = null;
}
"""


@dataclass(frozen=True, eq=False)
class ImageFigure:
    """One image with its colours.

    Parameters
    ----------
    figure : figure
        Bokeh's figure.
    source : ColumnDataSource
        The image and its place.
    mapper : LinearColorMapper
        Its colours.
    bar : ColorBar
        Their legend.
    """

    figure: Any
    source: ColumnDataSource
    mapper: LinearColorMapper
    bar: ColorBar


class Figures:
    """All figures of one page.

    Parameters
    ----------
    raster : Raster
        What the images show.
    tool : Tool or None
        Its outline is drawn over them.
    knobs : Knobs
        Cursor and lines.
    names : tuple of str
        Which of `IMAGES` there are.
    """

    def __init__(
        self, raster: Raster, tool: Tool | None, knobs: Knobs, names: tuple[str, ...]
    ) -> None:
        self._extent = tuple(MICRONS * edge for edge in raster.extent)
        left, right, bottom, top = self._extent
        self.x_range, self.y_range = _range(left, right), _range(bottom, top)
        self.cursor = ColumnDataSource(_points(knobs.points(CURSOR)))
        self.ends = {name: ColumnDataSource(_points(knobs.points(name))) for name in LINES}
        self._spans = [
            Span(dimension=one, line_color="#808080", line_width=1) for one in ("height", "width")
        ]
        self._outline = _outline(tool)
        self._palettes: dict[str, str] = {}
        self._shown: dict[str, NDArray[Any]] = {}
        self.images = {name: self._image(name, name == names[0]) for name in names}
        self._along: dict[str, NDArray[np.float64]] = {}
        self.band_sources: dict[str, ColumnDataSource] = {}
        self._out_of_range: list[BoxAnnotation] = []
        self.lines = {name: self._line(name, len(names) > 1) for name in LINES}
        self.figures = [one.figure for one in self.images.values()] + list(self.lines.values())
        self._link_drags()
        self.set_theme("light")

    @property
    def shape(self) -> float:
        """Height of the images over their width."""
        left, right, bottom, top = self._extent
        return (top - bottom) / (right - left)

    @property
    def seen(self) -> tuple[float, float, float, float]:
        """The part of the images that is seen: left, right, bottom and top in m."""
        ends = (self.x_range.start, self.x_range.end, self.y_range.start, self.y_range.end)
        left, right, bottom, top = (end / MICRONS for end in ends)
        return left, right, bottom, top

    def show(self, picture: Picture) -> None:
        """Show a picture's images; its lines are the page's to show, see `line_data`."""
        measured = np.where(picture.flagged, np.nan, picture.measured) - KELVIN
        scene, error = picture.scene, picture.error
        if scene is not None:
            self.images["scene"].figure.title.text = f"Scene: {scene.label}"
        limits = temperature_limits(picture)
        if scene is not None and scene.is_temperature:
            self._set("scene", scene.shown, scene.raster, limits, HEAT)
        elif scene is not None:
            self._set("scene", scene.shown, scene.raster, ends(scene.shown), PLAIN)
        self._set("measured", measured, picture.raster, limits, HEAT)
        if error is not None:
            shown = np.where(picture.flagged, np.nan, error)
            limit = error_limit(picture)
            self.images["error"].figure.title.text = f"{ERRORS[picture.knobs.error]} / K"
            self._set("error", shown, picture.raster, (-limit, limit), SIGNED)
        lowest = picture.camera.lower_limit if picture.camera else None
        for box in self._out_of_range:
            box.update(top=None if lowest is None else lowest - KELVIN, visible=lowest is not None)

    def line_data(self, picture: Picture) -> dict[str, dict[str, list[float]]]:
        """What stands along the lines of a picture, by the names of the lines' sources.

        The page draws it when it has drawn the images: a half of the work, that they lead.
        """
        self._along = {name: values.distance for name, values in picture.lines.items()}
        return {f"{name}_values": _line_data(values) for name, values in picture.lines.items()}

    def show_drawn(self, drawn: Drawn | None) -> None:
        """Shade what the draws cover along the lines; nothing for None."""
        for name, source in self.band_sources.items():
            if drawn is None:
                if len(source.data["along"]):
                    source.data = {"along": [], "low": [], "high": []}
                continue
            values = drawn.lines[name].measured - KELVIN
            known = np.isfinite(values).all(axis=0)
            source.data = {
                "along": MICRONS * self._along[name][known],
                "low": values[:, known].min(axis=0),
                "high": values[:, known].max(axis=0),
            }

    def set_places(self, knobs: Knobs) -> None:
        """Put cursor and lines where the knobs have them."""
        for name, source in {CURSOR: self.cursor, **self.ends}.items():
            data = _points(knobs.points(name))
            if source.data != data:
                source.data = data

    def view(self, middle: tuple[float, float] | None, width: float = 0.0) -> None:
        """Show what is around a place in m, so wide; or everything."""
        left, right, bottom, top = self._extent
        if middle is not None:
            half = MICRONS * width / 2
            tall = half * (top - bottom) / (right - left)
            x, y = (MICRONS * one for one in middle)
            left, right, bottom, top = x - half, x + half, y - tall, y + tall
        self.x_range.update(start=left, end=right)
        self.y_range.update(start=bottom, end=top)

    def set_theme(self, theme: str) -> None:
        """Draw everything on light or dark ground."""
        colours = _THEMES["dark" if theme == "dark" else "light"]
        text = colours["text"]
        grounds = {id(image.figure): colours["void"] for image in self.images.values()}
        for one in self.figures:
            one.update(
                background_fill_color=grounds.get(id(one), colours["ground"]),
                border_fill_color=colours["ground"],
                outline_line_color=colours["grid"],
            )
            one.title.text_color = text
            for axis in one.axis:
                axis.update(
                    axis_label_text_color=text,
                    major_label_text_color=text,
                    axis_line_color=text,
                    major_tick_line_color=text,
                    minor_tick_line_color=None,
                )
            for grid in one.grid:
                grid.grid_line_color = colours["grid"]
        for image in self.images.values():
            image.mapper.nan_color = colours["void"]
            image.bar.update(
                background_fill_color=colours["ground"],
                major_label_text_color=text,
            )
        for box in self._out_of_range:
            box.update(fill_color=colours["void"], fill_alpha=1.0)
        for one in self.lines.values():
            for legend in one.legend:
                legend.update(
                    background_fill_color=colours["ground"],
                    background_fill_alpha=0.8,
                    border_line_color=None,
                    label_text_color=text,
                )

    def _set(
        self,
        name: str,
        values: NDArray[Any],
        raster: Raster,
        limits: tuple[float, float],
        colours: str,
    ) -> None:
        """An image, its rows from the bottom as Bokeh has them."""
        image = self.images[name]
        left, right, bottom, top = (MICRONS * edge for edge in raster.extent)
        if (image.mapper.low, image.mapper.high) != limits:
            image.mapper.update(low=limits[0], high=limits[1])
        if self._palettes.get(name) != colours:
            self._palettes[name] = colours
            image.mapper.palette = PALETTES[colours]
        if self._shown.get(name) is values:
            return
        self._shown[name] = values
        image.source.data = {
            "image": [np.ascontiguousarray(values[::-1], np.float32)],
            "x": [left],
            "y": [bottom],
            "dw": [right - left],
            "dh": [top - bottom],
        }

    def _image(self, name: str, labelled: bool) -> ImageFigure:
        one = figure(
            x_range=self.x_range,
            y_range=self.y_range,
            frame_width=_LEAST_FRAME,
            frame_height=_LEAST_FRAME,
            tools="",
            toolbar_location=None,
            title=_TITLES[name],
            name=f"{name}_figure",
            min_border=4,
            output_backend="canvas",
        )
        source = ColumnDataSource(
            {"image": [np.zeros((2, 2), np.float32)], "x": [0], "y": [0], "dw": [1], "dh": [1]},
            name=f"{name}_image",
        )
        mapper = LinearColorMapper(palette=PALETTES[HEAT], low=0.0, high=1.0)
        drawn = one.image(
            image="image", x="x", y="y", dw="dw", dh="dh", source=source, color_mapper=mapper
        )
        bar = ColorBar(
            color_mapper=mapper,
            height=10,
            padding=2,
            margin=0,
            formatter=CustomJSTickFormatter(code=_WITH_UNIT, args={"title": one.title}),
        )
        one.add_layout(bar, "below")
        wheel = WheelZoomTool()
        missing = "no material" if name == "scene" else "out of range"
        known = {"title": one.title, "source": source, "missing": missing}
        tips = [("", "$sx{custom}"), ("x, y", "$x{0.0}, $y{0.0} µm")]
        hover = HoverTool(renderers=[drawn], tooltips=tips, attachment="above")
        hover.formatters = {"$sx": CustomJSHover(code=_VALUE, args=known)}
        one.add_tools(
            wheel,
            CrosshairTool(overlay=self._spans),
            hover,
        )
        one.toolbar.active_scroll = wheel
        self._draw_over(one)
        one.grid.visible = False
        one.xaxis.axis_label = "x / µm"
        one.yaxis.axis_label = "y / µm" if labelled else None
        one.yaxis.visible = labelled
        if labelled:
            one.min_border_left = _BORDER
        return ImageFigure(one, source, mapper, bar)

    def _draw_over(self, one: Any) -> None:
        """The tool, the lines and the cursor, each seen on any ground."""
        if self._outline is not None:
            for colour, width in (("white", 2.4), ("black", 1.2)):
                one.line(*self._outline, line_color=colour, line_width=width)
        for name, source in self.ends.items():
            one.line("x", "y", source=source, line_color="black", line_width=3.4)
            one.line("x", "y", source=source, line_color=LINE_COLOURS[name], line_width=1.8)
            one.scatter(
                "x", "y", source=source, size=9, marker="circle", line_color="black",
                fill_color=LINE_COLOURS[name], line_width=1.2,
            )  # fmt: skip
        for colour, width in (("black", 4.0), ("white", 1.8)):
            one.scatter(
                "x", "y", source=self.cursor, marker="cross", size=15, line_color=colour,
                line_width=width,
            )  # fmt: skip

    def _line(self, name: str, with_reference: bool) -> Any:
        one = figure(
            frame_width=_LEAST_FRAME,
            frame_height=150,
            tools="",
            toolbar_location=None,
            title=f"Temperature {LINE_NAMES[name]}",
            name=f"{name}_figure",
            min_border=4,
        )
        empty: dict[str, list[float]] = {"along": [], "measured": [], "reference": []}
        source = ColumnDataSource(empty, name=f"{name}_values")
        band = self.band_sources[name] = ColumnDataSource({"along": [], "low": [], "high": []})
        colour = LINE_COLOURS[name]
        one.add_layout(Span(dimension="height", line_color=colour, line_width=3, location=0))
        one.x_range.range_padding = 0.02
        box = BoxAnnotation(level="underlay", line_color=None, visible=False)
        one.add_layout(box)
        self._out_of_range.append(box)
        one.varea("along", "low", "high", source=band, fill_alpha=0.25, color=_MEASURED)
        if with_reference:
            one.line(
                "along", "reference", source=source, line_width=2, line_dash="dashed",
                legend_label="reference", line_color=_REFERENCE,
            )  # fmt: skip
        one.line(
            "along", "measured", source=source, line_width=2, legend_label="measured",
            name="measured", line_color=_MEASURED,
        )  # fmt: skip
        legend = one.legend[0]
        legend.update(
            orientation="horizontal", padding=0, margin=0, spacing=10, glyph_height=12,
            label_text_font_size="11px",
        )  # fmt: skip
        one.add_layout(legend, "above")
        tips = [("distance", "@along{0.0} µm"), ("measured", "@measured{0.0} °C")]
        if with_reference:
            tips.append(("reference", "@reference{0.0} °C"))
        measured = [one.select_one("measured")]
        one.add_tools(HoverTool(tooltips=tips, mode="vline", renderers=measured))
        one.xaxis.axis_label = "distance / µm"
        one.yaxis.axis_label = "radiance temperature / °C"
        one.min_border_left = _BORDER + 6
        one.title.text_font_size = "12px"
        return one

    def _link_drags(self) -> None:
        """Let the lines' ends and the cursor be dragged, and the view with them."""
        for image in self.images.values():
            one = image.figure
            code = CustomJS(
                args={
                    "frame": one,
                    "x_range": self.x_range,
                    "y_range": self.y_range,
                    "lines": list(self.ends.values()),
                    "cursor": self.cursor,
                    "extent": list(self._extent),
                },
                code=f"const grip = (window.__chipglow_grip ??= {{}});\n{_DRAG}",
            )
            for event in ("panstart", "pan", "panend"):
                one.js_on_event(event, code)


def _range(start: float, end: float) -> Range1d:
    """Range of an image: the wheel leads no further out than to three times of it."""
    return Range1d(start, end, bounds=(2 * start - end, 2 * end - start))


def places(source: ColumnDataSource) -> str:
    """Places of a source as a knob's text."""
    return ";".join(
        f"{x:.1f},{y:.1f}" for x, y in zip(source.data["x"], source.data["y"], strict=True)
    )


def _points(points: tuple[Point, ...]) -> dict[str, list[float]]:
    return {
        "x": [round(MICRONS * x, 3) for x, _ in points],
        "y": [round(MICRONS * y, 3) for _, y in points],
    }


def _line_data(values: LineValues) -> dict[str, list[float]]:
    reference = values.measured if values.reference is None else values.reference
    data = {
        "along": MICRONS * values.distance,
        "measured": values.measured - KELVIN,
        "reference": reference - KELVIN,
    }
    return {name: one.tolist() for name, one in data.items()}


def _outline(tool: Tool | None) -> tuple[list[float], list[float]] | None:
    if tool is None:
        return None
    x, y = MICRONS * tool.outline(3e-3).T
    return x.tolist(), y.tolist()


def temperature_limits(picture: Picture) -> tuple[float, float]:
    """Ends of the colours of temperatures in °C: of both images where the scene's shows one."""
    low, high = ends(np.where(picture.flagged, np.nan, picture.measured) - KELVIN, 0.0, 100.0, 10.0)
    scene = picture.scene
    if scene is None or not scene.is_temperature:
        return low, high
    return min(low, _lowest(picture)), max(high, float(np.nanmax(scene.shown)))


def error_limit(picture: Picture) -> float:
    """End of the colours of the error in K."""
    assert picture.error is not None
    return round_limit(np.where(picture.flagged, np.nan, picture.error), 99, 5.0)


def _lowest(picture: Picture) -> float:
    """Lower end of the colours of temperature in °C: the camera's range limit if it has one."""
    assert picture.scene is not None
    limit = picture.camera.lower_limit if picture.camera else None
    return float(np.nanmin(picture.scene.values) if limit is None else limit) - KELVIN
