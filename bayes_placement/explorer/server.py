"""The server of a page: on the loopback alone, for who knows the token, one session a process."""

import asyncio
import hmac
import socket
import sys
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from threading import Event, Thread

import uvicorn
from starlette.requests import Request
from starlette.responses import Response as Answer
from starlette.routing import Route, Router, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from .._shared.errors import InputError
from .._shared.garbage import give_memory_back
from ..page.standalone import FIRST, FOLDER, script
from .live import LivePage
from .messages import LONGEST, Message, MessageError, parsed

HOST = "127.0.0.1"


KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
}
"""Kinds of files that are served, by their suffixes."""

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' "
    "'unsafe-inline'; connect-src 'self'; img-src 'self' data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Headers of every answer: nothing is fetched elsewhere, and the address is told to nobody."""

REFUSED = 1008
"""Code by which a socket is closed after a message that no page sends."""

IDLE = 5.0
"""Time [s] without anything done after which memory goes back."""

MOST_PAGES = 8
"""Most pages that show the session at once."""

MOST_WAITING = 256
"""Most frames that wait for a page, of about a megabyte where channels and lines are many."""

TOO_LATE = 1013
"""Code by which the socket of a page is closed that did not read for long."""

END = b""
"""The frame after which a socket is closed."""

Post = Callable[[Callable[[], None]], None]
"""Runs a function in the thread of the page."""

MakePage = Callable[[Callable[[bytes], None], Post], LivePage]
"""Makes a page, given what sends a frame to all sockets, and what runs functions in its thread."""


