"""The rigid body of markers: its motion and its anchors."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.motion_model import ACCELERATION_TIME_S, discretize, empty_step
from services.fusion.kalman.rest.rigid_body import (
    ANCHOR_WALK,
    LOST_SIGMA,
    ROTATION_DENSITY,
    TRANSLATION_DENSITY,
    advance_body,
    is_lost,
    place_in_body,
    start_body,
)


def jacobian(rest, landmark):
    place, J = np.empty(3), np.empty((3, 6))
    place_in_body(rest, landmark, 0.0, place, J)
    return J


def test_displacement_is_translation_and_rotation_about_the_centre(rest):
    anchors = rest.anchor.copy()
    translation, rotation = np.array([1e-3, -2e-3, 3e-3]), np.array([2e-3, 1e-3, -3e-3])
    for landmark in range(3):
        expected = translation + np.cross(rotation, anchors[landmark] - rest.centre[0])
        np.testing.assert_allclose(
            jacobian(rest, landmark) @ np.concatenate([translation, rotation]), expected, atol=1e-15
        )


def test_advancing_is_the_textbook_prediction(rest):
    """Test: 20 ms. Expected: F P F^T + Q.

    Anchors carried by the displacement, which is then nothing; as if asked for without advancing.
    """
    place, J = np.empty(3), np.empty((3, 6))
    place_in_body(rest, 1, 0.02, place, J)
    anchors = rest.anchor.copy()
    motion, cov, step = rest.motion[0].copy(), rest.cov[0].copy(), empty_step()
    advance_body(rest, 0, 1.02)
    discretize(0.02, np.array([1.0, 0.0, 1.0 / ACCELERATION_TIME_S]), step)
    F = np.kron(step.F, np.eye(6))
    Q = np.kron(step.Q, np.diag([TRANSLATION_DENSITY] * 3 + [ROTATION_DENSITY] * 3))
    np.testing.assert_allclose(rest.cov[0], F @ cov @ F.T + Q, rtol=1e-12, atol=1e-18)
    expected = (F @ motion.ravel()).reshape(3, 6)
    np.testing.assert_allclose(rest.anchor[1], anchors[1] + J @ expected[0], atol=1e-15)
    np.testing.assert_allclose(rest.anchor[1], place, atol=1e-6)
    np.testing.assert_array_equal(rest.motion[0, 0], 0.0)
    np.testing.assert_allclose(rest.motion[0, 1:], expected[1:])
    np.testing.assert_allclose(rest.anchor_cov[1], np.eye(3) * (1e-6 + ANCHOR_WALK * 0.02))


def test_a_body_that_nobody_knows_or_that_flies_off_is_lost(rest):
    start_body(rest, 0, 2.0, np.array([0.03, 0.01, 0.7]))
    assert not is_lost(rest, 0)
    rest.cov[0, 4, 4] = 1.1 * LOST_SIGMA[1] ** 2
    assert is_lost(rest, 0)
    start_body(rest, 0, 2.0, np.array([0.03, 0.01, 0.7]))
    for diverged in (np.nan, np.inf, -100.0):
        rest.motion[0, 1, 2] = diverged
        assert is_lost(rest, 0)
