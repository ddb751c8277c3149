"""The page: a session and its figures as a Panel component, see page.js."""

import json
from asyncio import AbstractEventLoop, get_running_loop
from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from itertools import groupby
from math import isfinite
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any, ClassVar, Final

import numpy as np
import panel as pn
import param
from bokeh.document import Document
from jinja2 import Environment, PackageLoader
from panel.custom import Children, JSComponent
from panel.io import unlocked

from chipglow.app.controls import Texts
from chipglow.app.figures import TITLES, Figures
from chipglow.app.opening import MOST_UPLOADED, Opened, OpenedScene, OpenFiles
from chipglow.app.pictures import Drawn, Picture, Readout, SceneModel
from chipglow.app.session import PHASES, TEXTURES, Newest, Session
from chipglow.drawing.drawing import data_url, draw_chip, style
from chipglow.drawing.scales import KELVIN
from chipglow.quantities.format import quantity_text, rounded_text, uncertain_text
from chipglow.scene import Scene

_FOLDER: Final = Path(__file__).parent
_TEMPLATES: Final = Environment(
    loader=PackageLoader("chipglow.app"), autoescape=True, trim_blocks=True, lstrip_blocks=True
)
_PARTS: Final = (
    ("motion", "Motion", "Mean over the exposure minus its maximum"),
    ("footprint", "Footprint", "Mean over the pixel minus its hottest sample"),
    ("psf", "PSF", "Case 1 − case 2: with minus without the point spread function"),
    ("detector", "Detector", "Noise, counts and calibration"),
    ("texture", "of it: texture", "Error minus that without texture: part of the others"),
)


class Page(JSComponent):  # type: ignore[misc]
    """The page around the figures; it exchanges messages with `View`."""

    html = param.String()
    spec = param.String()
    figures = Children()

    _esm = (_FOLDER / "page.js").read_text(encoding="utf-8")
    _stylesheets: ClassVar[list[str]] = [(_FOLDER / "page.css").read_text(encoding="utf-8")]

    def __init__(self, **params: Any) -> None:
        self._message = RLock()
        super().__init__(**params)

    def alone(self, change: Callable[[], None]) -> None:
        """Change a notebook's page while no message comes: Panel drops changes made meanwhile."""
        with self._message:
            change()

    def _on_msg(self, ref: str, manager: Any, msg: Any) -> None:
        self.alone(lambda: super(Page, self)._on_msg(ref, manager, msg))


