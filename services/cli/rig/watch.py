"""Says when a rig that `rhot up` has started is up, where its live view is, and what is missing."""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.security.credentials import client_endpoints
from rhot.files.config import RigConfig
from rhot.files.viewer_access import page_address
from services.cli.rig.readiness import Missing, Readiness

_POLL_S = 0.25
# A state is told once it has lasted: starting services come one after the other, and a service that
# is started again is back within a second or two.
_LASTED_S = 2.0
# Most rigs are up within this time; before, there is nothing to complain of.
_PATIENCE_S = 8.0
# What is missing is told again, if it has changed, so often.
_TELL_AGAIN_S = 10.0


class RigWatch:
    """Watches the rig over the bus, and tells each change of its state once, by say(line)."""

    def __init__(
        self, config: RigConfig, path: Path, children: Sequence[str], say: Callable[[str], None]
    ) -> None:
        self._config, self._path, self._say = config, path, say
        self._readiness = Readiness(config, children)
        self._started_s = self._since_s = time.monotonic()
        self._told_s = self._started_s + _PATIENCE_S - _TELL_AGAIN_S
        self._state: list[tuple[str, str]] | None = None
        self._told: list[tuple[str, str]] | None = None
        self._was_up = False
        self._port = 0

    async def run(self, reasons: Mapping[str, str]) -> None:
        """For ever; reasons are why processes that have ended did so, as they come."""
        # A router that is not there yet is told here, as all that is missing.
        logging.getLogger("rhot.bus").setLevel(logging.ERROR)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._listen())
            while True:
                await asyncio.sleep(_POLL_S)
                self._look(self._readiness.missing(reasons), time.monotonic())

    async def _listen(self) -> None:
        async with open_bus(self._config.rig.name, client_endpoints(self._config)) as bus:
            self._readiness.router = True
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._follow_alive(bus))
                tasks.create_task(self._follow_health(bus))

    async def _follow_alive(self, bus: Bus) -> None:
        async for change in bus.watch_alive():
            self._readiness.note_alive(change)

    async def _follow_health(self, bus: Bus) -> None:
        async for beat in bus.every(topics.HEALTH, 64):
            self._readiness.note_health(beat)

    def _look(self, missing: Sequence[Missing], now_s: float) -> None:
        self._tell_view()
        state = [(one.who, one.kind) for one in missing]
        if state != self._state:
            self._state, self._since_s = state, now_s
        due = not missing or now_s - self._told_s >= _TELL_AGAIN_S
        if state != self._told and due and now_s - self._since_s >= _LASTED_S:
            self._tell(missing, self._since_s - self._started_s)
            self._told, self._told_s = state, now_s

    def _tell_view(self) -> None:
        """The address of the live view, once it serves and whenever it changes."""
        port = self._readiness.viewer_port
        if port and port != self._port:
            self._port = port
            address = page_address(self._config.viewer, port, socket.gethostname())
            self._say(f"live view: {address}")

    def _tell(self, missing: Sequence[Missing], after_s: float) -> None:
        name = f"rig {self._config.rig.name!r}"
        if not missing:
            again = " again" if self._was_up else f" after {after_s:.0f} s"
            self._was_up = True
            where = ", ".join(self._config.bus.listen)
            self._say(f"{name} is up{again}, router at {where}; `rhot top --config {self._path}`")
            return
        state = "not up" if self._was_up else "not up yet"
        self._say(f"{name} is {state}:")
        for one in missing:
            self._say(f"  {one.who}: {one.why.splitlines()[0]}")
