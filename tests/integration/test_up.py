"""`rhot up` as a user meets it: what is missing and why, then up, new calibrations, Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import signal
import socket
import sys
import urllib.request
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.files.calibration import save
from rhot.hand import default_hand
from services.cli.live.working_copy import working_copy
from testing.loopback import free_port

pytestmark = [pytest.mark.field, pytest.mark.asyncio(loop_scope="module")]
RHOT = str(Path(sys.executable).parent / "rhot")
# numba's first compilation on a loaded machine takes most of the start.
START_S, SOON_S = 240.0, 60.0


class Up:
    """A running `rhot up` and all that it has printed."""

    def __init__(self, process: asyncio.subprocess.Process, config: Path, port: int) -> None:
        self.process, self.config, self.port = process, config, port
        self.text = ""

    @property
    def calibration(self) -> Path:
        return self.config.parent / "calibration"

    async def read(self) -> None:
        while chunk := await self.process.stderr.read(65536):
            self.text += chunk.decode()

    async def until(self, part: str, seconds: float = SOON_S, since: int = 0) -> None:
        try:
            async with asyncio.timeout(seconds):
                while not re.search(part, self.text[since:]):
                    assert self.process.returncode is None, self.text
                    await asyncio.sleep(0.05)
        except TimeoutError:
            pytest.fail(f"{part!r} was not printed:\n{self.text[since:]}")


def use_ports(config: Path, port: int) -> None:
    endpoint = f'["tcp/127.0.0.1:{port}"]'
    text = config.read_text() + f"\n[bus]\nconnect = {endpoint}\nlisten = {endpoint}\n"
    config.write_text(text + f"[viewer]\nport = {free_port()}\n")


def children_of(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()


def alive(pids: list[str]) -> list[str]:
    return [pid for pid in pids if Path(f"/proc/{pid}").exists()]


@contextlib.asynccontextmanager
async def running(config: Path, port: int, *options: str) -> AsyncIterator[Up]:
    use_ports(config, port)
    process = await asyncio.create_subprocess_exec(
        *(RHOT, "up", str(config), *options),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
    )
    up = Up(process, config, port)
    reading = asyncio.create_task(up.read())
    try:
        yield up
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await asyncio.wait_for(process.wait(), 30.0)
        await reading


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def up() -> AsyncIterator[Up]:
    """The simulated rig without rig.json, while somebody else has the router's port."""
    with socket.socket() as other, working_copy() as config:
        port = free_port()
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(("127.0.0.1", port))
        other.listen()
        rig_json = config.parent / "calibration" / "rig.json"
        rig_json.rename(rig_json.with_suffix(".away"))
        async with running(config, port) as found:
            found.other = other
            yield found


async def a_pose(up: Up) -> None:
    """Wait for one that is published from now on."""
    async with open_bus("sim", [f"tcp/127.0.0.1:{up.port}"]) as bus, asyncio.timeout(SOON_S):
        assert (await anext(bus.latest(topics.POSE))).hand == "right"


async def test_a_port_in_use_is_named_with_its_process_and_once(up):
    reason = rf"no router can listen at tcp/127.0.0.1:{up.port}: \S+ \(process \d+\) listens"
    await up.until(rf"\[router\] error: {reason}")
    await up.until(rf"is not up yet:\n  router: {reason}")
    # Two more tries, five seconds apart, are silent.
    await asyncio.sleep(12.0)
    assert up.text.count("[router] error") == 1
    assert "is up" not in up.text
    up.other.close()


async def test_a_rig_that_is_not_calibrated_is_not_up_and_says_why_once(up):
    await up.until(r"  fusion: .*rig.json: no such file; make it with `rhot calibrate", START_S)
    told = up.text.count("[fusion] error")
    await asyncio.sleep(12.0)
    assert up.text.count("[fusion] error") == told
    assert "is up" not in up.text


async def test_the_live_view_is_where_it_is_said_to_be(up):
    await up.until(r"live view: http://127.0.0.1:\d+", START_S)
    (address,) = re.findall(r"live view: (http://127.0.0.1:\d+)", up.text)
    answer = await asyncio.to_thread(urllib.request.urlopen, address, timeout=SOON_S)
    assert answer.status == 200


async def test_a_calibration_that_comes_brings_the_rig_up(up):
    rig_json = up.calibration / "rig.json"
    rig_json.with_suffix(".away").rename(rig_json)
    await up.until(r"rig 'sim' is up after \d+ s", START_S)
    await a_pose(up)


async def test_new_calibrations_start_anew_who_uses_them(up):
    since = len(up.text)
    rig_json = up.calibration / "rig.json"
    rig_json.write_text(json.dumps(json.loads(rig_json.read_text())))
    await up.until(r"\[fusion\] note: rig.json changed: starting again", since=since)
    await up.until(r"\[viewer\] note: rig.json changed: starting again", since=since)
    await a_pose(up)
    since = len(up.text)
    save(up.calibration / "hand.right.json", default_hand("right", 1.02))
    await up.until(r"\[fusion\] note: hand.right.json changed: starting again", since=since)
    await a_pose(up)


async def test_ctrl_c_leaves_nothing_behind(up):
    children = children_of(up.process.pid)
    assert len(children) >= 7
    up.process.send_signal(signal.SIGINT)
    async with asyncio.timeout(SOON_S):
        assert await up.process.wait() == 0
    assert not alive(children)


async def test_markers_of_one_camera_are_a_rig(tmp_path):
    """Fusion is its master, though it could triangulate nothing."""
    with working_copy(tmp_path / "one") as config:
        second = '[[camera]]\nname = "right"\nsource = "simulator"\n'
        text = config.read_text()
        assert second in text
        config.write_text(text.replace(second, ""))
        port = free_port()
        async with running(config, port, "--no-viewer") as up:
            await up.until(r"rig 'sim' is up after \d+ s", START_S)
            assert "solver" not in up.text
            async with open_bus("sim", [f"tcp/127.0.0.1:{port}"]) as bus:
                async with asyncio.timeout(SOON_S):
                    frame = await anext(bus.latest(topics.MARKERS))
            assert frame.camera == "left"
