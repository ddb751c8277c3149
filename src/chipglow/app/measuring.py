"""The panel in which places are drawn on the images and read: table, curves and files."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from html import escape
from importlib.util import find_spec
from io import BytesIO
from math import isfinite
from typing import Any, Final, get_args

import numpy as np
import pandas as pd
import panel as pn
from bokeh.models import (
    ColumnDataSource,
    HoverTool,
    LinearColorMapper,
    NumberFormatter,
    Span,
    StringFormatter,
)
from bokeh.palettes import Cividis256, Greys256, Inferno256, Turbo256, Viridis256
from bokeh.plotting import figure

from chipglow.app.export import csv_file, picture_file, workbook
from chipglow.app.figures import MICRONS, TEXT
from chipglow.app.frames_model import KnownRegions
from chipglow.app.marks import Kind, Mark, marks_of, new_name, places_text
from chipglow.app.opened import Frames, Opened
from chipglow.app.reading import MEASURED, Reader, table_of
from chipglow.app.scene_model import SceneFrames
from chipglow.app.session import PAUSE, Newest
from chipglow.app.tools import DrawnPlaces, colour_of
from chipglow.laboratory.emissivity import PlacesDescription
from chipglow.laboratory.emissivity.places import (
    OF_A_CORRECTION,
    ImageView,
    KnownEmissivity,
    Palette,
)
from chipglow.laboratory.readings import PlaceCurves, PlaceReading, Profile
from chipglow.quantities import ZERO_CELSIUS
from chipglow.quantities.units import TEMPERATURE
from chipglow.scene import Region
from chipglow.scene.regions import Point

_COLOURS: Final[Mapping[str, Any]] = {
    "inferno": Inferno256,
    "viridis": Viridis256,
    "cividis": Cividis256,
    "grey": Greys256,
    "turbo": Turbo256,
}
_LABELS: Final = {name: name.capitalize() for name in get_args(Palette)} | {
    "turbo": "Turbo (not colour-blind safe)"
}

_COLUMNS: Final = {
    "place": "Place",
    "pixels": "Pixels",
    "mean_degC": "Mean / °C",
    "standard_deviation_K": "SD / K",
    "minimum_degC": "Min / °C",
    "maximum_degC": "Max / °C",
    "out_of_range": "Out of range",
    "emissivity": "Emissivity",
    "uncertainty": "its u",
    "true_temperature_degC": "True / °C",
    "expanded_uncertainty_K": "U (95 %) / K",
}
"""Columns of the table on the page with their titles."""

_HINTS: Final[Mapping[str, str]] = {
    "look": "Choose a shape above the images and draw it.",
    "point": "Point: click on an image.",
    "line": "Line: drag from end to end.",
    "box": "Box: drag from corner to corner.",
    "circle": "Circle: drag from the centre to the rim.",
    "polygon": "Polygon: click each corner, then press Enter; on a touch screen hold the last one.",
    "edit": "Edit: drag a handle, or click it and press Backspace to remove its place.",
}

_GRID: Final = {
    "display": "grid",
    "grid-template-columns": "repeat(auto-fit, minmax(280px, 1fr))",
    "width": "100%",
}
"""Figures side by side, as many as fit."""

_TABLE_STYLE: Final = """
.tabulator, .tabulator .tabulator-header, .tabulator .tabulator-header .tabulator-col,
.tabulator .tabulator-tableholder .tabulator-table,
.tabulator-row, .tabulator-row.tabulator-row-even
{ background: transparent !important; color: inherit !important; }
.tabulator-row.tabulator-selected
{ background: color-mix(in srgb, currentColor 15%, transparent) !important; }
"""
"""The colours of the page, on light and on dark ground."""

_TABLE_HEIGHT: Final = 180
"""Height of the table in pixels: a new row must not move what stands below."""

_LINE_HEIGHT: Final = 190
"""Height of the curves in pixels."""


class Measuring:
    """Places on the images of a page, and what they measure.

    `later` calls a function in the thread of the page, `say` shows a text of a kind, `know` takes
    the regions and their emissivities, and `send` sends the page a message. "ask" makes the page
    send one of a kind once it has painted what it was sent: "tools", "table" and "curves" then
    call `offer_tools`, `show_table` and `show_curves`.
    """

    def __init__(
        self,
        opened: Opened,
        later: Callable[[Callable[[], None]], None],
        say: Callable[..., None],
        know: Callable[[KnownRegions], None],
        send: Callable[[str, Any], None],
    ) -> None:
        self._opened, self._later, self._say = opened, later, say
        self._know, self._send = know, send
        self._marks: list[Mark] = []
        self._view = ImageView()
        self._reader = Reader(opened)
        self._curves: PlaceCurves | None = None
        self._asked: tuple[Frames, tuple[Region, ...]] | None = None
        self._readings: list[PlaceReading] = []
        self._table = pd.DataFrame()
        self._drawn = DrawnPlaces(
            opened.figures, self._add, self._move, self._remove, self._hint_at, send
        )
        self._work = Newest(self._read_curves, self._failed)
        self._hint = pn.pane.HTML(_HINTS["look"], margin=2)
        self.tools = pn.Column(margin=0)
        self._panel: pn.Column | None = None
        self._figures: tuple[Any, ...] = ()
        self._theme = "light"
        opened.watch(self._show_picture)

    @property
    def panel(self) -> pn.Column:
        """Table, curves, limits and files; built with the tools when first asked for.

        They take as long as the images, which are shown before.
        """
        if self._panel is None:
            self._panel = self._build()
            self._drawn.add_tools()
            self.set_theme(self._theme)
            self.show_again()
            self._send("ask", "tools")
        return self._panel

    def offer_tools(self) -> None:
        """Show the choice of the tools, which the page has by then: it activates them."""
        if not len(self.tools):
            self.tools.append(pn.pane.Bokeh(self._drawn.choice, margin=0))

    def set_theme(self, theme: str) -> None:
        """Set the colours of the curves' text."""
        self._theme = theme
        for one in self._figures:
            one.title.text_color = TEXT[theme]
            one.axis.axis_label_text_color = one.axis.major_label_text_color = TEXT[theme]
            one.axis.axis_line_color = one.axis.major_tick_line_color = TEXT[theme]

    def restore(self, described: PlacesDescription) -> None:
        """Show the places and the view of a file; ValueError for a place outside the image."""
        self._marks = list(marks_of(described, self._opened.frames.raster))
        self._know(self._regions())
        self._view = described.view

    def end(self) -> None:
        """Stop reading for a page that was closed."""
        self._work.cancel()

    def _hint_at(self, tool: str) -> None:
        self._hint.object = _HINTS[tool]

    # Places

    def _add(self, kind: Kind, points: tuple[Point, ...]) -> None:
        self._change(lambda: self._marks.append(self._new(kind, points)))

    def _new(self, kind: Kind, points: tuple[Point, ...]) -> Mark:
        return Mark(new_name(kind, self._marks), kind, points).within(self._reader.raster)

    def _move(self, number: int, handle: int, to: Point) -> None:
        def move() -> None:
            self._marks[number] = self._marks[number].moved(handle, to, self._reader.raster)

        self._change(move)

    def _remove(self, number: int) -> None:
        self._change(lambda: self._marks.pop(number), with_table=True)

    def _change(self, act: Callable[[], Any], with_table: bool = False) -> None:
        """Change the places, and show and read them; show an error if that is not possible.

        A change that is made in the table is shown there at once: a table that came later would
        end the next edit.
        """

        def change() -> None:
            try:
                act()
            except ValueError as error:
                self._say(str(error), "error")
            self.show_places(with_table)
            self._know(self._regions())

        self._later(change)  # together: the browser draws once

    def _regions(self) -> KnownRegions:
        """Return the regions and their emissivities."""
        return {mark.region: mark.emissivity for mark in self._marks if mark.region.has_area}

    def _on_edit(self, event: Any) -> None:
        def edit() -> None:
            self._marks[event.row] = self._edited(event.row, event.column, event.value)

        self._change(edit, with_table=True)

    def _edited(self, number: int, column: str, value: Any) -> Mark:
        """Return a place with a new name or emissivity; ValueError if it is not possible."""
        mark = self._marks[number]
        if column == "place":
            name = str(value or "").strip()
            others = [*OF_A_CORRECTION, *(one.name for one in self._marks if one is not mark)]
            if not name or name in others:
                raise ValueError(f"place: {name!r}, expected a name that no other place has")
            return replace(mark, name=name)
        number_given = value is not None and value != "" and isfinite(float(value))
        known = mark.emissivity
        if column == "emissivity":
            if not number_given:
                return replace(mark, emissivity=None)
            uncertainty = known.uncertainty if known else 0.0
            return replace(mark, emissivity=KnownEmissivity(float(value), uncertainty))
        if known is None:
            raise ValueError("its u: give the emissivity of the place first")
        uncertainty = float(value) if number_given else 0.0
        return replace(mark, emissivity=KnownEmissivity(known.mean, uncertainty))

    # Readings

    def _show_picture(self) -> None:
        """Show the colours of a new picture, and read all places in it."""
        self._reader.forget()
        self._show_view()
        self.show_places()

    def show_again(self) -> None:
        """Show all places on a page that was rendered anew."""
        self._drawn.renew()
        self.show_places()

    def show_places(self, with_table: bool = False) -> None:
        """Show all places, and what they measure: the table at once, or after the images."""
        if not self._reader.is_ready:
            return
        if not self._is_asked():
            self._work.cancel()  # it would delay the places
            self._asked = None
        self._readings = [self._reader.read(mark) for mark in self._marks]
        self._table = table_of(self._readings)
        means = [one.statistics.mean for one in self._readings]
        self._drawn.show(self._marks, means, self._reader.raster)
        if self._panel is None:
            return
        if with_table:
            self.show_table()
        else:
            self._send("ask", "table")

    def show_table(self) -> None:
        """Show the table of the places, which are shown on the images before."""
        known = list(map(self._reader.emissivity, self._marks, self._readings))
        # Objects: an empty field, by which a user removes an emissivity, is not a number.
        self._rows.value = self._table.reindex(columns=[*_COLUMNS]).assign(
            emissivity=pd.Series([mean for mean, _ in known], dtype=object),
            uncertainty=pd.Series([uncertainty for _, uncertainty in known], dtype=object),
        )
        self._rows.visible = bool(self._marks)
        self._copied.data = {"text": [self._table.to_csv(sep="\t", index=False)]}
        notes = (*(one.notes for one in self._readings), self._reader.doubts)
        warnings = [warning for one in notes for warning in one.warnings]
        self._warnings.object = "".join(f"<p>{escape(one)}</p>" for one in warnings)
        self._warnings.visible = bool(warnings)
        self._send("ask", "curves")

    def show_curves(self) -> None:
        """Show the curves along lines, the histogram, and the curves over time."""
        self._show_lines()
        self._show_histogram()
        self._ask_curves()

    def _show_lines(self) -> None:
        profiles = self._profiles()
        numbers = [number for number, mark in enumerate(self._marks) if mark.kind == "line"]
        self._along.data = {
            "xs": [(MICRONS * one.distance).tolist() for one in profiles],
            "ys": [(one.kelvins - ZERO_CELSIUS).tolist() for one in profiles],
            "colour": [colour_of(number) for number in numbers],
            "name": [one.place for one in profiles],
        }

    def _profiles(self) -> list[Profile]:
        return [self._reader.profile(mark) for mark in self._marks if mark.kind == "line"]

    def _counted(self) -> int | None:
        """Return the index of the selected place, by default of the last region."""
        areas = [number for number, mark in enumerate(self._marks) if mark.region.has_area]
        chosen = [number for number in self._rows.selection if number < len(self._marks)]
        return (chosen or areas[-1:] or [None])[0]

    def _show_histogram(self) -> None:
        """Show the frequency of temperatures in a place."""
        number = self._counted()
        if number is None:
            self._bins.data = {"left": [], "right": [], "top": []}
            return
        found = self._reader.histogram(self._marks[number])
        celsius = found.edges - ZERO_CELSIUS
        self._bins.data = {
            "left": celsius[:-1].tolist(),
            "right": celsius[1:].tolist(),
            "top": found.pixels.tolist(),
        }
        self._frequency.title.text = f"Frequency: {found.place}"
        self._bars.glyph.fill_color = colour_of(number)

    def _ask_curves(self) -> None:
        """Read the frames of a recording; those of a scene, which take long, when asked for."""
        frames = self._opened.frames
        self._now.location = float(MICRONS * frames.times[self._opened.frame])
        is_scene, several = isinstance(frames, SceneFrames), len(frames.times) > 1
        self._compute.visible = is_scene and several and bool(self._marks)
        if self._is_asked():
            return
        self._asked = frames, self._places()
        if several and self._marks and not is_scene:
            self._work.ask(tuple(self._marks))
        else:
            self._work.cancel()
            self._show_curves(None, ())

    def _is_asked(self) -> bool:
        """Return whether these places are read in all these frames, or will be."""
        if self._asked is None:
            return False
        frames, places = self._asked
        return frames is self._opened.frames and places == self._places()

    def _places(self) -> tuple[Region, ...]:
        return tuple(mark.region for mark in self._marks)

    def _read_curves(self, marks: tuple[Mark, ...]) -> None:
        """Read places in all frames, in a separate thread."""
        self._work.pause(PAUSE)
        curves = self._reader.curves(marks, self._check_frame)
        self._later(lambda: self._show_curves(curves, marks))

    def _check_frame(self, done: float) -> None:
        """Stop reading frames that are no longer needed, and say how many of a scene are read."""
        self._work.check()
        if isinstance(self._opened.frames, SceneFrames):
            text, kind = ("Frames are measured.", "busy") if done < 1 else ("", "")
            progress = {"progress": done} if done < 1 else {}
            self._later(lambda: self._say(text, kind, **progress))

    def _show_curves(self, curves: PlaceCurves | None, marks: tuple[Mark, ...]) -> None:
        self._curves = curves
        means = [] if curves is None else list(curves.mean - ZERO_CELSIUS)
        micros = [] if curves is None else (MICRONS * curves.times).tolist()
        self._over_time.data = {
            "xs": [micros] * len(means),
            "ys": [mean.tolist() for mean in means],
            "colour": [colour_of(number) for number, _ in enumerate(means)],
            "name": [mark.name for mark in marks],
        }

    def _failed(self, _kind: str, text: str) -> None:
        self._later(lambda: self._say(text, "error"))

    # View

    def _on_view(self) -> None:
        def kelvins(widget: Any) -> float | None:
            return None if widget.value is None else widget.value + ZERO_CELSIUS

        try:
            self._view = ImageView(
                frame=self._opened.frame,
                low=kelvins(self._low),
                high=kelvins(self._high),
                palette=self._palette.value,
                isotherm=kelvins(self._isotherm),
            )
        except ValueError as error:
            self._say(str(error).removeprefix("ImageView."), "error")
            return
        if self._reader.is_ready:
            self._show_view()

    def _show_view(self) -> None:
        """Set colours and limits of the images of temperatures, and the isotherm."""
        low, high = self._limits()
        for name, image in self._opened.images.items():
            if image.is_temperature:
                _mapper(self._opened.figures[name]).update(
                    palette=_COLOURS[self._view.palette], low=low, high=high
                )
        level = self._view.isotherm
        lines = [] if level is None else self._reader.isotherm(level)
        self._drawn.isotherm.data = {
            "xs": [(MICRONS * line[:, 0]).tolist() for line in lines],
            "ys": [(MICRONS * line[:, 1]).tolist() for line in lines],
        }

    def _limits(self) -> tuple[float, float]:
        """Return the ends of the colours in °C: those that are given, else of the images."""
        values = [
            one.values[np.isfinite(one.values)]
            for one in self._opened.images.values()
            if one.is_temperature
        ]
        known = np.concatenate(values) if values else np.zeros(0)
        low, high = (known.min(), known.max()) if known.size else (ZERO_CELSIUS, ZERO_CELSIUS + 1)
        low = self._view.low if self._view.low is not None else low
        high = self._view.high if self._view.high is not None else high
        return float(low) - ZERO_CELSIUS, max(float(high), float(low) + 1e-3) - ZERO_CELSIUS

    # Files

    def _tables(self) -> dict[str, pd.DataFrame]:
        tables = {"places": self._table}
        if self._curves is not None:
            tables["over time"] = self._curves.to_frame()
        if profiles := self._profiles():
            frames = [one.to_frame() for one in profiles]
            tables["along lines"] = pd.concat(frames, ignore_index=True)
        if (number := self._counted()) is not None:
            tables["histogram"] = self._reader.histogram(self._marks[number]).to_frame()
        return tables

    def _settings(self) -> dict[str, str]:
        low, high = self._limits()
        return {
            "File": self._opened.name,
            "Frame": str(self._opened.frame),
            "Time": f"{MICRONS * self._opened.frames.times[self._opened.frame]:.9g} µs",
            "Image": self._opened.images[MEASURED].title,
            "Colours": f"{low:.6g} °C to {high:.6g} °C, {self._view.palette}",
            "Session": self._session_text(),
        }

    def _session_text(self) -> str:
        view: dict[str, Any] = {"frame": self._opened.frame, "palette": self._view.palette}
        for name in ("low", "high", "isotherm"):
            if (kelvins := getattr(self._view, name)) is not None:
                view[name] = TEMPERATURE.text(round(kelvins, 6))
        opened = self._opened
        return places_text(self._marks, opened.source, opened.surroundings, view, opened.correction)

    def _picture(self) -> bytes:
        celsius = self._reader.kelvins - ZERO_CELSIUS
        title = f"{self._opened.images[MEASURED].title} / °C"
        return picture_file(
            celsius, self._reader.raster, title, self._marks, self._view, self._limits(),
            self._settings(),
        )  # fmt: skip

    # Widgets

    def _build(self) -> pn.Column:
        """Return the panel with its widgets and figures."""
        self._rows = _table_widget()
        # Panel calls these without the lock of the document, which changes of it need.
        self._rows.on_edit(self._on_edit)
        self._rows.on_click(lambda event: self._remove(event.row), column="delete")
        self._rows.param.watch(lambda _: self._later(self._show_histogram), "selection")
        self._warnings = pn.pane.HTML("", visible=False)
        self._low = _celsius("Colours from / °C", self._view.low)
        self._high = _celsius("to / °C", self._view.high)
        self._isotherm = _celsius("Isotherm / °C", self._view.isotherm)
        options = {label: name for name, label in _LABELS.items()}
        self._palette = pn.widgets.Select(
            label="Palette", options=options, value=self._view.palette, width=130
        )
        for widget in (self._low, self._high, self._isotherm, self._palette):
            widget.param.watch(lambda _: self._later(self._on_view), "value")
        self._compute = pn.widgets.Button(label="Measure all frames", visible=False, width=150)
        self._compute.on_click(lambda _: self._work.ask(tuple(self._marks)))
        self._copied = ColumnDataSource({"text": [""]})
        self._build_figures()
        return pn.Column(
            self._hint,
            self._rows,
            self._warnings,
            self._compute,
            pn.Column(*(_pane(one) for one in self._figures), styles=_GRID),
            pn.FlexBox(self._low, self._high, self._palette, self._isotherm),
            pn.FlexBox(*self._buttons()),
            sizing_mode="stretch_width",
        )

    def _build_figures(self) -> None:
        empty: dict[str, list[Any]] = {"xs": [], "ys": [], "colour": [], "name": []}
        self._over_time = ColumnDataSource(empty, name="over_time")
        self._along = ColumnDataSource(empty, name="along_lines")
        self._bins = ColumnDataSource({"left": [], "right": [], "top": []}, name="histogram")
        time = _curves("Over time", "time / µs", self._over_time)
        along = _curves("Along lines", "distance / µm", self._along)
        self._now = Span(dimension="height", line_color="#7d858f", line_dash="dotted", location=0)
        time.add_layout(self._now)
        self._frequency = _plot("Frequency", "temperature / °C", "pixels")
        self._bars = self._frequency.quad(
            "left", "right", "top", 0, source=self._bins, line_color=None
        )
        self._figures = (time, along, self._frequency)

    def _buttons(self) -> list[Any]:
        copy = pn.widgets.Button(label="Copy table", width=110)
        copy.js_on_click(
            args={"source": self._copied}, code="navigator.clipboard.writeText(source.data.text[0])"
        )
        excel = _download(
            "Excel", "chipglow.xlsx", lambda: workbook(self._tables(), self._settings())
        )
        if find_spec("openpyxl") is None:
            excel.disabled, excel.label = True, "Excel: needs openpyxl"
        return [
            copy,
            _download("Table, CSV", "places.csv", lambda: csv_file(self._table)),
            _download("Curves, CSV", "curves.csv", self._curves_file),
            excel,
            _download("Picture, PNG", "chipglow.png", self._picture),
            _download("Session, YAML", "session.yaml", lambda: self._session_text().encode()),
        ]

    def _curves_file(self) -> bytes:
        tables = {name: one for name, one in self._tables().items() if name != "places"}
        return b"\r\n".join(f"{name}\r\n".encode() + csv_file(one) for name, one in tables.items())


