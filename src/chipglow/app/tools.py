"""Bokeh's tools on the images: they draw places, and move their handles."""

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any, Final, get_args

import numpy as np
from bokeh.core.properties import field
from bokeh.events import SelectionGeometry
from bokeh.models import (
    BoxSelectTool,
    ColumnDataSource,
    CustomJS,
    FreehandDrawTool,
    LabelSet,
    PointDrawTool,
    PolySelectTool,
    RadioButtonGroup,
    glyphs,
)

from chipglow.app.figures import MICRONS, Overlay, haloed, outlined
from chipglow.app.marks import Kind, Mark
from chipglow.app.reading import MEASURED
from chipglow.drawing.scales import COLOURS
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Raster
from chipglow.scene.regions import Point

_TOOLS: Final[tuple[str, ...]] = ("look", *get_args(Kind), "edit")
"""Effect of a press on an image: move cursor and view, draw a place, or edit one."""

_ACTIVATE: Final = """
const chosen = cb_obj.active;
groups.forEach((group, i) => { if (i !== chosen) for (const tool of group) tool.active = false; });
for (const tool of groups[chosen]) {
  if ("origin" in tool) tool.origin = chosen === circle ? "center" : "corner";
  tool.active = true;
}
"""
"""Makes the tools of a choice the active ones of all figures."""

_BUTTONS: Final = ":host(.solid) .bk-btn-group { flex-wrap: wrap; }"


class DrawnPlaces:
    """The outlines of places on all images, and the tools that draw and edit them.

    `drawn` takes the kind and the points of a new place, `moved` the index of a place, that of its
    handle and where it is now, `removed` the index of a place, `chosen` the name of a tool; points
    are in m. `send` sends the page a message: Bokeh would send each of its sources alone, and the
    browser paint all images again after each.
    """

    def __init__(
        self,
        figures: Mapping[str, Any],
        drawn: Callable[[Kind, tuple[Point, ...]], None],
        moved: Callable[[int, int, Point], None],
        removed: Callable[[int], None],
        chosen: Callable[[str], None],
        send: Callable[[str, Any], None],
    ) -> None:
        self._drawn, self._moved, self._removed, self._send = drawn, moved, removed, send
        self._outlines = ColumnDataSource(haloed([], [], []), name="outlines")
        self._labels = ColumnDataSource(_labels([], [], 0.0), name="labels")
        self._handles = ColumnDataSource(_handles([]), name="handles")
        self._shown: dict[str, dict[str, list[Any]]] = {}
        self._is_current = False  # whether the page has what was shown last
        self._points = ColumnDataSource({"x": [], "y": []})
        self._strokes = ColumnDataSource({"xs": [], "ys": []})
        self.isotherm = ColumnDataSource({"xs": [], "ys": []}, name="isotherm")
        dashed = glyphs.MultiLine(line_color="white", line_width=1.6, line_dash="4 2")
        overlays = Overlay(self._outlines, outlined(), "overlay"), Overlay(self.isotherm, dashed)
        self._figures = list(figures.values())
        for name, one in figures.items():
            for overlay in overlays:
                overlay.draw_on(one)
            one.add_layout(self._names("reading" if name == MEASURED else "name"))
            # No tool is active before it is chosen: a press moves cursor and view.
            one.toolbar.update(active_drag=None, active_tap=None)
            one.on_event(SelectionGeometry, self._on_geometry)
        self._handles.on_change("data", self._on_handles)
        self._points.on_change("data", self._on_point)
        self._strokes.on_change("data", self._on_stroke)
        labels = [name.capitalize() for name in _TOOLS]
        self.choice = RadioButtonGroup(labels=labels, active=0, stylesheets=[_BUTTONS])
        self.choice.on_change("active", lambda attr, old, new: chosen(self._kind))

    def add_tools(self) -> None:
        """Add the tools to the figures, whose images may be shown before."""
        overlays = self._overlays()
        groups: list[list[Any]] = [[] for _ in _TOOLS]
        for one in self._figures:
            tools = self._tools({name: overlay.draw_on(one) for name, overlay in overlays.items()})
            one.add_tools(*dict.fromkeys(tools.values()))
            for group, name in zip(groups[1:], _TOOLS[1:], strict=True):
                group.append(tools[name])
        args = {"groups": groups, "circle": _TOOLS.index("circle")}
        self.choice.js_on_change("active", CustomJS(args=args, code=_ACTIVATE))

    def show(self, marks: Sequence[Mark], means: Sequence[float], raster: Raster) -> None:
        """Show the outlines, names, mean readings in K, and handles of places."""
        colours = [colour_of(number) for number in range(len(marks))]
        outlines = [MICRONS * mark.outline.T for mark in marks]
        x, y = ([outline[axis].tolist() for outline in outlines] for axis in (0, 1))
        left, right, _, _ = raster.extent
        shown = {
            "outlines": haloed(x, y, colours),
            "labels": _labels(marks, means, (left + right) / 2),
            "handles": _handles(marks),
        }
        # A source that is sent again would end the drag of a handle.
        before = self._shown if self._is_current else {}
        changed = {name: one for name, one in shown.items() if one != before.get(name)}
        self._shown, self._is_current = shown, True
        if changed:
            self._send("places", changed)

    def renew(self) -> None:
        """Let all be shown again, as the page does not have it, or the user has changed it."""
        self._is_current = False

    def _names(self, text: str) -> LabelSet:
        """Return the names of the places for a figure, by the column that has them."""
        return LabelSet(
            source=self._labels, x="x", y="y", text=text, text_align=field("align"),
            x_offset=field("offset"), y_offset=4, text_font_size="11px", text_color="white",
            background_fill_color="#16191d", background_fill_alpha=0.6, level="overlay",
        )  # fmt: skip

    def _overlays(self) -> dict[str, Overlay]:
        """Return what the tools draw or edit, by their names."""
        handle = glyphs.Scatter(size=9, fill_color="colour", line_color="black")
        return {
            "point": Overlay(self._points, glyphs.Scatter(size=9)),
            "line": Overlay(self._strokes, glyphs.MultiLine(line_color="white")),
            "edit": Overlay(self._handles, handle, "overlay"),
        }

    def _tools(self, drawn: Mapping[str, Any]) -> dict[str, Any]:
        """Return the tools of a figure by their names; `drawn` has what they draw or edit.

        A circle is drawn by a box about its centre. What is drawn stays until its place is shown.
        """
        box = BoxSelectTool(renderers=[], persistent=True)
        return {
            "point": PointDrawTool(renderers=[drawn["point"]], drag=False),
            "line": FreehandDrawTool(renderers=[drawn["line"]]),
            "box": box,
            "circle": box,
            "polygon": PolySelectTool(renderers=[], persistent=True),
            "edit": PointDrawTool(renderers=[drawn["edit"]], add=False),
        }

    def _on_geometry(self, event: SelectionGeometry) -> None:
        """Take a box, a circle about the middle of a box, or a polygon."""
        if not event.final:
            return
        self.renew()
        shape = event.geometry
        if shape["type"] == "poly":
            self._drawn("polygon", _metres(shape["x"], shape["y"]))
            return
        x, y = (shape["x0"], shape["x1"]), (shape["y0"], shape["y1"])
        if self._kind == "circle":
            middle = (sum(x) / 2, sum(y) / 2)
            self._drawn("circle", _metres((middle[0], x[1]), (middle[1], y[1])))
        else:
            self._drawn("box", _metres(x, y))

    @property
    def _kind(self) -> str:
        """The choice of the user."""
        return _TOOLS[int(self.choice.active)]

    def _on_point(self, _name: str, _old: Any, new: Mapping[str, Any]) -> None:
        if len(new["x"]):
            points = _metres(new["x"], new["y"])
            self._points.data = {"x": [], "y": []}
            self._drawn("point", points[-1:])

    def _on_stroke(self, _name: str, _old: Any, new: Mapping[str, Any]) -> None:
        if len(new["xs"]):
            points = _metres(new["xs"][-1], new["ys"][-1])
            self._strokes.data = {"xs": [], "ys": []}
            self._drawn("line", (points[0], points[-1]))

    def _on_handles(self, _name: str, _old: Any, new: Mapping[str, Any]) -> None:
        """Take a handle that was moved, or a place of which one was removed."""
        shown = self._shown["handles"]
        self.renew()
        marks, handles = (np.asarray(new[name], np.int_) for name in ("mark", "handle"))
        before = list(zip(shown["mark"], shown["handle"], strict=True))
        now = list(zip(marks.tolist(), handles.tolist(), strict=True))
        if len(now) < len(before):
            self._removed(next(mark for mark, handle in before if (mark, handle) not in now))
            return
        old = np.array([shown["x"], shown["y"]], np.float64)
        found = np.array([new["x"], new["y"]], np.float64)
        for index in np.flatnonzero((old != found).any(axis=0)).tolist():
            ((x, y),) = _metres([found[0, index]], [found[1, index]])
            self._moved(*now[index], (x, y))
            return


