"""The rigid body of markers: its motion and its anchors."""

from __future__ import annotations

import numpy as np

from services.fusion.kalman.motion_model import transition, unit_process_noise
from services.fusion.kalman.rigid_body import (
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
    motion, cov, unit_Q = rest.motion[0].copy(), rest.cov[0].copy(), np.empty((3, 3))
    advance_body(rest, 0, 1.02)
    f01, f02, f12, f22 = transition(0.02)
    F = np.kron(np.array([[1.0, f01, f02], [0.0, 1.0, f12], [0.0, 0.0, f22]]), np.eye(6))
    unit_process_noise(0.02, unit_Q)
    Q = np.kron(unit_Q, np.diag([TRANSLATION_DENSITY] * 3 + [ROTATION_DENSITY] * 3))
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
