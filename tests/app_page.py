"""Pages of the app without a browser."""

from threading import Event

from chipglow.app.opening import open_any
from chipglow.app.view import PageView

PATIENCE = 60.0  # s: of a machine with much else to do


def shown(path):
    """A page of a file whose picture is shown."""
    view = PageView(open_any(path), embedded=True)
    view.start(None)
    is_shown = Event()
    view.opened.watch(is_shown.set)
    view.session.show()
    assert is_shown.wait(PATIENCE)
    return view
