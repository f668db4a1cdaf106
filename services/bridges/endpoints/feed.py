"""The rig's hands and objects as frames, for every bridge alike: `async for frame in Feed(...)`."""

from __future__ import annotations

import asyncio
import contextlib
import time

from rhot import topics
from rhot.process.service import Service
from services.bridges.pacing import Frame, Newest, Pacer
from services.bridges.screening import hand_is_plausible, object_is_plausible

# Without anything new a frame comes all the same, so often: losing a hand is told, and programs
# that watch for a sign of life get one.
_IDLE_S = 0.1


class Feed:
    """Frames as poses come, rate_hz at most; who is slow gets the newest, and nothing waits."""

    def __init__(self, service: Service, rate_hz: float) -> None:
        self._newest = Newest(time.monotonic())
        self._pacer = Pacer(rate_hz)
        self._woken = asyncio.Event()
        self._poses = service.bus.latest(topics.POSE)
        self._objects = service.bus.latest(topics.OBJECT)
        service.tasks.create_task(self._take_hands())
        service.tasks.create_task(self._take_objects())

    def __aiter__(self) -> Feed:
        return self

    async def __anext__(self) -> Frame:
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_IDLE_S):
                await self._woken.wait()
        # Also where there is nothing to wait for: others of this loop get their turn.
        await asyncio.sleep(self._pacer.wait_s(time.monotonic()))
        self._woken.clear()
        now_s = time.monotonic()
        self._pacer.went(now_s)
        return self._newest.frame(now_s)

    async def _take_hands(self) -> None:
        async for pose in self._poses:
            if not hand_is_plausible(pose):
                self._poses.stats.rejected += 1
                continue
            self._newest.hand(pose, time.monotonic())
            self._woken.set()

    async def _take_objects(self) -> None:
        async for pose in self._objects:
            if not object_is_plausible(pose):
                self._objects.stats.rejected += 1
                continue
            self._newest.object(pose, time.monotonic())
            self._woken.set()
