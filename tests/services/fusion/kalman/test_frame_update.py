"""One frame's observations: where they go, and what becomes of each."""

from __future__ import annotations

import numpy as np

from services.fusion.geometry.projection import extrinsics
from services.fusion.intake.frame_rays import FrameRays
from services.fusion.kalman.frame_update import (
    NO_TRACK,
    drop_lost_tracks,
    empty_state,
    update_frame,
)
from services.fusion.kalman.track_history import start_track
from services.fusion.kalman.track_insertion import ACCEPTED, GATED
from testing.synthetic_points import SyntheticRig

PLACES = np.array([[0.0, 0.0, 0.6], [0.05, 0.02, 0.6], [0.02, -0.05, 0.6]])
CAMERAS = extrinsics(tuple(SyntheticRig().rig().values()))
MODELS = np.array([[0.1, 0.0, 3.0, 0.0], [1000.0, 0.0, 3.0, 0.0]])


def update(state, frame, *, new=True):
    return update_frame(state, frame, CAMERAS, MODELS, 30.0, new).tolist()


def test_every_observation_is_remembered_and_told_of():
    """Test: a landmark that fits, one that contradicts, one without a track.

    Expected: three codes; only what fits counts as seen.
    """
    state = empty_state([np.arange(3)], np.zeros((2, 3)), 2)
    for landmark in (0, 1):
        start_track(state.history, landmark, 0.0, PLACES[landmark], np.array([0.01, 0.1, 1.0]))
    q = PLACES @ CAMERAS.R[1].T + CAMERAS.t[1]
    rays = q[:, :2] / q[:, 2:]
    rays[1] += 0.3
    times_s, sigmas = np.array([0.010, 0.011, 0.012]), np.array([1e-4, 2e-4, 3e-4])
    codes = update(state, FrameRays(1, np.arange(3), times_s, rays, sigmas, 1e-4))
    assert codes == [ACCEPTED, GATED, NO_TRACK]
    recent = state.recent
    np.testing.assert_array_equal(recent.time_s[:, 1, 0], times_s)
    np.testing.assert_array_equal(recent.observed_s[:, 1], times_s)
    np.testing.assert_array_equal(recent.ray[:, 1, 0], rays)
    np.testing.assert_array_equal(recent.sigma[:, 1, 0], sigmas)
    assert recent.number.tolist() == [[0, 1]] * 3
    np.testing.assert_array_equal(recent.accepted_s[:, 1], [0.010, -np.inf, -np.inf])
    assert np.isinf(recent.accepted_s[:, 0]).all()
    assert (state.rest.probability > 0.0).tolist() == [True, False, False]


def test_a_track_ends_unseen_or_when_a_second_camera_sees_something_else():
    size, probability = np.array([3, 3, 0, 5, 4]), np.array([0.9, 0.9, 0.0, 0.9, 0.9])
    accepted_s = np.array(
        [[1.0, 1.1, 0.0], [1.0, 0.3, 0.2], [0.0] * 3, [0.2, 0.4, 0.3], [1.0, 0, 0]]
    )
    observed_s = accepted_s.copy()
    observed_s[4, 1] = 1.1
    assert drop_lost_tracks(size, probability, accepted_s, observed_s, 0.5) == 2
    assert size.tolist() == [3, 3, 0, 0, 0]
    assert probability.tolist() == [0.9, 0.9, 0.0, 0.0, 0.0]


def test_remembered_observations_are_not_remembered_twice():
    state = empty_state([np.arange(1)], np.zeros((2, 3)), 2)
    for time_s, new in ((0.1, True), (9.0, False)):
        frame = FrameRays(
            0, np.zeros(1, int), np.array([time_s]), np.zeros((1, 2)), np.full(1, 1e-4), 0.0
        )
        update(state, frame, new=new)
    assert state.recent.number[0, 0] == 1
    assert state.recent.observed_s[0, 0] == 0.1
