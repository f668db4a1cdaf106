"""Who looks at the page: a Visit for each browser, from its coming to its going.

viser tells of both on a thread of its own; visits are opened, updated and closed on the service's
loop.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TypeVar

import viser

from services.viewer.visits.section import Head, Section, Seen
from services.viewer.visits.visit import Visit

T = TypeVar("T")


class Visits:
    """All visits of one server; `anybody` is set while there is one. Made on the service's loop."""

    def __init__(self, server: viser.ViserServer, head: Head, sections: Sequence[Section]) -> None:
        self.anybody = asyncio.Event()
        self._head, self._sections = head, sections
        self._visits: dict[int, Visit] = {}
        self._loop = asyncio.get_running_loop()
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)

    def __len__(self) -> int:
        return len(self._visits)

    def update(self, seen: Seen) -> None:
        """Bring every visitor's page up to date."""
        for visit in self._visits.values():
            visit.update(seen)

    def close(self) -> None:
        """End all visits, as the service ends."""
        for client_id in list(self._visits):
            self._close(client_id)

    # Coroutines, so that viser runs them one after the other on its own loop instead of in a pool
    # of threads.

    async def _connected(self, client: viser.ClientHandle) -> None:
        self._hand_over(self._open, client)

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        self._hand_over(self._close, client.client_id)

    def _hand_over(self, function: Callable[[T], None], argument: T) -> None:
        # Browsers also leave because the service has ended, and its loop with it.
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function, argument)

    def _open(self, client: viser.ClientHandle) -> None:
        self._visits[client.client_id] = Visit(client, self._head, self._sections)
        self.anybody.set()

    def _close(self, client_id: int) -> None:
        visit = self._visits.pop(client_id, None)
        if visit is not None:
            visit.close()
        if not self._visits:
            self.anybody.clear()
