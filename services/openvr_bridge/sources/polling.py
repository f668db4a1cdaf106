"""SteamVR, polled at a steady rate in a thread of its own, as an asynchronous iteration of sweeps.

A call of openvr may take as long as it likes without keeping the event loop waiting. What the loop
does not take in time is dropped, oldest first, and counted.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

from rhot.bus.intake.buffer import Buffer
from rhot.errors import RhotError, SourceError
from services.openvr_bridge.events import QUIT
from services.openvr_bridge.sweep import Sweep

# Sweeps that may wait for a busy event loop: a quarter of a second at 250 Hz.
_WAITING = 64
# SteamVR answers within a millisecond once it runs; connecting takes some seconds.
_SILENT_S, _CONNECT_S = 3.0, 30.0
# A sweep is over by then, or hangs.
_STOP_S = 2.0


class Connection(Protocol):
    """What is polled: services.openvr_bridge.sources.steamvr.SteamVr."""

    def sweep(self) -> Sweep: ...
    def acknowledge_quit(self) -> None: ...
    def close(self) -> None: ...


class StuckError(RhotError):
    """A call of openvr does not come back: only a new process helps."""


class Polling:
    """Sweeps, as they come; raises SourceError when SteamVR is missing or quits."""

    def __init__(self, connect: Callable[[], Connection], rate_hz: float) -> None:
        loop = asyncio.get_running_loop()
        self.dropped = 0
        # Sweeps that began later than one period after they were due.
        self.late = 0
        self._connect, self._period_s = connect, 1.0 / rate_hz
        self._sweeps: Buffer[Sweep | Exception] = Buffer(loop, _WAITING)
        self._stopping = False
        self._heard = False
        # A daemon: one that hangs within openvr must not keep the process alive.
        self._thread = threading.Thread(target=self._run, name="steamvr", daemon=True)

    def start(self) -> None:
        """Begin to poll."""
        self._thread.start()

    def stop(self) -> None:
        """End polling; waits for the last sweep, though not for ever."""
        self._stopping = True
        if self._thread.is_alive():
            self._thread.join(_STOP_S)

    async def next(self) -> Sweep:
        """The next sweep. Raises StuckError if SteamVR does not answer."""
        try:
            async with asyncio.timeout(_SILENT_S if self._heard else _CONNECT_S):
                found = await self._sweeps.take()
        except TimeoutError:
            raise StuckError(
                "SteamVR does not answer any more: the bridge starts anew; if that does not help,"
                " restart SteamVR"
            ) from None
        if isinstance(found, Exception):
            raise found
        self._heard = True
        return found

    def _run(self) -> None:
        try:
            self._poll()
        # Whatever it is: it is raised where sweeps are awaited.
        except Exception as error:
            self._sweeps.push("", error)

    def _poll(self) -> None:
        connection = self._connect()
        try:
            due_s = time.perf_counter()
            while not self._stopping:
                sweep = connection.sweep()
                self.dropped += self._sweeps.push("", sweep)
                if any(event.kind == QUIT for event in sweep.events):
                    connection.acknowledge_quit()
                    raise SourceError("SteamVR quit; start it again")
                now_s = time.perf_counter()
                self.late += now_s > due_s + 2.0 * self._period_s
                # A sweep that took too long is not made up for.
                due_s = max(due_s + self._period_s, now_s)
                time.sleep(due_s - now_s)
        finally:
            connection.close()


@contextlib.contextmanager
def polling(connect: Callable[[], Connection], rate_hz: float) -> Iterator[Polling]:
    """Poll what connect() opens for as long as the block lasts."""
    poll = Polling(connect, rate_hz)
    poll.start()
    try:
        yield poll
    finally:
        poll.stop()
