"""The truth is what rhot.hand says about the angles and the wrist it names."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, forward


@pytest.mark.parametrize("t_s", [0.0, 1.3, 2.9])
def test_points_follow_from_wrist_and_angles(fist, t_s):
    truth = fist.truth(t_s)
    assert truth.stamp_ns == round(t_s * 1e9)
    hand = truth.hands["right"]
    angles = np.array(
        [
            [getattr(hand.angles_rad[d], a) for a in names]
            for d, names in zip(DIGITS, DIGIT_ANGLES, strict=True)
        ]
    )
    rotation = rotation_from_quaternion(hand.wrist.orientation_wxyz)
    positions, _ = forward(
        fist.hands["right"].model, rotation, np.array(hand.wrist.position_m), angles
    )
    np.testing.assert_allclose([hand.points_m[name] for name in JOINTS], positions, atol=3e-6)
    assert hand.angles_rad["thumb"].pip == 0.0


def test_objects_are_in_the_rig_frame(fist):
    cup = fist.truth(1.0).objects["cup"]
    T = fist.object_poses(1.0)["cup"]
    np.testing.assert_allclose(cup.position_m, T[:3, 3], atol=1e-6)
    np.testing.assert_allclose(rotation_from_quaternion(cup.orientation_wxyz), T[:3, :3], atol=1e-6)