def colour_of(number: int) -> str:
    """Return the colour of a place by its index."""
    return COLOURS[number % len(COLOURS)]


def _handles(marks: Sequence[Mark]) -> dict[str, list[Any]]:
    """Return the columns of the handles."""
    numbers = [number for number, mark in enumerate(marks) for _ in mark.handles]
    points = [point for mark in marks for point in mark.handles]
    return {
        "x": [MICRONS * x for x, _ in points],
        "y": [MICRONS * y for _, y in points],
        "colour": [colour_of(number) for number in numbers],
        "mark": numbers,
        "handle": [index for mark in marks for index, _ in enumerate(mark.handles)],
    }


def _labels(marks: Sequence[Mark], means: Sequence[float], middle: float) -> dict[str, list[Any]]:
    """Return the columns of the labels, on the side towards the middle of the image in m."""
    firsts = [mark.outline[0] for mark in marks]
    is_right = [bool(x > middle) for x, _ in firsts]
    return {
        "x": [float(MICRONS * x) for x, _ in firsts],
        "y": [float(MICRONS * y) for _, y in firsts],
        "name": [mark.name for mark in marks],
        "reading": [_reading(*one) for one in zip(marks, means, strict=True)],
        "align": ["right" if one else "left" for one in is_right],
        "offset": [-4.0 if one else 4.0 for one in is_right],  # pixels
    }


def _reading(mark: Mark, mean: float) -> str:
    """Return name and mean reading of a place, whose mean is in K."""
    return f"{mark.name}: {mean - ZERO_CELSIUS:.1f} °C" if isfinite(mean) else mark.name


def _metres(x: Sequence[float], y: Sequence[float]) -> tuple[Point, ...]:
    """Return points of a figure in m."""
    return tuple((float(a) / MICRONS, float(b) / MICRONS) for a, b in zip(x, y, strict=True))
