"""What a process serves for a rig: its own service, and perhaps one that follows it closely.

They share a session on the bus, and what one tells the other is handed over as it is; all else is
each one's own: its streams, its tasks, its health.
"""

from __future__ import annotations

import asyncio
import importlib
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from rhot.bus.bus import Bus, open_bus
from rhot.bus.intake.rounds import Rounds
from rhot.bus.security.credentials import client_endpoints
from rhot.files.config import RigConfig
from rhot.process.certificate_watch import watch_certificate
from rhot.process.rigs.context import SERVICE
from rhot.process.service import Service

Serve = Callable[[Service], Awaitable[None]]


@dataclass(frozen=True)
class Companion:
    """A service that another one's process serves as well, if that is given `--option`.

    module holds its coroutine `serve`, as its own command has it; of tells which rigs it is for;
    text is what --help says of the option.
    """

    name: str
    option: str
    module: str
    of: Callable[[RigConfig], bool]
    text: str

    def imported(self) -> Serve:
        """What runs it, of a module that is imported only where the option is given."""
        serve: Serve = importlib.import_module(self.module).serve
        return serve


@dataclass(frozen=True)
class Served:
    """A process's own service, which one of several it is, the coroutine that runs it; and what
    runs beside it.
    """

    name: str
    instance: str
    serve: Serve
    beside: Companion | None = None

    async def serve_rig(self, config: RigConfig, rounds: Rounds | None = None) -> None:
        """Run it all for one rig until it has ended; an error of one service ends both."""
        async with (
            open_bus(config.rig.name, client_endpoints(config), rounds=rounds) as bus,
            asyncio.TaskGroup() as tasks,
        ):
            tasks.create_task(self._serve(self.name, self.serve, config, bus))
            if self.beside is not None and self.beside.of(config):
                tasks.create_task(self._serve_beside(self.beside, config, bus.beside()))

    async def _serve_beside(self, other: Companion, config: RigConfig, bus: Bus) -> None:
        SERVICE.set(other.name)
        await self._serve(other.name, other.imported(), config, bus)

    async def _serve(self, name: str, serve: Serve, config: RigConfig, bus: Bus) -> None:
        """Run a service with a task group and health of its own."""
        async with asyncio.TaskGroup() as tasks:
            service = Service(name, self.instance, config, bus, tasks)
            company = (service.beat(), service.listen(), watch_certificate(service))
            companions = [tasks.create_task(one) for one in company]
            await serve(service)
            # A source that ended (a file, a replay) ends its service; what keeps it company goes.
            for task in companions:
                task.cancel()
