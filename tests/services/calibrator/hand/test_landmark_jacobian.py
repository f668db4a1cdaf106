"""The calibration's kinematics of many frames are those of rhot.hand."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import HANDS, LANDMARKS, HandName, default_hand, forward, landmark_point
from services.calibrator.hand.hand_parameters import HandParameters
from services.calibrator.hand.landmark_jacobian import landmarks_of


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
