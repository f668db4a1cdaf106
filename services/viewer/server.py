"""A viser server that keeps to itself.

viser listens on all interfaces by default, offers a button that opens a public tunnel, and lets any
web page that is open in the same browser connect. Here it listens where [viewer] host says, the
loopback by default; it has no tunnel, not even for a client that asks for one; and every request,
of a page or of its websocket, passes services/viewer/door.py before anything is answered. If its
port is taken it uses the next free one.
"""

from __future__ import annotations

import contextlib
import functools
import gzip
import io
import socket
import warnings
from collections.abc import Callable, Iterator
from http import HTTPStatus
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers, MultipleValuesError
from websockets.http11 import Request, Response

from rhot.errors import ConfigError
from rhot.files.rig_tables import Viewer
from rhot.files.viewer_access import access_problem
from services.viewer.door import Door
from services.viewer.front_page import HEADERS, front_page

Answer = Callable[[ServerConnection, Request], Response | None]


class LoneServer(viser.ViserServer):
    """A viser server without a public tunnel."""

    def request_share_url(self, verbose: bool = True) -> None:  # noqa: ARG002 - viser's signature
        """Do nothing, whoever asks."""
        return


@contextlib.contextmanager
def open_server(table: Viewer) -> Iterator[LoneServer]:
    """A running server; port 0 or a taken one gives another (see get_port()). Stops with the block.

    Raises ConfigError for any host but the loopback without a token, and for one that is no address
    of this machine.
    """
    if (wrong := access_problem(table)) is not None:
        raise ConfigError(wrong)
    _check_address(table.host)
    # A browser that leaves while its page is brought up to date is nothing to warn of.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection")
    # viser prints a banner and notes with rich; the services' standard output is for log lines.
    with contextlib.redirect_stdout(io.StringIO()), _guarded(Door(table.token)):
        server = LoneServer(host=table.host, port=table.port, label="rhot", verbose=False)
    try:
        server.gui.configure_theme(
            show_share_button=False,
            show_logo=False,
            control_width="large",
            brand_color=(0, 114, 178),
        )
        yield server
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def _check_address(host: str) -> None:
    """viser tries a thousand ports of an address it cannot have, and then waits for ever."""
    try:
        family = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0][0]
        socket.create_server((host, 0), family=family).close()
    except OSError as error:
        raise ConfigError(
            f"[viewer] host: {host!r} is no address of this machine ({error.strerror or error}); "
            'use "127.0.0.1", one of its own, or "0.0.0.0" for all'
        ) from None


@contextlib.contextmanager
def _guarded(door: Door) -> Iterator[None]:
    """Put the door before what viser answers.

    While its server starts, websockets' serve() is replaced by one whose requests pass it.
    """
    serve = websockets.asyncio.server.serve

    def guarded(*args: Any, process_request: Answer, **options: Any) -> Any:
        answer = functools.partial(_answer, door, process_request)
        return serve(*args, process_request=answer, **options)

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def _answer(
    door: Door, visers: Answer, connection: ServerConnection, request: Request
) -> Response | None:
    """A refusal, the page, or viser's own answer; None opens the websocket."""
    try:
        refused = door.refusal(request.path, request.headers)
    except MultipleValuesError as error:
        refused = (HTTPStatus.BAD_REQUEST, f"The header {error} is given twice.\n")
    if refused is not None:
        return connection.respond(*refused)
    response = visers(connection, request)
    if response is None:
        return None
    if request.path.partition("?")[0] == "/" and response.status_code == HTTPStatus.OK:
        compressed = response.headers.get("Content-Encoding") == "gzip"
        response = Response(HTTPStatus.OK, "OK", Headers(response.headers), _page(compressed))
        response.headers.pop("Content-Length")
        response.headers["Content-Length"] = str(len(response.body))
        if door.cookie:
            response.headers["Set-Cookie"] = door.cookie
    for name, value in HEADERS.items():
        response.headers[name] = value
    return response


@functools.cache
def _page(compressed: bool) -> bytes:
    """The page of a rig, made of viser's."""
    index = Path(viser.__file__).parent / "client" / "build" / "index.html"
    page = front_page(index.read_text(encoding="utf-8")).encode()
    return gzip.compress(page) if compressed else page
