"""The page: a session and its figures as a Panel component, see page.js."""

import logging
from asyncio import AbstractEventLoop, get_running_loop
from base64 import b64encode
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from math import hypot, isfinite
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any, ClassVar, Final, get_args

import numpy as np
import panel as pn
import param
from bokeh.document import Document
from jinja2 import Environment, PackageLoader
from panel.custom import Child, Children, JSComponent

from chipglow import __version__
from chipglow.analysis.attribution import AttributionReference
from chipglow.analysis.images import PARTS
from chipglow.app.asking import description_path
from chipglow.app.controls import CORRECTION, ERROR_IMAGES, WHOLE, Texts, rounded
from chipglow.app.correction_settings import correction_data, correction_texts, given_texts
from chipglow.app.figures import TEXT, Figures
from chipglow.app.frames_model import MeasurementModel
from chipglow.app.measuring import Measuring
from chipglow.app.models import Model
from chipglow.app.opened import Opened
from chipglow.app.opening import MOST_UPLOADED, OpenFiles
from chipglow.app.pictures import Drawn, Picture
from chipglow.app.scene_model import SceneModel
from chipglow.app.session import PHASES, TEXTURES, Newest, Session
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.quantities.format import quantity_text, readable, rounded_text, uncertain_decimals

_FOLDER: Final = Path(__file__).parent
_DROPPER_STYLE: Final = """
.filepond--root { margin: 0; font: inherit; min-height: 28px; }
.filepond--root .filepond--drop-label { min-height: 28px; color: inherit; }
.filepond--drop-label label { padding: 2px; font-size: 12px; }
.filepond--panel-root { background-color: rgba(128, 128, 128, 0.12); border: 1px dashed #8a9099; }
"""
"""The drop area as high as the buttons next to it, in either theme."""

_VIEW_WIDTH: Final = 160.0
_VIEW_SAMPLES: Final = 40
"""Smallest width of the view of a place in µm, and in pixels or samples."""

_SHOWN_SOURCES: Final = 3
"""Sources of uncertainty at the cursor with a separate bar."""

_log = logging.getLogger(__name__)


class Page(JSComponent):  # type: ignore[misc]
    """The page around the figures; it exchanges messages with `PageView`."""

    html = param.String()
    figures = Children()
    panels = Children()
    tools = Child()
    dropper = Child()

    _esm = (_FOLDER / "page.js").read_text(encoding="utf-8")
    _stylesheets: ClassVar[list[str]] = [(_FOLDER / "page.css").read_text(encoding="utf-8")]

    def __init__(self, **params: Any) -> None:
        self._message = RLock()
        super().__init__(**params)

    def alone(self, change: Callable[[], None]) -> None:
        """Change a page without a document while no message and no other change comes.

        Panel drops what is changed while a message comes.
        """
        with self._message:
            change()

    def _on_msg(self, ref: str, manager: Any, msg: Any) -> None:
        self.alone(lambda: super(Page, self)._on_msg(ref, manager, msg))