def _mapper(one: Any) -> LinearColorMapper:
    """Return the colours of the image of a figure, which is the first that it draws."""
    return one.renderers[0].glyph.color_mapper  # a search of the figure's models takes long


def _celsius(name: str, kelvins: float | None) -> Any:
    """Return a field of a temperature in °C, which may be empty."""
    value = None if kelvins is None else round(kelvins - ZERO_CELSIUS, 6)
    return pn.widgets.FloatInput(label=name, value=value, width=110)


def _table_widget() -> Any:
    def digits(pattern: str) -> NumberFormatter:
        return NumberFormatter(format=pattern, nan_format="–", text_align="right")

    formats = dict.fromkeys(_COLUMNS, digits("0.0"))
    formats |= {"place": StringFormatter(), "pixels": digits("0"), "out_of_range": digits("0.0 %")}
    formats |= {"emissivity": digits("0.000"), "uncertainty": digits("0.000")}
    formats |= {"expanded_uncertainty_K": digits("0.00"), "standard_deviation_K": digits("0.00")}
    number = {"type": "number", "step": 0.01}
    editors: dict[str, Any] = dict.fromkeys(_COLUMNS)
    editors |= {"place": {"type": "input"}, "emissivity": number, "uncertainty": number}
    return pn.widgets.Tabulator(
        pd.DataFrame(columns=[*_COLUMNS]),
        titles=dict(_COLUMNS),
        formatters=formats,
        editors=editors,
        buttons={"delete": "✕"},
        show_index=False,
        selectable=1,
        sortable=False,
        layout="fit_data_table",
        widths={"place": 110},
        height=_TABLE_HEIGHT,
        theme="simple",
        stylesheets=[_TABLE_STYLE],
        visible=False,
        sizing_mode="stretch_width",
    )


