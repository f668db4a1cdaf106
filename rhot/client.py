"""The client SDK: a rig's poses in a few lines.

    async with rhot.connect("tcp/127.0.0.1:7447") as rig:
        async for pose in rig.hand_poses("right"):
            print(pose.wrist.position_m)

Streams end with the `async with` block. Nothing arrives while nothing is sent; a router that dies
and returns is met again by itself. By default a stream skips to the newest message (`latest`); with
queue=n it delivers every message through a queue of n that drops the oldest.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator
from typing import TypeVar

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.streams import AliveWatch, Subscription
from rhot.camera_messages import Colors, ExposureControl
from rhot.errors import BusError, CalibrationError
from rhot.hand import HandName
from rhot.messages import HandPoints, HandPose, Health, MarkerFrame, ObjectPose, Session
from rhot.topics import Topic

T = TypeVar("T")

# Between two looks at what is in force.
_LOOK_S = 0.1


class RigClient:
    """A rig seen from outside. `bus` is there for whatever has no method of its own."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus

    def hand_poses(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Subscription[HandPose]:
        """Full hand poses, of one hand or of both."""
        return self._stream(topics.POSE, queue, hand=hand)

    def hand_points(
        self, hand: HandName | None = None, queue: int | None = None
    ) -> Subscription[HandPoints]:
        """3D landmarks, of one hand or of both."""
        return self._stream(topics.POINTS, queue, hand=hand)

    def object_poses(
        self, name: str | None = None, queue: int | None = None
    ) -> Subscription[ObjectPose]:
        """Object poses, of one object or of all."""
        return self._stream(topics.OBJECT, queue, object=name)

    def markers(
        self, camera: str | None = None, queue: int | None = None
    ) -> Subscription[MarkerFrame]:
        """Markers in the image of one camera or of all."""
        return self._stream(topics.MARKERS, queue, camera=camera)

    def health(self) -> Subscription[Health]:
        """Every service's health, once a second."""
        return self.bus.every(topics.HEALTH, 256)

    def services(self) -> AliveWatch:
        """Services as they come and go, beginning with those that are there."""
        return self.bus.watch_alive()

    async def session(self) -> Session | None:
        """The session's state, or None if no master answers."""
        answers = await self.bus.get(topics.SESSION)
        return answers[0] if answers else None

    def start(self) -> None:
        """Broadcast the start to all trackers (needs the rig's name in `connect`)."""
        self.bus.publisher(topics.SESSION).put(Session(running=True, start_ns=clock.now_ns()))

    def stop(self) -> None:
        """Broadcast the stop to all trackers (needs the rig's name in `connect`)."""
        self.bus.publisher(topics.SESSION).put(Session(running=False, start_ns=clock.now_ns()))

    async def colors(self, camera: str) -> Colors:
        """The colour ranges in force; raises BusError if no tracker of that camera answers."""
        return _one(await self.bus.get(topics.COLORS, camera=camera), camera)

    async def set_colors(self, camera: str, colors: Colors, timeout_s: float = 5.0) -> None:
        """Put colour ranges in force, and in their file on the camera's machine; colors.date and
        .tool tell this change from others.

        Raises CalibrationError with the tracker's words if it refuses them, BusError if none
        answers.
        """
        health = self.bus.every(topics.HEALTH, 16, service="pi_tracker", instance=camera)
        refusal = asyncio.ensure_future(
            _refusal(health, f"colours of {colors.date} by {colors.tool}")
        )
        try:
            await self.colors(camera)
            await self._put(topics.COLORS, colors, camera)
            deadline_s = time.monotonic() + timeout_s
            while time.monotonic() < deadline_s:
                now = await self.colors(camera)
                if now.colors == colors.colors and now.date == colors.date:
                    return
                await asyncio.wait([refusal], timeout=_LOOK_S)
                if refusal.done():
                    raise CalibrationError(refusal.result())
        finally:
            refusal.cancel()
            self.bus.close(health)
        raise CalibrationError(
            f"camera {camera!r} did not take the colours within {timeout_s:g} s, and does not say why; see its log"
        )

    async def exposure(self, camera: str) -> ExposureControl:
        """The exposure in force; raises BusError if no tracker of that camera answers."""
        return _one(await self.bus.get(topics.EXPOSURE, camera=camera), camera)

    async def set_exposure(
        self, camera: str, wanted: ExposureControl, timeout_s: float = 20.0
    ) -> ExposureControl:
        """Set exposure, gain and white balance, or run the automatics once; what is in force then.

        Raises CalibrationError with the tracker's words if it refuses, or if the camera has no such
        controls.
        """
        now = await self.exposure(camera)
        if not now.adjustable:
            raise CalibrationError(f"camera {camera!r}: {now.note}")
        before = now
        await self._put(topics.EXPOSURE, wanted, camera)
        deadline_s = time.monotonic() + timeout_s
        while time.monotonic() < deadline_s:
            await asyncio.sleep(_LOOK_S)
            now = await self.exposure(camera)
            if now.changed_ns != before.changed_ns and "refused" in now.note:
                raise CalibrationError(now.note)
            if now.changed_ns != before.changed_ns and now.mode == "fixed":
                return now
        raise CalibrationError(f"camera {camera!r} has not set its exposure within {timeout_s:g} s")

    async def _put(self, topic: Topic[T], message: T, camera: str) -> None:
        publisher = self.bus.publisher(topic, camera=camera)
        try:
            # The tracker has just answered, so it is there: its subscription is known to the router
            # within milliseconds.
            for _ in range(100):
                if publisher.wanted:
                    break
                await asyncio.sleep(0.01)
            publisher.put(message)
        finally:
            publisher.undeclare()

    def _stream(self, topic: Topic[T], queue: int | None, **names: str | None) -> Subscription[T]:
        given = {field: name for field, name in names.items() if name is not None}
        return (
            self.bus.latest(topic, **given)
            if queue is None
            else self.bus.every(topic, queue, **given)
        )


def _one(answers: list[T], camera: str) -> T:
    if not answers:
        raise BusError(
            f"no tracker of camera {camera!r} answers; is it running, and is the name right? `rhot top` shows them"
        )
    return answers[0]


async def _refusal(health: Subscription[Health], made: str) -> str:
    """The tracker's words, once it has refused what was made so."""
    async for beat in health:
        if made in beat.last_error:
            return beat.last_error
    return "the bus was closed"


@contextlib.asynccontextmanager
async def connect(endpoint: str = "tcp/127.0.0.1:7447", rig: str = "*") -> AsyncIterator[RigClient]:
    """A session with the router at endpoint; waits for it as long as it takes (cancel, or use
    asyncio.timeout, to give up).

    rig is the name in [rig] of rig.toml; "*" listens to every rig of that router.
    """
    async with open_bus(rig, [endpoint]) as bus:
        yield RigClient(bus)