class PageView:
    """A page and its session; a link gives `texts` of controls and other parameters, `link`."""

    def __init__(
        self,
        opened: Model,
        texts: Texts | None = None,
        link: Texts | None = None,
        files: OpenFiles | None = None,
        embedded: bool = False,
    ) -> None:
        self._link, self._files = link or {}, files
        self._uploads = Newest(self._open, self._notified)
        self.session = Session(opened, self._notified)
        self._refused = ""
        try:
            self.session.restore({**_session_texts(opened), **(texts or {})})
        except ValueError as error:
            self._refused = f"Link: {error}"
        self.figures = Figures(opened.raster, opened.tool, opened.images)
        images = {name: one.figure for name, one in self.figures.images.items()}
        model, state = self.session.model, self.session.state
        self.opened = Opened(opened.name, opened.source, opened.notes, images, model.frames(state))
        know = self.session.know
        self.measuring = Measuring(self.opened, self._later, self._say, know, self._send)
        self._document: Document | None = None
        self._loop: AbstractEventLoop | None = None
        self._show_opened = partial(self._send, "open")
        self._show_failed = partial(self._say, kind="error")
        self._handled = 0
        self._began = 0.0
        self._picture: Picture | None = None
        self._lines: dict[str, dict[str, Array]] = {}
        self._messages: list[dict[str, Any]] = []
        self._panels = pn.Column(sizing_mode="stretch_width", margin=0)
        self.page = Page(
            html=_html(opened, self.figures, files is not None, embedded),
            figures=[
                pn.pane.Bokeh(one, sizing_mode="fixed", margin=0)
                for one in self.figures.all.values()
            ],
            panels=[self._panels],
            tools=self.measuring.tools,
            dropper=self._dropper() if files is not None else None,
            sizing_mode="stretch_width",
        )
        self.page.on_msg(self._receive)

    def start(self, document: Document | None) -> None:
        """Set the document in which results of other threads are shown; None for a notebook.

        Places of a session are restored, and a frame of a file is drawn at once, so that the
        browser has it with the page.
        """
        self._document = document
        if document is None:
            with suppress(RuntimeError):  # not in a notebook's kernel: nothing shows the page
                self._loop = get_running_loop()
        model = self.session.model
        try:
            if model.places is not None:
                self.measuring.restore(model.places)
        except ValueError as error:
            self._refused = f"Session: {error}"
        if not isinstance(model, SceneModel):
            with suppress(ValueError, OSError):  # stated when the page is ready
                self._draw(model.picture(self.session.state))

    def end(self) -> None:
        """End the work for a page that was closed."""
        self.session.end()
        self.measuring.end()

    def _dropper(self) -> pn.widgets.FileDropper:
        """Return where files are dropped."""
        dropper = pn.widgets.FileDropper(
            max_file_size=f"{MOST_UPLOADED // 1024**2}MB", layout="compact", previews=[],
            width=230, margin=0, stylesheets=[_DROPPER_STYLE],
        )  # fmt: skip
        dropper.param.watch(lambda event: self._on_dropped(event.new), "value")
        return dropper

    # Messages of the page

    def _receive(self, event: Any) -> None:
        self._later(lambda: self._act(event.data))

    @property
    def _handlers(self) -> Mapping[str, Callable[[Any], None]]:
        """Functions that answer messages of the page, by kind; KeyError for other kinds."""
        return {
            "ready": self._on_ready,
            "change": self._on_change,
            "step": self._on_step,
            "draw": self._on_draw,
            "cancel": self._on_cancel,
            "chip": self._on_chip,
            "save": self._on_save,
            "painted": self._on_painted,
            "tools": lambda _: self.measuring.offer_tools(),
            "table": lambda _: self.measuring.show_table(),
            "curves": lambda _: self.measuring.show_curves(),
            "theme": self._on_theme,
        }

    def _on_painted(self, number: int) -> None:
        """Note that a picture is shown; after the first one the page gets what stands below."""
        self.session.painted(number)
        if not len(self._panels):
            self._panels.append(self.measuring.panel)

    def _on_theme(self, theme: str) -> None:
        self.figures.set_theme(theme)
        self.measuring.set_theme(theme)

    def _act(self, message: dict[str, Any]) -> None:
        self._handled = int(message["n"])
        self._handlers[message["kind"]](message.get("content"))

    def _notified(self, kind: str, *content: Any) -> None:
        self._later(lambda: getattr(self, f"_show_{kind}")(*content))

    def _reported(self, act: Callable[[], None]) -> None:
        """Do something and send its messages as one; a failure is shown on the page."""
        try:
            act()
        except Exception as error:  # a defect: it must not leave the page waiting
            _log.exception("chipglow app")
            self._say(f"Defect: {type(error).__name__}: {error}", "error")
        if self._messages:
            messages, self._messages = self._messages, []
            self.page._send_msg(messages)

    def _on_ready(self, _: None) -> None:
        """Fill a page that has just been rendered, and compute its picture."""
        self._lines = {}
        self._messages.clear()  # of a frame that was drawn before: all is sent again
        self._put_values()
        text = self._refused or "Computing the first picture."
        self._say(text, "error" if self._refused else "busy")
        self.measuring.show_again()
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

    def _on_draw(self, _: None) -> None:
        self._show_progress(0.0)
        self.session.draw()

    def _on_cancel(self, _: None) -> None:
        self.session.cancel()
        self._say("The computation was cancelled.")

    def _on_chip(self, theme: str) -> None:
        from chipglow.app.files import chip_picture  # Matplotlib takes long to import

        assert isinstance(self.session.model, SceneModel)
        self._send("chip", chip_picture(self.session.model.scene, TEXT[theme]))

    def _on_save(self, name: str) -> None:
        from chipglow.app.files import measurement_file, study_file

        model, picture = self.session.model, self._picture
        if isinstance(model, MeasurementModel):
            data = model.description.encode()
        elif not isinstance(model, SceneModel):
            return
        elif name == "study.yaml":
            data = study_file(model, self.session.state)
        elif picture is None or picture.quick or picture.state != self.session.state:
            self._say("The exact picture is not ready; save again when it is shown.", "error")
            return
        else:
            data = measurement_file(picture, model)
        url = f"data:application/octet-stream;base64,{b64encode(data).decode()}"
        self._send("download", {"name": name, "url": url})
        self._say(f"{name} is saved.")

    def _on_dropped(self, files: Mapping[str, bytes | str]) -> None:
        """Open the file that was dropped; the browser then loads its page."""
        for name, content in files.items():
            self._say(f"Opening {name}.", "busy", progress=None)
            data = content.encode() if isinstance(content, str) else content
            self._uploads.ask((name, data))

    def _open(self, upload: tuple[str, bytes]) -> None:
        """Open a file, or give it to the measurement that is open as its emissivity or PSF."""
        assert self._files is not None
        path = self._files.store(*upload)
        if isinstance(self.session.model, MeasurementModel) and (texts := given_texts(path)):
            self._notified("given", path, texts)
        else:
            self._notified("opened", self._files.add(path))

    def _show_given(self, path: Path, texts: Texts) -> None:
        try:
            self.session.change(texts)
        except ValueError as error:
            self._say(str(error).replace(str(path), path.name), "error", invalid=list(texts))
        else:
            self._changed()

    # Messages to the page

    def _show_picture(
        self, number: int, picture: Picture, numbers: dict[str, float] | None = None
    ) -> None:
        self._draw(picture)
        self._say(*self._described(picture))
        # The page draws the curves after the images: that halves the time to the images.
        content = {"number": number, "lines": self._changed_lines(picture)}
        content["absent"] = picture.absent
        content["images"] = list(picture.panels)
        self._send("picture", content | {"quick": picture.quick})
        if numbers is not None:
            self._show_numbers(picture, numbers, {})

    def _draw(self, picture: Picture) -> None:
        """Draw a picture in the figures; places are read in an exact one."""
        self._picture = picture
        self.figures.show(picture)
        if picture.quick:
            return
        model, state = self.session.model, picture.state
        measured = model.measurement_of(picture)
        stored = model.controls.emissivities(state.study)
        if isinstance(model, MeasurementModel):
            uploads = None if self._files is None else self._files.folder
            self.opened.correction = correction_data(state.study, stored, uploads)
        self.opened.show(picture, model.frames(state), model.frame(state), measured, stored)

    def _changed_lines(self, picture: Picture) -> dict[str, dict[str, Array]]:
        """Return the curves that the page does not have: the cursor changes none of them."""
        lines = {f"{name}_values": _columns(curves) for name, curves in picture.lines.items()}
        changed = {
            name: curves
            for name, curves in lines.items()
            if not _are_equal(curves, self._lines.get(name, {}))
        }
        self._lines = lines
        return changed

    def _described(self, picture: Picture) -> tuple[str, str]:
        """Return the status of the page with a picture, and its kind."""
        shown = picture.state.study.error_image
        if picture.quick:
            assert picture.exposure
            spacing = picture.exposure.raster.spacing
            finer = picture.state.study.camera.pitch < picture.raster.spacing
            what = "samples and pixels" if finer else "samples"
            return (
                f"Quick look on {what} of {1e6 * spacing:.3g} µm; the exact picture follows.",
                "busy",
            )
        if self._refused:
            return self._refused, "error"
        if picture.data["flagged"].all():
            limit = picture.lower_limit
            above = "" if limit is None else f", which begins at {limit:.0f} °C"
            return f"No pixel is within the camera's range{above}.", "error"
        if picture.corrected is not None:
            raster = picture.corrected.correction.raster
            size = f"{raster.columns} × {raster.rows}"
            around = "" if raster == picture.raster else " around the cursor"
            return f"Corrected: {size} pixels{around}.", ""
        if picture.state.study.images == CORRECTION:
            return "Exact picture; the correction follows.", "busy"
        if shown in picture.absent:
            return f"{ERROR_IMAGES[shown]} is 0 everywhere: {picture.absent[shown]}.", ""
        took = f", {1e3 * (perf_counter() - self._began):.0f} ms after the last change"
        return f"Exact picture{took if self._began else ''}.", ""

    def _show_numbers(
        self, picture: Picture, numbers: dict[str, float], contributions: dict[str, float]
    ) -> None:
        x, y = picture.state.cursor
        parts = {name: numbers[name] for name in (*PARTS, "texture") if name in numbers}
        corrected = picture.corrected and picture.corrected.at(picture.state.cursor)
        largest = _largest(corrected.contributions) if corrected else {}
        html = _NUMBERS.render(
            numbers=numbers,
            texts=_texts(numbers),
            reference=picture.reference,
            is_scene=bool(parts),
            is_divided=picture.state.study.analysis.reference in get_args(AttributionReference),
            position=f"{1e6 * x:.1f}, {1e6 * y:.1f} µm".replace("-", "−"),
            percent=_bars(parts),
            contributions=contributions,
            widths=_bars(contributions),
            is_correction=picture.state.study.images == CORRECTION,
            is_corrected=picture.corrected is not None,
            corrected=corrected,
            largest=largest,
            shares=_bars(largest),
            needs=self.session.model.needs(picture.state),
        )
        self._send("numbers", html)

    def _show_correcting(self, done: float) -> None:
        part = self.session.state.study.corrected_part
        pixels = "the whole frame" if part == WHOLE else "the pixels around the cursor"
        self._say(f"Correcting {pixels}.", "busy", progress=done or None)

    def _show_needs(self, needs: str) -> None:
        self._say(f"Measured image. Set {needs} to correct it.")

    def _show_drawn(self, drawn: Drawn) -> None:
        if drawn.state != self.session.state or self._picture is None:
            return
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

    def _send(self, kind: str, content: Any) -> None:
        self._messages.append({"kind": kind, "content": content})

    def _say(self, text: str, kind: str = "", **more: Any) -> None:
        self._send("status", {"text": readable(text), "kind": kind, **more})

    def _put_values(self) -> None:
        session, controls = self.session, self.session.model.controls
        content = {
            "n": self._handled,
            "values": controls.shown(session.state),
            "ranges": controls.ranges(session.state),
            "can_undo": session.can_undo,
            "can_redo": session.can_redo,
            "link": {**self._link, **session.state.texts},
        }
        self._send("values", content)

    def _later(self, show: Callable[[], None]) -> None:
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self.page.alone, lambda: self._reported(show))
            return
        if self._document is None:
            self.page.alone(lambda: self._reported(show))
            return
        try:
            self._document.add_next_tick_callback(partial(self._together, show, self._document))
        except RuntimeError:  # the page was closed meanwhile
            self.session.end()

    def _together(self, show: Callable[[], None], document: Document) -> None:
        """Send all messages at the end, through Bokeh, so that the browser draws once.

        Panel would keep a message that comes while others are written until the one after it.
        """
        document.hold("collect")
        try:
            self._reported(show)
        finally:
            document.unhold()