def _plot(title: str, x: str, y: str) -> Any:
    one = figure(
        title=title, height=_LINE_HEIGHT, sizing_mode="stretch_width", tools="",
        toolbar_location=None, background_fill_color=None, border_fill_color=None,
        outline_line_color="#80808059", min_border=4,
    )  # fmt: skip
    one.grid.grid_line_color = "#80808059"
    one.axis.minor_tick_line_color = None
    one.xaxis.axis_label, one.yaxis.axis_label = x, y
    return one


def _curves(title: str, x: str, source: ColumnDataSource) -> Any:
    one = _plot(title, x, "temperature / °C")
    drawn = one.multi_line("xs", "ys", source=source, line_color="colour", line_width=2)
    tips = [("", "@name"), (x.split(" ")[0], "$x{0.0}"), ("°C", "$y{0.0}")]
    one.add_tools(HoverTool(renderers=[drawn], tooltips=tips, line_policy="nearest"))
    return one


def _pane(one: Any) -> Any:
    return pn.pane.Bokeh(one, sizing_mode="stretch_width", margin=2)


def _download(label: str, filename: str, make: Callable[[], bytes]) -> Any:
    return pn.widgets.FileDownload(
        callback=lambda: BytesIO(make()), filename=filename, label=label, width=130,
    )  # fmt: skip
