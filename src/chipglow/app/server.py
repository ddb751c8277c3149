"""The app as a local server: who may come in, what may be uploaded, how it ends."""

import secrets
import signal
import socket
from asyncio import get_running_loop
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, Final
from urllib.parse import urlsplit

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from tornado.web import HTTPError, RequestHandler, stream_request_body

from chipglow.app.opening import (
    MOST_UPLOADED,
    OpenedMeasurement,
    OpenedScene,
    open_uploaded,
)
from chipglow.app.view import View

LOCAL: Final = "127.0.0.1"
TOKEN: Final = "token"
OPEN: Final = "open"

_MOST_OPEN: Final = 8
_WORDS: Final = f"{MOST_UPLOADED // 1024**2} MiB"


class Door(AuthProvider):  # type: ignore[misc]
    """Lets in who has the token: by the address that was printed, then by a cookie.

    Parameters
    ----------
    token : str
        The token.
    """

    def __init__(self, token: str) -> None:
        self._token = token

    def admits(self, handler: RequestHandler) -> bool:
        """Whether a request brings the token."""
        for given in (handler.get_query_argument(TOKEN, ""), self._cookie(handler)):
            if secrets.compare_digest(given.encode(), self._token.encode()):
                return True
        return False

    @property
    def get_user(self) -> Callable[[RequestHandler], str | None]:
        """Who asks; nobody without the token."""

        def user(handler: RequestHandler) -> str | None:
            if not self.admits(handler):
                return None
            if handler.get_query_argument(TOKEN, ""):
                name = _cookie_name(handler)
                handler.set_cookie(name, self._token, httponly=True, samesite="Strict")
            return "user"

        return user

    @property
    def get_user_async(self) -> None:
        """None: `get_user` says it."""
        return None

    @property
    def login_url(self) -> str:
        """Where nobody is sent."""
        return "/closed"

    @property
    def get_login_url(self) -> None:
        """None: `login_url` says it."""
        return None

    @property
    def login_handler(self) -> type[RequestHandler]:
        """What nobody sees."""
        return _Closed

    @property
    def logout_url(self) -> None:
        """None: who closes the page is out."""
        return None

    @property
    def logout_handler(self) -> None:
        """See `logout_url`."""
        return None

    def _cookie(self, handler: RequestHandler) -> str:
        return handler.get_cookie(_cookie_name(handler), "") or ""


class _Closed(RequestHandler):  # type: ignore[misc]
    def get(self) -> None:
        self.set_status(403)
        self.finish("Open the address that chipglow app printed: it holds a token.")


def _cookie_name(handler: RequestHandler) -> str:
    """One for each port: browsers keep cookies by host alone."""
    return f"chipglow-{handler.request.host.rpartition(':')[2]}"


class Opened:
    """What is open: what the command named, and what was uploaded since.

    Parameters
    ----------
    first : OpenedScene or OpenedMeasurement
        What the command named.
    """

    def __init__(self, first: OpenedScene | OpenedMeasurement) -> None:
        self.first = first
        self.folder = Path(mkdtemp(prefix="chipglow-app-"))
        self._uploaded: OrderedDict[str, OpenedScene | OpenedMeasurement] = OrderedDict()

    def find(self, key: str) -> OpenedScene | OpenedMeasurement | None:
        """What was uploaded with a key, or the first; None for an unknown key."""
        return self._uploaded.get(key) if key else self.first

    def add(self, path: Path, name: str) -> str:
        """Open a file that was uploaded; its key.

        Raises
        ------
        ValueError
            If it cannot be opened.
        """
        opened = open_uploaded(path, name)
        key = path.stem
        self._uploaded[key] = opened
        while len(self._uploaded) > _MOST_OPEN:
            old, _ = self._uploaded.popitem(last=False)
            (self.folder / f"{old}.nc").unlink(missing_ok=True)
        return key

    def close(self) -> None:
        """Remove the uploaded files."""
        rmtree(self.folder, ignore_errors=True)


