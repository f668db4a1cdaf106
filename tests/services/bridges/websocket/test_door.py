"""Who may connect."""

from __future__ import annotations

import pytest

from rhot.errors import ConfigError
from services.bridges.websocket.door import Door

TOKEN = "correct horse battery"
HERE = "127.0.0.1:8766"


def status(door: Door, host: str | None, origin: str | None, path: str = "/", bearer: str = ""):
    refused = door.refuses(host, origin, path, bearer)
    return None if refused is None else refused.status


@pytest.mark.parametrize(
    ("host", "origin", "expected"),
    [
        # A program, this server's own page, and one that rig.toml names.
        (HERE, None, None),
        ("localhost:8766", "http://localhost:8766", None),
        ("[::1]:8766", "http://[::1]:8766", None),
        (HERE, "http://localhost:3000", None),
        # A page of anywhere in a browser of this machine; a local file.
        (HERE, "https://evil.example", 403),
        (HERE, "null", 403),
        # A name of theirs that leads to 127.0.0.1: host and origin agree.
        ("evil.example:8766", "http://evil.example:8766", 403),
        ("127.0.0.1.evil.example", None, 403),
        (None, None, 403),
        ("", "", 403),
        ("[", None, 403),
    ],
)
def test_foreign_pages_stay_out(host, origin, expected):
    door = Door("127.0.0.1", "", ("http://localhost:3000",), "bridges.websocket")
    assert status(door, host, origin) == expected


def test_other_machines_need_a_token():
    with pytest.raises(ConfigError, match="give it a token of 16"):
        Door("0.0.0.0", "", (), "bridges.websocket")
    with pytest.raises(ConfigError, match="has 5 letters"):
        Door("127.0.0.1", "short", (), "bridges.websocket")
    door = Door("192.168.1.5", TOKEN, (), "bridges.websocket")
    for path, bearer, expected in (
        ("/", "", 401),
        ("/?token=wrong", "", 401),
        ("/?token=correct%20horse%20battery", "", None),
        ("/", f"Bearer {TOKEN}", None),
        ("/", "Bearer \udce4", 401),
    ):
        assert status(door, "192.168.1.5:8766", None, path, bearer) == expected


def test_what_is_free_needs_no_token_but_the_right_name():
    door = Door("127.0.0.1", TOKEN, (), "bridges.webxr")
    assert door.refuses(HERE, None, "/xr", "", free=True) is None
    assert door.refuses("evil.example", None, "/xr", "", free=True) is not None
