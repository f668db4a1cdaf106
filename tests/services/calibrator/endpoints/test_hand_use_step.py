"""A hand that is measured while it is used, as a page asks for it, over a real router: saved once
it is good, refused with the reason before.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
import pytest_asyncio

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import RefusedError
from rhot.files.calibration import load_hand
from rhot.files.config import RigConfig
from rhot.files.rig_tables import HandTable, RigTable
from rhot.hand import default_hand
from rhot.messages import HandPoints
from rhot.messages.calibration import CalibrationOrder, CalibrationState
from services.calibrator.endpoints import hand_use_step
from services.calibrator.endpoints.guide import Guide
from services.simulator.hands.gestures import MOTIONS
from testing.synthetic_hands import hand_message, noisy_points, wrist_rotation

SIZE, RATE_HZ, SECONDS = 0.85, 15.0, 66.0
START = CalibrationOrder(action="start", step="hand", way="use")
SAVE = CalibrationOrder(action="save", step="hand")
# Of the tables' proportions, measured within a few mm of noise.
NEAR = 0.04


@pytest.fixture(scope="module")
def used() -> list[HandPoints]:
    """A minute of random motion of a small hand, with 1 mm of noise."""
    model = default_hand("right", SIZE)
    random, motion = np.random.default_rng(3), MOTIONS["random"](model, 8)
    messages = []
    for frame in range(round(RATE_HZ * SECONDS)):
        gesture = motion(frame / RATE_HZ)
        R = wrist_rotation(gesture, np.zeros(3))
        position_m = np.array([0.0, 0.0, 0.5]) + gesture.shift_m
        points = noisy_points(model, R, position_m, gesture.angles_rad, random)
        messages.append(hand_message(model, frame, frame / RATE_HZ, points))
    return messages


@pytest.fixture
def rig(tmp_path: Path) -> RigConfig:
    hand = HandTable(markers={"wrist": "violet", "index_tip": "blue"})
    return RigConfig(rig=RigTable(name="desk"), hand={"right": hand}, folder=tmp_path)


@pytest_asyncio.fixture
async def page(router: str, rig: RigConfig) -> AsyncIterator[Bus]:
    """The page's bus; the guide answers on another one."""
    async with open_bus("desk", [router]) as theirs, open_bus("desk", [router]) as ours:
        guide = Guide(theirs, rig)
        theirs.answer_requests(topics.CALIBRATE, guide.answer)
        async with asyncio.timeout(60.0):
            while not await ours.get(topics.CALIBRATE):
                await asyncio.sleep(0.02)
        yield ours
        await guide.close()


async def until(page: Bus, true: Callable[[CalibrationState], bool]) -> CalibrationState:
    async with asyncio.timeout(120.0):
        while True:
            for state in await page.get(topics.CALIBRATE, timeout_s=30.0):
                if true(state):
                    return state
            await asyncio.sleep(0.05)


async def test_it_is_refused_until_it_is_good_and_saved_while_it_goes_on(
    page: Bus, rig: RigConfig, used: list[HandPoints], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_use_step, "EVERY_S", 4.0)
    points = page.publisher(topics.POINTS, hand="right")
    began = await page.request(topics.CALIBRATE, START)
    assert began.phase == "collecting"
    with pytest.raises(RefusedError, match=r"not good yet\. .*in view of two cameras"):
        await page.request(topics.CALIBRATE, SAVE)
    # A clock that is set back in between: what was seen before does not count.
    wrong = msgspec.structs.replace(used[0], stamp_ns=used[-1].stamp_ns + 60 * 10**9)
    for message in (wrong, *used):
        points.put(message)
        await asyncio.sleep(0.001)
    good = await until(page, lambda state: state.good or state.phase != "collecting")
    assert (good.phase, good.advice) == ("collecting", []), good
    assert "press Save" in good.to_do
    figures = {one.name: one.value for one in good.figures}
    assert all("mm" in figures[f"bones of the {one}"] for one in ("thumb", "ring finger"))
    file = rig.calibration_dir / "hand.right.json"
    assert not file.exists(), "nobody has said so"
    saved = await page.request(topics.CALIBRATE, SAVE)
    assert (saved.phase, saved.files) == ("saved", ["hand.right.json"])
    made, true = load_hand(rig.calibration_dir, "right"), default_hand("right", SIZE)
    lengths, true_lengths = (
        np.array([digit.lengths_m for digit in model.digits]) for model in (made, true)
    )
    assert lengths.sum() == pytest.approx(true_lengths.sum(), rel=NEAR)


async def test_what_is_stopped_or_failed_leaves_nothing(
    page: Bus, rig: RigConfig, used: list[HandPoints]
) -> None:
    points = page.publisher(topics.POINTS, hand="right")
    await page.request(topics.CALIBRATE, START)
    await until(page, lambda state: bool(state.figures))
    for message in used[:40]:
        points.put(message)
    state = await until(page, lambda state: "s of 60 s" in " ".join(state.seen))
    assert state.phase == "collecting"
    stopped = await page.request(topics.CALIBRATE, CalibrationOrder(action="stop"))
    assert (stopped.phase, stopped.figures, stopped.good) == ("idle", [], False)
    with pytest.raises(RefusedError, match="nothing to save"):
        await page.request(topics.CALIBRATE, SAVE)
    await page.request(topics.CALIBRATE, msgspec.structs.replace(START, hand="left"))
    failed = await until(page, lambda state: state.phase == "failed")
    assert "no [hand.left.markers]" in failed.to_do
    assert not rig.calibration_dir.exists()