@stream_request_body
class Upload(RequestHandler):  # type: ignore[misc]
    """Takes a file, piece by piece, and opens it."""

    def initialize(self, opened: Opened, door: Door, origins: tuple[str, ...]) -> None:
        """Set what Tornado gives every request."""
        self._opened, self._door, self._origins = opened, door, origins
        self._path: Path | None = None
        self._size = 0

    def prepare(self) -> None:
        """Refuse strangers, other origins and what is too large, before a byte is taken."""
        origin = urlsplit(self.request.headers.get("Origin", "")).netloc
        if not self._door.admits(self) or origin not in self._origins:
            raise HTTPError(403)
        length = int(self.request.headers.get("Content-Length", "0"))
        if length > MOST_UPLOADED:
            self._refuse(413, f"{self._name}: {length} bytes, expected up to {_WORDS}")
            return
        self.request.connection.set_max_body_size(MOST_UPLOADED)
        self._path = self._opened.folder / f"{secrets.token_urlsafe(12)}.nc"
        self._path.touch(mode=0o600)

    def data_received(self, chunk: bytes) -> None:
        """Write a piece."""
        if self._path is None:
            return
        with self._path.open("ab") as file:
            file.write(chunk)

    async def post(self) -> None:
        """Open the file; answer with its key, or with what is wrong with it."""
        path = self._path
        if path is None:
            return
        loop = get_running_loop()
        try:
            key = await loop.run_in_executor(None, self._opened.add, path, self._name)
        except (ValueError, OSError) as error:
            path.unlink(missing_ok=True)
            self._refuse(400, " ".join(str(error).split()))
            return
        self.finish(key)

    def on_connection_close(self) -> None:
        """Forget a file whose sender went away."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    @property
    def _name(self) -> str:
        name = Path(self.get_query_argument("name", "file")).name
        return "".join(letter for letter in name if letter.isprintable())[:100]

    def _refuse(self, status: int, text: str) -> None:
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(text)


class App:
    """The running app.

    Parameters
    ----------
    first : OpenedScene or OpenedMeasurement
        What a page shows that names nothing else.
    address : str
        Where it listens; this machine alone by default.
    port : int
        0 for any that is free.

    Raises
    ------
    OSError
        If the address or the port cannot be had.
    """

    def __init__(
        self, first: OpenedScene | OpenedMeasurement, address: str = LOCAL, port: int = 0
    ) -> None:
        self._check(address, port)
        self.opened = Opened(first)
        self._token = secrets.token_urlsafe(24)
        door = Door(self._token)
        port = port or _free_port(address)
        names = {address, LOCAL, "localhost"} if address != "0.0.0.0" else _own_names()
        origins = tuple(f"{name}:{port}" for name in sorted(names))
        upload = {"opened": self.opened, "door": door, "origins": origins}
        self.url = (
            f"http://{address if address != '0.0.0.0' else LOCAL}:{port}/?{TOKEN}={self._token}"
        )
        self.server = pn.io.server.get_server(
            {"/": self._page},
            port=port,
            address=address,
            websocket_origin=list(origins),
            title="chipglow",
            location=False,
            auth_provider=door,
            extra_patterns=[(r"/upload", Upload, upload)],
            unused_session_lifetime_milliseconds=15_000,
            check_unused_sessions_milliseconds=5_000,
        )

    def run(self) -> None:
        """Serve until Ctrl-C."""
        loop = self.server.io_loop

        # An exception would be lost if a finaliser were at work when the signal comes.
        def end(*_: object) -> None:
            loop.asyncio_loop.call_soon_threadsafe(loop.stop)

        before = {one: signal.signal(one, end) for one in (signal.SIGINT, signal.SIGTERM)}
        self.server.start()
        try:
            loop.start()
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)
            self.stop()

    def stop(self) -> None:
        """End it, and remove what was uploaded."""
        self.server.stop()
        self.opened.close()

    def _page(self) -> Any:
        given = {name: values[0].decode() for name, values in pn.state.session_args.items()}
        given.pop(TOKEN, None)
        key = given.pop(OPEN, "")
        opened = self.opened.find(key)
        if opened is None:
            return pn.pane.HTML("<p>This file is not open any more: open it again.</p>")
        link = {OPEN: key} if key else {}
        view = View(opened, given, link, _WORDS)
        view.start(pn.state.curdoc)
        pn.state.on_session_destroyed(lambda _: view.session.end())
        return view.page

    @staticmethod
    def _check(address: str, port: int) -> None:
        if not 0 <= port <= 65535:
            raise ValueError(f"--port: {port}, expected 0 to 65535")
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, port))
            except (OSError, OverflowError) as error:
                raise ValueError(f"{address}:{port}: cannot be listened on ({error})") from None


def _free_port(address: str) -> int:
    with socket.socket() as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


def _own_names() -> set[str]:
    """Names by which other machines may call this one."""
    host = socket.gethostname()
    found = {LOCAL, "localhost", host, socket.getfqdn()}
    with suppress(OSError):
        found |= {str(one[4][0]) for one in socket.getaddrinfo(host, None, socket.AF_INET)}
    return found
