"""The command ``chipglow app``: the app's server, and its address."""

import webbrowser
from pathlib import Path

from chipglow.app import serve
from chipglow.cli.screen import current


def serve_app(path: Path | None, address: str, port: int, browser: bool) -> None:
    """Serve the app until Ctrl-C.

    Parameters
    ----------
    path : Path, optional
        What to open; a small scene that comes with the program by default.
    address : str
        Where to listen.
    port : int
        0 for any that is free.
    browser : bool
        Whether to open the page in a browser.
    """

    def tell(url: str) -> None:
        screen = current()
        screen.say(f"The app is at {url}\nCtrl-C ends it.", {"url": url})
        if screen.is_for_programs:
            screen.close()
        if browser:
            webbrowser.open(url)

    serve(path, address, port, tell)
