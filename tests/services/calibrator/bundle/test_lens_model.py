"""The camera model: derivatives by finite differences, inverse, and agreement with
rhot.geometry.camera and OpenCV.
"""

from __future__ import annotations

import cv2
import numpy as np

from services.calibrator.bundle.lens_model import (
    LENS_SIZE,
    lens_camera,
    lens_vector,
    project,
    project_with_derivatives,
    rays,
)

LENS = np.array([530.0, 524.0, 316.0, 243.0, -0.29, 0.1, 0.001, -0.0007, -0.01])


def points(count: int = 40) -> np.ndarray:
    generator = np.random.default_rng(1)
    return np.stack(
        [
            generator.uniform(-0.3, 0.3, count),
            generator.uniform(-0.2, 0.2, count),
            generator.uniform(0.4, 0.9, count),
        ],
        axis=1,
    )


def test_projection_agrees_with_rhot_and_opencv():
    p = points()
    ours = project(LENS, p)
    camera = lens_camera("left", (640, 480), LENS, np.eye(4))
    np.testing.assert_allclose(ours, camera.project(p), atol=1e-9)
    theirs = cv2.projectPoints(p, np.zeros(3), np.zeros(3), camera.matrix, LENS[4:])[0].reshape(
        -1, 2
    )
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    np.testing.assert_allclose(lens_vector(camera.matrix, camera.distortion), LENS)


def test_derivatives_agree_with_finite_differences():
    p = points()
    lenses = np.tile(LENS, (len(p), 1))
    pixels, by_point, by_lens = project_with_derivatives(lenses, p)
    np.testing.assert_allclose(pixels, project(LENS, p), atol=1e-12)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-6
        numeric = (project(LENS, p + step) - project(LENS, p - step)) / 2e-6
        np.testing.assert_allclose(by_point[:, :, axis], numeric, rtol=1e-6, atol=1e-4)
    for number in range(LENS_SIZE):
        step = np.zeros(LENS_SIZE)
        step[number] = 1e-6
        numeric = (project(LENS + step, p) - project(LENS - step, p)) / 2e-6
        np.testing.assert_allclose(by_lens[:, :, number], numeric, rtol=1e-6, atol=1e-5)


def test_rays_undo_the_projection_also_at_the_corners_of_a_wide_lens():
    lens = np.array([400.0, 400.0, 319.5, 239.5, -0.32, 0.11, 0.001, -0.0005, 0.0])
    corners = np.array([[0.0, 0.0], [639.0, 479.0], [639.0, 0.0], [320.0, 240.0]])
    seen = rays(lens, corners)
    np.testing.assert_allclose(
        project(lens, np.concatenate([seen, np.ones((4, 1))], axis=1)), corners, atol=1e-6
    )


def test_a_pixel_no_ray_reaches_is_nan():
    """Test: barrel distortion so strong that the picture folds over.

    Expected: NaN outside, not a point on the far branch.
    """
    lens = np.array([280.0, 280.0, 319.5, 239.5, -0.3, 0.1, 0.0, 0.0, -0.015])
    seen = rays(lens, np.array([[0.0, 0.0], [320.0, 240.0]]))
    assert np.all(np.isnan(seen[0]))
    assert np.all(np.isfinite(seen[1]))


def test_behind_the_camera_is_nan():
    assert np.all(np.isnan(project(LENS, np.array([[0.0, 0.0, -1.0]]))))
