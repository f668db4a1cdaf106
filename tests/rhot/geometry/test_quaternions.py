"""Plain quaternions against the array ones, and against what a rotation must be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rhot.geometry import quaternions, transforms

ANGLES = st.floats(-3.0, 3.0)
VECTORS = st.tuples(ANGLES, ANGLES, ANGLES)


@given(VECTORS)
def test_agrees_with_the_array_functions(vector):
    R = transforms.rotation_from_vector(vector)
    q = quaternions.from_rows(tuple(map(tuple, R.tolist())))
    np.testing.assert_allclose(q, transforms.quaternion_from_rotation(R), atol=1e-15)
    assert abs(np.dot(quaternions.from_vector(*vector), q)) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(quaternions.rotate(q, (0.3, -2.0, 0.7)), R @ [0.3, -2.0, 0.7])


@given(VECTORS, VECTORS)
def test_product_and_vector(a, b):
    p, q = quaternions.from_vector(*a), quaternions.from_vector(*b)
    product = quaternions.normalized(quaternions.multiply(p, q))
    expected = transforms.quaternion_multiply(p, q)
    # At 180 deg both signs have w >= 0.
    assert abs(np.dot(product, expected)) == pytest.approx(1.0, abs=1e-12)
    back = quaternions.from_vector(*quaternions.to_vector(product))
    assert abs(np.dot(product, back)) == pytest.approx(1.0, abs=1e-12)
    one = quaternions.multiply(p, quaternions.conjugate(p))
    np.testing.assert_allclose(one, (1.0, 0.0, 0.0, 0.0), atol=1e-12)


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, -1, 1), (1, -2, 3)]
)
def test_matrices_at_180_deg(axis):
    u = np.array(axis) / np.linalg.norm(axis)
    q = quaternions.from_rows(tuple(map(tuple, (2.0 * np.outer(u, u) - np.eye(3)).tolist())))
    assert q[0] == pytest.approx(0.0, abs=1e-12)
    assert abs(np.dot(q[1:], u)) == pytest.approx(1.0, abs=1e-12)


def test_slerp_takes_the_short_way():
    p = quaternions.from_vector(0.0, 0.0, 3.0)
    q = quaternions.from_vector(0.0, 0.0, -3.0)
    half = quaternions.slerp(p, q, 0.5)
    assert abs(half[3]) == pytest.approx(1.0)
    assert quaternions.slerp(p, q, 0.0) == pytest.approx(quaternions.normalized(p))
    quarter = quaternions.slerp((1.0, 0.0, 0.0, 0.0), quaternions.from_vector(1.0, 0, 0), 0.25)
    assert quaternions.to_vector(quarter) == pytest.approx((0.25, 0.0, 0.0))


def test_tiny_turns_are_not_lost():
    assert quaternions.to_vector(quaternions.from_vector(0.0, 1e-12, 0.0))[1] == 1e-12
    assert quaternions.to_vector((1.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert math.isclose(quaternions.to_vector(quaternions.from_vector(math.pi, 0, 0))[0], math.pi)
