"""A simulated rig performs what a step asks of a person, so that it can be practised without any
hardware: its simulator is told what to show, and shows what it showed before once the step ends,
or this process does.

A real rig, or a simulated one whose simulator does not answer, is left alone.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import msgspec

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import BusError, CalibrationError, RhotError
from rhot.messages.simulator import SimStage
from services.calibrator.board.live_selection import Verdict
from services.calibrator.endpoints.desk import Desk

# Whether a simulator is there, s; a scene with a grasp takes it several seconds.
_THERE_S, _STAGE_S = 3.0, 60.0
# How often the stage is asked for anew, and seen whether somebody else has set it: a tour does so
# within seconds. Who is killed leaves it to the simulator after the lease, s: ten askings, since a
# fit on a busy machine may hold the loop for some of them.
_WATCH_S, _LEASE_S = 2.0, 20.0
# The simulated person's way to the next place takes .7 s, and pictures are a little late.
_WAY_S = 0.9
# A board that is not seen as a whole so often is carried on. A place that counts needs two takes;
# on a busy machine some more show it on its way.
_TAKES = 8


class Performer:
    """The simulated rig during one step."""

    def __init__(self, bus: Bus, stage: SimStage) -> None:
        self._bus, self.stage = bus, stage
        self._takes = 0

    async def show(self) -> None:
        """Show it from now on; raises BusError or RefusedError."""
        await self._ask(_LEASE_S, renews=False)

    async def leave(self) -> None:
        """Show what was there before, unless somebody else has set the stage; raises alike."""
        await self._ask(0.0, renews=True)

    async def _ask(self, lease_s: float, *, renews: bool, timeout_s: float = _STAGE_S) -> SimStage:
        wanted = msgspec.structs.replace(self.stage, lease_s=lease_s, renews=renews)
        return await self._bus.request(topics.SIM_STAGE, wanted, timeout_s=timeout_s)

    async def after_take(self, verdict: Verdict | None) -> None:
        """Carry the board on once its place counts, or cannot; None: no board was found yet."""
        self._takes += 1
        there = verdict in (Verdict.KEPT, Verdict.KNOWN)
        board = self.stage.board
        if board is None or not (there or self._takes >= _TAKES):
            return
        self._takes = 0
        carried = msgspec.structs.replace(board, place=board.place + 1)
        self.stage = msgspec.structs.replace(self.stage, board=carried)
        await self.show()
        await asyncio.sleep(_WAY_S)

    async def taken_away(self) -> None:
        """Keep the stage; return once the simulator shows what somebody else wanted."""
        while True:
            await asyncio.sleep(_WATCH_S)
            # A simulator that does not answer for once has lost nothing yet.
            with contextlib.suppress(BusError):
                shown = await self._ask(_LEASE_S, renews=True, timeout_s=_THERE_S)
                if not shown.shows_as(self.stage):
                    return


@contextlib.asynccontextmanager
async def practising(desk: Desk, stage: SimStage) -> AsyncIterator[Performer | None]:
    """As long as the block lasts a simulated rig shows that; None for another rig.

    Raises CalibrationError if somebody else sets the stage meanwhile.
    """
    simulated = any(camera.source == "simulator" for camera in desk.config.camera)
    if not simulated or not await desk.bus.get(topics.SIM_STAGE, timeout_s=_THERE_S):
        yield None
        return
    performer = Performer(desk.bus, stage)
    try:
        await performer.show()
        async with _undisturbed(performer):
            yield performer
    finally:
        with contextlib.suppress(RhotError):
            await performer.leave()


@contextlib.asynccontextmanager
async def _undisturbed(performer: Performer) -> AsyncIterator[None]:
    """End the block with CalibrationError once the stage is somebody else's."""
    block = asyncio.current_task()
    watch = asyncio.create_task(performer.taken_away())
    disturbed = False

    def end(done: asyncio.Task[None]) -> None:
        nonlocal disturbed
        if not done.cancelled() and done.exception() is None and block is not None:
            disturbed = True
            block.cancel()

    watch.add_done_callback(end)
    try:
        yield
    except asyncio.CancelledError:
        # Stopped by a person at the same time counts for more.
        if block is None or not disturbed or block.uncancel() > 0:
            raise
        raise CalibrationError(
            "the simulator was told to show something else meanwhile (is `rhot demo --tour` going "
            "on?): start the step again once that is over"
        ) from None
    finally:
        watch.cancel()
