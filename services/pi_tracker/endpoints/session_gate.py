"""Waits for the start broadcast, and after a restart asks whether it has been given.

Late or missing: it asks every second until somebody answers, so a tracker that restarts, or starts
before its master, carries on by itself. A broadcast that says stop pauses the tracker.
"""

from __future__ import annotations

import asyncio

from rhot import topics
from rhot.bus.bus import Bus
from rhot.messages import Session

_ASK_EVERY_S = 1.0


class SessionGate:
    """Whether the rig is to work, as the last broadcast or answer said."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._session: Session | None = None
        self._started = asyncio.Event()

    @property
    def known(self) -> bool:
        """Whether anybody has said how the session stands."""
        return self._session is not None

    @property
    def running(self) -> bool:
        return self._session is not None and self._session.running

    async def started(self) -> Session:
        """The session, once it runs."""
        while self._session is None or not self._session.running:
            self._started.clear()
            await self._started.wait()
        return self._session

    async def follow(self) -> None:
        """Listen for ever, and ask until there is an answer."""
        broadcasts = self._bus.latest(topics.SESSION)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._ask())
            async for session in broadcasts:
                self._take(session)

    async def _ask(self) -> None:
        while self._session is None:
            answers = await self._bus.get(topics.SESSION, timeout_s=_ASK_EVERY_S)
            # A broadcast may have come meanwhile; it is newer than any answer.
            if answers and self._session is None:
                self._take(answers[0])
            else:
                await asyncio.sleep(_ASK_EVERY_S)

    def _take(self, session: Session) -> None:
        self._session = session
        if session.running:
            self._started.set()
