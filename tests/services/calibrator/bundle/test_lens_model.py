"""The lens model agrees with rhot.geometry.camera and OpenCV; its Jacobians, its inverse."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.geometry.camera import Camera
from services.calibrator.bundle.lens_model import (
    FISHEYE,
    LENS_SIZE,
    lens_camera,
    lens_vector,
    project,
    project_with_jacobians,
    rays_from_pixels,
)

LENS = np.array([530.0, 524.0, 316.0, 243.0, -0.29, 0.1, 0.001, -0.0007, -0.01])
OTHER_LENS = np.array([610.0, 600.0, 330.0, 236.0, 0.1, -0.2, -0.002, 0.001, 0.05])


WIDE_LENS = np.array([230.0, 231.0, 330.0, 236.0, -0.03, 0.006, -0.002, 0.0003, FISHEYE])


def points(count: int = 40) -> np.ndarray:
    generator = np.random.default_rng(1)
    x = generator.uniform(-0.3, 0.3, count)
    y = generator.uniform(-0.2, 0.2, count)
    return np.stack([x, y, generator.uniform(0.4, 0.9, count)], axis=1)


def camera_of(lens: np.ndarray) -> Camera:
    return lens_camera("left", (640, 480), lens, np.eye(4))


def test_projection_agrees_with_rhot_and_opencv():
    p = points()
    ours = project(LENS, p)
    camera = camera_of(LENS)
    np.testing.assert_allclose(ours, camera.project(p), atol=1e-9)
    theirs = cv2.projectPoints(p, np.zeros(3), np.zeros(3), camera.matrix, LENS[4:])[0]
    np.testing.assert_allclose(ours, theirs.reshape(-1, 2), atol=1e-9)
    np.testing.assert_allclose(lens_vector(camera.matrix, camera.distortion), LENS)


def test_a_lens_for_each_point_agrees_with_rhots_cameras():
    """Why the adjustment may project with its own function, and with Jacobians: it is the same."""
    p = points()
    lenses = np.stack([(LENS, OTHER_LENS, WIDE_LENS)[k % 3] for k in range(len(p))])
    one_by_one = [
        camera_of(lens).project_camera(point)[0] for lens, point in zip(lenses, p, strict=True)
    ]
    np.testing.assert_allclose(project(lenses, p), one_by_one, atol=1e-10)
    np.testing.assert_allclose(project_with_jacobians(lenses, p)[0], one_by_one, atol=1e-10)


@pytest.mark.parametrize(("lens", "size"), [(LENS, LENS_SIZE), (WIDE_LENS, LENS_SIZE - 1)])
def test_jacobians_agree_with_finite_differences(lens, size):
    p = points()
    lenses = np.tile(lens, (len(p), 1))
    pixels, J_point, J_lens = project_with_jacobians(lenses, p)
    np.testing.assert_allclose(pixels, project(lens, p), atol=1e-12)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        numeric = (project(lens, p + step) - project(lens, p - step)) / 2e-6
        np.testing.assert_allclose(J_point[:, :, axis], numeric, rtol=1e-6, atol=1e-4)
    for number in range(size):
        step = np.zeros(LENS_SIZE)
        step[number] = 1e-6
        numeric = (project(lens + step, p) - project(lens - step, p)) / 2e-6
        np.testing.assert_allclose(J_lens[:, :, number], numeric, rtol=1e-6, atol=1e-5)


def test_rays_undo_the_projection_also_at_the_corners_of_a_wide_lens():
    lens = np.array([400.0, 400.0, 319.5, 239.5, -0.32, 0.11, 0.001, -0.0005, 0.0])
    corners = np.array([[0.0, 0.0], [639.0, 479.0], [639.0, 0.0], [320.0, 240.0]])
    rays = rays_from_pixels(lens, corners)
    ahead = np.concatenate([rays, np.ones((4, 1))], axis=1)
    np.testing.assert_allclose(project(lens, ahead), corners, atol=1e-6)


def test_a_pixel_no_ray_reaches_is_nan():
    """Test: barrel distortion so strong that the picture folds over.

    Expected: NaN outside, not a point on the far branch.
    """
    lens = np.array([280.0, 280.0, 319.5, 239.5, -0.3, 0.1, 0.0, 0.0, -0.015])
    rays = rays_from_pixels(lens, np.array([[0.0, 0.0], [320.0, 240.0]]))
    assert np.all(np.isnan(rays[0]))
    assert np.all(np.isfinite(rays[1]))


def test_behind_the_camera_is_nan():
    assert np.all(np.isnan(project(LENS, np.array([[0.0, 0.0, -1.0]]))))
