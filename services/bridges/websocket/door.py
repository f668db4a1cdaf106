"""Who may connect: programs of this machine, pages of this server, and who shows the token. Pure.

A web page of anywhere can open a WebSocket to 127.0.0.1 from a visitor's browser, which says whose
page it is (Origin, RFC 6455 section 10.2); and a name of anybody's may lead to 127.0.0.1 (DNS
rebinding), which the Host that was asked for gives away.
"""

from __future__ import annotations

import hmac
import re
from collections.abc import Sequence
from typing import NamedTuple
from urllib.parse import parse_qs

from rhot.errors import ConfigError

LOOPBACK = ("127.0.0.1", "localhost", "::1")
# 16 letters are more guesses than anybody makes over a network.
MIN_TOKEN = 16
_HOST = re.compile(r"(?:\[([0-9A-Fa-f:.]+)\]|([^:\[\]/@]+))(?::\d+)?\Z")


class Refused(NamedTuple):
    """Why somebody is sent away: an HTTP status and a sentence."""

    status: int
    reason: str


class Door:
    """Who may connect to a server of one bridge."""

    def __init__(self, host: str, token: str, origins: Sequence[str], table: str) -> None:
        """Raises ConfigError if others than this machine could connect without a token.

        table is the name of its table in rig.toml.
        """
        if token and len(token) < MIN_TOKEN:
            raise ConfigError(f"[{table}] token has {len(token)} letters; give it {MIN_TOKEN}")
        if host not in LOOPBACK and not token:
            raise ConfigError(
                f"[{table}] host = {host!r} lets other machines connect: give it a token of "
                f"{MIN_TOKEN} letters or more, or keep 127.0.0.1 and use "
                "`ssh -L PORT:127.0.0.1:PORT MASTER`"
            )
        self._here = host in LOOPBACK
        self._token = token
        self._origins = frozenset(origins)
        self._table = table

    def refuses(
        self, host: str | None, origin: str | None, path: str, bearer: str, *, free: bool = False
    ) -> Refused | None:
        """Why a request is refused; None if it may pass.

        host, origin and bearer are its headers Host, Origin and Authorization. What is free needs
        no token.
        """
        if self._here and _name_in(host or "") not in LOOPBACK:
            return Refused(403, f"this server is {LOOPBACK[0]}; ask for it by that name")
        if origin is not None and not self._knows(origin, host or ""):
            return Refused(
                403, f"pages of {origin[:80]} may not connect; see `origins` of [{self._table}]"
            )
        if self._token and not free and not self._shows_token(path, bearer):
            return Refused(401, f"needs ?token=... or Authorization: Bearer; see [{self._table}]")
        return None

    def _knows(self, origin: str, host: str) -> bool:
        return origin in self._origins or origin in (f"http://{host}", f"https://{host}")

    def _shows_token(self, path: str, bearer: str) -> bool:
        shown = parse_qs(path.partition("?")[2]).get("token", [""])[-1]
        if bearer.startswith("Bearer "):
            shown = bearer.removeprefix("Bearer ")
        return hmac.compare_digest(shown.encode(errors="replace"), self._token.encode())


def _name_in(host: str) -> str:
    """The name of a Host header without its port; "" if it is none."""
    match = _HOST.match(host)
    return "" if match is None else (match[1] or match[2]).lower()
