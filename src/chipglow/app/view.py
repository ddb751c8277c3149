"""The page: a session and its figures as a Panel component, see page.js."""

import json
from asyncio import AbstractEventLoop, get_running_loop
from base64 import b64encode
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import floor, isfinite, log10
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any, ClassVar, Final

import panel as pn
import param
from bokeh.document import Document
from panel.custom import Children, JSComponent
from panel.io import unlocked

from chipglow.app.controls import CURSOR, Control
from chipglow.app.figures import TITLES, Figures, line_data
from chipglow.app.model import Drawn, Picture, Readout, SceneModel
from chipglow.app.opening import Opened, OpenedScene
from chipglow.app.session import Session
from chipglow.drawing.scales import KELVIN
from chipglow.quantities.format import rounded_text
from chipglow.scene.lines import nearest

PHASES: Final = 3
TEXTURES: Final = 5
"""Draws of "Draw phases and textures": as many as in the paper's study."""

_FOLDER: Final = Path(__file__).parent

_PARTS: Final = (
    ("motion", "Motion", "Mean over the exposure minus its maximum", ""),
    ("footprint", "Footprint", "Mean over the pixel minus its hottest sample", ""),
    ("psf", "PSF", "Case 1 − case 2: with minus without the point spread function", ""),
    ("detector", "Detector", "Noise, counts and calibration", ""),
    ("texture", "of it: texture", "Error minus that without texture: part of the others", "within"),
)
_SAVES: Final = (
    ("study", "study.yaml", "Save the settings as a study"),
    ("figure", "Figure", "Save the images and lines as PNG"),
    ("netcdf", "NetCDF", "Save the measurement and its error"),
)


class Page(JSComponent):  # type: ignore[misc]
    """The page around the figures; it exchanges messages with `View`."""

    spec = param.String()
    figures = Children()

    _esm = (_FOLDER / "page.js").read_text(encoding="utf-8")
    _stylesheets: ClassVar[list[str]] = [(_FOLDER / "page.css").read_text(encoding="utf-8")]

    def __init__(self, **params: Any) -> None:
        self._message = RLock()
        super().__init__(**params)

    def alone(self, change: Callable[[], None]) -> None:
        """Change a notebook's page while it receives no message.

        Messages of a notebook may come in another thread, and Panel drops changes made meanwhile.
        """
        with self._message:
            change()

    def _on_msg(self, ref: str, manager: Any, msg: Any) -> None:
        self.alone(lambda: super(Page, self)._on_msg(ref, manager, msg))


