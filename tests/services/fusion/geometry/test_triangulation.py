"""Triangulation: round trips, covariance against noise, refusals, and the plain one beside it."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.triangulation import triangulate as plain_triangulate
from services.fusion.geometry.projection import Extrinsics, extrinsics
from services.fusion.geometry.triangulation import TriangulationStatus, triangulate
from testing.synthetic_points import SyntheticRig


def rays_of(cameras: Extrinsics, p):
    q = cameras.R @ p + cameras.t
    return q[:, :2] / q[:, 2:]


def plain(cameras: Extrinsics, rays, sigmas):
    """The plain triangulation of one point, weighted like the compiled one."""
    T = np.tile(np.eye(4), (len(cameras.R), 1, 1))
    T[:, :3, :3] = cameras.R
    T[:, :3, 3] = cameras.t
    return plain_triangulate(T, rays[:, None], 1.0 / sigmas)[0]


def chi_squared(cameras: Extrinsics, rays, sigmas, p) -> float:
    """Squared reprojection error in units of the rays' variances."""
    return float(np.sum(((rays - rays_of(cameras, p)) / sigmas[:, None]) ** 2))


@pytest.mark.parametrize("count", [2, 3, 4])
def test_round_trip_without_noise(count):
    cameras = extrinsics(tuple(SyntheticRig(cameras=count, toe_in_rad=0.1).rig().values()))
    for p in np.random.default_rng(0).uniform([-0.3, -0.2, 0.25], [0.3, 0.2, 1.5], (30, 3)):
        found = triangulate(rays_of(cameras, p), np.full(count, 1e-4), cameras, 3.0)
        assert found.status is TriangulationStatus.OK
        np.testing.assert_allclose(found.position_m, p, atol=1e-9)
        assert found.residual_sigma < 1e-6


def test_covariance_tells_the_scatter(pair):
    cameras = extrinsics(pair)
    random = np.random.default_rng(1)
    p, sigmas = np.array([0.08, -0.05, 0.7]), np.array([1.2e-4, 2.5e-4])
    rays = rays_of(cameras, p)
    found = [
        triangulate(rays + random.normal(size=(2, 2)) * sigmas[:, None], sigmas, cameras, 2.0)
        for _ in range(3000)
    ]
    errors = np.array([f.position_m - p for f in found])
    scatter, stated = np.cov(errors.T), found[0].covariance_m2
    np.testing.assert_allclose(np.sqrt(np.diag(scatter)), np.sqrt(np.diag(stated)), rtol=0.06)
    nees = (
        np.mean(
            [e @ np.linalg.solve(f.covariance_m2, e) for e, f in zip(errors, found, strict=True)]
        )
        / 3.0
    )
    assert nees == pytest.approx(1.0, abs=0.06)
    assert np.mean([f.residual_sigma**2 for f in found]) == pytest.approx(1.0, abs=0.1)


def test_refusals_say_why(pair):
    cameras = extrinsics(pair)
    sigmas = np.full(2, 1e-4)
    far = triangulate(rays_of(cameras, np.array([0.0, 0.0, 0.8])), sigmas, cameras, 0.5)
    assert far.status is TriangulationStatus.BEYOND
    crossed = triangulate(np.array([[-0.2, 0.0], [0.2, 0.0]]), sigmas, cameras, 2.0)
    assert crossed.status is TriangulationStatus.BEHIND
    alone = triangulate(np.zeros((1, 2)), sigmas[:1], cameras.of([0]), 2.0)
    assert alone.status is TriangulationStatus.PARALLEL
    same = triangulate(np.zeros((2, 2)), sigmas, cameras.of([0, 0]), 2.0)
    assert same.status is TriangulationStatus.PARALLEL


def test_rays_that_do_not_meet_have_a_large_residual(pair):
    cameras = extrinsics(pair)
    rays = rays_of(cameras, np.array([0.0, 0.0, 0.6]))
    rays[1, 1] += 0.01
    assert triangulate(rays, np.full(2, 1e-4), cameras, 2.0).residual_sigma > 50.0


@pytest.mark.parametrize("count", [2, 4])
def test_on_exact_rays_it_agrees_with_the_plain_triangulation(count):
    cameras = extrinsics(tuple(SyntheticRig(cameras=count, toe_in_rad=0.1).rig().values()))
    sigmas = np.linspace(1e-4, 3e-4, count)
    for p in np.random.default_rng(2).uniform([-0.3, -0.2, 0.25], [0.3, 0.2, 1.5], (30, 3)):
        rays = rays_of(cameras, p)
        found = triangulate(rays, sigmas, cameras, 3.0)
        np.testing.assert_allclose(found.position_m, plain(cameras, rays, sigmas), atol=1e-9)


def test_on_noisy_rays_only_this_one_has_the_least_reprojection_error():
    """Test: pixels of 5 px of noise in four cameras around a near point, where depths differ.

    Expected: the plain, linear solution is another point, near by, and never a better one; moving
    this one by a hair in any direction is never better either.
    """
    cameras = extrinsics(
        tuple(SyntheticRig(cameras=4, baseline_m=0.1, toe_in_rad=0.4).rig().values())
    )
    random, sigmas, apart = np.random.default_rng(3), np.full(4, 0.01), []
    for p in random.uniform([0.1, -0.05, 0.25], [0.2, 0.05, 0.4], (50, 3)):
        rays = rays_of(cameras, p) + random.normal(0.0, 0.01, (4, 2))
        here = triangulate(rays, sigmas, cameras, 3.0)
        assert here.status is TriangulationStatus.OK
        there = plain(cameras, rays, sigmas)
        least = chi_squared(cameras, rays, sigmas, here.position_m)
        assert chi_squared(cameras, rays, sigmas, there) > least
        for step in 1e-5 * np.vstack([np.eye(3), -np.eye(3)]):
            assert chi_squared(cameras, rays, sigmas, here.position_m + step) > least
        apart.append(np.linalg.norm(there - here.position_m))
    assert 1e-6 < np.median(apart) < 1e-3
