"""Observations inserted into a track: in any order, gated, or too late."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.track_history import NODES
from services.fusion.kalman.track_insertion import ACCEPTED, GATED, LATE, NOT_SEEN


def test_the_order_of_arrival_hardly_matters(curved_track):
    """Only the Jacobians of the projection are taken at slightly different places."""
    ordered, shuffled = curved_track(), curved_track(order=[0, 1, 3, 2, 5, 4, 8, 6, 7, 9, 11, 10])
    for time_s in (0.05, 0.1, 0.19):
        np.testing.assert_allclose(ordered.at(time_s)[0][:3], shuffled.at(time_s)[0][:3], atol=5e-5)


def test_what_contradicts_is_gated_and_leaves_no_trace(curved_track):
    track = curved_track()
    before = track.at(0.19)
    time_s, camera, ray = track.observed[-1]
    assert track.add(time_s + 0.01, camera, ray + 0.05, gate=30.0) == GATED
    after = track.at(0.19)
    np.testing.assert_array_equal(before[0], after[0])
    np.testing.assert_array_equal(before[1], after[1])


def test_a_landmark_behind_the_camera_is_not_seen(one_track):
    track = one_track()
    track.history.state[0, track.newest(), :, 2] = -0.6
    assert track.add(0.01, 0, np.zeros(2), gate=30.0) == NOT_SEEN
    assert track.history.size[0] == 1


def test_a_full_track_forgets_the_oldest_and_refuses_what_is_older(curved_track):
    track = curved_track()
    for k in range(3 * NODES):
        assert track.add(0.25 + k / 60.0, k % 2, track.observed[-1][2]) == ACCEPTED
    assert track.history.size[0] == NODES
    assert sorted(track.history.order[0].tolist()) == list(range(NODES))
    assert track.add(*track.observed[0]) == LATE