class View:
    """A page and its session.

    A link gives `texts` of controls and other parameters, `link`; `uploads` is the maximum size of
    an uploaded file, empty if none is accepted; `embedded` marks a part of another page.
    """

    def __init__(
        self,
        opened: Opened,
        texts: Mapping[str, str] | None = None,
        link: Mapping[str, str] | None = None,
        uploads: str = "",
        embedded: bool = False,
    ) -> None:
        self._link, self._embedded = link or {}, embedded
        self.session = Session(opened, self._notified)
        self._refused = self._restore(texts or {})
        source = opened.scene if isinstance(opened, OpenedScene) else opened.measurement
        images = tuple(TITLES) if isinstance(opened, OpenedScene) else ("measured",)
        self.figures = Figures(source.raster, source.tool, images)
        self._document: Document | None = None
        self._loop: AbstractEventLoop | None = None
        self._handled = 0
        self._began = 0.0
        self._picture: Picture | None = None
        self._drawn: Drawn | None = None
        panes = [
            pn.pane.Bokeh(one, sizing_mode="fixed", margin=0) for one in self.figures.all.values()
        ]
        spec = json.dumps(self._spec(opened, uploads))
        self.page = Page(spec=spec, figures=panes, sizing_mode="stretch_width")
        self.page.on_msg(self._receive)

    def start(self, document: Document | None) -> None:
        """Set the document in which results of other threads are shown; None for a notebook."""
        self._document = document
        if document is None:
            with suppress(RuntimeError):  # not in a notebook's kernel: nothing shows the page
                self._loop = get_running_loop()

    def _restore(self, texts: Mapping[str, str]) -> str:
        """Set the controls of a link that are possible; return what is wrong with the others."""
        refused = ""
        try:
            self.session.restore(texts)
        except ValueError:
            for path, text in texts.items():
                try:
                    self.session.restore({path: text})
                except ValueError as error:
                    refused = refused or f"Link: {error}"
        return refused

    def _receive(self, event: Any) -> None:
        """Answer a message of the page."""
        message = event.data
        self._handled = int(message["n"])
        with unlocked():  # one answer, that the browser draws once
            getattr(self, f"_on_{message['kind']}")(message.get("content"))

    def _notified(self, kind: str, *content: Any) -> None:
        """Show a result of another thread."""
        self._later(lambda: getattr(self, f"_show_{kind}")(*content))

    def _on_ready(self, _: None) -> None:
        """Fill a page that has just been rendered, and compute its picture."""
        self._put_values()
        text = self._refused or "Computing the first picture."
        self._say(text, "error" if self._refused else "busy")
        self.session.show()

    def _on_change(self, texts: dict[str, str], final: bool = True) -> None:
        try:
            self.session.change(texts, final)
        except ValueError as error:
            self._say(str(error), "error", invalid=list(texts))
            return
        self._changed()

    def _on_move(self, texts: dict[str, str]) -> None:
        self._on_change(texts, final=False)

    def _on_step(self, forward: bool) -> None:
        self.session.step(forward)
        self._changed()

    def _changed(self) -> None:
        self._refused = ""
        self._began = perf_counter()
        self._put_values()

    def _on_painted(self, number: int) -> None:
        self.session.painted(number)

    def _on_theme(self, theme: str) -> None:
        self.figures.set_theme(theme)

    def _on_draw(self, _: None) -> None:
        self._show_progress(0.0)
        self.session.draw(PHASES, TEXTURES)

    def _on_cancel(self, _: None) -> None:
        self.session.cancel()
        self._say("The drawing was cancelled.", "")

    def _on_save(self, kind: str) -> None:
        # Matplotlib is imported only to save something.
        from chipglow.app.files import figure_file, measurement_file, study_file

        model, picture = self.session.model, self._picture
        assert isinstance(model, SceneModel)
        if kind == "study":
            data, name = study_file(model, self.session.state), "study.yaml"
        elif picture is None or picture.quick or picture.state != self.session.state:
            self._say("The exact picture is not finished: save it when it is.", "error")
            return
        elif kind == "figure":
            data = figure_file(picture, model, self.figures.view, self._drawn)
            name = "chipglow.png"
        else:
            data, name = measurement_file(picture, model), "measurement.nc"
        types = {"study": "text/yaml", "figure": "image/png", "netcdf": "application/x-netcdf"}
        content = {"name": name, "type": types[kind], "data": b64encode(data).decode()}
        self._send("download", content)
        self._say(f"{name} is saved.", "")

    def _show_picture(self, number: int, picture: Picture) -> None:
        self._picture, self._drawn = picture, None
        self.figures.show(picture)
        self.figures.show_drawn(picture, None)
        if picture.quick:
            spacing = picture.exposures[0].raster.spacing
            finer = picture.state.study.camera.pitch < picture.raster.spacing
            what = "samples and pixels" if finer else "samples"
            text = f"Quick look on {what} of {1e6 * spacing:.3g} µm; the exact picture follows."
        else:
            took = f", {1e3 * (perf_counter() - self._began):.0f} ms after the last change"
            text = f"Exact picture{took if self._began else ''}."
        if self._refused and not picture.quick:
            self._say(self._refused, "error")
        else:
            self._say(text, "busy" if picture.quick else "")
        self._send("picture", {"number": number, "lines": line_data(picture)})

    def _show_readout(self, picture: Picture, found: Readout) -> None:
        x, y = picture.state.cursor
        rows = [("x, y", _minus(f"{1e6 * x:.1f}, {1e6 * y:.1f} µm"), "")]
        measured = ("measured", _measured(found), found.source)
        if found.parts is None:
            self._send("numbers", {"rows": [*rows, measured], "parts": [], "note": ""})
            return
        error = found.measured - found.reference
        rows += [
            ("true temperature", _celsius(found.true), "Of the scene's sample in mid-exposure"),
            ("emissivity", rounded_text(found.emissivity), "Of the same sample"),
            ("reference", _celsius(found.reference), "Maximum radiance temperature in the pixel"),
            measured,
            ("error", _kelvins(error), "Measured minus reference"),
        ]
        parts = []
        for name, label, tip, kind in _PARTS:
            image = found.parts.get(name)
            without = name == "detector" and picture.camera and not picture.camera.detector
            if image is None or without:
                continue
            value = float(nearest(image.values, picture.raster, picture.state.cursor))
            kelvin = value if isfinite(value) else None
            parts.append(
                {
                    "label": label,
                    "kelvin": kelvin,
                    "text": _kelvins(value),
                    "tip": tip,
                    "kind": kind,
                }
            )
        note = "They sum to the error; ± is the standard uncertainty (k = 1)."
        self._send("numbers", {"rows": rows, "parts": parts, "note": note})

    def _show_drawn(self, drawn: Drawn) -> None:
        if drawn.state != self.session.state or self._picture is None:
            return
        self._drawn = drawn
        self.figures.show_drawn(self._picture, drawn)
        if drawn.error is None:
            self._say("Drawn: the range of the draws is shaded.", "")
            return
        error = drawn.error
        low, high = map(_kelvins, error.range)
        self._say(
            f"Error at the cursor over {error.draws} draws: {_kelvins(error.mean)}, sample "
            f"standard deviation {error.standard_deviation:.1f} K, {low} to {high}. Shaded: the "
            "range along the lines.",
            "",
        )

    def _show_progress(self, done: float) -> None:
        self._say("Drawing phases and textures.", "busy", done)

    def _show_failed(self, text: str) -> None:
        self._say(text, "error")

    def _send(self, kind: str, content: Any) -> None:
        self.page._send_msg({"kind": kind, "content": content})

    def _say(
        self, text: str, kind: str, progress: float | None = None, invalid: list[str] | None = None
    ) -> None:
        content = {"text": text, "kind": kind, "progress": progress, "invalid": invalid or []}
        self._send("status", content)

    def _put_values(self) -> None:
        session, controls = self.session, self.session.model.controls
        content = {
            "n": self._handled,
            "values": controls.values(session.state),
            "shown": [row.path for row in controls.rows if controls.is_shown(row, session.state)],
            "can_undo": session.can_undo,
            "can_redo": session.can_redo,
            "link": {**self._link, **session.state.texts},
        }
        self._send("values", content)

    def _spec(self, opened: Opened, uploads: str) -> dict[str, Any]:
        is_scene = isinstance(opened, OpenedScene)
        left, right, bottom, top = self.figures.extent
        views = {"whole": "Whole view", CURSOR: "Cursor"}
        if is_scene:
            views |= {"rake_line": "Rake face", "band_line": "Shear band"}
        titles = {name: one.title.text for name, one in self.figures.all.items()}
        return {
            "name": opened.name,
            "embedded": self._embedded,
            "uploads": uploads,
            "rows": [_described(row) for row in self.session.model.controls.rows],
            "saves": _SAVES if is_scene else (),
            "views": list(views.items()),
            "images": list(self.figures.images),
            "figures": list(titles.items()),
            "extent": self.figures.extent,
            "shape": (top - bottom) / (right - left),
            "draws": f"{PHASES}² positions of the pixels, {TEXTURES} textures" if is_scene else "",
        }

    def _later(self, show: Callable[[], None]) -> None:
        """Show the result of another thread."""
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


