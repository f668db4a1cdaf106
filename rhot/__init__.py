"""rhot: hand and object tracking from low-cost parts. `rhot.connect` is the client SDK.

See rhot/client.py.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rhot.client import RigClient, connect

__all__ = ["RigClient", "connect"]


def __getattr__(name: str) -> Any:
    # Only on use: the offline tools and the pure modules must not load Zenoh.
    if name in __all__:
        from rhot import client

        return getattr(client, name)
    raise AttributeError(f"module 'rhot' has no attribute {name!r}")
