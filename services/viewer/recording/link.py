"""The recorder, as the page knows it: asked while anybody has the tab open, told what to do.

Nobody answers: state is None. What is refused stands in problem until the next request.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, RefusedError
from rhot.messages.recording import RecorderRequest, RecorderState, Recordings

# A time line moves while something is played; else people wait for nothing.
_PLAYING_S, _RESTING_S = 0.2, 1.0
# Files come and go seldom, and who recorded one wants to see it.
_LIST_S = 2.0
_TIMEOUT_S = 2.0
# Opening a long recording reads its index.
_REQUEST_S = 20.0


class RecorderLink:
    """One for all visitors; on the service's loop."""

    def __init__(self, bus: Bus) -> None:
        self.state: RecorderState | None = None
        self.recordings: Recordings | None = None
        self.problem = ""
        self._bus = bus
        self._watchers = 0
        self._wake = asyncio.Event()
        self._changed = asyncio.Event()
        self._requests: set[asyncio.Task[None]] = set()
        # A clock that stands while the replay is paused.
        self._stood_s = 0.0
        self._paused_s: float | None = None

    def watch(self) -> Callable[[], None]:
        """Somebody looks; the result ends it."""
        self._watchers += 1
        self._wake.set()

        def stop() -> None:
            self._watchers -= 1

        return stop

    async def changed(self) -> None:
        """Wait until the recorder has answered again, or has not."""
        self._changed.clear()
        await self._changed.wait()

    def ask(self, request: RecorderRequest) -> None:
        """Have something done; its outcome stands in state, recordings and problem."""
        task = asyncio.create_task(self._ask(request))
        self._requests.add(task)
        task.add_done_callback(self._requests.discard)

    async def _ask(self, request: RecorderRequest) -> None:
        self.problem = ""
        try:
            state: RecorderState = await self._bus.request(topics.RECORDER, request, _REQUEST_S)
            self._take(state)
        except RefusedError as error:
            self.problem = str(error)
        except BusError:
            self._take(None)
        self._wake.set()

    async def run(self) -> None:
        """Keep state and recordings up to date, for ever."""
        listed_s = 0.0
        while True:
            if not self._watchers:
                self._wake.clear()
                await self._wake.wait()
            states = await self._bus.get(topics.RECORDER, _TIMEOUT_S)
            self._take(states[0] if states else None)
            if time.monotonic() - listed_s >= _LIST_S and self.state is not None:
                lists = await self._bus.get(topics.RECORDINGS, _TIMEOUT_S)
                self.recordings = lists[0] if lists else self.recordings
                listed_s = time.monotonic()
            playing = self.state is not None and self.state.replay is not None
            await asyncio.sleep(_PLAYING_S if playing else _RESTING_S)

    def _take(self, state: RecorderState | None) -> None:
        self.state = state
        replay = None if state is None else state.replay
        paused = replay is not None and replay.state != "playing"
        now_s = time.monotonic()
        if paused and self._paused_s is None:
            self._paused_s = now_s
        elif not paused and self._paused_s is not None:
            self._stood_s += now_s - self._paused_s
            self._paused_s = None
        self._changed.set()

    def now_s(self) -> float:
        """time.monotonic() less the time for which the replay was paused: what was there then stays
        in the picture.
        """
        return (time.monotonic() if self._paused_s is None else self._paused_s) - self._stood_s
