"""The compiled joints are those of rhot.hand.forward."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import HANDS, default_hand, forward
from services.simulator.hands.hand_kinematics import Skeleton


@pytest.mark.parametrize("hand", HANDS)
def test_equal_to_the_reference(hand):
    rng = np.random.default_rng(5)
    model = default_hand(hand, 1.1)
    skeleton = Skeleton(model)
    for _ in range(20):
        rotation, wrist = rotation_from_quaternion(rng.normal(size=4)), rng.normal(size=3)
        angles = rng.uniform(-0.5, 1.9, (5, 4))
        for ours, reference in zip(
            skeleton.joints(rotation, wrist, angles),
            forward(model, rotation, wrist, angles),
            strict=True,
        ):
            np.testing.assert_allclose(ours, reference, atol=1e-12)
