"""The page: a session, its figures, and what stands around them, as a Panel component."""

import json
from asyncio import AbstractEventLoop, get_running_loop
from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from math import floor, isfinite, log10
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any, ClassVar, Final

import panel as pn
import param
from bokeh.document import Document
from bokeh.events import PanEnd, Tap
from panel.custom import Child, JSComponent
from panel.io import unlocked

from chipglow.app.figures import IMAGES, Figures, places
from chipglow.app.knobs import (
    CURSOR,
    LINES,
    Knob,
    counts,
)
from chipglow.app.model import SceneModel
from chipglow.app.opening import OpenedMeasurement, OpenedScene
from chipglow.app.picture import Drawn, Picture, Readout
from chipglow.app.session import Listener, Session
from chipglow.drawing.scales import KELVIN
from chipglow.quantities.format import rounded_text
from chipglow.scene.lines import nearest

PHASES: Final = 3
TEXTURES: Final = 5
"""Of what "Draw phases and textures" makes: the paper's study has as many."""

_FOLDER: Final = Path(__file__).parent
_VIEW_WIDTH: Final = 160e-6

_PARTS: Final = (
    ("motion", "Motion", "Mean over the exposure less its greatest", ""),
    ("footprint", "Footprint", "Mean over the pixel less its hottest sample", ""),
    ("psf", "PSF", "Case 1 − case 2: with the point spread function less without it", ""),
    ("detector", "Detector", "Noise, counts and calibration", ""),
    ("texture", "of it: texture", "The error less that without texture: in the others", "within"),
)  # fmt: skip


class Page(JSComponent):  # type: ignore[misc]
    """What stands around the figures; what changes goes to and fro as messages, see page.js."""

    spec = param.String()
    scene_figure = Child()
    measured_figure = Child()
    error_figure = Child()
    rake_line_figure = Child()
    band_line_figure = Child()

    _esm = (_FOLDER / "page.js").read_text(encoding="utf-8")
    _stylesheets: ClassVar[list[str]] = [(_FOLDER / "page.css").read_text(encoding="utf-8")]

    def __init__(self, **params: Any) -> None:
        self._turn = RLock()
        super().__init__(**params)

    def alone(self, change: Callable[[], None]) -> None:
        """Change what a notebook shows while no message of its page is taken.

        A notebook's messages may come in a thread of their own, and Panel drops what changes in
        another one meanwhile.
        """
        with self._turn:
            change()

    def _on_msg(self, ref: str, manager: Any, msg: Any) -> None:
        self.alone(lambda: super(Page, self)._on_msg(ref, manager, msg))


