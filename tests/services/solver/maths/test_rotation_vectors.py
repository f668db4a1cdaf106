"""Small turns against rhot.geometry.transforms."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector
from services.solver.maths.rotation_vectors import rotation_vector, turned


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 1e-3, 0.5, 3.0])
def test_turns_are_rotation_vectors(angle: float) -> None:
    axis = np.array([0.36, -0.48, 0.8])
    start = rotation_from_vector(np.array([0.3, 0.2, -0.7]))
    R = turned(start, angle * axis)
    np.testing.assert_allclose(R, rotation_from_vector(angle * axis) @ start, atol=1e-12)
    np.testing.assert_allclose(rotation_vector(R @ start.T), angle * axis, atol=1e-9)
