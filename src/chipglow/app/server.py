"""The app as a local server: access by a token, and the end on a signal."""

import secrets
import signal
import socket
from contextlib import suppress
from functools import partial
from threading import Thread
from typing import Any, Final

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from tornado.web import RequestHandler

from chipglow.app.asking_page import AskingPage
from chipglow.app.controls import Texts
from chipglow.app.models import Model
from chipglow.app.opening import Asking, OpenFiles
from chipglow.app.view import PageView

LOCAL: Final = "127.0.0.1"
TOKEN: Final = "token"
OPEN: Final = "open"


class _Closed(RequestHandler):  # type: ignore[misc]
    def get(self) -> None:
        self.set_status(403)
        self.finish("Open the address that chipglow app printed: it contains a token.")


class TokenAuth(AuthProvider):  # type: ignore[misc]
    """Admits requests with the token: in the printed address, then in a cookie."""

    login_url = "/closed"  # Panel needs one; it answers 403
    login_handler = _Closed
    get_login_url = get_user_async = logout_url = logout_handler = None

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(24)  # bytes: 192 bits cannot be guessed

    def get_user(self, handler: RequestHandler) -> str | None:
        """Return a user for a request with the token, and set the cookie."""
        # One cookie for each port: browsers keep cookies by host alone.
        cookie = f"chipglow-{handler.request.host.rpartition(':')[2]}"
        given = handler.get_query_argument(TOKEN, ""), handler.get_cookie(cookie) or ""
        if not any(secrets.compare_digest(one.encode(), self.token.encode()) for one in given):
            return None
        if given[0]:
            handler.set_cookie(cookie, self.token, httponly=True, samesite="Strict")
        return "user"


class App:
    """The running app; port 0 means any that is free."""

    def __init__(self, first: Model | Asking, address: str = LOCAL, port: int = 0) -> None:
        port = _free_port(address, port)
        # A page that asks for settings loads the scripts that the file's own page needs then.
        pn.extension("tabulator", "filedropper")
        self.files = OpenFiles(first)
        self._views: set[PageView] = set()
        auth = TokenAuth()
        everywhere = address == "0.0.0.0"
        names = _own_names() if everywhere else {address, LOCAL, "localhost"}
        self.url = f"http://{LOCAL if everywhere else address}:{port}/?{TOKEN}={auth.token}"
        self.server = pn.io.server.get_server(
            {"/": self._page},
            port=port,
            address=address,
            websocket_origin=[f"{name}:{port}" for name in sorted(names)],
            title="chipglow",
            location=False,
            auth_provider=auth,
            unused_session_lifetime_milliseconds=15_000,
            check_unused_sessions_milliseconds=5_000,
        )

    def run(self) -> None:
        loop = self.server.io_loop

        # An exception would be lost if a finaliser were at work when the signal comes.
        def end(*_: object) -> None:
            loop.asyncio_loop.call_soon_threadsafe(loop.stop)

        before = {one: signal.signal(one, end) for one in (signal.SIGINT, signal.SIGTERM)}
        self.server.start()
        Thread(target=self.files.warm, daemon=True).start()
        try:
            loop.start()
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)
            self.stop()

    def stop(self) -> None:
        self.server.stop()
        for view in self._views:
            view.end()
        self.files.close()

    def _page(self) -> Any:
        given = {name: values[0].decode() for name, values in pn.state.session_args.items()}
        given.pop(TOKEN, None)
        key = given.pop(OPEN, "")
        opened = self.files.find(key)
        if opened is None:
            return pn.pane.HTML("<p>This file is no longer open: open it again.</p>")
        document = pn.state.curdoc
        view = partial(self._view, given=given, key=key, document=document)
        if isinstance(opened, Asking):
            asking = AskingPage(opened, key, self.files, view)
            asking.start(document)
            return asking.page
        return view(opened)

    def _view(self, opened: Model, given: Texts, key: str, document: Any) -> Any:
        """Return the page of an open file."""
        view = PageView(opened, given, {OPEN: key} if key else {}, self.files)
        view.start(document)
        self._views.add(view)
        document.on_session_destroyed(lambda _: self._end(view))
        return view.page

    def _end(self, view: PageView) -> None:
        self._views.discard(view)
        view.end()


def _free_port(address: str, port: int) -> int:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except (OSError, OverflowError) as error:
            raise ValueError(f"{address}:{port}: not available ({error})") from None
        return int(probe.getsockname()[1])


def _own_names() -> set[str]:
    """Return the names by which other machines may call this one."""
    host = socket.gethostname()
    names = {LOCAL, "localhost", host, socket.getfqdn()}
    with suppress(OSError):
        names |= {str(one[4][0]) for one in socket.getaddrinfo(host, None, socket.AF_INET)}
    return names
