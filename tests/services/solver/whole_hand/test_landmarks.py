"""Where landmarks sit on the hand, and measured ones as arrays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rhot.hand import JOINTS, LANDMARKS
from services.solver.whole_hand.landmarks import Observation, hand_landmarks, observation_arrays


def test_every_landmark_has_a_place(world: Callable) -> None:
    landmarks = hand_landmarks(world("left").model)
    assert set(landmarks) == set(LANDMARKS)
    for name, landmark in landmarks.items():
        assert JOINTS[landmark.joint] == name
        assert (landmark.digit >= 0) == (landmark.depth > 0)
        assert 0.0 < landmark.reach_m < 0.25


def test_observations_keep_the_order_they_came_in(world: Callable) -> None:
    landmarks = hand_landmarks(world("right").model)
    seen = {
        name: Observation(np.full(3, float(i)), 1e-6 * np.eye(3), True)
        for i, name in enumerate(("ring_tip", "wrist"))
    }
    arrays = observation_arrays(landmarks, seen)
    assert [JOINTS[joint] for joint in arrays.joint] == ["ring_tip", "wrist"]
    np.testing.assert_array_equal(arrays.point_m, [[0.0] * 3, [1.0] * 3])


def test_no_observation_is_no_error(world: Callable) -> None:
    arrays = observation_arrays(hand_landmarks(world("right").model), {})
    assert arrays.joint.shape == (0,)
    assert arrays.point_m.shape == arrays.offset_m.shape == (0, 3)
    assert arrays.whitening.shape == (0, 3, 3)


def test_whitened_errors_have_unit_covariance(world: Callable) -> None:
    A = np.random.default_rng(1).normal(0.0, 1e-2, (3, 3))
    seen = {"wrist": Observation(np.zeros(3), A @ A.T, True)}
    for misfit_m in (0.0, 5e-3):
        (W,) = observation_arrays(hand_landmarks(world("right").model), seen, misfit_m).whitening
        C = A @ A.T + misfit_m**2 * np.eye(3)
        np.testing.assert_allclose(W @ C @ W.T, np.eye(3), atol=1e-9)
