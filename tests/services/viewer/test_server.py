"""The viser server keeps to itself: loopback or a token, no tunnel, no foreign pages."""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import websockets.asyncio.server
from websockets.exceptions import InvalidStatus

from rhot.errors import ConfigError
from rhot.files.rig_tables import Viewer
from services.viewer.server import LoneServer, open_server

TOKEN = "a-secret_of-16-or-more"


def addresses() -> list[str]:
    """This machine's addresses that are not the loopback's."""
    with contextlib.suppress(OSError):
        return [
            a for a in socket.gethostbyname_ex(socket.gethostname())[2] if not a.startswith("127.")
        ]
    return []


@pytest.fixture(scope="module")
def local() -> Iterator[LoneServer]:
    """A server for this machine only."""
    with open_server(Viewer(port=0)) as server:
        yield server


@pytest.fixture(scope="module")
def guarded() -> Iterator[LoneServer]:
    """A server that wants a token; here it listens on the loopback, too."""
    with open_server(Viewer(port=0, token=TOKEN)) as server:
        yield server


def ask(server: LoneServer, target: str = "/", **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of a GET."""
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=10)
    with contextlib.closing(connection):
        connection.request("GET", target, headers=headers)
        answer = connection.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()


def refused(browse: Callable[..., object], server: LoneServer, **options: Any) -> int:
    """The status with which a websocket is refused."""
    with pytest.raises(InvalidStatus) as told:
        browse(server.get_port(), **options)
    return int(told.value.response.status_code)


def test_it_listens_on_the_loopback_only(capsys: pytest.CaptureFixture[str]) -> None:
    with open_server(Viewer(port=0)) as server:
        assert server.get_host() == "127.0.0.1"
        for address in [*addresses(), "127.0.0.2"]:
            with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
                socket.create_connection((address, server.get_port()), timeout=2).close()
    assert capsys.readouterr().out == "", "standard output is for log lines"


def test_the_page_is_called_rhot_and_asks_nothing_of_other_machines(local: LoneServer) -> None:
    status, headers, page = ask(local)
    assert status == 200
    assert b"<title>rhot</title>" in page
    assert b"Viser</title>" not in page
    assert page.count(b'rel="icon"') == 1
    assert headers["Content-Security-Policy"].startswith("default-src 'self' data: blob:")
    assert "Set-Cookie" not in headers
    assert ask(local, "/../../etc/passwd")[0] == 404


def test_other_hosts_need_a_token() -> None:
    with pytest.raises(ConfigError, match=r'needs a token.*token = "'):
        open_server(Viewer(host="0.0.0.0")).__enter__()


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid"])
def test_an_address_of_another_machine_is_refused_at_once(host: str) -> None:
    table = Viewer(host=host, token=TOKEN)
    with pytest.raises(ConfigError, match="no address of this machine"):
        open_server(table).__enter__()


def test_a_taken_port_gives_the_next(local: LoneServer) -> None:
    with open_server(Viewer(port=local.get_port())) as second:
        assert second.get_port() != local.get_port()


def test_there_is_no_tunnel_even_for_a_client_that_asks(
    browse: Callable[..., object], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = threading.Event()
    monkeypatch.setattr("viser._viser.ViserTunnel", lambda *_: pytest.fail("a tunnel was opened"))
    with open_server(Viewer(port=0)) as server:
        original = server.request_share_url
        monkeypatch.setattr(server, "request_share_url", lambda: (original(), asked.set()))
        browser = browse(server.get_port())
        theme = browser.wait_for("ThemeConfigurationMessage")  # type: ignore[attr-defined]
        assert theme["show_share_button"] is False
        browser.share()  # type: ignore[attr-defined]
        assert asked.wait(5.0)


def test_foreign_pages_are_refused(browse: Callable[..., object], local: LoneServer) -> None:
    serve = websockets.asyncio.server.serve
    with open_server(Viewer(port=0)):
        assert websockets.asyncio.server.serve is serve, "the library is left as it was"
    for origin in (
        "http://evil.example",
        "http://127.0.0.1.evil.example",
        "https://127.0.0.1:1",
        "null",
    ):
        assert refused(browse, local, origin=origin) == 403
    for origin in (f"http://127.0.0.1:{local.get_port()}", "http://localhost:9000"):
        browse(local.get_port(), origin=origin)


def test_a_name_that_was_made_to_point_here_gets_nothing(local: LoneServer) -> None:
    for host in ("evil.example:8080", "localhost.evil.example", "127.0.0.1@evil.example", ""):
        status, _, body = ask(local, Host=host)
        assert (status, b"html" in body) == (403, False)
    assert ask(local, Host="localhost:9000")[0] == 200


def test_without_the_token_nothing_is_answered(
    browse: Callable[..., object], guarded: LoneServer
) -> None:
    for target in ("/", "/?token=", "/?token=wrong", f"/?token={TOKEN[:-1]}", "/?token=%ff%fe"):
        status, headers, body = ask(guarded, target)
        assert status == 401
        assert b"<html" not in body
        assert b"needs its token" in body
        assert TOKEN not in str(headers)
        assert refused(browse, guarded, target=target) == 401
    assert ask(guarded, "/", Cookie='rhot_="; x=\xff')[0] == 401


def test_the_token_opens_page_and_websocket(
    browse: Callable[..., object], guarded: LoneServer
) -> None:
    status, headers, page = ask(guarded, f"/?token={TOKEN}")
    assert status == 200
    assert b"<title>rhot</title>" in page
    cookie, *rest = headers["Set-Cookie"].split("; ")
    assert set(rest) == {"Path=/", "HttpOnly", "SameSite=Strict"}
    assert ask(guarded, "/", Cookie=cookie)[0] == 200
    own = {"origin": f"http://127.0.0.1:{guarded.get_port()}"}
    browse(guarded.get_port(), additional_headers={"Cookie": cookie}, **own)
    browse(guarded.get_port(), target=f"/?token={TOKEN}")
    # With it, but from another page: a browser that was here sends its cookie along.
    for origin in ("http://evil.example", "null"):
        told = refused(browse, guarded, additional_headers={"Cookie": cookie}, origin=origin)
        assert told == 403


def test_headers_that_come_twice_are_refused(local: LoneServer) -> None:
    with socket.create_connection(("127.0.0.1", local.get_port()), timeout=10) as line:
        line.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n")
        assert line.recv(4096).startswith(b"HTTP/1.1 400 ")
