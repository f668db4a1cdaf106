"""`rhot up` with SteamVR on this machine: from the binding's structs to an object's pose."""

from __future__ import annotations

import asyncio
import os
import signal
import sys

import pytest

pytest.importorskip("openvr", reason="PyPI openvr is not installed; it is made for x86 alone")

from rhot import topics
from rhot.bus.bus import open_bus
from testing.source_tree import ROOT

pytestmark = pytest.mark.integration

SITECUSTOMIZE = """
import sys
if "openvr_bridge" in " ".join(sys.orig_argv):
    from testing.steamvr import StandIn, device
    from types import SimpleNamespace
    stand_in = StandIn()
    stand_in.slots[3] = device("LHR-1")
    stand_in.install(SimpleNamespace(setattr=setattr))
"""


async def test_an_object_is_where_steamvr_says(tmp_path, endpoint):
    (tmp_path / "sitecustomize.py").write_text(SITECUSTOMIZE)
    (tmp_path / "rig.toml").write_text(
        f'[bus]\nconnect = ["{endpoint}"]\nlisten = ["{endpoint}"]\n'
        '[objects]\nsource = "steamvr"\nrate_hz = 50\n'
        '[[object]]\nname = "cup"\nserial = "LHR-1"\n'
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    command = [
        sys.executable,
        "-m",
        "services.cli",
        "up",
        str(tmp_path / "rig.toml"),
        "--no-viewer",
    ]
    up = await asyncio.create_subprocess_exec(
        *command,
        env=environment,
        cwd=tmp_path,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    try:
        async with asyncio.timeout(120.0), open_bus("desk", [endpoint]) as bus:
            objects, poses = bus.every(topics.OBJECT, 64), bus.every(topics.OPENVR, 64)
            alive = bus.watch_alive()
            # Fusion is the master, whose clock the bridge has asked.
            while (await anext(poses)).clock_sigma_ns < 0:
                pass
            pose = await anext(objects)
            assert (pose.object, pose.serial, pose.position_m) == ("cup", "LHR-1", (0.0,) * 3)
            while (await anext(alive)).service != "openvr_bridge":
                pass
    finally:
        up.send_signal(signal.SIGTERM)
        await up.communicate()
    assert up.returncode == 0
