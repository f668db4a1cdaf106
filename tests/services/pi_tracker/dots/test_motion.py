"""The filter of a hand's posture: a closing finger followed, a hidden dot carried along."""

from __future__ import annotations

import numpy as np
import pytest

from services.pi_tracker.dots import motion
from services.pi_tracker.dots.body.rotations import turned
from services.pi_tracker.dots.body.skeleton import Skeleton
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.start.posture import postures

NAMES = (*finger_landmarks("thumb"), *finger_landmarks("index"))
SKELETON = Skeleton(NAMES, (1280, 720))
ROTATION, SIDE = turned(np.array([[1.2, 0.4, -0.3]])), np.array([1.0])


def _seen(bend: float) -> np.ndarray:
    """Pixels of a hand whose index finger bends so much more than usual, rad."""
    posture = np.zeros((1, SKELETON.size))
    posture[0, :3] = 0.01, 0.02, 0.4
    posture[0, 6 : SKELETON.moving] = SKELETON.usual
    posture[0, 11:14] += bend * np.array([1.0, 1.0, 0.6])
    facing = np.array([[0.4, 0.2]])
    return SKELETON.project(posture, ROTATION, SIDE, facing)[0][0]


@pytest.fixture(scope="module")
def begun() -> list[tuple[float, motion.State]]:
    return postures(SKELETON, _seen(-0.3), np.full(8, 1.0))[1]


def test_the_first_picture_allows_several_postures_that_all_show_it(
    begun: list[tuple[float, motion.State]],
) -> None:
    assert begun[0][0] == 0.0
    assert len(begun) > 1
    for _, state in begun:
        pixels, _ = SKELETON.project(*state[:4])
        assert np.linalg.norm(pixels[0] - _seen(-0.3), axis=1).max() < 4.0


def test_a_left_hand_and_a_right_one_are_among_them(
    begun: list[tuple[float, motion.State]],
) -> None:
    assert {float(state.sides[0]) for _, state in begun} == {-1.0, 1.0}


def test_what_was_learnt_of_a_person_fades_to_what_people_are(
    begun: list[tuple[float, motion.State]],
) -> None:
    state, own = begun[0][1], np.arange(SKELETON.moving, SKELETON.size)
    means = state.means.copy()
    means[:, own] = 3.0 * SKELETON.person
    after = motion.coasted(SKELETON, state._replace(means=means), 20.0)
    assert np.abs(after.means[0, own] / SKELETON.person).max() < 1e-3
    assert np.allclose(np.sqrt(after.covs[0, own, own]), SKELETON.person, rtol=1e-3)


def test_a_hidden_tip_goes_along_with_its_finger(begun: list[tuple[float, motion.State]]) -> None:
    state = motion.together([one for _, one in begun])
    seen = np.ones((len(begun), 8), bool)
    seen[:, 7] = False
    total = np.zeros(len(begun))
    for frame in range(1, 11):
        ahead = motion.coasted(SKELETON, state, 1 / 30)
        added, _ = motion.levels(SKELETON, 1 / 30)[1]
        places = np.broadcast_to(_seen(-0.3 + 0.1 * frame), (len(begun), 8, 2))
        after = motion.updated(
            SKELETON, ahead._replace(covs=ahead.covs + added), seen, places, np.ones(seen.shape)
        )
        state, total = after.state, total + after.nats
    best = int(total.argmax())
    pixels, _ = SKELETON.project(*state[:4])
    # It has moved by 130 px, and the bend of the last joint was not seen.
    moved = np.linalg.norm(_seen(0.7)[7] - _seen(-0.3)[7])
    assert moved > 60.0
    assert np.linalg.norm(pixels[best, 7] - _seen(0.7)[7]) < 0.25 * moved
    assert np.linalg.eigvalsh(state.covs[best]).min() > 0.0


def test_time_that_runs_backwards_leads_back(begun: list[tuple[float, motion.State]]) -> None:
    state = motion.together([one for _, one in begun])
    size = SKELETON.size
    means = state.means.copy()
    means[:, size:] = np.linspace(-1.0, 1.0, SKELETON.moving)
    ahead = motion.coasted(SKELETON, state._replace(means=means), 0.01)
    back = motion.coasted(SKELETON, motion.reversed_in_time(SKELETON, ahead), 0.01)
    # Velocities fade by a twenty-fifth meanwhile.
    away, left = ahead.means[:, :3] - means[:, :3], back.means[:, :3] - means[:, :3]
    assert np.all(np.abs(left) < 0.05 * np.abs(away))
    assert np.linalg.eigvalsh(back.covs).min() > 0.0
    twice = motion.reversed_in_time(SKELETON, motion.reversed_in_time(SKELETON, ahead))
    assert all(np.array_equal(a, b) for a, b in zip(twice, ahead, strict=True))
