"""A hand's landmarks begin, follow the others, begin again and end."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.hand_filter import HandFilter
from testing.synthetic_points import MovingHand


def test_two_frames_begin_a_hand(one_hand):
    hand = one_hand()
    hand.run(range(2))
    assert hand.counts.started == 6
    hand.run(range(2, 12))
    found, errors = hand.errors_m(10 / 60.0)
    assert found.all()
    assert np.linalg.norm(errors, axis=1).max() < 0.005


def test_a_hand_begins_with_fewer_than_all(one_hand):
    hand = one_hand()
    for k in range(20):
        hand.see(hand.frame(k), seen=(0, 2) if k < 10 else (0, 2, 3))
    found, errors = hand.errors_m(18 / 60.0)
    assert found.tolist() == [True, False, True, True, False, False]
    assert np.linalg.norm(errors[found], axis=1).max() < 0.005


def test_a_wild_look_moves_nothing(one_hand):
    hand = one_hand()
    hand.run(range(30))
    camera, times_s, rays = hand.frame(30)
    wild = rays.copy()
    wild[2] += [0.02, 0.01]
    hand.see((camera, times_s, wild))
    assert hand.counts.gated == 1
    _, errors = hand.errors_m(30 / 60.0)
    assert np.linalg.norm(errors, axis=1).max() < 0.008
    hand.run(range(31, 40))
    assert hand.counts.started == 6


def test_a_hand_elsewhere_is_found_again(one_hand):
    hand = one_hand()
    hand.run(range(30))
    hand.path = MovingHand(distance_m=0.5, seed=9)
    hand.run(range(30, 60))
    found, errors = hand.errors_m(58 / 60.0)
    assert found.all()
    assert np.linalg.norm(errors, axis=1).max() < 0.005


def test_a_landmark_that_nobody_sees_ends(one_hand):
    hand = one_hand()
    hand.run(range(20))
    for k in range(20, 40):
        hand.see(hand.frame(k), seen=(0, 1, 2, 3, 4))
    found, _ = hand.errors_m(39 / 60.0)
    assert found.tolist() == [True] * 5 + [False]
    assert hand.counts.dropped == 1


def test_a_landmark_that_one_camera_sees_stays_with_its_hand(one_hand):
    """Test: the other camera does not see a tip for a quarter of a second.

    Expected: it is told all the time, and not much farther off than its sigma.
    """
    hand = one_hand()
    hand.run(range(30))
    for k in range(30, 45):
        hand.see(hand.frame(k), seen=range(6) if k % 2 else (0, 1, 3, 4, 5))
        told = hand.told(k / 60.0)
        error = told.positions_m[2] - hand.path(np.array([k / 60.0]))[0, 2]
        assert told.found[2]
        assert error @ np.linalg.solve(told.covariances_m2[2], error) < 30.0
    assert hand.counts.dropped == 0


def test_a_hand_that_one_camera_sees_stays_for_two_seconds(one_hand):
    hand = one_hand()
    hand.run(range(30))
    hand.run(range(30, 120, 2))
    assert hand.errors_m(118 / 60.0)[0].all()
    hand.run(range(120, 180, 2))
    assert not hand.errors_m(178 / 60.0)[0].any()


def test_what_the_other_camera_sees_again_begins_anew(one_hand):
    hand = one_hand()
    hand.run(range(30))
    hand.run(range(30, 60, 2))
    hand.run(range(60, 75))
    found, errors = hand.errors_m(73 / 60.0)
    assert found.all()
    assert hand.counts.started == 12
    assert np.linalg.norm(errors, axis=1).max() < 0.01


def test_what_contradicts_two_cameras_is_dropped(one_hand):
    """Test: both cameras see another thing where a tip was, somewhere else each time.

    Expected: the tip is not told for longer than it is held.
    """
    hand = one_hand()
    random = np.random.default_rng(5)
    hand.run(range(30))
    for k in range(30, 60):
        camera, times_s, rays = hand.frame(k)
        rays[2] = random.uniform(-0.3, 0.3, 2)
        hand.see((camera, times_s, rays))
    found, errors = hand.errors_m(58 / 60.0)
    others = [0, 1, 3, 4, 5]
    assert found[others].all()
    assert np.linalg.norm(errors[others], axis=1).max() < 0.01
    assert not found[2] or np.linalg.norm(errors[2]) < 0.3


def test_a_landmark_that_begins_is_taken_to_move_as_the_others_do(one_hand, monkeypatch):
    """A second of a hand; a tip is seen for the last .05 s of it alone."""
    errors_m = []
    for known in (True, False):
        if not known:
            monkeypatch.setattr(HandFilter, "_velocity", lambda *_: np.zeros(3))
        found = []
        for seed in range(1, 9):
            hand = one_hand(seed=seed)
            for k in range(60):
                hand.see(hand.frame(k), seen=range(6) if k >= 57 else (0, 1, 3, 4, 5))
            alive, error_m = hand.errors_m(60 / 60.0)
            assert alive.all()
            found.append(np.linalg.norm(error_m[2]))
        errors_m.append(np.sqrt(np.mean(np.square(found))))
    assert errors_m[0] < 0.8 * errors_m[1]
