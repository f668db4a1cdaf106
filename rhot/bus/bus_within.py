"""A bus for who does not wait for ever: a command, a program, but no service."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence

from rhot.bus.bus import Bus, open_bus
from rhot.bus.security.credentials import plain
from rhot.errors import BusError


@contextlib.asynccontextmanager
async def open_bus_within(
    timeout_s: float | None, rig: str, connect: Sequence[str], advice: str
) -> AsyncIterator[Bus]:
    """As open_bus(), but raises BusError if no router answers in time.

    advice: what a person should do then. A certificate that is refused is a BusError at once.
    """
    async with contextlib.AsyncExitStack() as stack:
        try:
            async with asyncio.timeout(timeout_s):
                bus = await stack.enter_async_context(
                    open_bus(rig, connect, despite_certificates=False)
                )
        except TimeoutError:
            found = ", ".join(map(plain, connect))
            raise BusError(f"no router answers at {found}; {advice}") from None
        yield bus
