"""Interpolation against functions known in closed form."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rhot.geometry.transforms import (
    angle_between,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_vector,
)
from services.cli.evaluate.interpolation import cubic, linear, slerp

STAMPS = 1_700_000_000_000_000_000 + np.arange(31, dtype=np.int64) * 33_333_333


def test_cubic_follows_a_motion_to_a_hundredth_of_a_millimetre():
    at = STAMPS[2:-3] + 14_000_000
    seconds = (STAMPS - STAMPS[0]) * 1e-9
    found = cubic(STAMPS, 0.1 * np.sin(6.0 * seconds)[:, None], at)
    assert np.abs(found[:, 0] - 0.1 * np.sin(6.0 * (at - STAMPS[0]) * 1e-9)).max() < 1e-5


def test_linear_is_exact_on_a_line_and_keeps_trailing_shape():
    seconds = (STAMPS - STAMPS[0]) * 1e-9
    values = np.stack([seconds, -2.0 * seconds], axis=1).reshape(-1, 2, 1) * np.ones((1, 2, 4))
    at = np.array([STAMPS[0], STAMPS[3] + 1_000_000, STAMPS[-1]])
    found = linear(STAMPS, values, at)
    assert found.shape == (3, 2, 4)
    assert np.allclose(found[:, 0, 0], (at - STAMPS[0]) * 1e-9, atol=1e-12)


@given(st.floats(0.0, 1.0), st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_slerp_goes_the_shortest_way_at_constant_speed(share, vectors):
    a, b = rotation_from_vector(vectors[:3]), rotation_from_vector(vectors[3:])
    stamps = np.array([0, 10**9], dtype=np.int64)
    q = np.array([quaternion_from_rotation(a), -quaternion_from_rotation(b)])
    found = slerp(stamps, q, np.array([round(share * 1e9)], dtype=np.int64))[0]
    assert np.isclose(np.linalg.norm(found), 1.0)
    assert found[0] >= 0.0
    whole, part = angle_between(a, b), angle_between(a, rotation_from_quaternion(found))
    # At 180 deg both ways are the shortest.
    assert np.isclose(part, round(share * 1e9) * 1e-9 * whole, atol=1e-5)
