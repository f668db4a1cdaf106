"""What a running rig answers when it is asked: who is alive, colours and exposures of trackers.

Nobody waits for a rig that does not run: without a router the answer is there within a second or
two, and says so.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.security.credentials import client_endpoints
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.messages.camera import Colors, ExposureControl

# A router on the same network answers within milliseconds, a busy one within half a second.
_ROUTER_S = 2.0
_ANSWER_S = 1.5
# Liveliness tokens that are there arrive at once; longer than any network's delay.
_ALIVE_S = 0.5


@dataclass(frozen=True)
class Answers:
    """What was answered; why_not says why no router did."""

    router: bool = False
    why_not: str = ""
    alive: frozenset[tuple[str, str]] = frozenset()
    colors: dict[str, Colors] = field(default_factory=dict)
    exposures: dict[str, ExposureControl] = field(default_factory=dict)


def ask_rig(config: RigConfig, cameras: Sequence[str]) -> Answers:
    """Ask the rig of a rig.toml, and the trackers of these cameras."""
    return asyncio.run(_ask(config, cameras))


async def _ask(config: RigConfig, cameras: Sequence[str]) -> Answers:
    async with contextlib.AsyncExitStack() as stack:
        try:
            async with asyncio.timeout(_ROUTER_S):
                opening = open_bus(
                    config.rig.name, client_endpoints(config), despite_certificates=False
                )
                bus = await stack.enter_async_context(opening)
        except TimeoutError:
            return Answers(why_not="it does not run, or cannot be reached from here")
        except BusError as error:
            return Answers(why_not=str(error))
        return await _ask_on(bus, cameras)


async def _ask_on(bus: Bus, cameras: Sequence[str]) -> Answers:
    watch, alive = bus.watch_alive(), set()
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_ALIVE_S):
            async for change in watch:
                alive.add((change.service, change.instance))
    colors, exposures = await asyncio.gather(
        asyncio.gather(*(bus.get(topics.COLORS, _ANSWER_S, camera=name) for name in cameras)),
        asyncio.gather(*(bus.get(topics.EXPOSURE, _ANSWER_S, camera=name) for name in cameras)),
    )
    return Answers(
        router=True,
        alive=frozenset(alive),
        colors={name: got[0] for name, got in zip(cameras, colors, strict=True) if got},
        exposures={name: got[0] for name, got in zip(cameras, exposures, strict=True) if got},
    )
