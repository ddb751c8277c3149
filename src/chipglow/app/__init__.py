"""The app: a scene and a camera with controls, as a local server or as a part of a notebook."""

import gc
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chipglow.text import needs_extra

if TYPE_CHECKING:
    from chipglow.scene import Scene
    from chipglow.study import Study

__all__ = ["explore", "serve"]


def explore(scene: "Scene | str | Path | None" = None, study: "Study | None" = None) -> Any:
    """Return the app's page for a notebook: a scene and a camera with controls.

    Parameters
    ----------
    scene : Scene or path-like, optional
        A scene, or a path that ``chipglow app`` opens; the bundled scene by default.
    study : Study, optional
        Initial surface and camera; the paper's by default.

    Returns
    -------
    panel.viewable.Viewable
        A notebook shows it as the last line of a cell.

    Raises
    ------
    ValueError
        If Panel is not installed, or the scene cannot be opened.
    """
    _check_installed()
    import panel as pn

    from chipglow.app.opening import Asking, open_any
    from chipglow.app.view import PageView

    opened = open_any(scene, study)
    if isinstance(opened, Asking):
        raise ValueError(
            f"{opened.path}: is neither a scene nor a measurement; convert it by chipglow convert "
            "or import, or open it in chipglow app"
        )
    # Its scripts come with it: nothing is loaded from the network.
    pn.extension("tabulator", inline=True)
    view = PageView(opened, embedded=True)
    view.start(None)
    return view.page


def serve(path: Path | None, address: str, port: int, ready: Callable[[str], None]) -> None:
    """Serve the app until Ctrl-C; `ready` takes the URL as soon as a browser can open it."""
    _check_installed()
    from chipglow.app.opening import open_any
    from chipglow.app.server import App

    app = App(open_any(path), address, port)
    ready(app.url)
    # Imported objects are exempt from garbage collection, which would take longer than a picture.
    gc.freeze()
    app.run()


def _check_installed() -> None:
    if find_spec("panel") is None:
        raise ValueError(needs_extra("app", "Panel", "app"))
