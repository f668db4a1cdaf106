"""The plain triangulation: round trips, weights, and rays it cannot use."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.transforms import apply, inverse, rotation_from_vector, transform
from rhot.geometry.triangulation import triangulate

POINTS = np.random.default_rng(0).uniform([-0.2, -0.15, 0.3], [0.2, 0.15, 1.2], (30, 3))


def rig(count: int):
    """T_camera_from_rig (c, 4, 4) of cameras 10 cm apart, each turned a little."""
    return np.stack(
        [
            inverse(
                transform(rotation_from_vector([0.02 * n, -0.05 * n, 0.1]), [0.1 * n, 0.0, 0.0])
            )
            for n in range(count)
        ]
    )


def rays_of(T, points):
    p_cameras = np.stack([apply(one, points) for one in T])
    return p_cameras[..., :2] / p_cameras[..., 2:]


@pytest.mark.parametrize("count", [2, 3, 4])
def test_exact_rays_give_exact_points(count):
    T = rig(count)
    found = triangulate(T, rays_of(T, POINTS), np.full(count, 527.0))
    np.testing.assert_allclose(found, POINTS, atol=1e-9)


def test_noise_scatters_the_points_as_pixels_weigh():
    """Test: one of three cameras has ten times the noise, and a tenth of the weight.

    Expected: less error than with equal weights.
    """
    T, random = rig(3), np.random.default_rng(1)
    noise = random.normal(size=(3, 30, 2)) * np.array([1e-4, 1e-4, 1e-3])[:, None, None]
    rays = rays_of(T, POINTS) + noise
    weighted = triangulate(T, rays, np.array([1000.0, 1000.0, 100.0])) - POINTS
    alike = triangulate(T, rays, np.full(3, 1000.0)) - POINTS
    assert np.sqrt(np.mean(weighted**2)) < 0.6 * np.sqrt(np.mean(alike**2))


def test_a_ray_of_no_weight_is_left_out():
    T = rig(3)
    rays = rays_of(T, POINTS)
    rays[2] += 0.1
    weights = np.full((3, 30), 500.0)
    weights[2] = 0.0
    np.testing.assert_allclose(triangulate(T, rays, weights), POINTS, atol=1e-9)


def test_rays_that_are_nan_give_points_that_are_nan_and_harm_no_others():
    T = rig(2)
    rays = rays_of(T, POINTS)
    rays[1, 3] = np.nan
    found = triangulate(T, rays, np.full(2, 527.0))
    assert np.isnan(found[3]).all()
    np.testing.assert_allclose(np.delete(found, 3, axis=0), np.delete(POINTS, 3, axis=0), atol=1e-9)


def test_a_point_behind_the_cameras_comes_back_as_it_is():
    T = rig(2)
    behind = -POINTS
    np.testing.assert_allclose(
        triangulate(T, rays_of(T, behind), np.full(2, 527.0)), behind, atol=1e-9
    )
