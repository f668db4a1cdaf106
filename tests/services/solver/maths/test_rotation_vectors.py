"""The kernels' rotation vectors are those of rhot.geometry.transforms."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import (
    rotation_from_quaternion,
    rotation_from_vector,
    vector_from_rotation,
)
from services.solver.maths.rotation_vectors import apply_rotation_vector, rotation_vector


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 1e-3, 0.5, 3.0])
def test_turns_are_rotation_vectors(angle: float) -> None:
    axis = np.array([0.36, -0.48, 0.8])
    start = rotation_from_vector(np.array([0.3, 0.2, -0.7]))
    R = apply_rotation_vector(start, angle * axis)
    np.testing.assert_allclose(R, rotation_from_vector(angle * axis) @ start, atol=1e-12)
    np.testing.assert_allclose(rotation_vector(R @ start.T), angle * axis, atol=1e-9)


def test_random_rotations_agree_with_the_plain_code() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        R = rotation_from_quaternion(rng.normal(size=4))
        v = rng.normal(size=3) * 10.0 ** rng.uniform(-6.0, 0.3)
        turned = apply_rotation_vector(R, v)
        np.testing.assert_allclose(turned, rotation_from_vector(v) @ R, atol=1e-12)
        # Near 180 deg only the length is reliable.
        expected = vector_from_rotation(R)
        length = np.linalg.norm(expected)
        assert np.linalg.norm(rotation_vector(R)) == pytest.approx(length, abs=1e-12)
        if length < np.deg2rad(170.0):
            np.testing.assert_allclose(rotation_vector(R), expected, atol=1e-12)
