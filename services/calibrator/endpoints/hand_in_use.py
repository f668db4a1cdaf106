"""A hand that measures itself while somebody uses the rig: points are collected, and now and then
the hand is estimated from all of them, in a thread.

Both `rhot calibrate hand --watch` and the page do this; what they tell is their own.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError
from rhot.messages import HandPoints
from services.calibrator.guided.hand_fitting import Wanted, from_motion
from services.calibrator.guided.hand_in_use import InUse
from services.calibrator.hand.free_motion.seen_so_far import SeenSoFar

if TYPE_CHECKING:
    from services.calibrator.output.hand_file import HandFile

# Between two estimates; each takes 3 to 6 s of one core, on this computer alone.
EVERY_S = 20.0
# How often it is told what was seen.
_LOOK_S = 0.5
# The newest messages: 10 minutes of two cameras at 30 Hz.
_MOST_MESSAGES = 36_000
# A message that is older than the one before it has come late; one that is so much older, or comes
# when all were, is of a clock that was set, s.
_LATE_S = 2.0


async def hand_in_use(
    bus: Bus, wanted: Wanted, tell: Callable[[InUse], bool], every_s: float
) -> InUse:
    """Collect and estimate until tell, who hears of it twice a second, has heard enough.

    What is known in the end. Raises BusError if the bus fails.
    """
    collected = _Collected()
    points = bus.every(topics.POINTS, 256, hand=wanted.hand)

    async def listen() -> None:
        async for message in points:
            collected.add(message)
        raise BusError("the bus was closed")

    loop = asyncio.get_running_loop()
    listening = asyncio.create_task(listen())
    fitting: asyncio.Task[HandFile] | None = None
    now = InUse(collected.seen, 0.0, 0, None, "")
    began_s, used = loop.time(), 0
    next_s = began_s + every_s
    try:
        while not tell(now):
            # A bus that fails ends the wait.
            await asyncio.wait({listening}, timeout=_LOOK_S)
            if listening.done():
                listening.result()
            if fitting is None and loop.time() >= next_s and collected.count > used:
                used = collected.count
                work = asyncio.to_thread(from_motion, tuple(collected.messages), wanted)
                fitting = asyncio.create_task(work)
            elif fitting is not None and fitting.done():
                now = _tried(now, fitting)
                fitting, next_s = None, loop.time() + every_s
            heard_s = collected.heard_s or began_s
            now = now._replace(seen=collected.seen, silent_s=loop.time() - heard_s)
        return now
    finally:
        for task in (listening, fitting):
            if task is not None:
                task.cancel()
        bus.close(points)


def _tried(before: InUse, fitting: asyncio.Task[HandFile]) -> InUse:
    """With the result of a try; raises what is no CalibrationError."""
    tries = before.tries + 1
    try:
        return before._replace(tries=tries, made=fitting.result(), why="")
    except CalibrationError as error:
        return before._replace(tries=tries, why=str(error))


class _Collected:
    """The newest messages, in the order of their stamps. count is of all that came."""

    def __init__(self) -> None:
        self.messages: deque[HandPoints] = deque(maxlen=_MOST_MESSAGES)
        self.seen = SeenSoFar()
        self.count = 0
        self.heard_s = 0.0

    def add(self, message: HandPoints) -> None:
        self.count += 1
        self.heard_s = asyncio.get_running_loop().time()
        if self.messages:
            late_s = 1e-9 * (self.messages[-1].stamp_ns - message.stamp_ns)
            if late_s > _LATE_S:
                self.messages.clear()
                self.seen = SeenSoFar()
            elif late_s > 0.0:
                return
        self.messages.append(message)
        self.seen.add(message)
