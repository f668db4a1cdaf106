"""The rigid body of markers: its motion, and what a look teaches."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.triangulation import extrinsics
from services.fusion.kalman.measurement import NOT_VISIBLE
from services.fusion.kalman.motion_model import transition, unit_noise
from services.fusion.kalman.rigid_body import (
    LOST,
    SHIFT_DENSITY,
    TURN_DENSITY,
    WANDER,
    advance,
    begin,
    empty_rest,
    look,
    lost,
    moved,
)
from testing.synthetic_points import Setup

CENTRE = np.array([0.03, 0.01, 0.7])
ANCHORS = CENTRE + np.array([[0.08, 0.0, 0.0], [0.0, -0.09, 0.01], [-0.05, 0.04, -0.02]])


@pytest.fixture
def rest():
    """Three anchors about a centre, slowly moving."""
    made = empty_rest([np.arange(3)])
    begin(made, 0, 1.0, CENTRE)
    made.anchor[:], made.anchor_cov[:], made.belief[:] = ANCHORS, np.eye(3) * 1e-6, 0.9
    random = np.random.default_rng(2)
    made.motion[0, 1:] = random.normal(0.0, [[0.02], [0.1]], (2, 6))
    root = random.normal(0.0, 1e-2, (18, 18))
    made.cov[0] = root @ root.T
    return made


def levers(rest, slot):
    place, J = np.empty(3), np.empty((3, 6))
    moved(rest, slot, 0.0, place, J)
    return J


def test_displacement_is_shift_and_turn_about_the_centre(rest):
    shift, turn = np.array([1e-3, -2e-3, 3e-3]), np.array([2e-3, 1e-3, -3e-3])
    for slot in range(3):
        expected = shift + np.cross(turn, ANCHORS[slot] - CENTRE)
        np.testing.assert_allclose(
            levers(rest, slot) @ np.concatenate([shift, turn]), expected, atol=1e-15
        )


def test_advancing_is_the_textbook_prediction(rest):
    """Test: 20 ms. Expected: F P F^T + Q.

    Anchors carried by the displacement, which is then nothing; as if asked for without advancing.
    """
    place, J = np.empty(3), np.empty((3, 6))
    moved(rest, 1, 0.02, place, J)
    motion, cov, noise = rest.motion[0].copy(), rest.cov[0].copy(), np.empty((3, 3))
    advance(rest, 0, 1.02)
    f01, f02, f12, f22 = transition(0.02)
    F = np.kron(np.array([[1.0, f01, f02], [0.0, 1.0, f12], [0.0, 0.0, f22]]), np.eye(6))
    unit_noise(0.02, noise)
    Q = np.kron(noise, np.diag([SHIFT_DENSITY] * 3 + [TURN_DENSITY] * 3))
    np.testing.assert_allclose(rest.cov[0], F @ cov @ F.T + Q, rtol=1e-12, atol=1e-18)
    expected = (F @ motion.ravel()).reshape(3, 6)
    np.testing.assert_allclose(rest.anchor[1], ANCHORS[1] + J @ expected[0], atol=1e-15)
    np.testing.assert_allclose(rest.anchor[1], place, atol=1e-6)
    np.testing.assert_array_equal(rest.motion[0, 0], 0.0)
    np.testing.assert_allclose(rest.motion[0, 1:], expected[1:])
    np.testing.assert_allclose(rest.anchor_cov[1], np.eye(3) * (1e-6 + WANDER * 0.02))


@pytest.mark.parametrize("later_s", [0.0, -0.03, 0.002])
def test_a_look_is_a_kalman_update_of_body_and_anchor(rest, later_s):
    """Test: against the dense formula for the joint state of 18 + 3.

    Expected: equal, the cross-covariance left out.
    """
    R, t = extrinsics(tuple(Setup().rig().values()))
    place, J = np.empty(3), np.empty((3, 6))
    moved(rest, 0, later_s, place, J)
    q = R[1] @ place + t[1]
    Hp = (R[1][:2] - np.outer(q[:2] / q[2], R[1][2])) / q[2]
    H = np.hstack([Hp @ J, later_s * Hp @ J, 0.5 * later_s**2 * Hp @ J, Hp])
    P = np.zeros((21, 21))
    P[:18, :18], P[18:, 18:] = rest.cov[0], rest.anchor_cov[0]
    variances, nu = np.array([4e-8, 1e-6]), np.array([3e-4, -2e-4])
    drift = Hp @ J @ rest.motion[0, 1]
    S = H @ P @ H.T + variances[0] * np.eye(2) + variances[1] * np.outer(drift, drift)
    K = P @ H.T @ np.linalg.inv(S)
    expected = np.concatenate([rest.motion[0].ravel(), rest.anchor[0]]) + K @ nu
    after = P - K @ H @ P
    likelihood = look(rest, 0, later_s, q[:2] / q[2] + nu, variances, R[1], t[1], True, 30.0)
    assert likelihood == pytest.approx(
        -0.5 * (nu @ np.linalg.solve(S, nu) + np.log(np.linalg.det(S))) - np.log(2.0 * np.pi)
    )
    np.testing.assert_allclose(
        np.concatenate([rest.motion[0].ravel(), rest.anchor[0]]), expected, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(rest.cov[0], after[:18, :18], rtol=1e-7, atol=1e-14)
    np.testing.assert_allclose(rest.anchor_cov[0], after[18:, 18:], rtol=1e-7, atol=1e-16)


def test_a_look_that_does_not_steer_moves_the_anchor_only(rest):
    R, t = extrinsics(tuple(Setup().rig().values()))
    motion, cov = rest.motion.copy(), rest.cov.copy()
    q = R[0] @ ANCHORS[2] + t[0]
    look(rest, 2, 0.0, q[:2] / q[2] + 1e-3, np.array([4e-8, 0.0]), R[0], t[0], False, 30.0)
    np.testing.assert_array_equal(rest.motion, motion)
    np.testing.assert_array_equal(rest.cov, cov)
    assert np.linalg.norm(rest.anchor[2] - ANCHORS[2]) > 1e-7


def test_what_contradicts_or_cannot_be_seen_changes_nothing(rest):
    R, t = extrinsics(tuple(Setup().rig().values()))
    before = [array.copy() for array in rest]
    variances = np.array([4e-8, 0.0])
    assert look(rest, 0, 0.0, np.array([5.0, 5.0]), variances, R[0], t[0], True, 30.0) < -15.0
    rest.anchor[1, 2] = -1.0
    assert look(rest, 1, 0.0, np.zeros(2), variances, R[0], t[0], True, 30.0) == NOT_VISIBLE
    rest.anchor[1] = ANCHORS[1]
    for array, same in zip(before, rest, strict=True):
        np.testing.assert_array_equal(array, same)


def test_a_body_that_nobody_knows_or_that_flies_off_is_lost(rest):
    begin(rest, 0, 2.0, CENTRE)
    assert not lost(rest, 0)
    rest.cov[0, 4, 4] = 1.1 * LOST[1] ** 2
    assert lost(rest, 0)
    begin(rest, 0, 2.0, CENTRE)
    for mad in (np.nan, np.inf, -100.0):
        rest.motion[0, 1, 2] = mad
        assert lost(rest, 0)
