"""From moving a painted tracker to registered poses: real router, real processes."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.files.config import load_rig
from services.object_tracker.service import serve
from testing.painted_tracker import PaintedTracker, play


async def command(rig_toml: Path, *words: str) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "services.cli", "calibrate", "objects", "--config", str(rig_toml), *words),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        env=os.environ | {"NO_COLOR": "1"},
    )


async def test_a_cup_that_is_moved_is_where_it_is(
    running: Callable, router: str, rig_toml: Path, scene: PaintedTracker
) -> None:
    moving = replace(scene, seconds=600.0)
    async with asyncio.timeout(240.0), open_bus("desk", [router]) as bus:
        player = asyncio.create_task(play(bus, moving))
        process = await command(rig_toml, "--seconds", "8")
        said = (await process.communicate())[0].decode()
        player.cancel()
    assert process.returncode == 0, said
    for words in ("Move cup's tracker (orange paint)", "enough after", "registered cup"):
        assert words in said
    # Guidance comes before there is enough.
    assert "Turn the tracker more" in said or "s more in sight" in said
    config = load_rig(rig_toml)
    async with running("object_tracker", serve, config) as (service, bus):
        exact = replace(moving, outliers=0.0)
        began_ns = clock.now_ns()
        player = asyncio.create_task(play(bus, exact, None, began_ns))
        errors_m = []
        async for pose in bus.every(topics.OBJECT, 64):
            if pose.tracking != "ok":
                continue
            assert pose.registered
            truth = exact.truth((pose.stamp_ns - began_ns) * 1e-9)
            errors_m.append(np.linalg.norm(truth[:3, 3] - pose.position_m))
            if len(errors_m) >= 200:
                break
        player.cancel()
        assert not [one for one in service.faults.standing() if one.code == "object_unregistered"]
    assert np.median(errors_m) < 0.003


async def test_ctrl_c_ends_it_and_writes_nothing(
    router: str, rig_toml: Path, scene: PaintedTracker
) -> None:
    async with asyncio.timeout(60.0), open_bus("desk", [router]) as bus:
        player = asyncio.create_task(play(bus, replace(scene, seconds=600.0)))
        process = await command(rig_toml)
        assert process.stdout is not None
        line = b""
        while b"seen a second by" not in line:
            line = await process.stdout.readline()
            assert line, "ended without a line of what is seen"
        process.send_signal(signal.SIGINT)
        said = (await process.communicate())[0].decode()
        player.cancel()
    assert "ended by Ctrl-C" in said
    assert "nothing was written" in said
    assert process.returncode not in (0, None)
    assert not (rig_toml.parent / "calibration" / "objects.json").exists()


@pytest.mark.parametrize("silent", ["cameras", "tracker"])
async def test_what_does_not_come_is_named(
    router: str, rig_toml: Path, scene: PaintedTracker, silent: str
) -> None:
    other = replace(
        scene, seconds=600.0, serial="LHR-9", fps=0.001 if silent == "cameras" else 30.0
    )
    async with asyncio.timeout(60.0), open_bus("desk", [router]) as bus:
        player = asyncio.create_task(play(bus, other))
        process = await command(rig_toml)
        said = (await process.communicate())[0].decode()
        player.cancel()
    assert process.returncode not in (0, None)
    expected = "no markers of camera left and right" if silent == "cameras" else "no poses of LHR-1"
    assert expected in said
    if silent == "tracker":
        assert "heard: LHR-9" in said
