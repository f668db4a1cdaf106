"""`rhot doctor` names the right cause of each fault that is planted into a running rig."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import pytest_asyncio

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.client import RigClient
from rhot.files.config import load_rig
from rhot.messages import ClockEcho
from services.cli.doctor.text import links_text
from testing.watched_rig import WatchedRig, watched_rig

pytestmark = [
    pytest.mark.field,
    pytest.mark.timeout(600),
    pytest.mark.asyncio(loop_scope="module"),
]
# A hue that nothing in the scene has, and no picture's noise reaches.
NOWHERE = {"hsv_low": [2, 250, 250], "hsv_high": [4, 255, 255]}


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def rig() -> AsyncIterator[WatchedRig]:
    async with watched_rig() as rig:
        yield rig


async def test_the_session_is_stopped(rig: WatchedRig) -> None:
    client = RigClient(rig.bus)
    client.stop()
    async with rig.until_mended(client.start):
        cause = await rig.named("session_stopped")
    assert "rhot session start" in cause.action


@pytest.mark.parametrize(
    ("planted", "camera", "code"),
    [
        ("dark", "left", "camera_dark"),
        ("freeze", "left", "camera_frozen"),
        ("white", "left", "camera_saturated"),
        ("mirror", "left", "cameras_mirrored"),
        ("ahead", "right", "camera_clock_off"),
    ],
)
async def test_a_camera_is_wrong(rig: WatchedRig, planted: str, camera: str, code: str) -> None:
    feed = rig.feed.cameras[camera]
    getattr(feed, planted)()
    async with rig.until_mended(feed.well):
        cause = await rig.named(code)
    assert camera in f"{cause.name} {cause.text}"


async def test_a_camera_is_slow(rig: WatchedRig) -> None:
    feed = rig.feed.cameras["right"]
    feed.slow()
    async with rig.until_mended(feed.well):
        await rig.named("camera_slow")
        # On a machine with much to do the other one may be slow as well.
        slow = {link.name: link.text for link in rig.links if link.code == "camera_slow"}
    assert "of 10" in slow["camera right"]


async def test_a_range_is_wrong(rig: WatchedRig) -> None:
    path = rig.config.parent / "calibration" / "left.colors.json"
    right_one = path.read_bytes()
    wrong = json.loads(right_one)
    wrong["colors"]["lime"] = NOWHERE
    path.write_text(json.dumps(wrong), encoding="utf-8")
    async with rig.until_mended(lambda: path.write_bytes(right_one)):
        cause = await rig.named("marker_not_seen")
    assert cause.name == "markers of left"
    assert "lime" in cause.text
    assert "rhot calibrate colors left" in cause.action


async def test_a_service_is_absent(rig: WatchedRig) -> None:
    name = "pi_tracker/left"
    await rig.stop(name)
    async with rig.until_mended(lambda: rig.start(name)):
        cause = await rig.named("service_absent")
    assert cause.name == name
    assert "rhot-pi-tracker@left" in cause.action


async def test_a_tracker_hangs(rig: WatchedRig) -> None:
    pid = rig.supervisor.pids["pi_tracker/right"]
    os.kill(pid, signal.SIGSTOP)
    async with rig.until_mended(lambda: os.kill(pid, signal.SIGCONT)):
        # Its token is gone with the router's patience: who looks then has never heard of it.
        cause = await rig.named("service_silent", "service_gone", "service_absent")
    assert cause.name == "pi_tracker/right"


async def test_fusion_is_absent_then_not_calibrated(rig: WatchedRig) -> None:
    await rig.stop("fusion")
    geometry = rig.config.parent / "calibration" / "rig.json"
    content = geometry.read_bytes()
    async with rig.until_mended(lambda: geometry.write_bytes(content)):
        assert (await rig.named("service_absent")).name == "fusion"
        geometry.unlink()
        rig.start("fusion")
        cause = await rig.named("not_calibrated")
    assert "rig.json" in cause.text


async def test_a_second_fusion_runs(rig: WatchedRig) -> None:
    rig.children["second"] = rig.children["fusion"]
    rig.start("second")
    try:
        cause = await rig.named("second_service")
    finally:
        await rig.stop("second")
    await rig.well()
    assert "fusion" in cause.text


async def test_a_second_clock_answers(rig: WatchedRig) -> None:
    async with open_bus("sim", [rig.endpoint]) as stranger:
        stranger.answer(
            topics.CLOCK,
            lambda: ClockEcho(
                master_ns=clock.now_ns() + 1_000_000_000, session=stranger.session, host="elsewhere"
            ),
        )
        cause = await rig.named("second_clock")
    await rig.well()
    assert "elsewhere" in cause.text


@pytest.fixture
def small_disk(rig: WatchedRig) -> Iterator[Path]:
    """The folder of recordings on a file system of 100 MB."""
    folder = rig.config.parent / load_rig(rig.config).recorder.folder
    folder.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", "size=100m", "rhot-test", str(folder)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("needs to be root, to mount a small disk")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


async def test_a_disk_is_nearly_full(rig: WatchedRig, small_disk: Path) -> None:
    """Poses still come: the link is worse, and the advice is there."""
    links = await rig.until("disk_low", lambda all_: any(one.code == "disk_low" for one in all_))
    low = next(one for one in links if one.code == "disk_low")
    assert low.state == "worse"
    assert str(small_disk) in low.text
    assert low.action in links_text(links)
