"""The server of a page: on this computer alone, for who has its address, until no page is left."""

import asyncio
import secrets
import socket
import time
import traceback
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.concurrency import run_in_threadpool
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import PlainTextResponse, Response
    from starlette.routing import Route, WebSocketRoute
    from starlette.types import ASGIApp, Receive, Scope, Send
    from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState
except ModuleNotFoundError as fault:
    raise ExfitError(f"app needs {fault.name}: pip install 'exfit[app]'") from fault

from exfit.features.app.beginning import LARGEST, dropped
from exfit.features.app.messages import LONGEST, Message, read_message
from exfit.features.app.packing import packed
from exfit.features.app.session import Content, Given, Session

HERE = "127.0.0.1"
BESIDE = ("fit", "profile")  # what runs beside the other messages of its page
LINGER = 60.0  # s after the last page was closed: time to load it again
PAGE = Path(__file__).parent / "page"
FILES = {
    "": ("index.jinja", "text/html"),
    "app.js": ("app.js", "text/javascript"),
    "plot.js": ("plot.js", "text/javascript"),
    "style.css": ("style.css", "text/css"),
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors "
)
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Pages:
    """The pages that are open, and since when there is none; before the first there is no end."""

    def __init__(self) -> None:
        self.count, self.closed = 0, float("inf")

    def opened(self) -> None:
        """Count a page more."""
        self.count, self.closed = self.count + 1, float("inf")

    def left(self) -> None:
        """Count a page less."""
        self.count -= 1
        if not self.count:
            self.closed = time.monotonic()


class Doorkeeper:
    """Lets in who knows the token, by the address of this server, from none but its own pages."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self.app, self.token = app, token
        self.hosts = {f"{name}:{port}" for name in (HERE, "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer 403 to all others."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        host, origin = asked.headers.get("host", ""), asked.headers.get("origin")
        foreign = origin is not None and origin != f"http://{host}"
        foreign |= scope["type"] == "websocket" and origin is None
        token = scope["path"].split("/")[1].encode()
        known = secrets.compare_digest(token, self.token.encode())
        if host in self.hosts and not foreign and known:
            await self.app(scope, receive, send)
        elif scope["type"] == "http":
            refusal = PlainTextResponse("exfit app: use the address that it printed\n", 403)
            await refusal(scope, receive, send)
        else:
            await WebSocket(scope, receive, send).close(1008)


def page_server(
    given: Given, linger: float = LINGER, within: str = "'none'"
) -> tuple["PageServer", str]:
    """Make the server of pages, each with a session of its own; return its address, too.

    It ends ``linger`` s after its last page; pages of the sources ``within`` may frame it. Raises
    ExfitError for what cannot be shown.
    """
    first = Session(given)
    try:
        first.prepare()
    except BaseException:
        first.close()
        raise
    waiting = [first]
    listening = socket.create_server((HERE, 0))
    port, token = listening.getsockname()[1], secrets.token_urlsafe(24)
    pages, headers = Pages(), {**HEADERS, "Content-Security-Policy": POLICY + within}

    async def file(request: Request) -> Response:
        name, kind = FILES.get(request.path_params.get("name", ""), ("", ""))
        if not name:
            return PlainTextResponse("not found\n", 404, headers)
        return Response((PAGE / name).read_bytes(), 200, headers, kind)

    async def drop(request: Request) -> Response:
        data = bytearray()
        async for part in request.stream():
            data += part
            if len(data) > LARGEST:
                return PlainTextResponse(f"file: more than {LARGEST} bytes", 413, headers)
        try:
            name = request.query_params.get("name", "")
            place = await run_in_threadpool(dropped, name, bytes(data))
        except ExfitError as fault:
            return PlainTextResponse(str(fault), 400, headers)
        return PlainTextResponse(place.name, 200, headers)

    async def live(socket: WebSocket) -> None:
        await socket.accept()
        pages.opened()
        try:
            session = waiting.pop() if waiting else Session(given)
            await PageConversation(socket, session).hold()
        finally:
            pages.left()

    routes = [
        Route(f"/{token}/", file),
        Route(f"/{token}/file", drop, methods=["POST"]),
        Route(f"/{token}/{{name}}", file),
        WebSocketRoute(f"/{token}/live", live),
    ]
    app = Doorkeeper(Starlette(routes=routes), token, port)
    config = uvicorn.Config(
        app, log_level="critical", lifespan="off", ws="websockets-sansio",
        ws_max_size=4 * LONGEST, timeout_graceful_shutdown=1,
    )  # fmt: skip
    server = PageServer(config, listening, pages, linger, first)
    return server, f"http://{HERE}:{port}/{token}/"


class PageServer(uvicorn.Server):
    """A server that ends when the last page has been closed for a while."""

    def __init__(
        self,
        config: uvicorn.Config,
        listening: socket.socket,
        pages: Pages,
        linger: float,
        first: Session,
    ) -> None:
        super().__init__(config)
        self.listening, self.pages, self.linger, self.first = listening, pages, linger, first

    async def on_tick(self, counter: int) -> bool:
        """Look whether it is time to end."""
        if time.monotonic() - self.pages.closed > self.linger:
            return True
        return await super().on_tick(counter)

    def serve_pages(self) -> None:
        """Serve until the last page is closed; raises KeyboardInterrupt at Ctrl-C."""
        try:
            self.run([self.listening])
        finally:
            self.first.close()  # of a page that was never opened


class PageConversation:
    """A page's messages and their answers: in turn, but for a fit or a profile."""

    def __init__(self, socket: WebSocket, session: Session) -> None:
        self.socket, self.session = socket, session
        self.loop = asyncio.get_running_loop()
        self.sending = asyncio.Lock()
        self.beside = set[asyncio.Task[None]]()

    async def hold(self) -> None:
        """Answer until the page is closed."""
        try:
            while True:
                text = await self.socket.receive_text()
                try:
                    asked = read_message(text)
                except ExfitError as fault:
                    await self._send(refusal(fault))
                    continue
                if asked.do in BESIDE:
                    task = asyncio.create_task(self._answer(asked))
                    self.beside.add(task)
                    task.add_done_callback(self.beside.discard)
                else:
                    await self._answer(asked)
        except (WebSocketDisconnect, KeyError):  # KeyError: of a message that is no text
            pass
        finally:
            await run_in_threadpool(self.session.close)

    async def _answer(self, asked: Message) -> None:
        try:
            content = await run_in_threadpool(self.session.answer, asked, self._send_from_thread)
        except ExfitError as fault:
            content = refusal(fault)
        except OSError as fault:
            content = {"of": "fault", "lines": [f"{fault.filename}: {fault.strerror}"]}
        except KeyboardInterrupt:
            content = {"of": "fault", "lines": ["stopped before there was a result"]}
        except Exception:  # the page goes on, and the terminal has what its developers need
            traceback.print_exc()
            content = {"of": "fault", "lines": ["a mistake in exfit: the terminal says more"]}
        await self._send(content)

    def _send_from_thread(self, content: Content) -> None:
        asyncio.run_coroutine_threadsafe(self._send(content), self.loop)

    async def _send(self, content: dict[str, Any]) -> None:
        data = packed(content)
        async with self.sending:
            if self.socket.application_state is WebSocketState.CONNECTED:
                try:
                    await self.socket.send_bytes(data)
                except (WebSocketDisconnect, RuntimeError):
                    return


def refusal(fault: ExfitError) -> Content:
    """Say why something is not done."""
    return {"of": "fault", "lines": str(fault).splitlines()}
