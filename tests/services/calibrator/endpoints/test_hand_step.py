"""The guided exercises over a real router: a hand whose bones are known does them, is told what to
do, and is measured.
"""

from __future__ import annotations

import asyncio
import itertools

import msgspec
import numpy as np
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import HandTable, RigTable
from rhot.hand import HandModel, default_hand
from rhot.hand_exercises import CYCLE_S, EXERCISES
from rhot.messages import HandPoints
from rhot.messages.calibration import CalibrationOrder
from services.calibrator.endpoints import hand_exercises
from services.calibrator.endpoints.desk import Desk
from services.calibrator.endpoints.hand_step import hand_step
from services.calibrator.guided.found import Found
from services.simulator.hands.calibration_exercises import guided
from testing.synthetic_hands import hand_message, noisy_points, wrist_rotation

RIG = RigConfig(
    rig=RigTable(name="desk"),
    hand={"right": HandTable(markers={"wrist": "violet", "index_tip": "blue"})},
)
ORDER = CalibrationOrder(action="start", step="hand", hand="right")
SCALE, RATE_HZ = 1.1, 15.0


def nobody(_: Found) -> None:
    """Nothing of it can be saved before its end."""


@pytest.fixture(scope="module")
def exercises() -> list[HandPoints]:
    """All exercises of a large hand, with half a millimetre of noise."""
    model: HandModel = default_hand("right", SCALE)
    random, motion = np.random.default_rng(5), guided(default_hand("right", SCALE), 3)
    messages = []
    for frame in range(int((CYCLE_S + 1.0) * RATE_HZ)):
        t_s = frame / RATE_HZ
        gesture = motion(t_s)
        R = wrist_rotation(gesture, np.zeros(3))
        points = noisy_points(model, R, np.array([0.0, 0.0, 0.5]), gesture.angles_rad, random)
        messages.append(hand_message(model, frame, t_s, points))
    return messages


async def test_the_exercises_give_the_hand_that_did_them(
    router: str, exercises: list[HandPoints], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hand_exercises, "READY_S", 0.01)
    said: list[str] = []
    phases: list[str] = []

    def change(**fields: object) -> None:
        if "phase" in fields:
            phases.append(str(fields["phase"]))
        said.append(str(fields["to_do"]))

    async with open_bus("desk", [router]) as ours, open_bus("desk", [router]) as theirs:
        publisher = theirs.publisher(topics.POINTS, hand="right")

        async def publish() -> None:
            while not publisher.wanted:
                await asyncio.sleep(0.01)
            for message in exercises:
                publisher.put(message)
                await asyncio.sleep(0.002)

        async with asyncio.timeout(120.0):
            publishing = asyncio.create_task(publish())
            found = await hand_step(Desk(ours, RIG, ORDER, change, nobody))
            await publishing
    assert [prompt for prompt, _ in itertools.groupby(said[1:-1])] == [
        one.prompt for one in EXERCISES
    ]
    assert phases == ["computing"]
    assert found.good, (found.figures, found.advice)
    (made,) = found.files.values()
    assert isinstance(made, HandModel)
    true_m, table_m = (default_hand("right", s).digits[1].lengths_m[0] for s in (SCALE, 1.0))
    assert abs(made.digits[1].lengths_m[0] - true_m) < 0.5 * (true_m - table_m)


async def test_without_points_it_says_so(router: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hand_exercises, "READY_S", 0.01)
    monkeypatch.setattr(hand_exercises, "_SILENT_S", 0.2)
    async with open_bus("desk", [router]) as bus:
        with pytest.raises(CalibrationError, match="is fusion running and the hand in view"):
            await hand_step(Desk(bus, RIG, ORDER, lambda **_: None, nobody))
        left = msgspec.structs.replace(ORDER, hand="left")
        with pytest.raises(CalibrationError, match=r"no \[hand.left.markers\]"):
            await hand_step(Desk(bus, RIG, left, lambda **_: None, nobody))