class Guard:
    """Lets nothing through but requests to this address, of this origin, with the token.

    The token is the first part of every path.
    """

    def __init__(self, app: ASGIApp, token: str, port: int):
        self._app, self._token = app, token.encode()
        self._hosts = {f"{host}:{port}".encode() for host in (HOST, "localhost")}
        self._origins = {b"http://" + host for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or refuse."""
        if scope["type"] == "lifespan" or self._allows(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": REFUSED})
        else:
            await Answer("Forbidden", 403, HEADERS)(scope, receive, send)

    def _allows(self, scope: Scope) -> bool:
        headers = [(name, value) for name, value in scope["headers"]]
        hosts = [value for name, value in headers if name == b"host"]
        origins = [value for name, value in headers if name == b"origin"]
        token = scope["path"].encode().split(b"/")[1:2]
        needed = 1 if scope["type"] == "websocket" else 0
        return (
            len(hosts) == 1
            and hosts[0] in self._hosts
            and needed <= len(origins) <= 1
            and all(origin in self._origins for origin in origins)
            and bool(token)
            and hmac.compare_digest(token[0], self._token)
        )


class PageServer:
    """A page and its sockets.

    `make` makes the page, given what sends frames to sockets and what runs functions in its thread.
    """

    def __init__(self, make: "MakePage", token: str, port: int):
        self._token = token
        self._socket = _listening(port)
        self.port: int = self._socket.getsockname()[1]
        self._sockets: dict[WebSocket, asyncio.Queue[bytes]] = {}
        self._cells: list[Callable[[bytes], None]] = []
        self._turns = ThreadPoolExecutor(1, thread_name_prefix="explorer")
        # Events: a thread that is joined when Ctrl-C comes counts as ended, though it runs on.
        self._started, self._ended = Event(), Event()
        self._count = self._taken = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._server = uvicorn.Server(self._config())
        self._thread = Thread(target=self._run, daemon=True, name="explorer-server")
        self.page: LivePage = make(self._broadcast, self._post)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.port}/{self._token}/"

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()
        self._started.wait()
        self._post(self.page.prepare)

    def attach(self, hear: Callable[[bytes], None]) -> None:
        """Send all frames to one more page, which is shown by no socket, from the first one on."""
        if hear not in self._cells:
            self._cells.append(hear)
        self._post(self.page.greet)

    def take(self, text: str) -> None:
        """Take a message of such a page; one that no page sends is left."""
        with suppress(MessageError):
            self._take(parsed(text))

    def wait(self) -> None:
        """Wait until it is closed."""
        while not self._ended.wait(0.5):  # in parts, so that Ctrl-C is seen
            pass

    def close(self) -> None:
        """End the server, the workers and all pages."""
        self._server.should_exit = True
        self._ended.wait(5.0)
        self._turns.shutdown(cancel_futures=True)  # nobody sees what is in line
        self.page.close()

    def _config(self) -> uvicorn.Config:
        """Nothing is logged: the address is secret."""
        routes = [
            WebSocketRoute("/{token}/socket", self._serve_socket),
            Route("/{token}/", partial(_file, "index.html")),
            *(Route(f"/{{token}}/{name}", partial(_file, name)) for name in _files()),
        ]
        app = Guard(Router(routes, redirect_slashes=False), self._token, self.port)
        return uvicorn.Config(
            app,
            log_level="critical",
            access_log=False,
            ws="websockets-sansio",
            ws_max_size=LONGEST,
            ws_per_message_deflate=False,  # on one machine it takes longer than it saves
            lifespan="off",
            server_header=False,
            timeout_graceful_shutdown=1,
        )

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        finally:
            self._ended.set()

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._started.set()
        tidying = asyncio.create_task(self._tidy())
        await self._server.serve(sockets=[self._socket])
        tidying.cancel()

    async def _tidy(self) -> None:
        """Give memory back that nobody uses, once after the page did something."""
        seen = tidied = 0
        while True:
            await asyncio.sleep(IDLE)
            if seen == self._count != tidied:
                tidied = self._count
                self._turns.submit(give_memory_back)
            seen = self._count

    def _post(self, function: Callable[[], None]) -> None:
        """Run a function in the thread of the page, after those before it."""
        self._count += 1
        if not self._server.should_exit:
            self._turns.submit(_told, function)

    def _broadcast(self, frame: bytes) -> None:
        """Send a frame to all pages, from any thread."""
        for hear in self._cells:
            hear(frame)
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._put, frame)

    def _put(self, frame: bytes) -> None:
        for web, queue in [*self._sockets.items()]:
            if queue.qsize() < MOST_WAITING:
                queue.put_nowait(frame)
            else:
                self._leave(web)

    def _leave(self, web: WebSocket) -> None:
        """Send no more to a page that reads nothing; once it reads, it comes back for all anew."""
        queue = self._sockets.pop(web)
        while not queue.empty():
            queue.get_nowait()
        queue.put_nowait(END)

    async def _serve_socket(self, web: WebSocket) -> None:
        if len(self._sockets) >= MOST_PAGES:
            await web.close(REFUSED)
            return
        await web.accept()
        self._sockets[web] = asyncio.Queue()
        greeting = self.page.greeting()  # at once, whatever the page is at
        for frame in greeting:
            self._sockets[web].put_nowait(frame)
        if not greeting:
            self._post(self.page.greet)
        sending = asyncio.create_task(_send_all(web, self._sockets[web]))
        try:
            while True:
                self._take(parsed(await web.receive_text()))
        except (MessageError, KeyError):  # bytes, where a text is needed
            await web.close(REFUSED)
        except WebSocketDisconnect:
            pass
        finally:
            self._sockets.pop(web, None)
            sending.cancel()

    def _take(self, message: Message) -> None:
        """Put a message in line; a page sends a move once that before is answered."""
        if message.do == "stop":
            self.page.stop()  # a structure may be compiled meanwhile
        self._taken += 1
        self._post(partial(self._handle, message, self._taken))

    def _handle(self, message: Message, number: int) -> None:
        self.page.handle(message, others_wait=number < self._taken)


async def _send_all(web: WebSocket, queue: "asyncio.Queue[bytes]") -> None:
    while (frame := await queue.get()) != END:
        await web.send_bytes(frame)
    await web.close(TOO_LATE)


def _told(function: Callable[[], None]) -> None:
    """Run a function; an error that is none of ours is seen in the terminal, and the page stays."""
    try:
        function()
    except Exception:  # noqa: BLE001
        traceback.print_exc(file=sys.stderr)


def _listening(port: int) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((HOST, port))
    except (OSError, OverflowError) as error:
        listening.close()
        raise InputError(
            f"port={port} was given, which cannot be used ({error}); a free one from 1024 to 65535 "
            "is needed, or 0 for any: port=0."
        ) from error
    listening.listen()  # who asks before the server has started waits
    return listening


def _files() -> dict[str, bytes]:
    """Files of the page by their paths in its folder, read once: no path comes from a request."""
    return {
        path.relative_to(FOLDER).as_posix(): path.read_bytes()
        for path in sorted(FOLDER.rglob("*"))
        if path.suffix in KINDS
    }


async def _file(name: str, request: Request) -> Answer:
    path = FOLDER / name
    # All modules in one: a browser would ask for one after the other.
    content = script().encode() if path.stem == FIRST else path.read_bytes()
    return Answer(content, headers=HEADERS, media_type=KINDS[path.suffix])
