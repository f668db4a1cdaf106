"""A simulated rig performs what a step asks of a person, so that it can be practised without any
hardware: its simulator is told what to show, and shows what it showed before once the step ends.

A real rig, or a simulated one whose simulator does not answer, is left alone.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import msgspec

from rhot import topics
from rhot.bus.bus import Bus
from rhot.errors import CalibrationError, RhotError
from rhot.messages.simulator import SimStage
from services.calibrator.board.live_selection import Verdict
from services.calibrator.endpoints.desk import Desk

# Whether a simulator is there, s; a scene with a grasp takes it several seconds.
_THERE_S, _STAGE_S = 3.0, 60.0
# How often it is looked whether somebody else has set the stage: a tour does so within seconds.
_WATCH_S = 2.0
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

    async def show(self, stage: SimStage) -> None:
        """Show that from now on; raises BusError or RefusedError."""
        self.stage = stage
        await self._bus.request(topics.SIM_STAGE, stage, timeout_s=_STAGE_S)

    async def after_take(self, verdict: Verdict | None) -> None:
        """Carry the board on once its place counts, or cannot; None: no board was found yet."""
        self._takes += 1
        there = verdict in (Verdict.KEPT, Verdict.KNOWN)
        board = self.stage.board
        if board is None or not (there or self._takes >= _TAKES):
            return
        self._takes = 0
        carried = msgspec.structs.replace(board, place=board.place + 1)
        await self.show(msgspec.structs.replace(self.stage, board=carried))
        await asyncio.sleep(_WAY_S)

    async def taken_away(self) -> None:
        """Return once the simulator shows what somebody else wanted."""
        while True:
            await asyncio.sleep(_WATCH_S)
            for shown in await self._bus.get(topics.SIM_STAGE, timeout_s=_THERE_S):
                if _anywhere(shown) != _anywhere(self.stage):
                    return


@contextlib.asynccontextmanager
async def practising(desk: Desk, stage: SimStage) -> AsyncIterator[Performer | None]:
    """As long as the block lasts a simulated rig shows that; None for another rig.

    Raises CalibrationError if somebody else sets the stage meanwhile.
    """
    simulated = any(camera.source == "simulator" for camera in desk.config.camera)
    before = await desk.bus.get(topics.SIM_STAGE, timeout_s=_THERE_S) if simulated else []
    if not before:
        yield None
        return
    # What a calibrator that was killed has left there is nobody's wish.
    own = SimStage() if before[0].board or before[0].begins_in_s is not None else before[0]
    performer = Performer(desk.bus, stage)
    try:
        await performer.show(stage)
        async with _undisturbed(performer):
            yield performer
    finally:
        with contextlib.suppress(RhotError):
            await performer.show(own)


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


def _anywhere(stage: SimStage) -> SimStage:
    """The same with a board at no particular place: it may be on its way to the next."""
    board = stage.board
    if board is None:
        return stage
    return msgspec.structs.replace(stage, board=msgspec.structs.replace(board, place=0))