class View:
    """A page and its session.

    Parameters
    ----------
    opened : OpenedScene or OpenedMeasurement
        What is looked at.
    texts : dict, optional
        Knobs that are not at their first value, as a link has them.
    link : dict, optional
        What a link of this page says besides.
    uploads : str
        How large a file may be that is uploaded, in words; empty where none may.
    embedded : bool
        Whether it is part of another page, such as a notebook's.
    """

    def __init__(
        self,
        opened: OpenedScene | OpenedMeasurement,
        texts: dict[str, str] | None = None,
        link: dict[str, str] | None = None,
        uploads: str = "",
        embedded: bool = False,
    ) -> None:
        self._link, self._embedded = link or {}, embedded
        listener = Listener(
            picture=lambda number, picture: self._later(lambda: self._show(number, picture)),
            readout=lambda picture, found: self._later(lambda: self._tell(picture, found)),
            drawn=lambda drawn: self._later(lambda: self._show_drawn(drawn)),
            progress=self._tell_progress,
            failed=lambda text: self._later(lambda: self._say(text, "error")),
        )
        self.session = Session(opened, listener)
        refused = self._restore(texts or {})
        scene = opened.scene if isinstance(opened, OpenedScene) else None
        pixels = opened.measurement if isinstance(opened, OpenedMeasurement) else None
        source = scene or pixels
        assert source is not None
        names = IMAGES if scene is not None else ("measured",)
        self.figures = Figures(source.raster, source.tool, self.session.knobs, names)
        self._document: Document | None = None
        self._loop: AbstractEventLoop | None = None
        self._handled = 0
        self._began = 0.0
        self._picture: Picture | None = None
        self._drawn: Drawn | None = None
        self.page = Page(
            spec=json.dumps(self._spec(opened, uploads)),
            sizing_mode="stretch_width",
            **{
                f"{name}_figure": pn.pane.Bokeh(one, sizing_mode="fixed", margin=0)
                for name, one in (
                    *((name, image.figure) for name, image in self.figures.images.items()),
                    *self.figures.lines.items(),
                )
            },
        )
        self._refused = refused
        self._listen()

    def start(self, document: Document | None) -> None:
        """Say in which document the results of other threads are shown; None of a notebook's."""
        self._document = document
        if document is None:
            with suppress(RuntimeError):  # no notebook's kernel, nothing that shows the page
                self._loop = get_running_loop()

    def _ready(self) -> None:
        """Fill a page that is there now, and compute its picture."""
        self._put_values()
        text = self._refused or "Computing the first picture."
        self._say(text, "error" if self._refused else "busy")
        self.session.show()

    def _send(self, kind: str, content: Any) -> None:
        self.page._send_msg({"kind": kind, "content": content})

    def _restore(self, texts: dict[str, str]) -> str:
        """Turn the knobs as a link says; what is wrong with it, or nothing.

        What is right of a link counts even if something else is wrong.
        """
        model, knobs = self.session.model, self.session.knobs
        refused = ""
        try:
            knobs = model.turned(knobs, texts)
        except ValueError:
            for name, text in texts.items():
                try:
                    knobs = model.turned(knobs, {name: text})
                except ValueError as error:
                    refused = refused or f"Link: {error}"
        self.session.knobs = knobs
        return refused

    def _listen(self) -> None:
        def received(event: Any) -> None:
            with unlocked():  # one answer, that the browser draws once
                self._receive(event.data)

        self.page.on_msg(received)
        for image in self.figures.images.values():
            image.figure.on_event(Tap, self._tapped)
            image.figure.on_event(PanEnd, lambda _: self._turn({}, True))
        sources = {CURSOR: self.figures.cursor, **self.figures.ends}
        for name, source in sources.items():
            source.on_change("data", self._dragged(name, source))

    def _tapped(self, event: Any) -> None:
        self._turn({CURSOR: f"{event.x:.1f},{event.y:.1f}"}, True)
        self.figures.set_places(self.session.knobs)

    def _dragged(self, name: str, source: Any) -> Callable[..., None]:
        def moved(attribute: str, old: Any, new: Any) -> None:
            points = self.session.knobs.points(name)
            kept = ";".join(f"{1e6 * x:.1f},{1e6 * y:.1f}" for x, y in points)
            if places(source) != kept:
                self._turn({name: places(source)}, False)

        return moved

    def _receive(self, message: dict[str, Any]) -> None:
        """Do what the page's message says."""
        self._handled = int(message["n"])
        if "ready" in message:
            self._ready()
        elif "painted" in message:
            self.session.painted(int(message["painted"]))
        elif "turn" in message:
            self._turn(message["turn"], bool(message["final"]))
        elif "undo" in message:
            self.session.undo()
            self._turned()
        elif "theme" in message:
            self.figures.set_theme(str(message["theme"]))
            self._put_values()
        elif "view" in message:
            self._view(str(message["view"]))
            self._put_values()
        elif "save" in message:
            self._save(str(message["save"]))
        elif "draw" in message:
            self._tell_progress(0.0)
            self.session.draw(PHASES, TEXTURES)
        elif "cancel" in message:
            self.session.cancel()
            self._say("The drawing was cancelled.", "")

    def _turn(self, texts: dict[str, str], final: bool) -> None:
        try:
            self.session.turn(texts, final)
        except ValueError as error:
            self._say(str(error), "error", invalid=list(texts))
            return
        self._turned()

    def _turned(self) -> None:
        self._refused = ""
        self._began = perf_counter()
        self.figures.set_places(self.session.knobs)
        self._put_values()

    def _view(self, name: str) -> None:
        knobs = self.session.knobs
        if name == "whole":
            self.figures.view(None)
            return
        ends = {"rake": knobs.rake_line, "band": knobs.band_line}
        points = ends.get(name, (knobs.cursor,))
        x, y = (sum(point[axis] for point in points) / len(points) for axis in (0, 1))
        self.figures.view((x, y), _VIEW_WIDTH)

    def _save(self, what: str) -> None:
        # Only who saves something waits for Matplotlib.
        from chipglow.app.files import figure_file, measurement_file, study_file

        model, picture = self.session.model, self._picture
        if not isinstance(model, SceneModel):
            return
        if what == "study":
            data, name, kind = study_file(model, self.session.knobs), "study.yaml", "text/yaml"
        elif picture is None or picture.coarse or picture.knobs != self.session.knobs:
            self._say("The exact picture is not there yet: save it when it is.", "error")
            return
        elif what == "figure":
            data = figure_file(picture, model, self.figures.seen, self._drawn)
            name, kind = "chipglow.png", "image/png"
        else:
            data, name, kind = (
                measurement_file(picture, model),
                "measurement.nc",
                "application/x-netcdf",
            )
        text = b64encode(data).decode()
        self._send("download", {"name": name, "type": kind, "data": text})
        self._say(f"{name} is saved.", "")

    def _show(self, number: int, picture: Picture) -> None:
        self._picture, self._drawn = picture, None
        self.figures.show(picture)
        self.figures.show_drawn(None)
        assert picture.scene is not None or picture.errors is None
        if picture.coarse:
            step = picture.exposures[0].raster.spacing
            finer = picture.knobs.pitch < picture.raster.spacing
            what = "samples and pixels" if finer else "samples"
            text = f"Quick look on {what} of {1e6 * step:.3g} µm; the exact picture follows."
        else:
            text = "Exact picture."
            if self._began:
                took = 1e3 * (perf_counter() - self._began)
                text = f"Exact picture, {took:.0f} ms after the last change."
        if self._refused and not picture.coarse:
            self._say(self._refused, "error")
        else:
            self._say(text, "busy" if picture.coarse else "")
        self._send("picture", {"number": number, "lines": self.figures.line_data(picture)})

    def _tell(self, picture: Picture, found: Readout) -> None:
        """Numbers at the cursor."""
        errors = picture.errors
        x, y = picture.knobs.cursor
        rows = [("x, y", _signed(f"{1e6 * x:.1f}, {1e6 * y:.1f} µm"), "")]
        if errors is not None:
            rows += [
                ("true temperature", _celsius(found.true), "Of the scene's sample, in the middle"),
                ("emissivity", rounded_text(found.emissivity), "Of the same sample"),
                ("reference", _celsius(found.reference), "Greatest radiance temperature in pixel"),
            ]
        rows.append(("measured", self._measured_text(found), found.source))
        if errors is None or found.parts is None:
            self._put_numbers(rows, [])
            return
        error = found.measured - found.reference
        rows.append(("error", _kelvins(error), "Measured less reference"))
        parts = []
        for name, label, tip, kind in _PARTS:
            image = getattr(found.parts, name)
            if image is None or (
                name == "detector" and picture.camera and not picture.camera.detector
            ):
                continue
            value = float(nearest(image, picture.raster, picture.knobs.cursor))
            known = isfinite(value)
            parts.append(
                {
                    "label": label,
                    "kelvin": value if known else None,
                    "text": _kelvins(value),
                    "tip": tip,
                    "kind": kind,
                }
            )
        self._put_numbers(rows, parts)

    def _measured_text(self, found: Readout) -> str:
        if not isfinite(found.measured):
            return "–"
        text = _celsius(found.measured)
        if isfinite(found.uncertainty):
            text = _with_uncertainty(found.measured - KELVIN, found.uncertainty)
        return f"{text} (under range)" if found.flagged else text

    def _put_numbers(self, rows: list[tuple[str, str, str]], parts: list[dict[str, Any]]) -> None:
        note = "They sum to the error; ± is the standard uncertainty (k = 1)." if parts else ""
        self._send("numbers", {"rows": rows, "parts": parts, "note": note})

    def _show_drawn(self, drawn: Drawn) -> None:
        if drawn.knobs != self.session.knobs:
            return
        self._drawn = drawn
        self.figures.show_drawn(drawn)
        if drawn.error is None:
            self._say("Drawn: shaded is the range of the draws.", "")
            return
        found = drawn.error
        self._say(
            f"Error at the cursor over {found.draws} draws: {_kelvins(found.mean)}, sample "
            f"standard deviation {found.standard_deviation:.1f} K, {_kelvins(found.range[0])} to "
            f"{_kelvins(found.range[1])}. Shaded: the range along the lines.",
            "",
        )

    def _tell_progress(self, done: float) -> None:
        self._later(lambda: self._say("Drawing phases and textures.", "busy", done))

    def _say(
        self, text: str, kind: str, progress: float | None = None, invalid: list[str] | None = None
    ) -> None:
        said = {"text": text, "kind": kind, "progress": progress, "invalid": invalid or []}
        self._send("status", said)

    def _put_values(self) -> None:
        knobs, panel = self.session.knobs, self.session.model.panel
        values = {knob.name: knob.number(getattr(knobs, knob.name)) for knob in panel.knobs}
        for name in (CURSOR, *LINES):
            points = knobs.points(name)
            values[name] = "; ".join(f"{1e6 * x:.1f}, {1e6 * y:.1f}" for x, y in points)
        visible = [knob.name for knob in panel.knobs if counts(knob, knobs)]
        content = {
            "n": self._handled,
            "values": values,
            "visible": visible,
            "can_undo": self.session.can_undo,
            "link": {**self._link, **panel.texts(knobs)},
        }
        self._send("values", content)

    def _spec(self, opened: OpenedScene | OpenedMeasurement, uploads: str) -> dict[str, Any]:
        is_scene = isinstance(opened, OpenedScene)
        views = {"whole": "Whole view", "cursor": "Cursor"}
        if is_scene:
            views |= {"rake": "Rake face", "band": "Shear band"}
        titles = {
            "scene": "Scene",
            "measured": "Measured radiance temperature",
            "error": "Error",
            "rake_line": "Along the first line",
            "band_line": "Along the second line",
        }
        return {
            "name": opened.name,
            "embedded": self._embedded,
            "uploads": uploads,
            "knobs": [_described(knob) for knob in self.session.model.panel.knobs],
            "views": list(views.items()),
            "figures": [*self.figures.images, *self.figures.lines],
            "shape": self.figures.shape,
            "titles": titles,
            "draws": f"{PHASES}² positions of the pixels, {TEXTURES} textures" if is_scene else "",
        }

    def _later(self, show: Callable[[], None]) -> None:
        """Show something that another thread found."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self.page.alone, show)
            return
        if self._document is None:
            show()
            return

        def together() -> None:
            with unlocked():  # one message, that the browser draws once
                show()

        try:
            self._document.add_next_tick_callback(together)
        except RuntimeError:  # the page was closed meanwhile
            self.session.end()


def _described(knob: Knob) -> dict[str, Any]:
    """A knob as page.js has it."""
    unit = {"um": "µm", "us": "µs", "degC": "°C"}
    written = knob.quantity.unit if knob.quantity else ""
    return {
        "name": knob.name,
        "label": knob.label,
        "group": knob.group,
        "unit": unit.get(written, written),
        "low": knob.low,
        "high": knob.high,
        "step": knob.step,
        "stops": [float(knob.number(stop)) for stop in knob.stops],
        "choices": list(knob.choices.items()) if knob.choices else None,
        "optional": knob.optional,
    }


def _celsius(kelvins: float) -> str:
    return _signed(f"{kelvins - KELVIN:.1f} °C") if isfinite(kelvins) else "–"


def _with_uncertainty(celsius: float, uncertainty: float) -> str:
    """Both to the second digit that counts in the uncertainty, and at least to 0.1 °C."""
    size = floor(log10(uncertainty)) if uncertainty > 0 else 0
    digits = min(max(1 - size, 1), 4)
    return _signed(f"{celsius:.{digits}f} ± {uncertainty:.{digits}f} °C")


def _kelvins(kelvins: float) -> str:
    return _signed(f"{kelvins:+.1f} K") if isfinite(kelvins) else "–"


def _signed(text: str) -> str:
    return text.replace("-", "−")
