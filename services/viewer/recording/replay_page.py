"""A page of its own for what is replayed, beside the live one, while a recording is open.

It is the same page on another rig's name: nobody's live view changes because somebody replays.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

import msgspec

from rhot.bus.bus import open_bus
from rhot.bus.security.credentials import client_endpoints
from rhot.process.service import Service
from services.viewer.recording.link import RecorderLink

log = logging.getLogger("rhot.viewer")

# What the page is called on the bus: a recording may hold health of the page that was open then.
INSTANCE = "replay"


class ReplayPage:
    """Opens and closes the page; `show` is what makes one, for ever: the service's own."""

    def __init__(
        self, service: Service, link: RecorderLink, show: Callable[[Service], Awaitable[None]]
    ) -> None:
        self.page: Service | None = None
        self._service, self._link, self._show = service, link, show

    @property
    def port(self) -> int:
        """Of the page, 0 while there is none."""
        return int(self.page.values.get("port", 0)) if self.page is not None else 0

    def _rig(self) -> str:
        """The rig's name that is replayed to, "" if nothing is, or if it is this page's."""
        replay = self._link.state.replay if self._link.state is not None else None
        own = self._service.config.rig.name
        return replay.rig if replay is not None and replay.rig != own else ""

    async def run(self) -> None:
        """Have a page there while a recording is open, for ever."""
        while True:
            while not (rig := self._rig()):
                await self._link.changed()
            async with (
                open_bus(rig, client_endpoints(self._service.config)) as bus,
                asyncio.TaskGroup() as tasks,
            ):
                config = msgspec.structs.replace(
                    self._service.config,
                    rig=msgspec.structs.replace(self._service.config.rig, name=rig),
                )
                self.page = Service("viewer", INSTANCE, config, bus, tasks)
                showing = tasks.create_task(_forever(self._show, self.page))
                try:
                    while self._rig() == rig:
                        await self._link.changed()
                finally:
                    self.page = None
                    showing.cancel()


async def _forever(show: Callable[[Service], Awaitable[None]], page: Service) -> None:
    await show(page)
