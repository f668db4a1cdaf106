"""Objects at other instants than their messages': constant twist, told horizon, interpolation."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from rhot.geometry.quaternions import from_vector
from rhot.geometry.transforms import (
    angle_between,
    rotation_from_quaternion,
    rotation_from_vector,
)
from rhot.messages.objects import ObjectPose
from rhot.object_motion import HORIZON_NS, between, predict

MS = 1_000_000


def pose(stamp_ns=10**18, **fields):
    values = {
        "object": "cup",
        "serial": "LHR-1",
        "seq": 1,
        "position_m": (0.1, 0.2, 0.3),
        "orientation_wxyz": (1.0, 0.0, 0.0, 0.0),
        "velocity_m_s": (1.0, -2.0, 0.5),
        "angular_velocity_rad_s": (0.0, 4.0, 0.0),
        "tracking": "ok",
        "registered": True,
        "sigma_m": 1e-3,
        "sigma_rad": 3e-3,
    }
    return ObjectPose(stamp_ns=stamp_ns, **(values | fields))


@pytest.mark.parametrize("ahead_ms", [-30, 0, 20, 100])
def test_a_constant_twist_is_predicted_exactly(ahead_ms):
    there = predict(pose(), 10**18 + ahead_ms * MS)
    t = ahead_ms * 1e-3
    np.testing.assert_allclose(there.position_m, [0.1 + t, 0.2 - 2 * t, 0.3 + 0.5 * t], atol=1e-12)
    R = rotation_from_quaternion(there.orientation_wxyz)
    assert angle_between(rotation_from_vector([0.0, 4.0 * t, 0.0]), R) < 1e-9
    assert (there.stamp_ns, there.tracking) == (10**18 + ahead_ms * MS, "ok")


def test_beyond_the_horizon_it_stands_still_and_says_so():
    at_horizon = predict(pose(), 10**18 + HORIZON_NS)
    beyond = predict(pose(), 10**18 + 20 * HORIZON_NS)
    assert beyond.position_m == at_horizon.position_m
    assert (at_horizon.tracking, beyond.tracking) == ("ok", "lost")
    assert predict(pose(), 0).tracking == "lost"


def test_certainty_shrinks_with_time_and_none_stays_none():
    sigmas = [predict(pose(), 10**18 + k * 10 * MS).sigma_m for k in range(8)]
    assert sigmas == sorted(sigmas)
    assert sigmas[0] == 1e-3
    # A hand at 20 m/s^2 for 50 ms: 25 mm at most, half of it RMS.
    assert sigmas[5] == pytest.approx(1e-3 + 12.5e-3)
    assert predict(pose(sigma_m=None, sigma_rad=None), 10**18 + MS).sigma_rad is None


def test_a_lost_pose_is_not_moved():
    there = predict(pose(tracking="lost", position_m=(0.0, 0.0, 0.0)), 10**18 + 10 * MS)
    assert (there.tracking, there.position_m) == ("lost", (0.0, 0.0, 0.0))


def test_between_two_messages():
    before = pose()
    after = pose(
        10**18 + 10 * MS,
        position_m=(0.2, 0.2, 0.3),
        orientation_wxyz=from_vector(0.0, 0.4, 0.0),
        velocity_m_s=(3.0, -2.0, 0.5),
        tracking="out_of_range",
        sigma_m=5e-3,
        registered=False,
    )
    middle = between(before, after, 10**18 + 4 * MS)
    assert middle.position_m == pytest.approx((0.14, 0.2, 0.3))
    assert middle.velocity_m_s == pytest.approx((1.8, -2.0, 0.5))
    assert 2.0 * math.acos(middle.orientation_wxyz[0]) == pytest.approx(0.16)
    assert (middle.tracking, middle.registered, middle.sigma_m) == ("out_of_range", False, 5e-3)
    assert between(before, pose(position_m=(9.0, 0, 0)), 10**18).position_m[0] == 9.0


def test_a_prediction_is_a_message_like_any_other():
    there = predict(pose(), 10**18 + 12_345_678)
    assert msgspec.json.decode(msgspec.json.encode(there), type=ObjectPose) == there
