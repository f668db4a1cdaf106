"""rhot: hand and object tracking from low-cost parts.

The client SDK: `rhot.connect` with asyncio, `rhot.open` without (rhot/client.py, rhot/blocking.py).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rhot.blocking import BlockingRig, open  # noqa: A004
    from rhot.client import RigClient, connect, run

_HOMES = {
    "BlockingRig": "rhot.blocking",
    "RigClient": "rhot.client",
    "connect": "rhot.client",
    "open": "rhot.blocking",
    "run": "rhot.client",
}

__all__ = ["BlockingRig", "RigClient", "connect", "open", "run"]


def __getattr__(name: str) -> Any:
    # Only on use: the offline tools and the pure modules must not load Zenoh.
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'rhot' has no attribute {name!r}")