def _session_texts(opened: Model) -> dict[str, str]:
    """Return the controls that the session of an open file states: frame and surroundings."""
    places, texts = opened.places, dict[str, str]()
    if places is None:
        return texts
    times = opened.frames(opened.controls.initial).times
    if 0 < places.view.frame < len(times):
        texts["start"] = f"{1e6 * rounded(float(times[places.view.frame])):.9g} us"
    if isinstance(opened, MeasurementModel):
        texts |= correction_texts(places)
    return texts


def _columns(curves: Mapping[str, Array]) -> dict[str, Array]:
    """Return the curves along a line as the page draws them.

    Bokeh sends arrays as their bytes, and lists number by number, which takes much longer.
    """
    unknown = np.full_like(curves["along"], np.nan)
    drawn = {"corrected": unknown, **curves}
    return {key: np.asarray(curve) for key, curve in drawn.items() if key not in ("low", "high")}


def _are_equal(curves: Mapping[str, Array], others: Mapping[str, Array]) -> bool:
    return curves.keys() == others.keys() and all(
        np.array_equal(curve, others[key], equal_nan=True) for key, curve in curves.items()
    )


def _largest(contributions: Mapping[str, float]) -> dict[str, float]:
    """Return the largest contributions, and the root of the squares of the others."""
    ordered = sorted(contributions.items(), key=lambda one: -one[1])
    others = [value for _, value in ordered[_SHOWN_SOURCES:]]
    return dict(ordered[:_SHOWN_SOURCES]) | ({"others": hypot(*others)} if others else {})


