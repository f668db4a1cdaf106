"""The measurement update, against the textbook."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.projection import extrinsics
from services.fusion.kalman.measurement import (
    NOT_VISIBLE,
    Innovation,
    Measurement,
    innovate,
    mahalanobis_squared,
    update,
)
from services.fusion.kalman.motion_model import Gaussian

RAY_VARIANCE, CLOCK_VARIANCE = 1e-6, 4e-6


def innovation_of(state: Gaussian, cameras, camera: int, ray) -> tuple[float, Innovation]:
    found = Innovation(np.zeros((2, 3)), np.zeros(2), np.zeros((2, 2)), np.zeros((9, 2)))
    measured = Measurement(
        cameras.R[camera], cameras.t[camera], np.asarray(ray), RAY_VARIANCE, CLOCK_VARIANCE
    )
    return innovate(state, measured, found), found


def test_update_is_the_textbook_formula(pair):
    random = np.random.default_rng(6)
    root = 0.05 * random.normal(size=(9, 9))
    x, P = np.array([0.05, -0.02, 0.6, 0.4, -0.3, 0.2, 1.0, 2.0, -1.0]), root @ root.T
    likelihood, found = innovation_of(Gaussian(x, P), extrinsics(pair), 1, [0.02, 0.01])
    H = np.hstack([found.H, np.zeros((2, 6))])
    nu, ray_velocity = found.nu, found.H @ x[3:6]
    S = (
        H @ P @ H.T
        + RAY_VARIANCE * np.eye(2)
        + CLOCK_VARIANCE * np.outer(ray_velocity, ray_velocity)
    )
    np.testing.assert_allclose(found.S_inverse, np.linalg.inv(S), rtol=1e-9)
    np.testing.assert_allclose(found.K, P @ H.T @ np.linalg.inv(S), rtol=1e-9)
    assert mahalanobis_squared(nu, found.S_inverse) == pytest.approx(nu @ np.linalg.inv(S) @ nu)
    assert likelihood == pytest.approx(
        -0.5 * (nu @ np.linalg.inv(S) @ nu + np.log(np.linalg.det(2.0 * np.pi * S)))
    )
    posterior = Gaussian(x.copy(), P.copy())
    update(posterior, found)
    np.testing.assert_allclose(posterior.mean, x + found.K @ nu, atol=1e-12)
    np.testing.assert_allclose(posterior.cov, P - found.K @ H @ P, atol=1e-12)
    np.testing.assert_array_equal(posterior.cov, posterior.cov.T)


@pytest.mark.parametrize("depth_m", [-0.5, 0.0, 0.01, np.nan])
def test_what_is_not_in_front_of_the_camera_is_not_visible(pair, depth_m):
    state = Gaussian(np.array([0.0, 0.0, depth_m, *[0.0] * 6]), np.eye(9))
    assert innovation_of(state, extrinsics(pair), 0, [0.0, 0.0])[0] == NOT_VISIBLE
