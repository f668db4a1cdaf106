"""A viser server for the browsers of this machine only.

viser listens on all interfaces by default, offers a button that opens a public tunnel, and lets any
web page that is open in the same browser connect. Here it listens on the loopback, has no tunnel,
not even for a client that asks for one, and refuses other pages. If its port is taken it uses the
next free one. Other machines can use an SSH tunnel.
"""

from __future__ import annotations

import contextlib
import functools
import io
import re
from collections.abc import Iterator

import viser
import websockets.asyncio.server

from rhot.errors import BusError

_LOOPBACK = ("127.0.0.1", "localhost")
# Origins of the server's own page, directly or through an SSH tunnel's port; None: programs, which
# send no origin.
_ORIGINS = [re.compile(r"http://(127\.0\.0\.1|localhost)(:\d+)?"), None]


class LoopbackServer(viser.ViserServer):
    """A viser server without a public tunnel."""

    def request_share_url(self, verbose: bool = True) -> None:  # noqa: ARG002 - viser's signature
        """Do nothing, whoever asks."""
        return


@contextlib.contextmanager
def open_server(host: str, port: int) -> Iterator[LoopbackServer]:
    """A running server; port 0 or a taken one gives another (see get_port()). Stops with the block.

    Raises BusError for any host but the loopback.
    """
    if host not in _LOOPBACK:
        raise BusError(
            f"the viewer listens on {_LOOPBACK[0]} only, not on {host!r};"
            f" from another machine use `ssh -L {port}:127.0.0.1:{port}`"
        )
    # viser prints a banner and notes with rich; the services' standard output is for log lines.
    with contextlib.redirect_stdout(io.StringIO()), _own_pages_only():
        server = LoopbackServer(host="127.0.0.1", port=port, label="rhot", verbose=False)
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


@contextlib.contextmanager
def _own_pages_only() -> Iterator[None]:
    """Refuse other pages: viser passes no `origins` to websockets' serve().

    While its server starts, serve() is replaced by one that has them.
    """
    serve = websockets.asyncio.server.serve
    own_pages_only = functools.partial(serve, origins=_ORIGINS)
    websockets.asyncio.server.serve = own_pages_only  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]
