"""One recording replayed on request: opened, played, paused, jumped in, closed.

What is replayed goes out under a rig's name of its own, at the rates that requests allow; a line
that is full drops it, as live data, which it must not hold up. What goes wrong while it plays
closes the recording and stands in note.
"""

from __future__ import annotations

import asyncio
from pathlib import Path

from rhot.bus.bus import Bus
from rhot.errors import CaptureError, RefusedError
from rhot.messages.recording import RecorderRequest, Replay
from services.recorder.sources.playback import Playback
from services.recorder.sources.replay import publishing


class Deck:
    """At most one recording, published on `bus` under the name `rig`."""

    def __init__(self, bus: Bus, rig: str) -> None:
        self.rig = rig
        self.note = ""
        self._publish = publishing(bus, patient=False)
        self._playback: Playback | None = None
        self._task: asyncio.Task[None] | None = None

    async def open(
        self,
        path: Path,
        *,
        rate: float = 1.0,
        loop: bool = False,
        window_ns: tuple[int, int] | None = None,
    ) -> None:
        """Play a recording, in place of the one before; raises CaptureError if it cannot be."""
        playback = await asyncio.to_thread(self._load, path, rate, loop, window_ns)
        await self.close()
        self.note, self._playback = "", playback
        self._task = asyncio.create_task(self._play(playback))

    def _load(
        self, path: Path, rate: float, loop: bool, window_ns: tuple[int, int] | None
    ) -> Playback:
        return Playback(
            path, self.rig, self._publish, rate=rate, loop=loop, window_ns=window_ns, stay=True
        )

    async def _play(self, playback: Playback) -> None:
        try:
            await playback.run()
        except CaptureError as error:
            self.note = str(error)
            if self._playback is playback:
                self._playback = None

    async def close(self) -> None:
        """End the replay, if there is one."""
        task, self._task, self._playback = self._task, None, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])

    async def control(self, request: RecorderRequest) -> None:
        """Play, pause, set or close; raises RefusedError without a recording."""
        playback = self._playback
        if playback is None:
            raise RefusedError(
                'nothing is being replayed: ask for "open" with the name of a recording', "invalid"
            )
        if request.do == "close":
            await self.close()
        elif request.do == "pause":
            playback.pause()
        else:
            self._set(playback, request)
            if request.do == "play":
                playback.play()

    def _set(self, playback: Playback, request: RecorderRequest) -> None:
        if request.loop is not None:
            playback.loop = request.loop
        if request.rate is not None:
            playback.set_rate(request.rate)
        if request.at_s is not None:
            summary = playback.summary
            begin_ns = summary.start_ns if request.at_s >= 0.0 else summary.end_ns
            playback.seek(begin_ns + round(request.at_s * 1e9))

    def state(self) -> Replay | None:
        """What is open."""
        playback = self._playback
        if playback is None:
            return None
        summary = playback.summary
        return Replay(
            name=playback.path.name,
            rig=self.rig,
            recorded_rig=summary.rig,
            state=playback.state,
            at_s=round((playback.position_ns - summary.start_ns) * 1e-9, 3),
            duration_s=round(max(0.0, summary.duration_s), 3),
            rate=playback.rate,
            loop=playback.loop,
        )
