"""A frame filtered: late ones, models that lag behind, and a hand that moves as one body."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.filtering import BEHIND_FRAMES


def test_late_frames_give_the_same_estimate(one_hand):
    """Test: every fourth frame arrives three frames late.

    Expected: the estimate is that of frames in order.
    """
    in_order, mixed = one_hand(), one_hand()
    given = [in_order.frame(k) for k in range(24)]
    for frame in given:
        in_order.see(frame)
    order = sorted(range(24), key=lambda k: k + 3.5 * (k % 4 == 0 and k > 4))
    for k in order:
        mixed.see(given[k])
    time_s = 23 / 60.0
    expected, found = in_order.told(time_s), mixed.told(time_s)
    np.testing.assert_allclose(found.positions_m, expected.positions_m, atol=2e-5)
    assert mixed.counts.late == 0


def test_what_is_older_than_all_that_is_remembered_is_late(one_hand):
    hand = one_hand()
    hand.run(range(10, 50))
    hand.see(hand.frame(9))
    assert hand.counts.late == 6


def test_a_model_left_behind_goes_on_from_the_likeliest(one_hand):
    """Test: a hand at half a metre a second, for longer than a model may be improbable.

    Expected: the model of rest has gone on from another one's estimate, as a rigid body.
    """
    hand = one_hand()
    hand.run(range(4 + 2 * BEHIND_FRAMES))
    history = hand.filter._history
    newest = history.order[history.size[0] - 1]
    rested = [int(history.parent[node, 0]) for node in history.order[: history.size[0]]]
    assert set(rested) > {0}
    apart = history.state[newest, 0, :18] - history.state[newest, 2, :18]
    assert np.abs(apart).max() < 0.1
