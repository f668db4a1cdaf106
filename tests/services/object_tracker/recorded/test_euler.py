"""triad_openvr's angles: its formulas, written down anew, and back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_quaternion, rotation_y
from services.object_tracker.recorded.euler import rotation_from_triad_angles


def triad_angles(R: Array) -> tuple[float, float, float]:
    """Yaw, pitch, roll in degrees as triad_openvr's convert_to_euler has them."""
    yaw = math.degrees(math.atan2(R[1, 0], R[0, 0]))
    pitch = math.degrees(math.atan2(R[2, 0], R[0, 0]))
    roll = math.degrees(math.atan2(R[2, 1], R[2, 2]))
    return yaw, pitch, roll


def test_any_rotation_comes_back() -> None:
    rng = np.random.default_rng(7)
    for quaternion in rng.normal(size=(2000, 4)):
        R = rotation_from_quaternion(quaternion)
        found = rotation_from_triad_angles(*triad_angles(R))
        assert found is not None
        np.testing.assert_allclose(found, R, atol=1e-9)


def test_with_the_four_decimals_that_are_printed() -> None:
    """The worst of 2000 rotations is 0.02 deg off, the median 1e-4 deg."""
    rng = np.random.default_rng(8)
    errors = []
    for quaternion in rng.normal(size=(2000, 4)):
        R = rotation_from_quaternion(quaternion)
        found = rotation_from_triad_angles(*(round(angle, 4) for angle in triad_angles(R)))
        if found is not None:
            cosine = (np.trace(found @ R.T) - 1.0) / 2.0
            errors.append(math.degrees(math.acos(min(1.0, cosine))))
    assert len(errors) > 1990
    assert np.median(errors) < 2e-4
    assert max(errors) < 0.1


def test_what_cannot_be_told_is_none() -> None:
    assert rotation_from_triad_angles(10.0, 170.0, 0.0) is None  # two signs of one m00
    assert rotation_from_triad_angles(90.0, 90.0, 0.0) is None
    assert rotation_from_triad_angles(*triad_angles(rotation_y(math.pi / 2))) is None
    assert rotation_from_triad_angles(float("nan"), 0.0, 0.0) is None


@pytest.mark.parametrize("angle", [0.0, 180.0, -180.0])
def test_half_turns(angle: float) -> None:
    found = rotation_from_triad_angles(angle, angle, 0.0)
    assert found is not None
    cosine = math.cos(math.radians(angle))
    np.testing.assert_allclose(found, np.diag([cosine, cosine, 1.0]), atol=1e-12)
