"""Several rigs in one real process, on a real router: what one does, the others do not notice."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import textwrap
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from rhot import topics
from rhot.bus.bus import open_bus

DEADLINE_S = 60.0
SERVICE = textwrap.dedent("""
    import asyncio
    from rhot.errors import CalibrationError, SourceError
    from rhot.process.lifecycle import command
    from rhot.process.rigs.context import PLACE
    async def serve(service):
        service.values["place"] = float(PLACE.get())
        wish = (service.config.calibration_dir / "wish").read_text().strip()
        if wish == "uncalibrated":
            raise CalibrationError("no lens yet; run the calibration")
        service.ready()
        if wish == "bug":
            await asyncio.sleep(0.2)
            raise ValueError("oops")
        await asyncio.Event().wait()
    command("probe", "__main__", "a service of several rigs", several_rigs=True)
""")


@pytest.fixture
def notified(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as server:
        server.bind(str(tmp_path / "notify"))
        server.setblocking(False)
        yield server


@pytest.fixture
async def process(
    tmp_path: Path, endpoint: str, router: object, notified: socket.socket
) -> AsyncIterator[asyncio.subprocess.Process]:
    """Three rigs: one well, one that meets a bug, one that is not calibrated."""
    for name, wish in (("well", "run"), ("broken", "bug"), ("new", "uncalibrated")):
        folder = tmp_path / "rigs"
        (folder / name).mkdir(parents=True)
        (folder / name / "wish").write_text(wish)
        (folder / f"{name}.toml").write_text(
            f'[rig]\nname = "{name}"\ncalibration = "{name}"\n'
            f'[bus]\nconnect = ["{endpoint}"]\n[[camera]]\nname = "left"\n'
        )
    environment = {
        **os.environ,
        "NOTIFY_SOCKET": str(tmp_path / "notify"),
        "RHOT_LOG_FORMAT": "json",
    }
    argv = [sys.executable, "-c", SERVICE, "--config", str(tmp_path / "rigs")]
    pipes = {"stdout": asyncio.subprocess.PIPE, "stderr": asyncio.subprocess.STDOUT}
    found = await asyncio.create_subprocess_exec(*argv, **pipes, env=environment)
    yield found
    if found.returncode is None:
        found.kill()
        await found.communicate()


async def test_a_broken_rig_touches_no_other(
    process: asyncio.subprocess.Process, tmp_path: Path, endpoint: str, notified: socket.socket
) -> None:
    beats: dict[str, list[float]] = {}
    places: dict[str, float] = {}
    async with asyncio.timeout(DEADLINE_S), asyncio.TaskGroup() as tasks:

        async def follow(rig: str) -> None:
            async with open_bus(rig, [endpoint]) as bus:
                async for beat in bus.every(topics.HEALTH, 16):
                    beats.setdefault(rig, []).append(beat.uptime_s)
                    places[rig] = beat.values.get("place", -1.0)

        followers = [tasks.create_task(follow(rig)) for rig in ("well", "broken", "new")]
        while len(beats.get("well", [])) < 3 or not beats.get("new"):
            if len(beats.get("well", [])) == 2:
                # The one without a calibration begins once it has one.
                (tmp_path / "rigs" / "new" / "wish").write_text("run")
            await asyncio.sleep(0.05)
        for follower in followers:
            follower.cancel()
    assert beats["well"] == sorted(beats["well"])
    assert beats["new"][0] < beats["well"][-1]
    # In the order of their files: broken, new, well.
    assert (places["new"], places["well"]) == (1.0, 2.0)
    process.send_signal(signal.SIGTERM)
    async with asyncio.timeout(DEADLINE_S):
        output, _ = await process.communicate()
    assert process.returncode == 0
    errors = [line for line in map(json.loads, output.splitlines()) if line["level"] == "error"]
    assert {line["rig"] for line in errors} == {"broken", "new"}
    assert any("run the calibration" in line["text"] for line in errors)
    assert any("ValueError: oops" in line.get("trace", "") for line in errors)
    heard = []
    while True:
        try:
            heard.append(notified.recv(4096).decode())
        except BlockingIOError:
            break
    status = [text for text in heard if text.startswith("STATUS=")][-1]
    assert "well: running" in status
    assert "broken: " in status


async def test_two_files_of_one_rig_are_told_and_the_first_is_served(
    tmp_path: Path, endpoint: str, router: object
) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.toml").write_text(
            f'[rig]\nname = "same"\ncalibration = "."\n'
            f'[bus]\nconnect = ["{endpoint}"]\n[[camera]]\nname = "left"\n'
        )
    (tmp_path / "wish").write_text("run")
    argv = [sys.executable, "-c", SERVICE, "--config", str(tmp_path)]
    process = await asyncio.create_subprocess_exec(
        *argv, stdout=asyncio.subprocess.PIPE, env={**os.environ, "RHOT_LOG_FORMAT": "json"}
    )
    assert process.stdout is not None
    async with asyncio.timeout(DEADLINE_S):
        lines = []
        while len(lines) < 2:
            lines.append(json.loads(await process.stdout.readline()))
        process.send_signal(signal.SIGTERM)
        await process.communicate()
    said = {line["level"]: line["text"] for line in lines}
    assert "every rig of a network has a [rig] name of its own" in said["error"]
    assert "ready" in said["info"]