def _described(row: Control) -> dict[str, Any]:
    """Return a control as page.js needs it."""
    options = [(word, option.label) for word, option in row.options.items()]
    return {
        "path": row.path,
        "label": row.label,
        "group": row.group,
        "unit": row.unit,
        "low": row.low,
        "high": row.high,
        "step": row.step,
        "stops": [float(row.number(stop)) for stop in row.stops],
        "options": options or None,
        "optional": row.optional,
    }


def _measured(found: Readout) -> str:
    """Return the measured temperature to two digits of its uncertainty, at least to 0.1 °C."""
    text = _celsius(found.measured)
    if isfinite(found.measured) and isfinite(found.uncertainty):
        size = floor(log10(found.uncertainty)) if found.uncertainty > 0 else 0
        digits = min(max(1 - size, 1), 4)
        celsius = found.measured - KELVIN
        text = _minus(f"{celsius:.{digits}f} ± {found.uncertainty:.{digits}f} °C")
    return f"{text} (under range)" if found.flagged and isfinite(found.measured) else text


def _celsius(kelvins: float) -> str:
    return _minus(f"{kelvins - KELVIN:.1f} °C") if isfinite(kelvins) else "–"


def _kelvins(kelvins: float) -> str:
    return _minus(f"{round(kelvins, 1) + 0.0:+.1f} K") if isfinite(kelvins) else "–"


def _minus(text: str) -> str:
    return text.replace("-", "−")
