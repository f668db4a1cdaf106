"""Who may open the page: this machine alone, or whoever has the token. Pure.

The page shows what cameras see and starts recordings and calibrations: beyond the loopback it is
opened with a secret only, which is part of its address.
"""

from __future__ import annotations

import secrets

from rhot.files.rig_tables import Viewer

LOOPBACK = ("127.0.0.1", "localhost", "::1")
# Addresses at which a server listens on all its networks: no browser can ask for them.
_EVERYWHERE = ("0.0.0.0", "::")
# 24 random bytes: nobody guesses them, and they fit on one line.
_TOKEN_BYTES = 24


def access_problem(viewer: Viewer) -> str | None:
    """What is wrong with [viewer] host and token, and what to write instead."""
    if viewer.host in LOOPBACK or viewer.token:
        return None
    made = secrets.token_urlsafe(_TOKEN_BYTES)
    return (
        f"[viewer] host: at {viewer.host!r} other machines reach the page, so it needs a token; "
        f'for example this one, made just now: token = "{made}" (or leave host at "127.0.0.1" and '
        f"use `ssh -L {viewer.port}:127.0.0.1:{viewer.port} MASTER`)"
    )


def page_address(viewer: Viewer, port: int, hostname: str = "") -> str:
    """What to open in a browser; hostname is this machine's, for who listens everywhere."""
    host = hostname or "127.0.0.1" if viewer.host in _EVERYWHERE else viewer.host
    shown = f"[{host}]" if ":" in host else host
    return f"http://{shown}:{port}" + (f"/?token={viewer.token}" if viewer.token else "")
