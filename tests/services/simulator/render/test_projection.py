"""Rays and projection of the renderer are those of rhot.geometry.camera."""

from __future__ import annotations

import numpy as np

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
