"""The model of wide lenses against OpenCV's, its inverse and its derivatives."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.geometry.camera import Camera, distortion_derivatives
from rhot.geometry.fisheye import WIDEST_RAD, distort_fisheye, fisheye_powers

LENSES = [(0.0, 0.0, 0.0, 0.0), (-0.05, 0.02, -0.006, 0.0008), (0.1, -0.03, 0.01, -0.001)]


def wide_camera(distortion, focal_px=225.0) -> Camera:
    matrix = np.array([[focal_px, 0.0, 322.0], [0.0, 1.01 * focal_px, 236.0], [0.0, 0.0, 1.0]])
    return Camera("left", (640, 480), matrix, np.array(distortion), np.eye(4))


def rays_to(degrees: float, count: int = 300) -> np.ndarray:
    generator = np.random.default_rng(2)
    theta = np.radians(generator.uniform(0.0, degrees, count))
    turn = generator.uniform(0.0, 2.0 * np.pi, count)
    return np.tan(theta)[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)


@pytest.mark.parametrize("distortion", LENSES)
def test_projection_agrees_with_opencv_and_is_undone(distortion):
    camera, rays = wide_camera(distortion), rays_to(85.0)
    pixels = camera.pixels_from_rays(rays)
    ahead = np.concatenate([rays, np.ones((len(rays), 1))], axis=1).reshape(-1, 1, 3)
    zero = np.zeros(3)
    theirs, _ = cv2.fisheye.projectPoints(ahead, zero, zero, camera.matrix, camera.distortion)
    np.testing.assert_allclose(pixels, theirs.reshape(-1, 2), atol=1e-8)
    np.testing.assert_allclose(camera.rays_from_pixels(pixels), rays, rtol=1e-7, atol=1e-9)
    middle = np.array([[322.0, 236.0]])
    np.testing.assert_allclose(camera.rays_from_pixels(middle), 0.0, atol=1e-12)
    np.testing.assert_allclose(camera.pixels_from_rays([[0.0, 0.0]]), middle)


def test_beyond_86_degrees_there_is_no_ray_and_no_pixel():
    camera = wide_camera(LENSES[1], 150.0)
    assert np.isnan(camera.rays_from_pixels([[0.0, 0.0]])).all()
    steep = np.tan(WIDEST_RAD + 0.01)
    assert np.isnan(camera.project_camera([[steep, 0.0, 1.0], [0.0, 0.0, -1.0]])).all()


def test_derivatives_agree_with_finite_differences():
    rays, k = np.concatenate([rays_to(80.0), [[1e-9, 0.0], [0.0, 1e-5]]]), np.array(LENSES[1])
    analytic = np.array(distortion_derivatives(rays, k))  # (2, 2, n)
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = 1e-6
        numeric = (distort_fisheye(rays + step, k) - distort_fisheye(rays - step, k)) / 2e-6
        np.testing.assert_allclose(analytic[:, axis].T, numeric, atol=1e-6)
    by_k = rays.T[:, None] * fisheye_powers(rays)  # (2, 4, n)
    for number in range(4):
        step = np.zeros(4)
        step[number] = 1e-4
        numeric = (distort_fisheye(rays, k + step) - distort_fisheye(rays, k - step)) / 2e-4
        np.testing.assert_allclose(by_k[:, number].T, numeric, atol=1e-8)
