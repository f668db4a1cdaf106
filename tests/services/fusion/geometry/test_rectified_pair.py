"""The rectified frame of two cameras: level epipolar lines, positive disparity."""

from __future__ import annotations

import numpy as np
import pytest

from services.fusion.geometry.rectified_pair import (
    rectified_pair,
    rectified_pairs,
    rectify_ray,
    rectify_rays,
)
from testing.synthetic_points import SyntheticRig


def rays_of(camera, points):
    p_camera = points @ camera.T_camera_from_rig[:3, :3].T + camera.T_camera_from_rig[:3, 3]
    return p_camera[:, :2] / p_camera[:, 2:]


@pytest.mark.parametrize("swap", [False, True])
def test_both_cameras_see_a_point_at_one_height_with_the_disparity_of_its_depth(pair, swap):
    first, second = pair[::-1] if swap else pair
    rectified = rectified_pair(first, second)
    points = np.random.default_rng(0).uniform([-0.2, -0.15, 0.3], [0.2, 0.15, 1.0], (20, 3))
    a = rectify_rays(rectified.R_rectified_from_first, rays_of(first, points))
    b = rectify_rays(rectified.R_rectified_from_second, rays_of(second, points))
    np.testing.assert_allclose(a[:, 1], b[:, 1], atol=1e-12)
    p_rectified = (points - rectified.origin_rig) @ rectified.R_rig_from_rectified
    np.testing.assert_allclose(a[:, 0] - b[:, 0], rectified.baseline_m / p_rectified[:, 2])
    assert (a[:, 0] > b[:, 0]).all()


def test_one_ray_and_many_agree_and_backward_ones_have_no_height(pair):
    R = rectified_pair(*pair).R_rectified_from_second
    rays = np.random.default_rng(1).uniform(-0.5, 0.5, (10, 2))
    one_by_one = [rectify_ray(R, ray) for ray in rays]
    np.testing.assert_allclose(rectify_rays(R, rays), one_by_one, atol=1e-15)
    backwards = np.diag([1.0, -1.0, -1.0])
    assert np.isinf(rectify_ray(backwards, rays[0])).all()
    assert np.isnan(rectify_rays(backwards, rays)).all()


def test_cameras_in_one_place_or_along_their_baseline_have_no_rectified_frame():
    left, right = SyntheticRig().rig().values()
    assert rectified_pair(left, left) is None
    ahead = left.T_rig_from_camera.copy()
    ahead[2, 3] += 0.1
    assert rectified_pair(left, type(left)("ahead", *_rest_of(left), ahead)) is None
    assert list(rectified_pairs((left, left, right))) == [(0, 2), (1, 2)]


def _rest_of(camera):
    return camera.size_px, camera.matrix, camera.distortion
