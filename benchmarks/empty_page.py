"""A page with one image and a text that a click changes: the least that a page of Panel takes.

    python benchmarks/empty_page.py

Prints its address; see app_latency.py, which compares the app with it.
"""

import socket

import numpy as np
import panel as pn
from bokeh.events import Tap
from bokeh.plotting import figure


def main():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = pn.io.server.get_server({"/": page}, port=port, address="127.0.0.1")
    server.start()
    print(f"http://127.0.0.1:{port}/", flush=True)
    server.io_loop.start()


def page():
    """Return a button; a press of it shows an image of 640 x 512 pixels and a text."""
    button = pn.widgets.Button(name="Open")
    column = pn.Column(button)
    button.on_click(lambda _: column.append(pn.Column(*image_and_text())))
    return column


def image_and_text():
    one = figure(width=400, height=320, css_classes=["picture"])
    row, column = np.mgrid[:512, :640]
    values = (row + column).astype(np.float32)
    one.image([values], x=0, y=0, dw=640, dh=512)
    text = pn.pane.HTML("Measured image", css_classes=["numbers"])

    def show(event):
        text.object = f"Measured image {event.x:.1f}, {event.y:.1f}"

    one.on_event(Tap, show)
    return pn.pane.Bokeh(one), text


if __name__ == "__main__":
    main()
