"""Messages over WebSocket, and files over HTTP, for programs and pages of one bridge.

Each client gets the newest of each topic at its own pace: a slow one gets fewer, and nobody waits
for it. Two batches are on their way to a client at most; the next one goes when its side has
answered the ping behind the first, so that no buffer between fills with what is old by then. What a
client sends is untrusted, and closes its own connection at worst.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import ssl
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Mapping
from http import HTTPStatus
from typing import NamedTuple

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request as HttpRequest
from websockets.http11 import Response

from rhot.errors import BusError
from services.bridges.pacing import Pacer
from services.bridges.websocket.door import Door
from services.bridges.websocket.outbox import Outbox
from services.bridges.websocket.protocol import MAX_REQUEST_BYTES, frame, request_from

log = logging.getLogger("rhot.bridge")

# Browsers and programs of one rig's users; each costs a copy of every message.
_MAX_CLIENTS = 32
# On their way to a client: with one, a link of 20 ms would bring 50 batches a second at most.
_BATCHES_UNDERWAY = 2
# Requests are read one after the other with this pause: a client that floods waits in its own line.
_REQUEST_PAUSE_S = 0.05
# What a close may say (RFC 6455, section 5.5).
_REASON_BYTES = 120
# Nothing of a page comes from, or goes to, anywhere else.
_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' blob: data:; frame-ancestors 'self'; base-uri 'none'; form-action 'none'"
)


class File(NamedTuple):
    """A file of a page; open ones need no token, since they tell nothing of the rig."""

    content: bytes
    media_type: str
    open: bool = True


class WebServer:
    """One bridge's clients; address() is where they find it."""

    def __init__(
        self,
        door: Door,
        hello: str,
        rate_hz: float,
        files: Mapping[str, File] | None = None,
        live_path: str = "/",
    ) -> None:
        """hello is the first frame of every client; live_path is where the WebSocket is."""
        self.connected = asyncio.Event()
        self._door = door
        self._hello = hello
        self._rate_hz = rate_hz
        self._files = files or {}
        self._live_path = live_path
        self._clients: set[_Client] = set()

    @property
    def clients(self) -> int:
        """How many are connected."""
        return len(self._clients)

    def put(self, topic: str, text: str) -> None:
        """A frame for all who want it; never waits."""
        for client in self._clients:
            client.put(topic, text)

    @contextlib.asynccontextmanager
    async def listening(
        self, host: str, port: int, table: str, tls: ssl.SSLContext | None = None
    ) -> AsyncIterator[int]:
        """Serves for as long as the block lasts; the port, another one for port 0.

        table is the name of its table in rig.toml. Raises BusError if the address cannot be had.
        """
        # Every page that is refused, and every broken handshake, would be a line and a traceback.
        logging.getLogger("websockets").setLevel(logging.CRITICAL)
        try:
            server = await serve(
                self._handle,
                host,
                port,
                process_request=self._answer,
                # Frames are small, and on one machine or one network: time counts, not bytes.
                compression=None,
                max_size=MAX_REQUEST_BYTES,
                max_queue=4,
                write_limit=65_536,
                server_header=None,
                close_timeout=1.0,
                ssl=tls,
            )
        except OSError as error:
            raise BusError(
                f"cannot serve at {host}:{port}: {error.strerror or error}; set another host or "
                f"port under [{table}] in rig.toml, 0 for any free port"
            ) from None
        try:
            yield _port_of(server)
        finally:
            server.close()
            await server.wait_closed()

    def _answer(self, _: ServerConnection, request: HttpRequest) -> Response | None:
        """None lets a WebSocket pass; everything else is answered here."""
        headers, path = request.headers, request.path.partition("?")[0]
        file = self._files.get(path)
        refused = self._door.refuses(
            headers.get("Host"),
            headers.get("Origin"),
            request.path,
            headers.get("Authorization", ""),
            free=file is not None and file.open,
        )
        if refused is not None:
            return _response(HTTPStatus(refused.status), _text(refused.reason))
        if file is not None:
            return _response(HTTPStatus.OK, file)
        if path == "/" and self._live_path != "/":
            return _moved(next(iter(self._files)) + request.path[1:])
        if path != self._live_path:
            return _response(HTTPStatus.NOT_FOUND, _text(f"there is {self._live_path}"))
        if headers.get("Upgrade", "").lower() != "websocket":
            return _response(HTTPStatus.UPGRADE_REQUIRED, _text("this is a WebSocket"))
        if len(self._clients) >= _MAX_CLIENTS:
            return _response(
                HTTPStatus.SERVICE_UNAVAILABLE, _text(f"{_MAX_CLIENTS} are connected already")
            )
        return None

    async def _handle(self, connection: ServerConnection) -> None:
        client = _Client(connection, self._rate_hz)
        self._clients.add(client)
        self.connected.set()
        try:
            await connection.send(self._hello)
            async with asyncio.TaskGroup() as tasks:
                sending = tasks.create_task(client.send())
                await client.hear()
                sending.cancel()
        except* ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            if not self._clients:
                self.connected.clear()


class _Client:
    """One connection."""

    def __init__(self, connection: ServerConnection, rate_hz: float) -> None:
        self._connection = connection
        self._outbox = Outbox()
        self._fastest_hz = rate_hz
        self._pacer = Pacer(rate_hz)
        self._woken = asyncio.Event()
        self._underway: deque[Awaitable[float]] = deque()

    def put(self, topic: str, text: str) -> None:
        if self._outbox.put(topic, text):
            self._woken.set()

    async def send(self) -> None:
        while True:
            await self._woken.wait()
            await asyncio.sleep(self._pacer.wait_s(time.monotonic()))
            if len(self._underway) >= _BATCHES_UNDERWAY:
                await self._underway.popleft()
            self._woken.clear()
            self._pacer.went(time.monotonic())
            for text in self._outbox.take():
                await self._connection.send(text)
            self._underway.append(await self._connection.ping())

    async def hear(self) -> None:
        """Until the client goes; what it asks for holds at once."""
        async for text in self._connection:
            try:
                request = request_from(text)
            except ValueError as error:
                reason = str(error).encode()[:_REASON_BYTES].decode(errors="ignore")
                await self._connection.close(1007, reason)
                return
            self._outbox.ask(request)
            self._pacer = Pacer(min(self._fastest_hz, request.rate_hz or self._fastest_hz))
            self.put_now(frame("subscribed", request))
            await asyncio.sleep(_REQUEST_PAUSE_S)

    def put_now(self, text: str) -> None:
        self._outbox.put_always("subscribed", text)
        self._woken.set()


def _port_of(server: Server) -> int:
    return int(next(iter(server.sockets)).getsockname()[1])


def _text(reason: str) -> File:
    return File(f"{reason}\n".encode(), "text/plain; charset=utf-8")


def _response(status: HTTPStatus, file: File) -> Response:
    headers = Headers(
        {
            "Content-Type": file.media_type,
            "Content-Length": str(len(file.content)),
            "Content-Security-Policy": _POLICY,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-cache",
            "Connection": "close",
        }
    )
    return Response(status.value, status.phrase, headers, file.content)


def _moved(where: str) -> Response:
    response = _response(HTTPStatus.FOUND, _text(f"see {where}"))
    response.headers["Location"] = where
    return response
