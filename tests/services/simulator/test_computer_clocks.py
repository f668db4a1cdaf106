"""The clock of a simulated camera computer, set while the rig runs."""

from __future__ import annotations

import asyncio
from functools import partial

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import RefusedError
from rhot.messages.simulator import SimClock, SimFrame
from rhot.process.service import Service
from services.simulator.computer_clocks import ComputerClocks
from services.simulator.service import serve


async def test_a_wrong_request_is_refused_and_changes_nothing(router):
    async with open_bus("sim", [router]) as theirs, open_bus("sim", [router]) as ours:
        clocks = ComputerClocks(["left", "right"])
        for camera in ("left", "right"):
            answer = partial(clocks.answer, camera)
            theirs.answer_requests(topics.SIM_CLOCK, answer, camera=camera)
        async with asyncio.timeout(60.0):
            while len(await ours.get(topics.SIM_CLOCK)) < 2:
                await asyncio.sleep(0.02)
        wanted = SimClock(ahead_ns=-5)
        assert await ours.request(topics.SIM_CLOCK, wanted, camera="left") == wanted
        assert await ours.get(topics.SIM_CLOCK, camera="right") == [SimClock(ahead_ns=0)]
        # msgspec checks what it decodes, not what it encodes.
        with pytest.raises(RefusedError):
            await ours.request(topics.SIM_CLOCK, SimClock(ahead_ns=10**18), camera="left")
        with pytest.raises(RefusedError):
            await ours.request(topics.SIM_CLOCK, another_request(), camera="left")
        assert (clocks.ahead_ns("left"), clocks.ahead_ns("right")) == (-5, 0)


def another_request() -> msgspec.Struct:
    """A request for something else."""
    return msgspec.defstruct("Other", [("step_s", float)])(2.0)


async def test_stamps_and_clock_step_together(router, config):
    """A picture's stamp and the clock that the tracker reads belong to one computer."""
    scene = msgspec.structs.replace(config.simulator, scene="still")
    live = msgspec.structs.replace(config, simulator=scene)
    async with (
        open_bus("sim", [router]) as theirs,
        open_bus("sim", [router]) as ours,
        asyncio.timeout(60.0),
        asyncio.TaskGroup() as tasks,
    ):
        pictures = ours.raw(topics.SIM_FRAME, 64, camera="left")
        service = Service("simulator", "main", live, theirs, tasks)
        running = tasks.create_task(serve(service))
        before = msgspec.json.decode((await anext(pictures)).attachment, type=SimFrame)
        await ours.request(topics.SIM_CLOCK, SimClock(ahead_ns=2 * 10**9), camera="left")
        async for sample in pictures:
            after = msgspec.json.decode(sample.attachment, type=SimFrame)
            if after.clock_skew_ns - before.clock_skew_ns > 10**9:
                break
        running.cancel()
    set_ns = after.clock_skew_ns - before.clock_skew_ns
    assert abs(set_ns - 2 * 10**9) < 10**6
    # What is left is the time between the two pictures, of some periods.
    assert 0 < after.stamp_ns - before.stamp_ns - set_ns < 5 * 10**9
