"""The compiled undistortion against the plain one, rhot.geometry.camera.Camera."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.camera import Camera, pinhole
from services.fusion.intake.undistortion import undistort


def camera(distortion) -> Camera:
    matrix = pinhole((640, 480), np.deg2rad(62.5))
    matrix[0, 1] = 0.3
    return Camera("left", (640, 480), matrix, np.array(distortion), np.eye(4))


def test_equals_the_camera_and_inverts_the_projection():
    pixels = np.random.default_rng(0).uniform([0, 0], [639, 479], (200, 2))
    for distortion in ([0.0] * 5, [-0.3, 0.1, 1e-3, -2e-3, 0.0], [0.2, -0.05, 0.0, 1e-3, 0.01]):
        model = camera(distortion)
        rays, scale, valid = undistort(model, pixels)
        assert valid.all()
        np.testing.assert_allclose(model.pixels_from_rays(rays), pixels, atol=1e-6)
        np.testing.assert_allclose(rays, model.rays_from_pixels(pixels), atol=2e-9)
        # The scale is the ray's change per pixel, by finite differences in both directions.
        half_x, half_y = np.array([0.5, 0.0]), np.array([0.0, 0.5])
        right = undistort(model, pixels + half_x)[0] - undistort(model, pixels - half_x)[0]
        down = undistort(model, pixels + half_y)[0] - undistort(model, pixels - half_y)[0]
        area = np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
        np.testing.assert_allclose(scale, np.sqrt(area), rtol=1e-4)


@pytest.mark.parametrize("distortion", [[0.0] * 4, [-0.03, 0.006, -0.002, 0.0003]])
def test_a_fisheye_equals_the_camera(distortion):
    matrix = np.array([[230.0, 0.0, 318.0], [0.0, 231.0, 241.0], [0.0, 0.0, 1.0]])
    model = Camera("left", (640, 480), matrix, np.array(distortion), np.eye(4))
    turn = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, 200)
    out = np.linspace(0.0, 290.0, 200)
    pixels = np.array([318.0, 241.0]) + out[:, None] * np.stack([np.cos(turn), np.sin(turn)], 1)
    rays, scale, valid = undistort(model, pixels)
    assert valid.all()
    np.testing.assert_allclose(rays, model.rays_from_pixels(pixels), rtol=1e-8, atol=1e-11)
    right, down = (undistort(model, pixels + np.array(half))[0] for half in ((0.01, 0), (0, 0.01)))
    (a, b), (c, d) = ((right - rays) / 0.01).T, ((down - rays) / 0.01).T
    np.testing.assert_allclose(scale, np.sqrt(np.abs(a * d - b * c)), rtol=2e-2)
    assert not undistort(model, np.array([[318.0 + 600.0, 241.0], [np.nan, 0.0]])).valid.any()
    assert np.isnan(model.rays_from_pixels([[918.0, 241.0]])).all()


def test_pixels_beyond_the_lens_are_not_valid():
    model = camera([-0.8, 0.0, 0.0, 0.0, 0.0])
    rays, scale, valid = undistort(model, np.array([[320.0, 240.0], [1e6, 240.0], [1e300, 0.0]]))
    assert valid.tolist() == [True, False, False]
    assert scale[1] == 0.0
    assert undistort(model, np.zeros((0, 2)))[0].shape == (0, 2)
    assert np.isfinite(rays[0]).all()