def _bars(values: Mapping[Any, float]) -> dict[Any, float]:
    """Return the lengths of bars to both sides in percent of their track."""
    # 1e-9 K: without an error there is no bar.
    largest = np.nanmax([1e-9, *np.abs(list(values.values()))])
    return {name: 50 * np.nan_to_num(value) / largest for name, value in values.items()}


def _html(opened: Model, figures: Figures, may_upload: bool, embedded: bool) -> str:
    """Return the page without figures and numbers."""
    rows = [row for row in opened.controls.rows.values() if row.group]
    left, right, bottom, top = figures.extent
    spec = {
        "embedded": embedded,
        "version": __version__,
        "stops": {row.path: row.stops for row in rows},
        "images": list(figures.images),
        "shown": opened.shown(opened.controls.initial),
        "figures": list(figures.all),
        "extent": figures.extent,
        "view": max(_VIEW_WIDTH, 1e6 * _VIEW_SAMPLES * opened.raster.spacing),
        "shape": (top - bottom) / (right - left),
    }
    return _PAGE.render(
        spec=spec,
        name=opened.name,
        scene=opened.scene if isinstance(opened, SceneModel) else None,
        description=_description_name(opened),
        may_upload=may_upload,
        groups={row.group: [one for one in rows if one.group == row.group] for row in rows},
        images={name: one.figure.title.text for name, one in figures.images.items()},
        lines={name: one.figure.title.text for name, one in figures.lines.items()},
        draws=f"{PHASES}² positions of the pixels, {TEXTURES} textures",
    )


