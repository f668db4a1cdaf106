"""What people do in a browser, handed over to the service's loop: viser has other threads."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any


def on_loop(function: Callable[[Any], None]) -> Callable[[Any], None]:
    """A callback for viser that has function(event) called on the loop that is running now."""
    loop = asyncio.get_running_loop()

    def happened(event: Any) -> None:
        # Browsers also leave because the service has ended, and its loop with it.
        if not loop.is_closed():
            loop.call_soon_threadsafe(function, event)

    return happened
