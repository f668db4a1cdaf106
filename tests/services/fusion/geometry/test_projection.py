"""Projection: against the plain camera, and its Jacobian by finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.projection import NEAR_M, extrinsics, project


def test_projection_agrees_with_the_camera_and_its_jacobian_with_finite_differences(pair):
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


@pytest.mark.parametrize("depth_m", [-0.5, 0.0, 0.5 * NEAR_M, np.nan])
def test_what_is_not_in_front_of_the_camera_is_refused_and_writes_nothing(pair, depth_m):
    R, t = extrinsics(pair)
    ray, H = np.full(2, 7.0), np.full((2, 3), 7.0)
    assert not project(np.array([0.0, 0.0, depth_m]), R[0], t[0], ray, H)
    assert (ray == 7.0).all()
    assert (H == 7.0).all()


def test_some_of_the_extrinsics_are_those_cameras_in_that_order(pair):
    both = extrinsics(pair)
    swapped = both.of([1, 0])
    np.testing.assert_array_equal(swapped.R, both.R[::-1])
    np.testing.assert_array_equal(swapped.t, both.t[::-1])
    assert swapped.R.flags.c_contiguous