class View:
    """A page and its session; a link gives `texts` of controls and other parameters, `link`."""

    def __init__(
        self,
        opened: Opened,
        texts: Texts | None = None,
        link: Texts | None = None,
        files: OpenFiles | None = None,
        embedded: bool = False,
    ) -> None:
        self._link, self._files, self._embedded = link or {}, files, embedded
        self._upload: Path | None = None
        self._uploads = Newest(self._open, self._notified)
        self.session = Session(opened, self._notified)
        self._refused = self._restore(texts or {})
        self._is_scene = isinstance(opened, OpenedScene)
        shown = opened.scene if isinstance(opened, OpenedScene) else opened.measurement
        images = tuple(TITLES) if self._is_scene else ("measured",)
        self.figures = Figures(shown.raster, shown.tool, images)
        self._document: Document | None = None
        self._loop: AbstractEventLoop | None = None
        self._handled = 0
        self._began = 0.0
        self._picture: Picture | None = None
        self._drawn: Drawn | None = None
        panes = [
            pn.pane.Bokeh(one, sizing_mode="fixed", margin=0) for one in self.figures.all.values()
        ]
        self.page = Page(
            html=self._html(opened),
            spec=self._spec(opened),
            figures=panes,
            sizing_mode="stretch_width",
        )
        self.page.on_msg(self._receive)

    def start(self, document: Document | None) -> None:
        """Set the document in which results of other threads are shown; None for a notebook."""
        self._document = document
        if document is None:
            with suppress(RuntimeError):  # not in a notebook's kernel: nothing shows the page
                self._loop = get_running_loop()

    def end(self) -> None:
        """End the work for a page that was closed."""
        self.session.end()
        if self._upload is not None:
            self._upload.unlink(missing_ok=True)

    def _restore(self, texts: Texts) -> str:
        """Set the controls of a link that are possible; return what is wrong with the others."""
        try:
            self.session.restore(texts)
            return ""
        except ValueError:
            refused = ""
        for path, text in texts.items():
            try:
                self.session.restore({path: text})
            except ValueError as error:
                refused = refused or f"Link: {error}"
        return refused

    def _receive(self, event: Any) -> None:
        message = event.data
        self._handled = int(message["n"])
        with unlocked():  # one answer, that the browser draws once
            getattr(self, f"_on_{message['kind']}")(message.get("content"))

    def _notified(self, kind: str, *content: Any) -> None:
        self._later(lambda: getattr(self, f"_show_{kind}")(*content))

    def _on_ready(self, _: None) -> None:
        """Fill a page that has just been rendered, and compute its picture."""
        self._put_values()
        text = self._refused or "Computing the first picture."
        self._say(text, "error" if self._refused else "busy")
        self.session.show()

    def _on_change(self, change: dict[str, Any]) -> None:
        texts = change["texts"]
        try:
            self.session.change(texts, change["final"])
        except ValueError as error:
            self._say(str(error), "error", invalid=list(texts))
            return
        self._changed()

    def _on_step(self, forward: str) -> None:
        self.session.step(forward=bool(forward))
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
        self.session.draw()

    def _on_cancel(self, _: None) -> None:
        self.session.cancel()
        self._say("The drawing was cancelled.")

    def _on_save(self, name: str) -> None:
        # Matplotlib is imported only to save something.
        from chipglow.app.files import figure_file, measurement_file, study_file

        model, picture = self.session.model, self._picture
        assert isinstance(model, SceneModel)
        if name == "study.yaml":
            data = study_file(model, self.session.state)
        elif picture is None or picture.quick or picture.state != self.session.state:
            self._say("The exact picture is not finished: save it when it is.", "error")
            return
        elif name == "chipglow.png":
            data = figure_file(picture, model, self.figures.view, self._drawn)
        else:
            data = measurement_file(picture, model)
        self._send("download", {"name": name, "data": b64encode(data).decode()})
        self._say(f"{name} is saved.")

    def _on_piece(self, piece: dict[str, Any]) -> None:
        """Append a piece of an uploaded file; the last one opens it."""
        assert self._files is not None
        if self._upload is None or piece["first"]:
            self._upload = self._files.new_path()
        with self._upload.open("ab") as file:
            file.write(piece["data"])
            size = file.tell()
        if size > MOST_UPLOADED:
            self._upload.unlink()
        elif piece["last"]:
            self._uploads.ask((self._upload, piece["name"]))
            self._upload = None
        else:
            self._send("more", None)

    def _open(self, upload: tuple[Path, str]) -> None:
        path, name = upload
        assert self._files is not None
        try:
            key = self._files.add(path, name)
        except (ValueError, OSError):
            path.unlink(missing_ok=True)
            raise
        self._notified("opened", key)

    def _show_opened(self, key: str) -> None:
        self._send("open", key)

    def _show_picture(self, number: int, picture: Picture) -> None:
        self._picture, self._drawn = picture, None
        self.figures.show(picture)
        if picture.quick:
            assert picture.exposure
            spacing = picture.exposure.raster.spacing
            finer = picture.state.study.camera.pitch < picture.raster.spacing
            what = "samples and pixels" if finer else "samples"
            follows = f"Quick look on {what} of {1e6 * spacing:.3g} µm; the exact picture follows."
            self._say(follows, "busy")
        elif self._refused:
            self._say(self._refused, "error")
        else:
            took = f", {1e3 * (perf_counter() - self._began):.0f} ms after the last change"
            self._say(f"Exact picture{took if self._began else ''}.")
        # The page draws the curves after the images: that halves the time to the images.
        lines = {
            f"{name}_values": {key: curve.tolist() for key, curve in curves.items()}
            for name, curves in picture.lines.items()
        }
        self._send("picture", {"number": number, "lines": lines})

    def _show_readout(self, picture: Picture, readout: Readout) -> None:
        x, y = picture.state.cursor
        position = f"{1e6 * x:.1f}, {1e6 * y:.1f} µm".replace("-", "−")
        rows = [("x, y", position, ""), ("measured", _measured(readout), readout.source)]
        parts, known = [], readout.parts
        if known is not None:
            rows[1:1] = [
                ("true temperature", _celsius(readout.true), "Of the sample in mid-exposure"),
                ("emissivity", rounded_text(readout.emissivity), "Of the same sample"),
                ("reference", _celsius(readout.reference), "Maximum in the pixel"),
            ]
            rows.append(("error", _kelvins(known["case_1"]), "Measured minus reference"))
            shown = [part for part in _PARTS if part[0] in known]
            kelvins = [known[part[0]] for part in shown]
            bars = np.nan_to_num(kelvins)
            percents = 50 * bars / max(1e-9, np.abs(bars).max())
            parts = list(zip(shown, percents, map(_kelvins, kelvins), strict=True))
        template = _TEMPLATES.get_template("numbers.html")
        self._send("numbers", template.render(rows=rows, parts=parts))

    def _show_drawn(self, drawn: Drawn) -> None:
        if drawn.state != self.session.state or self._picture is None:
            return
        self._drawn = drawn
        self.figures.show_drawn(self._picture, drawn)
        if (error := drawn.error) is None:
            self._say("Drawn: the range of the draws is shaded.")
            return
        low, high = map(_kelvins, error.range)
        self._say(
            f"Error at the cursor over {error.draws} draws: {_kelvins(error.mean)}, sample "
            f"standard deviation {error.standard_deviation:.1f} K, {low} to {high}. Shaded: the "
            "range along the lines."
        )

    def _show_progress(self, done: float) -> None:
        self._say("Drawing phases and textures.", "busy", progress=done)

    def _show_failed(self, text: str) -> None:
        self._say(text, "error")

    def _send(self, kind: str, content: Any) -> None:
        self.page._send_msg({"kind": kind, "content": content})

    def _say(self, text: str, kind: str = "", **more: Any) -> None:
        self._send("status", {"text": text, "kind": kind, **more})

    def _put_values(self) -> None:
        session, controls = self.session, self.session.model.controls
        content = {
            "n": self._handled,
            "values": {
                row.path: row.shown(controls.value(row, session.state)) for row in controls.rows
            },
            "shown": [row.path for row in controls.rows if controls.is_shown(row, session.state)],
            "can_undo": session.can_undo,
            "can_redo": session.can_redo,
            "link": {**self._link, **session.state.texts},
        }
        self._send("values", content)

    def _html(self, opened: Opened) -> str:
        """Return the page without figures and numbers."""
        figures = self.figures
        rows = (row for row in opened.controls.rows if row.group)
        return _TEMPLATES.get_template("page.html").render(
            name=opened.name,
            is_scene=self._is_scene,
            embedded=self._embedded,
            may_upload=self._files is not None,
            groups=[(name, list(of)) for name, of in groupby(rows, lambda row: row.group)],
            images={name: one.figure.title.text for name, one in figures.images.items()},
            lines={name: one.figure.title.text for name, one in figures.lines.items()},
            draws=f"{PHASES}² positions of the pixels, {TEXTURES} textures",
            chip=_chip(opened.scene) if isinstance(opened, OpenedScene) else "",
        )

    def _spec(self, opened: Opened) -> str:
        """Return what page.js needs beside the page."""
        left, right, bottom, top = self.figures.extent
        return json.dumps(
            {
                "embedded": self._embedded,
                "most_uploaded": MOST_UPLOADED,
                "stops": {
                    row.path: [float(row.shown(stop)) for stop in row.stops]
                    for row in opened.controls.rows
                },
                "images": list(self.figures.images),
                "figures": list(self.figures.all),
                "extent": self.figures.extent,
                "shape": (top - bottom) / (right - left),
            }
        )

    def _later(self, show: Callable[[], None]) -> None:
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


def _measured(readout: Readout) -> str:
    """Return the measured temperature, to two digits of its uncertainty if that is known."""
    text = _celsius(readout.measured)
    if isfinite(readout.measured) and readout.uncertainty > 0:
        text = f"{uncertain_text(readout.measured - KELVIN, readout.uncertainty)} °C"
    return f"{text} (under range)" if readout.flagged and isfinite(readout.measured) else text


def _celsius(kelvins: float) -> str:
    return quantity_text(kelvins - KELVIN if isfinite(kelvins) else None, "°C", 1)


def _kelvins(kelvins: float) -> str:
    return quantity_text(kelvins if isfinite(kelvins) else None, "K", 1, "+")


def _chip(scene: Scene) -> str:
    """Return a picture of the whole chip as the address of a PNG; empty without one."""
    if scene.overview is None:
        return ""
    file = BytesIO()
    with style():
        draw_chip(scene.overview, scene.raster, scene.tool).savefig(file, dpi=110)
    return data_url(file.getvalue())
