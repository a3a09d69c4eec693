"""The lab's server: the page and a WebSocket on 127.0.0.1, for one user, until the page is closed or Ctrl-C.

Each page has a `Session` of its own. Its messages are answered in order, in one thread: nothing is shared but the kernels and the
fields. A reply is binary: the length of an object in JSON (4 bytes, little-endian), the object, spaces up to a multiple of four
bytes, and the numbers.

Refused are requests without the token in the address, and with another host in it than 127.0.0.1 or localhost (so that no name of
a foreign page leads here); sockets opened by pages of another origin; messages longer than 4096 characters; and whatever is not in
`compare.lab.messages`.
"""

import asyncio
import hmac
import json
import logging
import secrets
import struct
import sys
import webbrowser
from collections.abc import Callable
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.netutil import bind_sockets
from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from compare.lab import page
from compare.lab.beside import Fields
from compare.lab.engine import Engines
from compare.lab.messages import LONGEST, parsed
from compare.lab.session import Reply, Session
from compare.lab.settings import Settings

HOST = "127.0.0.1"
MOST_PAGES = 32
LEAVES = 3.0  # seconds after the last page was closed until the server ends; a page that is loaded again takes less
LOG = logging.getLogger("compare.lab")


def packed(reply: Reply) -> bytes:
    """A reply as bytes."""
    text = json.dumps(reply.content, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + reply.data


class Lab:
    """What all pages share.

    Parameters
    ----------
    settings : of a page when it opens.
    stays : whether the server goes on when there is no page.
    """

    def __init__(self, settings: Settings, stays: bool = False) -> None:
        self.settings, self.stays = settings, stays
        self.token = secrets.token_urlsafe(16)
        self.fields, self.engines = Fields(), Engines()
        self.pages: set[Socket] = set()
        self.ended = asyncio.Event()
        self._leaves: asyncio.TimerHandle | None = None
        self.port = 0

    @property
    def address(self) -> str:
        return f"http://{HOST}:{self.port}/{self.token}/"

    @property
    def hosts(self) -> tuple[str, ...]:
        return f"{HOST}:{self.port}", f"localhost:{self.port}"

    def allows(self, request: HTTPServerRequest, token: str) -> bool:
        """Whether a request has the right token and host."""
        return hmac.compare_digest(token.encode(), self.token.encode()) and request.host in self.hosts

    def listen(self, port: int = 0) -> HTTPServer:
        """Begin to listen, on a free port if none is given. ValueError if it is taken."""
        try:
            sockets = bind_sockets(port, HOST)
        except OSError as error:
            raise ValueError(f"port {port} of {HOST} cannot be listened on: {error}; leave --port out for a free one") from None
        self.port = sockets[0].getsockname()[1]
        given: dict[str, Any] = {"lab": self}
        handlers: list[Any] = [(rf"/([^/]+)/{name}", Part, given | {"name": name}) for name in PARTS]
        handlers.append((r"/([^/]+)/socket", Socket, given))
        server = HTTPServer(
            Application(
                handlers,
                default_handler_class=Nothing,
                default_handler_args=given,
                log_function=_quiet,
                websocket_max_message_size=4 * LONGEST,
            )
        )
        server.add_sockets(sockets)
        return server

    def joined(self, socket: "Socket") -> None:
        self.pages.add(socket)
        if self._leaves is not None:
            self._leaves.cancel()
            self._leaves = None

    def left(self, socket: "Socket") -> None:
        self.pages.discard(socket)
        if not self.pages and not self.stays and self._leaves is None:
            self._leaves = asyncio.get_running_loop().call_later(LEAVES, self.ended.set)

    def close(self) -> None:
        self.fields.close()
        self.engines.close()


def _quiet(handler: RequestHandler) -> None:
    """No line in the log for each request."""


class Guarded(RequestHandler):
    """Answers requests with the right token and host only."""

    def initialize(self, lab: Lab, name: str = "") -> None:
        self.lab, self.name = lab, name

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-store")
        self.set_header("X-Frame-Options", "DENY")

    def write_error(self, status_code: int, **_: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}: take the address that python -m compare lab printed, with its token\n")


class Nothing(Guarded):
    """Any other address."""

    def prepare(self) -> None:
        self.send_error(404)


PARTS: dict[str, tuple[str, Callable[[], str]]] = {
    "": ("text/html; charset=utf-8", page.html),
    "lab.js": ("text/javascript; charset=utf-8", page.module),
    "socket.js": ("text/javascript; charset=utf-8", page.socket),
    "lab.css": ("text/css; charset=utf-8", page.style),
}


class Part(Guarded):
    """The page and its parts."""

    def get(self, token: str) -> None:
        if not self.lab.allows(self.request, token):
            self.send_error(403)
            return
        kind, text = PARTS[self.name]
        self.set_header("Content-Type", kind)
        self.set_header(
            "Content-Security-Policy",
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
            f"frame-ancestors 'none'; connect-src {' '.join(f'ws://{host}' for host in self.lab.hosts)}",
        )
        self.finish(text())


class Socket(WebSocketHandler):
    """The socket of one page."""

    def initialize(self, lab: Lab) -> None:
        self.lab = lab
        self.session: Session | None = None

    def check_origin(self, origin: str) -> bool:
        return origin in [f"http://{host}" for host in self.lab.hosts]

    async def get(self, token: str) -> None:
        if not self.lab.allows(self.request, token) or "Origin" not in self.request.headers:
            self.set_status(403)
            self.finish()
            return
        await super().get(token)

    def open(self, *_: str) -> None:
        if len(self.lab.pages) >= MOST_PAGES:
            self._send([Reply({"kind": "ended", "text": f"There are {MOST_PAGES} pages of this lab already. Close one."})])
            self.close(1013, "too many pages")
            return
        self.set_nodelay(True)
        self.lab.joined(self)
        self.session = Session(self.lab.settings, self.lab.fields, self.lab.engines)
        self._send(self.session.opening())

    def on_message(self, message: str | bytes) -> None:
        if self.session is None:
            return
        try:
            given = parsed(message)
        except ValueError as error:
            self.close(1007, str(error)[:100])
            return
        try:
            replies = self.session.handle(given)
        except Exception:
            LOG.exception("the lab failed")
            replies = [Reply({"kind": "ended", "text": "The lab failed; the terminal shows where. Load the page again."})]
        self._send(replies)

    def _send(self, replies: list[Reply]) -> None:
        try:
            for reply in replies:
                self.write_message(packed(reply), binary=True)
        except WebSocketClosedError:
            pass

    def on_close(self) -> None:
        self.session = None
        self.lab.left(self)


async def serve(settings: Settings, port: int = 0, browser: bool = True, stays: bool = False) -> None:
    """Serve pages until the last one is closed, or until this is cancelled; prints the address.

    stays : go on when all pages are closed.
    """
    lab = Lab(settings, stays)
    server = lab.listen(port)
    try:
        print(f"the lab is at {lab.address}\nit ends when its page is closed, or by Ctrl-C", flush=True)
        if browser and not webbrowser.open(lab.address):
            print("no browser could be opened: open the address in one", file=sys.stderr)
        await lab.ended.wait()
    finally:
        server.stop()
        for socket in list(lab.pages):
            socket.close(1001, "the lab has ended")
        await server.close_all_connections()
        lab.close()