def _description_name(opened: Model) -> str:
    """Return the name under which the settings of a camera file are saved; empty without any."""
    if not (isinstance(opened, MeasurementModel) and opened.description):
        return ""
    name = Path(opened.name)
    is_description = name.suffix.lower() in (".yaml", ".yml")
    return name.name if is_description else description_path(name).name


def _texts(numbers: Mapping[str, float]) -> dict[str, str]:
    """Return measured, reference and error, of which the texts differ by exactly the error's.

    They have the digits of the measured temperature's uncertainty, if that is known.
    """
    uncertainty = numbers.get("uncertainty", 0.0)
    is_known = isfinite(uncertainty) and uncertainty > 0
    decimals = uncertain_decimals(uncertainty) if is_known else 1
    celsius = {
        name: round(numbers[name] - ZERO_CELSIUS, decimals)
        for name in ("measured", "reference")
        if name in numbers
    }
    texts = {name: _quantity(value, "°C", decimals) for name, value in celsius.items()}
    if is_known and isfinite(celsius["measured"]):
        number = _quantity(celsius["measured"], "", decimals)
        texts["measured"] = f"{number} ± {uncertainty:.{decimals}f} °C"
    if "reference" in celsius:
        error = celsius["measured"] - celsius["reference"]
        texts["error"] = _quantity(error, "K", decimals, "+")
    return texts


def _quantity(value: float, unit: str, decimals: int, sign: str = "") -> str:
    return quantity_text(value if isfinite(value) else None, unit, decimals, sign)


def _celsius(kelvins: float) -> str:
    return _quantity(kelvins - ZERO_CELSIUS, "°C", 1)


def _kelvins(kelvins: float) -> str:
    return _quantity(kelvins, "K", 1, "+")


_TEMPLATES: Final = Environment(
    loader=PackageLoader("chipglow.app"), autoescape=True, trim_blocks=True, lstrip_blocks=True
)
_TEMPLATES.filters |= {"celsius": _celsius, "kelvins": _kelvins, "rounded": rounded_text}
_PAGE: Final = _TEMPLATES.get_template("page.html")
_NUMBERS: Final = _TEMPLATES.get_template("numbers.html")
