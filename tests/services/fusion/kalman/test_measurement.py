"""The measurement: its derivative by finite differences, its update against the textbook."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.triangulation import extrinsics
from services.fusion.kalman.measurement import (
    NOT_VISIBLE,
    correct,
    distance_squared,
    innovate,
    project,
)


def observe(state, cov, R, t, seen, variances):
    H, nu, Si, gain = np.zeros((2, 3)), np.zeros(2), np.zeros((2, 2)), np.zeros((9, 2))
    likelihood = innovate(
        state, cov, R, t, np.asarray(seen), np.asarray(variances), H, nu, Si, gain
    )
    return likelihood, H, nu, Si, gain


def test_projection_agrees_with_the_camera_and_its_derivative_with_finite_differences(pair):
    R, t = extrinsics(pair)
    random = np.random.default_rng(5)
    for p in random.uniform([-0.2, -0.15, 0.3], [0.2, 0.15, 1.2], (40, 3)):
        for c, camera in enumerate(pair):
            ray, H = np.zeros(2), np.zeros((2, 3))
            assert project(p, R[c], t[c], ray, H)
            np.testing.assert_allclose(
                camera.pixels_from_rays(ray)[0], camera.project(p)[0], atol=1e-9
            )
            numeric, step = np.zeros((2, 3)), 1e-6
            for j in range(3):
                up, down, unused = np.zeros(2), np.zeros(2), np.zeros((2, 3))
                project(p + step * np.eye(3)[j], R[c], t[c], up, unused)
                project(p - step * np.eye(3)[j], R[c], t[c], down, unused)
                numeric[:, j] = (up - down) / (2.0 * step)
            np.testing.assert_allclose(H, numeric, rtol=1e-6, atol=1e-7)


def test_update_is_the_textbook_formula(pair):
    R, t = extrinsics(pair)
    random = np.random.default_rng(6)
    root = 0.05 * random.normal(size=(9, 9))
    state, cov = np.array([0.05, -0.02, 0.6, 0.4, -0.3, 0.2, 1.0, 2.0, -1.0]), root @ root.T
    variances = [1e-6, 4e-6]
    likelihood, H, nu, Si, gain = observe(state, cov, R[1], t[1], [0.02, 0.01], variances)
    full = np.hstack([H, np.zeros((2, 6))])
    image_velocity = H @ state[3:6]
    S = (
        full @ cov @ full.T
        + variances[0] * np.eye(2)
        + variances[1] * np.outer(image_velocity, image_velocity)
    )
    np.testing.assert_allclose(Si, np.linalg.inv(S), rtol=1e-9)
    np.testing.assert_allclose(gain, cov @ full.T @ np.linalg.inv(S), rtol=1e-9)
    assert distance_squared(nu, Si) == pytest.approx(nu @ np.linalg.inv(S) @ nu)
    assert likelihood == pytest.approx(
        -0.5 * (nu @ np.linalg.inv(S) @ nu + np.log(np.linalg.det(2.0 * np.pi * S)))
    )
    new_state, new_cov = state.copy(), cov.copy()
    correct(new_state, new_cov, H, nu, gain)
    np.testing.assert_allclose(new_state, state + gain @ nu, atol=1e-12)
    np.testing.assert_allclose(new_cov, cov - gain @ full @ cov, atol=1e-12)
    np.testing.assert_array_equal(new_cov, new_cov.T)


@pytest.mark.parametrize("depth_m", [-0.5, 0.0, 0.01, np.nan])
def test_what_is_not_in_front_of_the_camera_is_not_visible(pair, depth_m):
    R, t = extrinsics(pair)
    state = np.array([0.0, 0.0, depth_m, *[0.0] * 6])
    assert observe(state, np.eye(9), R[0], t[0], [0.0, 0.0], [1e-6, 0.0])[0] == NOT_VISIBLE
