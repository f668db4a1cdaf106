"""A hand over time: missing landmarks, gaps, stamps from another year, a locked mirror image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rhot.geometry.transforms import angle_between, rotation_from_vector
from rhot.hand import TIPS
from services.solver.whole_hand.hand_tracker import HandTracker
from services.solver.whole_hand.landmarks import Observation, hand_landmarks
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS

FRAME_NS = 33_333_333


def _observed(points_m: dict, rng: np.random.Generator | None = None) -> dict[str, Observation]:
    noise = rng.normal(0.0, 1e-3, (len(points_m), 3)) if rng else np.zeros((len(points_m), 3))
    return {
        name: Observation(p + n, 1e-6 * np.eye(3), True)
        for (name, p), n in zip(points_m.items(), noise, strict=True)
    }


@pytest.fixture
def tracker(world: Callable) -> HandTracker:
    model = world("right").model
    return HandTracker(model, hand_landmarks(model))


def test_nothing_before_the_wrist_and_three_tips(world: Callable, tracker: HandTracker) -> None:
    ours = world("right")
    found = ours.points(ours.motion(1, 1)[0])
    assert tracker.track(0, {}) is None
    assert tracker.track(1, _observed({name: found[name] for name in TIPS})) is None
    names = ["wrist", "index_tip", "ring_tip", "thumb_tip"]
    assert tracker.track(2, _observed({name: found[name] for name in names[:3]})) is None
    assert tracker.track(3, _observed({name: found[name] for name in names})) is not None


def test_landmarks_that_may_be_anywhere_on_a_ray_begin_no_hand(
    world: Callable, tracker: HandTracker
) -> None:
    ours = world("right")
    certain = _observed(ours.points(ours.motion(1, 1)[0]))
    along_ray = np.diag([1e-6, 1e-6, 0.36])
    vague = {n: replace(seen, covariance_m2=along_ray) for n, seen in certain.items()}
    assert tracker.track(0, vague) is None
    assert tracker.track(1, vague | {"wrist": certain["wrist"]}) is None
    assert tracker.track(2, certain) is not None
    # A hand that is known goes on with them.
    assert tracker.track(3, vague) is not None


def test_follows_and_is_surer_than_a_single_message(world: Callable, tracker: HandTracker) -> None:
    ours, rng = world("right"), np.random.default_rng(2)
    model, errors, alone = ours.model, [], []
    for frame, instant in enumerate(ours.motion(2, 150)):
        observed = _observed(ours.points(instant), rng)
        estimate = tracker.track(frame * FRAME_NS, observed)
        assert estimate is not None
        errors.append(angle_between(estimate.rotation, instant.rotation))
        if frame % 10 == 0:
            single = HandTracker(model, hand_landmarks(model)).track(0, observed)
            alone.append(angle_between(single.rotation, instant.rotation))
    assert np.mean(errors) < np.deg2rad(6.0)
    assert np.mean(errors) < np.mean(alone)


def test_landmarks_come_and_go(world: Callable, tracker: HandTracker) -> None:
    """Each landmark hidden a fifth of the time, in stretches.

    The tips that are seen stay matched, and nothing jumps away.
    """
    ours, rng, tips = world("right"), np.random.default_rng(3), []
    for frame, instant in enumerate(ours.motion(3, 240, "fist")):
        found = ours.points(instant)
        hidden = (
            {name for i, name in enumerate(found) if (frame // 12 + 3 * i) % 5 == 0}
            if frame
            else set()
        )
        estimate = tracker.track(
            frame * FRAME_NS,
            _observed({name: p for name, p in found.items() if name not in hidden}, rng),
        )
        assert estimate is not None
        tips.append(angle_between(estimate.rotation, instant.rotation))
        # The wrist itself is out of sight for 0.4 s at a time.
        assert np.linalg.norm(estimate.position_m - instant.position_m) < 0.08
    assert np.mean(tips) < np.deg2rad(9.0)
    assert max(tips) < np.deg2rad(50.0)


def test_uncertainty_grows_while_hidden(world: Callable, tracker: HandTracker) -> None:
    ours = world("right")
    found = ours.points(ours.motion(4, 1)[0])
    tracker.track(0, _observed(found))
    without = {name: p for name, p in found.items() if name != "ring_tip"}
    spread = []
    for frame in range(1, 20):
        estimate = tracker.track(frame * FRAME_NS, _observed(without))
        spread.append(np.sqrt(np.diag(estimate.covariance))[6:].reshape(5, 4))
    assert np.all(np.diff([s[3, 2] for s in spread]) > 0.0)
    # Less than twice: what the other fingers do tells something of this one.
    assert spread[-1][3, 2] > 1.6 * spread[-1][1, 2] > 0.0


def test_a_second_without_landmarks_forgets_the_hand(world: Callable, tracker: HandTracker) -> None:
    ours = world("right")
    found = _observed(ours.points(ours.motion(5, 1)[0]))
    assert tracker.track(0, found) is not None
    assert tracker.track(30 * FRAME_NS, {}) is not None
    assert tracker.track(31 * FRAME_NS, {}) is None
    assert tracker.track(32 * FRAME_NS, found) is not None


@pytest.mark.parametrize("jump_ns", [-5 * FRAME_NS, 2 * 10**9, 2**62])
def test_stamps_that_jump_start_anew(world: Callable, tracker: HandTracker, jump_ns: int) -> None:
    ours = world("right")
    a, b = ours.motion(6, 1)[0], ours.motion(7, 1)[0]
    start = 10**18
    tracker.track(start, _observed(ours.points(a)))
    estimate = tracker.track(start + jump_ns, _observed(ours.points(b)))
    assert angle_between(estimate.rotation, b.rotation) < np.deg2rad(30.0)


@pytest.mark.parametrize("flip", [(np.pi, 0.0, 0.0), (0.0, np.pi, 0.0), (0.0, 0.0, np.pi)])
def test_a_mirrored_orientation_does_not_last(
    world: Callable, tracker: HandTracker, flip: tuple
) -> None:
    ours, rng = world("right"), np.random.default_rng(8)
    motion = ours.motion(8, 30)
    estimate = tracker.track(0, _observed(ours.points(motion[0])))
    wrong = estimate.rotation @ rotation_from_vector(flip)
    # As if the first estimate had gone wrong, and the tracker were sure of it.
    sure = 1e-4 * np.eye(UNKNOWNS)
    tracker._estimate = estimate._replace(rotation=wrong, covariance=sure)
    for frame, instant in enumerate(motion[1:], 1):
        estimate = tracker.track(frame * FRAME_NS, _observed(ours.points(instant), rng))
    assert angle_between(estimate.rotation, motion[-1].rotation) < np.deg2rad(30.0)


def test_two_hands_in_a_row(world: Callable, tracker: HandTracker) -> None:
    """The hand is suddenly elsewhere, as after an identity swap: found again in half a second."""
    ours = world("right")
    a, b = ours.motion(9, 20), ours.motion(10, 20)
    for frame, instant in enumerate([*a, *b]):
        estimate = tracker.track(frame * FRAME_NS, _observed(ours.points(instant)))
    assert angle_between(estimate.rotation, b[-1].rotation) < np.deg2rad(30.0)


def test_a_challenge_is_the_same_whoever_asks_for_it(world: Callable, tracker: HandTracker) -> None:
    """Live it comes after the pose is out, offline with the next message."""
    ours = world("right")
    other, asked = HandTracker(ours.model, hand_landmarks(ours.model)), 0
    for frame, instant in enumerate(ours.motion(5, 12)):
        observed = _observed(ours.points(instant))
        one, two = (each.track(frame * FRAME_NS, observed) for each in (tracker, other))
        np.testing.assert_array_equal(one.covariance, two.covariance)
        asked += other.challenge_due
        other.challenge()
        assert not other.challenge_due
    assert asked


def test_restarts_are_as_far_apart_as_asked(world: Callable) -> None:
    """From the second on: the first comes as soon as a hand is found."""
    ours = world("right")
    tracker = HandTracker(ours.model, hand_landmarks(ours.model), 7)
    due = []
    for frame, instant in enumerate(ours.motion(5, 40)):
        tracker.track(frame * FRAME_NS, _observed(ours.points(instant)))
        if tracker.challenge_due:
            due.append(frame)
    assert np.diff(due).tolist() == [7] * (len(due) - 1)
    assert len(due) > 3
