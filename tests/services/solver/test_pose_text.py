"""A pose as JSON, straight from its numbers: what msgspec makes of the message."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import Solver
from rhot.messages import HandPoints
from services.solver.pose_text import PoseTexts
from services.solver.step import SolverStep

END = b',"sent_ns":0}'


@pytest.mark.parametrize("method", ["dls", "analytic"])
@pytest.mark.parametrize("hand", ["left", "right"])
def test_equals_the_message(world: Callable, hand: str, method: str) -> None:
    ours = world(hand)
    config = RigConfig(solver=Solver(method=method))
    told, written = (SolverStep(config, {hand: ours.model}) for _ in range(2))
    for seq, place in enumerate(ours.motion(40, 1)):
        points = ours.message(ours.points(place), seq)
        if seq % 7 == 3:  # fewer landmarks: another template
            points = msgspec.structs.replace(points, points=points.points[1:])
        pose, text = told.step(points), written.text(points)
        assert (pose is None) == (text is None)
        if pose is not None and text is not None:
            assert text + END == msgspec.json.encode(pose)


def test_no_pose_of_a_hand_that_is_not_found_or_not_configured(world: Callable) -> None:
    right = world("right")
    step = SolverStep(RigConfig(), {"right": right.model})
    nothing = HandPoints(hand="right", seq=0, stamp_ns=1, points=[])
    assert step.text(nothing) is None
    assert step.text(msgspec.structs.replace(nothing, hand="left")) is None


@pytest.mark.parametrize("value", [float("nan"), 0.0, 1.0 / 3.0])
def test_numbers_without_a_text_of_their_own_are_told_all_the_same(
    world: Callable, value: float
) -> None:
    right = world("right")
    step = SolverStep(RigConfig(), {"right": right.model})
    points = right.message(right.points(right.motion(1, 1)[0]), 0)
    hand = step._hands["right"]
    solved = hand.solve(points)
    assert solved is not None
    # The thumb's first flexion is left out of a message where it is 0.
    solved.numbers[26, 1] = value
    text = PoseTexts().of(
        points,
        solved.numbers,
        solved.measured,
        lambda like: hand.message(points, like, solved.measured),
    )
    assert text + END == msgspec.json.encode(hand.message(*solved))
