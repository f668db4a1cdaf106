"""The bridge as a process, on a Python without what Windows lacks."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.messages import ClockEcho
from testing.source_tree import ROOT

SITECUSTOMIZE = """
from testing.without_posix import take_away
take_away()
from testing.steamvr import StandIn, device
from types import SimpleNamespace
stand_in = StandIn()
stand_in.slots[3] = device("LHR-1")
stand_in.install(SimpleNamespace(setattr=setattr))
"""


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Of a process without POSIX, with a SteamVR."""
    (tmp_path / "sitecustomize.py").write_text(SITECUSTOMIZE)
    own = {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)]), "RHOT_LOG_FORMAT": "json"}
    return {**os.environ, **own}


def test_the_stand_in_has_no_posix(environment):
    def run(script: str) -> str:
        command = [sys.executable, "-c", script]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return (done.stderr.strip().splitlines() or ["fine"])[-1]

    assert run("import resource").startswith("ModuleNotFoundError")
    assert run("import uvloop").startswith("ModuleNotFoundError")
    assert run("import os; os.getloadavg()").startswith("AttributeError")
    # A service that needs them does not live there.
    assert "No module named" in run("import services.recorder.writer")
    assert run("import services.openvr_bridge.service") == "fine"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_it_starts_sends_tells_its_health_and_ends(tmp_path, router, environment, number):
    path = tmp_path / "rig.toml"
    path.write_text(
        f'[bus]\nconnect = ["{router}"]\n[objects]\nsource = "steamvr"\nrate_hz = 50\n'
        '[[object]]\nname = "cup"\nserial = "LHR-1"\n'
    )
    command = [sys.executable, "-m", "services.openvr_bridge", "--config", str(path)]
    pipes = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.STDOUT}
    async with open_bus("desk", [router]) as bus:
        bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=clock.now_ns()))
        poses, beats = bus.every(topics.OPENVR, 64), bus.every(topics.HEALTH, 8)
        process = await asyncio.create_subprocess_exec(*command, **pipes, env=environment)
        living = asyncio.create_task(_first_health(poses, beats))
        ending = asyncio.create_task(process.communicate())
        await asyncio.wait([living, ending], timeout=60.0, return_when=asyncio.FIRST_COMPLETED)
        if process.returncode is None:
            process.send_signal(number if living.done() else signal.SIGKILL)
        output, _ = await ending
        assert living.done(), output.decode()
        health = living.result()
    assert process.returncode == 0, output.decode()
    assert (health.service, health.instance, health.rss_mb) == ("openvr_bridge", "main", 0.0)
    assert b"Traceback" not in output


async def _first_health(poses, beats):
    """The bridge's health, once its poses carry the clock's offset."""
    while (await anext(poses)).clock_sigma_ns < 0:
        pass
    return await anext(beats)
