"""Rays and projection of the renderer are those of rhot.geometry.camera."""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera
from services.simulator.render.projection import lens_parameters, pixel_rays, project


def test_projection_is_the_cameras(fist):
    rng = np.random.default_rng(4)
    for camera in fist.cameras.values():
        points = rng.uniform((-0.25, -0.25, 0.35), (0.25, 0.25, 0.85), (50, 3))
        ours = np.array([project(lens_parameters(camera), *p) for p in points])
        np.testing.assert_allclose(ours, camera.project_camera(points), atol=1e-9)


def test_rays_undo_the_projection(fist):
    camera = fist.cameras["left"]
    rays = pixel_rays(camera)
    assert rays.shape == (480, 3, 640)
    for x, y in ((0, 0), (639, 479), (320, 240), (17, 401)):
        np.testing.assert_allclose(
            camera.project_camera(rays[y, :, x].astype(float) * 0.7)[0], (x, y), atol=2e-4
        )


def test_a_wide_lens_is_the_cameras_too():
    matrix = np.array([[75.0, 0.0, 80.0], [0.0, 75.0, 60.0], [0.0, 0.0, 1.0]])
    k = np.array([-0.03, 0.006, -0.002, 0.0003])
    camera = Camera("wide", (160, 120), matrix, k, np.eye(4))
    points = np.random.default_rng(4).uniform((-1.5, -1.0, 0.2), (1.5, 1.0, 0.4), (50, 3))
    ours = np.array([project(lens_parameters(camera), *p) for p in points])
    np.testing.assert_allclose(ours, camera.project_camera(points), atol=1e-9)
    rays = pixel_rays(camera)
    again = camera.project_camera(rays[60].T.astype(float))
    np.testing.assert_allclose(again, [(x, 60) for x in range(160)], atol=2e-4)
