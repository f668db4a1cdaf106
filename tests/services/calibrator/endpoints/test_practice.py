"""What a simulated rig shows for a calibration step, over a real router: as long as the step's
process lives, and not longer.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec

from rhot import topics
from rhot.bus.bus import Bus
from rhot.files.config import load_rig
from rhot.messages.simulator import SimStage
from services.simulator.service import serve

BEFORE = SimStage(scene="still", hidden=["right.index_tip"])
# A step that goes on for ever, with a lease short enough to be waited for.
STEP = """
import asyncio, sys
from rhot.bus.bus import open_bus
from rhot.files.config import load_rig
from rhot.messages.calibration import CalibrationOrder
from rhot.messages.simulator import SimBoard, SimStage
from services.calibrator.endpoints import practice
from services.calibrator.endpoints.desk import Desk

practice._WATCH_S, practice._LEASE_S = 0.3, 4.0

async def step(rig, endpoint):
    async with open_bus("desk", [endpoint]) as bus:
        order = CalibrationOrder(action="start", step="stereo")
        desk = Desk(bus, load_rig(rig), order, lambda **_: None, lambda _: None)
        async with practice.practising(desk, SimStage(board=SimBoard())):
            print("shown", flush=True)
            await asyncio.Event().wait()

asyncio.run(step(*sys.argv[1:]))
"""


async def shown(bus: Bus) -> SimStage:
    return (await bus.get(topics.SIM_STAGE, timeout_s=10.0))[0]


async def test_a_step_that_is_killed_leaves_nothing_on_the_stage(
    running: Callable, router: str, repository: Path
) -> None:
    rig = repository / "config" / "sim.toml"
    config = load_rig(rig)
    # No pictures are rendered: only what is on the stage counts.
    cameras = [msgspec.structs.replace(one, source="v4l2:0") for one in config.camera]
    alone = msgspec.structs.replace(config, camera=cameras)
    async with running("simulator", serve, alone, deadline_s=120.0) as (_, bus):
        while not await bus.get(topics.SIM_STAGE):
            await asyncio.sleep(0.05)
        await bus.request(topics.SIM_STAGE, BEFORE, timeout_s=30.0)
        step = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", STEP, str(rig), router),
            stdout=asyncio.subprocess.PIPE,
        )
        assert step.stdout is not None
        assert await step.stdout.readline() == b"shown\n"
        # Longer than its lease the step lives, and renews it.
        await asyncio.sleep(6.0)
        assert (await shown(bus)).board is not None
        step.kill()
        await step.wait()
        while (now := await shown(bus)).board is not None:
            await asyncio.sleep(0.1)
        assert now == BEFORE
