"""The calibration's kinematics of many frames are those of rhot.hand."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector
from rhot.hand import HANDS, LANDMARKS, HandName, default_hand, forward, landmark_point
from services.calibrator.hand.hand_parameters import HandParameters
from services.calibrator.hand.landmark_jacobian import FIRST_ANGLE, landmarks_of


@pytest.mark.parametrize("hand", HANDS)
def test_landmarks_are_where_the_hand_model_has_them(hand: HandName) -> None:
    """Of the tables' hand, whose unknowns are 0, at random angles; to 1e-12 m."""
    model = default_hand(hand, 1.1)
    parameters = HandParameters(model, LANDMARKS)
    limits = model.limits_rad
    angles = np.random.default_rng(1).uniform(limits[..., 0], limits[..., 1], (20, 5, 4))
    found = landmarks_of(
        parameters, parameters.geometry(np.zeros(parameters.unknowns)), angles, model.side
    )
    for frame, q in enumerate(angles):
        joints = forward(model, np.eye(3), np.zeros(3), q)
        expected = [landmark_point(model, name, *joints) for name in LANDMARKS]
        np.testing.assert_allclose(found.points[frame], expected, atol=1e-12)


@pytest.mark.parametrize("hand", HANDS)
def test_derivatives_by_the_pose(hand: HandName) -> None:
    """By a turn and a shift of the wrist and each angle, against finite differences."""
    model = default_hand(hand)
    parameters = HandParameters(model, LANDMARKS)
    measures = parameters.geometry(np.zeros(parameters.unknowns))
    limits = model.limits_rad
    angles = np.random.default_rng(2).uniform(limits[..., 0], limits[..., 1], (3, 5, 4))
    found = landmarks_of(parameters, measures, angles, model.side)
    for k in range(3):
        turn = rotation_from_vector(1e-6 * np.eye(3)[k])
        moved = (found.points @ turn.T - found.points) / 1e-6
        np.testing.assert_allclose(found.by_pose[..., k], moved, atol=1e-6)
        shift = np.broadcast_to(np.eye(3)[k], moved.shape)
        np.testing.assert_array_equal(found.by_pose[..., 3 + k], shift)
    for k in range(20):
        step = 1e-6 * np.eye(20)[k].reshape(5, 4)
        other = landmarks_of(parameters, measures, angles + step, model.side)
        moved = (other.points - found.points) / 1e-6
        np.testing.assert_allclose(found.by_pose[..., FIRST_ANGLE + k], moved, atol=1e-6)
