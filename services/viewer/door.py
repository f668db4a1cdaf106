"""Who may come in: decided from a request's address and headers, before anything is answered. Pure.

Without a token the page is for browsers of this machine: a Host that is not the loopback's is a
page of another name that was made to point here (DNS rebinding), and a foreign Origin is another
page open in the same browser. Both are refused, page and websocket alike. With a token, whoever has
it comes in, from any machine, but still from the page's own address only.
"""

from __future__ import annotations

import hashlib
import hmac
import re
from collections.abc import Mapping
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

_LOCAL_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?\Z", re.IGNORECASE)
_LOCAL_ORIGIN = re.compile(r"http://(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?\Z", re.IGNORECASE)
_NO_TOKEN = (
    "This page needs its token: open the address that `rhot up` or the viewer's log shows, "
    "http://.../?token=...; the token is in rig.toml, [viewer] token.\n"
)
_OTHER_HOST = "This page is for browsers of its own machine: open http://127.0.0.1 at this port.\n"
_OTHER_PAGE = "Another page may not use this one.\n"
Refused = tuple[HTTPStatus, str]


class Door:
    """Lets in who may; token is "" where only this machine is served."""

    def __init__(self, token: str = "") -> None:
        self._token = token
        # Two rigs on one machine share a browser's cookies, whatever their ports.
        self._name = "rhot_" + hashlib.sha256(token.encode()).hexdigest()[:8]

    def refusal(self, target: str, headers: Mapping[str, str]) -> Refused | None:
        """Why a request for a target (path and query) is refused; None lets it in."""
        host, origin = headers.get("Host", ""), headers.get("Origin")
        if self._token:
            if not self._has_token(target, headers.get("Cookie", "")):
                return HTTPStatus.UNAUTHORIZED, _NO_TOKEN
            own = origin is None or origin.partition("://")[2].lower() == host.lower()
            return None if own else (HTTPStatus.FORBIDDEN, _OTHER_PAGE)
        if not _LOCAL_HOST.match(host):
            return HTTPStatus.FORBIDDEN, _OTHER_HOST
        # Programs send no origin.
        if origin is not None and not _LOCAL_ORIGIN.match(origin):
            return HTTPStatus.FORBIDDEN, _OTHER_PAGE
        return None

    @property
    def cookie(self) -> str:
        """What a browser that came in is to send with its websocket; "" where none is needed."""
        return f"{self._name}={self._token}; Path=/; HttpOnly; SameSite=Strict" * bool(self._token)

    def _has_token(self, target: str, cookies: str) -> bool:
        given = [*_query_tokens(target), _cookie(cookies, self._name)]
        # All of them, each in constant time: how long it takes says nothing of the token.
        same = [hmac.compare_digest(_bytes(one), _bytes(self._token)) for one in given]
        return any(same)


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


def _query_tokens(target: str) -> list[str]:
    try:
        # Two are enough to tell that there is more than one.
        return parse_qs(urlsplit(target).query, max_num_fields=8).get("token", [])[:2]
    except ValueError:
        return []


def _cookie(cookies: str, name: str) -> str:
    try:
        found = SimpleCookie(cookies).get(name)
    except CookieError:
        return ""
    return "" if found is None else found.value
