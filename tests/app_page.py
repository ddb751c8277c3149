"""Pages of the app without a browser."""

import time

from chipglow.app.opening import open_any
from chipglow.app.view import PageView

PATIENCE = 60.0  # s: of a machine with much else to do


def shown(path, files=None):
    """A page of frames whose picture is shown, with its panel."""
    view = PageView(open_any(path), files=files, embedded=True)
    view.start(None)
    assert view.opened.images
    assert view.measuring.panel is not None
    return view


def painted(measuring):
    """Show the table and the curves of places, as the page asks for them when it has painted."""
    measuring.show_table()
    measuring.show_curves()


def until(is_true):
    end = time.monotonic() + PATIENCE
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.01)


def numbers_html(view, picture, numbers, contributions):
    """Show the numbers at the cursor, and return them as the page has them."""
    view._show_numbers(picture, numbers, contributions)
    return view._messages.pop()["content"]
