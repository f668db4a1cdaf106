"""The size of a hand of the tables' proportions that was guessed wrongly."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.files.config import RigConfig
from rhot.hand import LANDMARKS, HandModel, HandName, default_hand
from rhot.messages import HandPose
from services.solver.maths.chains import hand_chains, resized
from services.solver.step import SolverStep
from services.solver.whole_hand.hand_size import HandSize
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.landmarks import Observation, Observed, hand_landmarks

# What the fit is told of landmarks on a hand of the tables.
TOLD_M2 = 25e-6
FRAME_NS = 33_333_333


def bones_m(pose: HandPose) -> np.ndarray:
    """The lengths of the fingers' bones."""
    joints = pose.positions_m[np.arange(6, 26).reshape(4, 5)[:, 1:]]
    return np.linalg.norm(np.diff(joints, axis=1), axis=2)


def seen(
    world: Callable, size: float, seed: int, frames: int, hand: HandName = "right"
) -> list[dict[str, np.ndarray]]:
    """Wrist and tips of a moving hand of the tables at a size."""
    ours = world(hand)
    model = msgspec.structs.replace(default_hand(hand, size), origin="simulated")
    ours = type(ours)(model)
    return [ours.points(instant) for instant in ours.motion(seed, frames)]


@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("size", [0.86, 1.0, 1.13])
def test_a_wrong_guess_is_corrected(world: Callable, hand: HandName, size: float) -> None:
    errors = []
    for seed in (1, 2, 3):
        step = SolverStep(RigConfig(), {hand: default_hand(hand)})
        for frame, points in enumerate(seen(world, size, seed, 150, hand)):
            pose = step.step(world(hand).message(points, frame))
        table_m = default_hand(hand).lengths_m[1:]
        # Skin goes with bones.
        share = pose.joint("index_tip").radius_m / default_hand(hand).digits[1].radii_m[3]
        assert share == pytest.approx(np.mean(bones_m(pose) / table_m), abs=2e-3)
        errors.append(float(np.mean(bones_m(pose) / table_m)) / size - 1.0)
    # A look at postures that habit finds unlikely is off by some percent.
    assert np.max(np.abs(errors)) < 0.07
    assert abs(np.mean(errors)) < 0.04


def test_points_that_are_no_hands_do_not_run_away_with_it(world: Callable) -> None:
    """As of a chessboard whose squares were told wrongly; twice as large is refused elsewhere."""
    step = SolverStep(RigConfig(), {"right": default_hand("right")})
    for frame, points in enumerate(seen(world, 1.6, 1, 300)):
        step.step(world("right").message(points, frame))
    assert 1.1 < (step.size("right") or 0.0) < 1.36


def test_a_measured_hand_keeps_its_size(world: Callable) -> None:
    for origin in ("measured", "simulated"):
        model = msgspec.structs.replace(default_hand("right"), origin=origin)
        step = SolverStep(RigConfig(), {"right": model})
        for frame, points in enumerate(seen(world, 1.1, 1, 60)):
            pose = step.step(world("right").message(points, frame))
        np.testing.assert_allclose(bones_m(pose), model.lengths_m[1:], atol=2e-5)


@pytest.mark.parametrize("hand", ["right", "left"])
def test_a_resized_hand_is_that_of_the_tables_at_the_size(hand: HandName) -> None:
    small, large = default_hand(hand, 0.9), default_hand(hand, 1.08)
    chains, expected = resized(hand_chains(small), 1.2), hand_chains(large)
    for name, found in chains._asdict().items():
        np.testing.assert_allclose(found, getattr(expected, name), atol=1e-12, err_msg=name)
    landmarks = hand_landmarks(small)
    places = landmarks.places(LANDMARKS)
    landmarks.resize(1.2)
    np.testing.assert_allclose(
        places.offset_m, hand_landmarks(large).places(LANDMARKS).offset_m, atol=1e-12
    )
    # And of lists that are asked for later.
    (offset_m,) = landmarks.places(("middle_proximal",)).offset_m
    np.testing.assert_allclose(offset_m, large.paint["middle_proximal"].offset_m, atol=1e-12)


def test_it_is_the_same_whoever_asks_for_the_challenge(world: Callable) -> None:
    """Live a look comes after the pose is out, offline with the next message."""

    def tracker() -> HandTracker:
        model: HandModel = default_hand("right")
        return HandTracker(model, hand_landmarks(model), size=HandSize(TOLD_M2))

    late, asked, changed = tracker(), tracker(), 0
    for frame, points in enumerate(seen(world, 1.1, 4, 60)):
        observed = {
            name: Observation(p, (1e-6 + TOLD_M2) * np.eye(3), True) for name, p in points.items()
        }
        one, two = (each.track(frame * FRAME_NS, observed) for each in (late, asked))
        np.testing.assert_array_equal(one.covariance, two.covariance)
        np.testing.assert_array_equal(one.angles_rad, two.angles_rad)
        before = asked.chains.lengths_m[2, 0]
        asked.challenge()
        changed += asked.chains.lengths_m[2, 0] != before
    assert changed > 2


def observed(points: dict[str, np.ndarray]) -> Observed:
    return Observed.of({name: Observation(p, 1e-6 * np.eye(3), True) for name, p in points.items()})


def test_a_hand_that_is_held_is_looked_at_once(world: Callable) -> None:
    size, (points, *_, other) = HandSize(TOLD_M2), seen(world, 1.0, 1, 40)
    due = [size.is_due(frame * FRAME_NS, observed(points)) for frame in range(10, 90)]
    assert due == [True, *[False] * 79]
    # Not without most landmarks, nor carried elsewhere; in another posture it is.
    few = dict(list(other.items())[:4])
    assert not size.is_due(100 * FRAME_NS, observed(few))
    moved = {name: point + 0.1 for name, point in points.items()}
    assert not size.is_due(101 * FRAME_NS, observed(moved))
    assert size.is_due(102 * FRAME_NS, observed(other))
    # Nor again so soon.
    assert not size.is_due(103 * FRAME_NS, observed(points))
