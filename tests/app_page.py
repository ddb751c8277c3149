"""Pages of the app without a browser."""

import time
from threading import Event

from chipglow.app.opening import open_any
from chipglow.app.view import PageView

PATIENCE = 60.0  # s: of a machine with much else to do


def shown(path, files=None):
    """A page of a file whose picture is shown."""
    view = PageView(open_any(path), files=files, embedded=True)
    view.start(None)
    is_shown = Event()
    view.opened.watch(is_shown.set)
    view.session.show()
    assert is_shown.wait(PATIENCE)
    return view


def until(is_true):
    end = time.monotonic() + PATIENCE
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.01)
