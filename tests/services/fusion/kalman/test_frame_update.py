"""One frame's observations: where they go, and what is told of each."""

from __future__ import annotations

import numpy as np

from services.fusion.geometry.triangulation import extrinsics
from services.fusion.kalman.frame_update import KEPT, NO_TRACK, drop, no_looks, take_in
from services.fusion.kalman.rigid_body import empty_rest
from services.fusion.kalman.track_history import ACCEPTED, GATED, empty_ring, start
from testing.synthetic_points import Setup

PLACES = np.array([[0.0, 0.0, 0.6], [0.05, 0.02, 0.6], [0.02, -0.05, 0.6]])
DENSITIES = np.array([1.0, 100.0])


def test_every_observation_is_remembered_and_told_of():
    """Test: a landmark that fits, one that contradicts, one without a track.

    Expected: three codes; only what fits counts as seen.
    """
    R, t = extrinsics(tuple(Setup().rig().values()))
    ring, rest, looks = empty_ring(3, 2), empty_rest([np.arange(3)]), no_looks(3, 2)
    for slot in (0, 1):
        start(ring, slot, 0.0, PLACES[slot], np.array([0.01, 0.1, 1.0]))
    q = PLACES @ R[1].T + t[1]
    rays = q[:, :2] / q[:, 2:]
    rays[1] += 0.3
    times_s, sigmas = np.array([0.010, 0.011, 0.012]), np.array([1e-4, 2e-4, 3e-4])
    codes = take_in(
        ring, rest, looks, np.arange(3), times_s, 1, rays, sigmas, 1e-4, 30.0, R, t, DENSITIES, True
    )
    assert codes.tolist() == [ACCEPTED, GATED, NO_TRACK]
    np.testing.assert_array_equal(looks.look_s[:, 1, 0], times_s)
    np.testing.assert_array_equal(looks.looked_s[:, 1], times_s)
    np.testing.assert_array_equal(looks.look[:, 1, 0], np.column_stack([rays, sigmas]))
    assert looks.number.tolist() == [[0, 1]] * 3
    np.testing.assert_array_equal(looks.seen_s[:, 1], [0.010, -np.inf, -np.inf])
    assert np.isinf(looks.seen_s[:, 0]).all()
    assert (rest.belief > 0.0).tolist() == [True, False, False]


def test_a_track_that_two_cameras_have_not_seen_lately_ends():
    filled, belief = np.array([3, 3, 0, 5]), np.array([0.9, 0.9, 0.0, 0.9])
    seen_s = np.array([[1.0, 1.1, 0.0], [1.0, 0.3, 0.2], [0.0, 0.0, 0.0], [0.2, 1.0, 0.9]])
    assert drop(filled, belief, seen_s, 0.5) == 1
    assert filled.tolist() == [3, 0, 0, 5]
    assert belief.tolist() == [0.9, 0.0, 0.0, 0.9]


def test_the_latest_looks_are_kept_and_remembered_ones_are_not_kept_twice():
    R, t = extrinsics(tuple(Setup().rig().values()))
    ring, rest, looks = empty_ring(1, 2), empty_rest([np.arange(1)]), no_looks(1, 2)
    for k in range(KEPT + 3):
        take_in(
            ring,
            rest,
            looks,
            np.zeros(1, int),
            np.array([k / 30]),
            0,
            np.zeros((1, 2)),
            np.full(1, 1e-4),
            0.0,
            30.0,
            R,
            t,
            DENSITIES,
            True,
        )
    take_in(
        ring,
        rest,
        looks,
        np.zeros(1, int),
        np.array([9.0]),
        0,
        np.zeros((1, 2)),
        np.full(1, 1e-4),
        0.0,
        30.0,
        R,
        t,
        DENSITIES,
        False,
    )
    np.testing.assert_allclose(np.sort(looks.look_s[0, 0]), np.arange(3, KEPT + 3) / 30)
    assert looks.looked_s[0, 0] == (KEPT + 2) / 30
