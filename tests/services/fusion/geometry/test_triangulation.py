"""Triangulation: round trips, covariance against noise, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.triangulation import TriangulationStatus, extrinsics, triangulate
from testing.synthetic_points import Setup


def rays_of(cameras, p):
    return np.array(
        [(c.T_camera_from_rig[:3, :3] @ p + c.T_camera_from_rig[:3, 3]) for c in cameras]
    )


@pytest.mark.parametrize("count", [2, 3, 4])
def test_round_trip_without_noise(count):
    cameras = tuple(Setup(cameras=count, toe_in_rad=0.1).rig().values())
    R, t = extrinsics(cameras)
    for p in np.random.default_rng(0).uniform([-0.3, -0.2, 0.25], [0.3, 0.2, 1.5], (30, 3)):
        q = rays_of(cameras, p)
        found = triangulate(q[:, :2] / q[:, 2:], np.full(count, 1e-4), R, t, 3.0)
        assert found.status is TriangulationStatus.OK
        np.testing.assert_allclose(found.position_m, p, atol=1e-9)
        assert found.residual_sigma < 1e-6


def test_covariance_tells_the_scatter(pair):
    R, t = extrinsics(pair)
    random = np.random.default_rng(1)
    p, sigmas = np.array([0.08, -0.05, 0.7]), np.array([1.2e-4, 2.5e-4])
    q = rays_of(pair, p)
    found = [
        triangulate(
            q[:, :2] / q[:, 2:] + random.normal(size=(2, 2)) * sigmas[:, None], sigmas, R, t, 2.0
        )
        for _ in range(3000)
    ]
    errors = np.array([f.position_m - p for f in found])
    scatter, told = np.cov(errors.T), found[0].covariance_m2
    np.testing.assert_allclose(np.sqrt(np.diag(scatter)), np.sqrt(np.diag(told)), rtol=0.06)
    nees = (
        np.mean(
            [e @ np.linalg.solve(f.covariance_m2, e) for e, f in zip(errors, found, strict=True)]
        )
        / 3.0
    )
    assert nees == pytest.approx(1.0, abs=0.06)
    assert np.mean([f.residual_sigma**2 for f in found]) == pytest.approx(1.0, abs=0.1)


def test_refusals_say_why(pair):
    R, t = extrinsics(pair)
    sigmas = np.full(2, 1e-4)
    q = rays_of(pair, np.array([0.0, 0.0, 0.8]))
    far = triangulate(q[:, :2] / q[:, 2:], sigmas, R, t, 0.5)
    assert far.status is TriangulationStatus.BEYOND
    crossed = triangulate(np.array([[-0.2, 0.0], [0.2, 0.0]]), sigmas, R, t, 2.0)
    assert crossed.status is TriangulationStatus.BEHIND
    assert (
        triangulate(np.zeros((1, 2)), sigmas[:1], R[:1], t[:1], 2.0).status
        is TriangulationStatus.PARALLEL
    )
    same = triangulate(np.zeros((2, 2)), sigmas, R[[0, 0]], t[[0, 0]], 2.0)
    assert same.status is TriangulationStatus.PARALLEL


def test_rays_that_do_not_meet_have_a_large_residual(pair):
    R, t = extrinsics(pair)
    q = rays_of(pair, np.array([0.0, 0.0, 0.6]))
    rays = q[:, :2] / q[:, 2:] + [[0.0, 0.0], [0.0, 0.01]]
    assert triangulate(rays, np.full(2, 1e-4), R, t, 2.0).residual_sigma > 50.0
