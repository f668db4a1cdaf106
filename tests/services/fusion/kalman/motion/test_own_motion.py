"""What a landmark does by itself: asked for by its looks, and by no others."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.hand_filter import MODELS
from services.fusion.kalman.motion.own_motion import (
    CALM_S,
    LEAST,
    LIVELY,
    carried_on,
    rates_of,
    transitions,
)
from testing.families.motions import tapping
from testing.synthetic_points import MovingHand


def test_own_motion_fades_and_ends():
    assert carried_on(1000.0, CALM_S) == 1000.0 * np.exp(-1.0)
    assert carried_on(2.0 * LEAST, CALM_S) == 0.0


def test_what_moves_by_itself_fades_as_a_lively_hand():
    assert rates_of(MODELS, 0, 1.0) == LIVELY
    assert rates_of(MODELS, 0, 0.0) == (MODELS.velocity_rate[0], MODELS.acceleration_rate[0])
    F = transitions(MODELS, 0, np.array([0.0, 5.0]), 0.02)
    assert F[1, 2] < F[0, 2]


def test_a_finger_that_taps_is_found_to_move_by_itself(one_hand):
    """Test: fingers tap one after the other on a hand that hardly moves.

    Expected: own motion is found of each finger that taps and not of the wrist; the calmest models
    go on explaining the hand; a tap is followed.
    """
    path = tapping(4.0, 0.025, 1)
    hand = one_hand(path=path)
    moved, calm, worst = np.zeros(6), [], 0.0
    for k in range(240):
        hand.see(hand.frame(k))
        history = hand.filter._history
        newest = history.order[history.size[0] - 1]
        m = int(np.argmax(history.probability[newest]))
        if k > 60:
            moved = np.maximum(moved, history.own[newest, m])
            calm.append(m < 2)
            found, errors = hand.errors_m(k / 60.0)
            assert found.all()
            worst = max(worst, float(np.linalg.norm(errors, axis=1).max()))
    assert moved[0] == 0.0
    assert np.count_nonzero(moved > 1e3) >= 3
    assert np.mean(calm) > 0.9
    assert worst < 0.05


def test_a_hand_that_moves_as_a_whole_asks_for_little_of_it(one_hand):
    hand = one_hand(path=MovingHand(finger_share=0.0))
    found = []
    for k in range(120):
        hand.see(hand.frame(k))
        history = hand.filter._history
        newest = history.order[history.size[0] - 1]
        if k > 60:
            m = int(np.argmax(history.probability[newest]))
            found.append(np.count_nonzero(history.own[newest, m] > history.carried[newest, m]))
    assert np.mean(found) < 0.3
