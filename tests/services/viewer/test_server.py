"""The viser server keeps to itself: loopback, no tunnel, no foreign pages."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from urllib.request import urlopen

import pytest
import websockets.asyncio.server
from websockets.exceptions import InvalidStatus

from rhot.errors import BusError
from services.viewer.server import open_server


def addresses() -> list[str]:
    """This machine's addresses that are not the loopback's."""
    with contextlib.suppress(OSError):
        return [
            a for a in socket.gethostbyname_ex(socket.gethostname())[2] if not a.startswith("127.")
        ]
    return []


def test_it_listens_on_the_loopback_only(capsys: pytest.CaptureFixture[str]) -> None:
    with open_server("127.0.0.1", 0) as server:
        assert server.get_host() == "127.0.0.1"
        with urlopen(f"http://127.0.0.1:{server.get_port()}", timeout=5) as page:
            assert b"<html" in page.read()
        for address in [*addresses(), "127.0.0.2"]:
            with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
                socket.create_connection((address, server.get_port()), timeout=2).close()
    assert capsys.readouterr().out == "", "standard output is for log lines"


def test_other_hosts_are_refused_with_the_way_to_do_it() -> None:
    with pytest.raises(BusError, match="ssh -L 8080"), open_server("0.0.0.0", 8080):
        pass


def test_a_taken_port_gives_the_next() -> None:
    with open_server("127.0.0.1", 0) as first, open_server("127.0.0.1", first.get_port()) as second:
        assert second.get_port() != first.get_port()


def test_there_is_no_tunnel_even_for_a_client_that_asks(
    browse: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = threading.Event()
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *_: pytest.fail("a tunnel was opened"))
    with open_server("127.0.0.1", 0) as server:
        original = server.request_share_url
        monkeypatch.setattr(server, "request_share_url", lambda: (original(), asked.set()))
        browser = browse(server.get_port())
        theme = browser.wait_for("ThemeConfigurationMessage")  # type: ignore[attr-defined]
        assert theme["show_share_button"] is False
        browser.share()  # type: ignore[attr-defined]
        assert asked.wait(5.0)


def test_foreign_pages_are_refused(browse: Callable[..., object]) -> None:
    serve = websockets.asyncio.server.serve
    with open_server("127.0.0.1", 0) as server:
        assert websockets.asyncio.server.serve is serve, "the library is left as it was"
        for origin in (
            "http://evil.example",
            "http://127.0.0.1.evil.example",
            "https://127.0.0.1:1",
            "null",
        ):
            with pytest.raises(InvalidStatus):
                browse(server.get_port(), origin=origin)
        for origin in (f"http://127.0.0.1:{server.get_port()}", "http://localhost:9000"):
            browse(server.get_port(), origin=origin)
