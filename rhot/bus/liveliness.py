"""Services that come and go, as Zenoh's liveliness tokens tell."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import zenoh

from rhot.bus.intake.buffer import Buffer
from rhot.topics import ALIVE


@dataclass(frozen=True)
class Alive:
    """A service that came or went."""

    service: str
    instance: str
    alive: bool


class AliveWatch(Buffer[Alive]):
    """Liveliness tokens as they come and go."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        super().__init__(loop, 1024)

    def declare(self, session: zenoh.Session, key: str) -> None:
        self._entity = session.liveliness().declare_subscriber(key, self._on_sample, history=True)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        names = ALIVE.names(key)
        if names is not None:
            self.push(
                key, Alive(names["service"], names["instance"], sample.kind == zenoh.SampleKind.PUT)
            )

    def __aiter__(self) -> AliveWatch:
        return self

    async def __anext__(self) -> Alive:
        return await self.take()
