"""A guided calibration as a page asks for it, over a real router: cameras that answer with rendered
boards, and points of a hand that does the exercises.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import cv2
import msgspec
import pytest
import pytest_asyncio

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import RefusedError
from rhot.files.calibration import load_lens
from rhot.files.config import RigConfig, load_rig
from rhot.messages.calibration import CalibrationOrder, CalibrationPhase, CalibrationState
from services.calibrator.endpoints.guide import Guide
from testing.synthetic_boards import BenchSetup

DEADLINE_S = 120.0
# Some are too much like others to be kept.
POSITIONS, WANTED = 14, 7
LENS = CalibrationOrder(action="start", step="lens", camera="left", count=WANTED)


@pytest.fixture(scope="module")
def shown() -> list[bytes]:
    """A board in so many positions, as PNG."""
    bench = BenchSetup(
        positions=POSITIONS, size_px=(320, 240), focal_px=263.0, distortion=(0.0,) * 5
    ).bench()
    camera = bench.cameras[0]
    return [cv2.imencode(".png", bench.picture(camera, key))[1].tobytes() for key in bench.poses]


@pytest.fixture
def rig(tmp_path: Path) -> RigConfig:
    (tmp_path / "rig.toml").write_text(
        '[rig]\nname = "desk"\n[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n'
        '[hand.right.markers]\nwrist = "violet"\nindex_tip = "blue"\n'
    )
    return load_rig(tmp_path / "rig.toml")


@pytest_asyncio.fixture
async def page(router: str, rig: RigConfig) -> AsyncIterator[Bus]:
    """The page's bus; the guide answers on another one."""
    async with open_bus("desk", [router]) as theirs, open_bus("desk", [router]) as ours:
        guide = Guide(theirs, rig)
        theirs.answer_requests(topics.CALIBRATE, guide.answer)
        async with asyncio.timeout(DEADLINE_S):
            while not await ours.get(topics.CALIBRATE):
                await asyncio.sleep(0.02)
        yield ours
        await guide.close()


async def until(page: Bus, *phases: CalibrationPhase) -> CalibrationState:
    async with asyncio.timeout(DEADLINE_S):
        while True:
            for state in await page.get(topics.CALIBRATE, timeout_s=10.0):
                if state.phase in phases:
                    return state
            await asyncio.sleep(0.05)


async def test_a_lens_from_the_first_picture_to_its_file(
    page: Bus, router: str, rig: RigConfig, shown: list[bytes]
) -> None:
    asked = 0

    def answer() -> bytes:
        nonlocal asked
        asked += 1
        # Each position stands still over four takes; no two pictures of a camera are the same.
        return shown[min((asked - 1) // 4, POSITIONS - 1)] + asked.to_bytes(4)

    async with open_bus("desk", [router]) as camera:
        camera.answer(topics.FRAME, answer, camera="left")
        with pytest.raises(RefusedError, match="nothing to save"):
            await page.request(topics.CALIBRATE, CalibrationOrder(action="save"))
        await page.request(topics.CALIBRATE, LENS)
        with pytest.raises(RefusedError, match="stop it first"):
            await page.request(topics.CALIBRATE, LENS)
        state = await until(page, "done", "failed")
    assert state.phase == "done", state.to_do
    figures = {one.name: one.value for one in state.figures}
    assert figures["pictures used"] == str(WANTED)
    assert float(figures["error of pictures that were left out"].split()[0]) < 0.5
    assert not (rig.calibration_dir / "left.lens.json").exists(), "nobody has said so"
    saved = await page.request(topics.CALIBRATE, CalibrationOrder(action="save"))
    assert (saved.phase, saved.files) == ("saved", ["left.lens.json"])
    made = load_lens(rig.calibration_dir, "left")
    assert made.matrix[0][0] == pytest.approx(263.0, rel=0.03)


async def test_a_camera_that_is_silent_ends_the_step_and_not_the_service(page: Bus) -> None:
    await page.request(topics.CALIBRATE, LENS)
    state = await until(page, "failed")
    assert "camera left sends no picture" in state.to_do
    await page.request(topics.CALIBRATE, msgspec.structs.replace(LENS, camera="top"))
    assert "top" in (await until(page, "failed")).to_do


async def test_a_step_is_stopped(page: Bus) -> None:
    hand = CalibrationOrder(action="start", step="hand", hand="right")
    began = await page.request(topics.CALIBRATE, hand)
    assert began.phase == "collecting"
    stopped = await page.request(topics.CALIBRATE, CalibrationOrder(action="stop"))
    assert (stopped.phase, stopped.number) == ("idle", began.number)


async def test_a_picture_that_comes_twice_shows_nothing_that_stands_still(
    page: Bus, router: str, shown: list[bytes]
) -> None:
    asked = 0

    def answer() -> bytes:
        nonlocal asked
        asked += 1
        return shown[(asked // 2) % POSITIONS]

    async with open_bus("desk", [router]) as camera:
        camera.answer(topics.FRAME, answer, camera="left")
        await page.request(topics.CALIBRATE, LENS)
        async with asyncio.timeout(DEADLINE_S):
            while asked < 20:
                await asyncio.sleep(0.05)
        state = await until(page, "collecting", "failed", "done")
        assert state.phase == "collecting"
        assert f"0/{WANTED} positions" in " ".join(state.seen)
        await page.request(topics.CALIBRATE, CalibrationOrder(action="stop"))
