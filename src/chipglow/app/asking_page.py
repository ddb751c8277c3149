"""The page that asks for the settings of a file: it has the fields of the description."""

from collections.abc import Callable, Mapping
from html import escape
from typing import Any, Final

import panel as pn
from bokeh.document import Document

from chipglow.app.asking import CONTENTS, FIRST, Content, Setting, settings_of
from chipglow.app.models import Model
from chipglow.app.opening import Asking, OpenFiles
from chipglow.app.session import Newest
from chipglow.quantities.format import readable

_WIDTH: Final = 330
"""Width of a field in pixels: one of them fits a telephone."""

_STYLE: Final = """
:host { font: 14px/1.4 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
"""
_INTRODUCTION: Final = (
    "The file states too little. Give the settings as for the command line; they are saved beside "
    "it as {}.yaml. Other files are named by their path on this computer."
)

_ERROR_STYLE: Final = f"{_STYLE} :host {{ color: #b3261e; }}"


class AskingPage:
    """The page of a file that lacks settings; then it shows what `view` returns of the open file.

    The browser has the scripts by then: another page would load them again.
    """

    def __init__(
        self, asking: Asking, key: str, files: OpenFiles, view: Callable[[Model], Any]
    ) -> None:
        self._key, self._files, self._view = key, files, view
        self._document: Document | None = None
        self._work = Newest(self._open, self._notified)
        self._fields: dict[Content, dict[str, pn.widgets.TextInput]] = {}
        options = {CONTENTS[one]: one for one in asking.contents}
        self._content = pn.widgets.Select(
            label="Content of the file", options=options, width=_WIDTH, visible=len(options) > 1
        )
        # HTML, not Markdown, which makes links of names such as spot.nc and slants a_b_c.
        self._said = pn.pane.HTML("", stylesheets=[_ERROR_STYLE], sizing_mode="stretch_width")
        self._button = pn.widgets.Button(label="Open", color="primary", width=_WIDTH)
        self._button.on_click(self._clicked)
        self._content.param.watch(lambda _: self._choose(), "value")
        self._asked = pn.Column(sizing_mode="stretch_width")
        name = escape(asking.name)
        title = f"<h2>{name}</h2><p>{_INTRODUCTION.format(name)}</p>"
        form = pn.Column(
            pn.pane.HTML(title, stylesheets=[_STYLE], sizing_mode="stretch_width"),
            self._content,
            self._said,
            self._asked,
            self._button,
            sizing_mode="stretch_width",
            styles={"max-width": "1100px", "margin": "0 auto", "padding": "8px"},
        )
        self.page = pn.Column(form, sizing_mode="stretch_width", margin=0)
        self._choose(asking.settings)
        self._say(asking.error)

    def start(self, document: Document | None) -> None:
        """Set the document in which the results of another thread are shown."""
        self._document = document

    def _choose(self, texts: Mapping[str, str] | None = None) -> None:
        """Show the fields of the chosen content."""
        content: Content = self._content.value
        settings = settings_of(content)
        made = {path: _field(one, (texts or {}).get(path, "")) for path, one in settings.items()}
        self._fields[content] = made
        first = [made[path] for path in FIRST[content]]
        rest = [field for path, field in made.items() if path not in FIRST[content]]
        card = pn.Card(
            pn.FlexBox(*rest), title="All settings", collapsed=True, sizing_mode="stretch_width"
        )
        self._asked[:] = [pn.FlexBox(*first), card]

    def _clicked(self, _: Any) -> None:
        content: Content = self._content.value
        texts = {path: field.value_input for path, field in self._fields[content].items()}
        given = {path: text.strip() for path, text in texts.items() if text.strip()}
        self._button.loading = True
        self._work.ask((content, given))

    def _open(self, answer: tuple[Content, dict[str, str]]) -> None:
        opened = self._files.answer(self._key, *answer)
        if isinstance(opened, Asking):
            self._notified("failed", opened.error)
        else:
            self._later(lambda: self._show(opened))

    def _show(self, opened: Model) -> None:
        self.page[:] = [self._view(opened)]

    def _notified(self, _kind: str, text: str) -> None:
        def show() -> None:
            self._button.loading = False
            self._say(text)

        self._later(show)

    def _later(self, show: Callable[[], None]) -> None:
        if self._document is not None:
            self._document.add_next_tick_callback(show)

    def _say(self, error: str) -> None:
        parts = readable(error).split("; ")
        self._said.object = f"<ul>{''.join(f'<li>{escape(part)}</li>' for part in parts)}</ul>"
        self._said.visible = bool(error)


def _field(setting: Setting, text: str) -> pn.widgets.TextInput:
    return pn.widgets.TextInput(
        label=setting.path,
        value=text,
        placeholder=setting.allowed.removeprefix("none, ").removeprefix("or "),
        description=setting.parameter.meaning,
        width=_WIDTH,
    )
