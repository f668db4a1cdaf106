"""The kernel's quaternions are those of rhot.geometry.transforms."""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import quaternion_from_rotation, rotation_from_quaternion
from services.solver.maths.quaternions import quaternions_from_rotations


def test_quaternions_are_those_of_transforms() -> None:
    rng = np.random.default_rng(1)
    wild = rng.normal(size=(200, 4))
    # Half turns have w = 0, where careless formulas divide by it.
    wild[:60, 0] = 0.0
    wild[:20, 1] = 0.0
    R = np.array([rotation_from_quaternion(q) for q in wild])
    ours, theirs = quaternions_from_rotations(R), np.array([quaternion_from_rotation(r) for r in R])
    assert np.all(ours[:, 0] >= 0.0)
    # The sign of a half turn is open; otherwise they are equal.
    np.testing.assert_allclose(np.abs(np.sum(ours * theirs, axis=1)), 1.0, atol=1e-12)
    np.testing.assert_allclose(ours[60:], theirs[60:], atol=1e-12)
