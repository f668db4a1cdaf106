"""A frame filtered: late ones, models that lag behind, and a hand that moves as one body."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.filtering import BEHIND_FRAMES
from services.fusion.kalman.held import filter_again
from testing.synthetic_points import MovingHand


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
    hand.filter.settle()
    history = hand.filter._history
    newest = history.order[history.size[0] - 1]
    rested = [int(history.parent[node, 0]) for node in history.order[: history.size[0]]]
    assert set(rested) > {0}
    apart = history.state[newest, 0, :18] - history.state[newest, 2, :18]
    assert np.abs(apart).max() < 0.1


def test_a_model_that_one_camera_leads_off_goes_on_from_the_likeliest(one_hand):
    """Test: what a model has of a landmark is moved .2 m along the second camera's ray, so that it
    uses all of that camera's looks and none of the first one's.

    Expected: after four of those it has gone on from the likeliest, long before it has been
    improbable for so long that it would anyway.
    """
    hand, model, landmark = one_hand(), 5, 1
    hand.run(range(60))
    hand.filter.settle()
    history = hand.filter._history
    newest = history.order[history.size[0] - 1]
    assert int(np.argmax(history.probability[newest])) != model
    at = slice(3 * landmark, 3 * landmark + 3)
    centre = -hand.cameras.R[1].T @ hand.cameras.t[1]
    away = history.state[newest, model, at] - centre
    history.state[newest, model, at] += 0.2 * away / np.linalg.norm(away)
    used, parents = [], []
    for k in range(60, 60 + BEHIND_FRAMES):
        hand.see(hand.frame(k))
        hand.filter.settle()
        newest = history.order[history.size[0] - 1]
        used.append(bool(history.used_by[newest, model, landmark]))
        parents.append(int(history.parent[newest, model]))
    assert used[:8] == [False, True] * 4
    likeliest = int(np.argmax(history.probability[newest]))
    assert parents[:8] == [model] * 7 + [likeliest]
    apart_m = history.state[newest, model, at] - history.state[newest, likeliest, at]
    assert np.linalg.norm(apart_m) < 0.02


def test_models_that_follow_later_end_as_if_filtered_at_once(one_hand):
    """Test: 40 frames, of which most wait for their leading models only.

    Expected: once the others have followed, each node is what filtering it anew makes of it.
    """
    hand, waited = one_hand(), 0
    for k in range(40):
        hand.see(hand.frame(k))
        history = hand.filter._history
        waited += history.incomplete[0]
        hand.filter.settle()
        assert not history.incomplete[0]
        newest = history.order[history.size[0] - 1]
        names = ("state", "cov", "probability", "behind", "own", "strikes", "passed")
        names += ("way", "used", "parent")
        followed = {name: getattr(history, name)[newest].copy() for name in names}
        filter_again(hand.filter._held.address, history.size[0] - 1)
        for name, found in followed.items():
            np.testing.assert_array_equal(found, getattr(history, name)[newest], err_msg=name)
    assert waited > 25


def test_who_settles_and_when_changes_no_estimate(one_hand):
    settled, left = one_hand(), one_hand()
    for k in range(30):
        settled.see(settled.frame(k))
        left.see(left.frame(k))
        told = [hand.told(k / 60.0) for hand in (settled, left)]
        np.testing.assert_array_equal(told[0].positions_m, told[1].positions_m)
        np.testing.assert_array_equal(told[0].covariances_m2, told[1].covariances_m2)
        settled.filter.settle()


def test_a_frame_that_leading_models_do_not_expect_waits_for_all(one_hand):
    """Test: a hand at rest that suddenly is 3 mm aside.

    Expected: its first frame there is filtered by all models before anything is told.
    """
    still = MovingHand(seed=1)(np.zeros((1, 6)))[0]
    hand = one_hand(path=lambda times: np.broadcast_to(still, (len(times), 6, 3)).copy())
    hand.run(range(30))
    assert hand.filter._history.incomplete[0]
    still += [0.003, 0.0, 0.0]
    hand.see(hand.frame(30))
    assert not hand.filter._history.incomplete[0]
