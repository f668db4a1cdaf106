"""The measurement update of a rigid body, against the dense formula."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.projection import extrinsics
from services.fusion.kalman.measurement import NOT_VISIBLE, Measurement
from services.fusion.kalman.rest.body_update import update_body
from services.fusion.kalman.rest.rigid_body import place_in_body
from testing.synthetic_points import SyntheticRig

R, t = extrinsics(tuple(SyntheticRig().rig().values()))
GATE = 30.0


def measurement(camera: int, ray, clock_variance: float = 0.0) -> Measurement:
    return Measurement(R[camera], t[camera], ray, 4e-8, clock_variance)


@pytest.mark.parametrize("dt_s", [0.0, -0.03, 0.002])
def test_it_is_a_kalman_update_of_body_and_anchor(rest, dt_s):
    """Test: against the dense formula for the joint state of 18 + 3.

    Expected: equal, the cross-covariance left out.
    """
    place, J = np.empty(3), np.empty((3, 6))
    place_in_body(rest, 0, dt_s, place, J)
    q = R[1] @ place + t[1]
    Hp = (R[1][:2] - np.outer(q[:2] / q[2], R[1][2])) / q[2]
    H = np.hstack([Hp @ J, dt_s * Hp @ J, 0.5 * dt_s**2 * Hp @ J, Hp])
    P = np.zeros((21, 21))
    P[:18, :18], P[18:, 18:] = rest.cov[0], rest.anchor_cov[0]
    nu = np.array([3e-4, -2e-4])
    measured = measurement(1, q[:2] / q[2] + nu, clock_variance=1e-6)
    drift = Hp @ J @ rest.motion[0, 1]
    S = (
        H @ P @ H.T
        + measured.ray_variance * np.eye(2)
        + measured.clock_variance * np.outer(drift, drift)
    )
    K = P @ H.T @ np.linalg.inv(S)
    expected = np.concatenate([rest.motion[0].ravel(), rest.anchor[0]]) + K @ nu
    after = P - K @ H @ P
    likelihood = update_body(rest, 0, dt_s, measured, True, GATE)
    assert likelihood == pytest.approx(
        -0.5 * (nu @ np.linalg.solve(S, nu) + np.log(np.linalg.det(S))) - np.log(2.0 * np.pi)
    )
    np.testing.assert_allclose(
        np.concatenate([rest.motion[0].ravel(), rest.anchor[0]]), expected, rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(rest.cov[0], after[:18, :18], rtol=1e-7, atol=1e-14)
    np.testing.assert_allclose(rest.anchor_cov[0], after[18:, 18:], rtol=1e-7, atol=1e-16)


def test_a_marker_that_does_not_update_the_body_moves_its_anchor_only(rest):
    anchor, motion, cov = rest.anchor[2].copy(), rest.motion.copy(), rest.cov.copy()
    q = R[0] @ anchor + t[0]
    update_body(rest, 2, 0.0, measurement(0, q[:2] / q[2] + 1e-3), False, GATE)
    np.testing.assert_array_equal(rest.motion, motion)
    np.testing.assert_array_equal(rest.cov, cov)
    assert np.linalg.norm(rest.anchor[2] - anchor) > 1e-7


def test_what_contradicts_or_cannot_be_seen_changes_nothing(rest):
    before = [array.copy() for array in rest]
    contradicts = measurement(0, np.array([5.0, 5.0]))
    assert update_body(rest, 0, 0.0, contradicts, True, GATE) < -15.0
    anchor = rest.anchor[1].copy()
    rest.anchor[1, 2] = -1.0
    assert update_body(rest, 1, 0.0, measurement(0, np.zeros(2)), True, GATE) == NOT_VISIBLE
    rest.anchor[1] = anchor
    for array, same in zip(before, rest, strict=True):
        np.testing.assert_array_equal(array, same)
