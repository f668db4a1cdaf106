import cv2
import numpy as np
import pytest

from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import rotation_from_vector, transform


@pytest.fixture
def camera():
    T = transform(rotation_from_vector([0.02, -0.3, 0.1]), [0.075, 0.01, -0.02])
    return Camera(
        "right",
        (640, 480),
        pinhole((640, 480), np.deg2rad(62.5)),
        np.array([-0.08, 0.03, 1e-3, -5e-4, 0.01]),
        T,
    )


def points_in_view(camera, count=200):
    rng = np.random.default_rng(3)
    p_camera = np.column_stack(
        [
            rng.uniform(-0.25, 0.25, count),
            rng.uniform(-0.2, 0.2, count),
            rng.uniform(0.45, 1.0, count),
        ]
    )
    return p_camera @ camera.T_rig_from_camera[:3, :3].T + camera.T_rig_from_camera[:3, 3]


def test_focal_length_of_the_seed_camera():
    assert pinhole((640, 480), np.deg2rad(62.5))[0, 0] == pytest.approx(527.3, abs=0.05)


def test_projection_agrees_with_opencv(camera):
    p_rig = points_in_view(camera)
    T = camera.T_camera_from_rig
    expected, _ = cv2.projectPoints(
        p_rig, cv2.Rodrigues(T[:3, :3].copy())[0], T[:3, 3], camera.matrix, camera.distortion
    )
    assert np.allclose(camera.project(p_rig), expected.reshape(-1, 2), atol=1e-9)


def test_rays_undo_the_projection(camera):
    p_rig = points_in_view(camera)
    p_camera = p_rig @ camera.T_camera_from_rig[:3, :3].T + camera.T_camera_from_rig[:3, 3]
    rays = camera.rays_from_pixels(camera.project(p_rig))
    assert np.allclose(rays, p_camera[:, :2] / p_camera[:, 2:], atol=1e-9)


def test_a_point_behind_the_camera_has_no_pixel(camera):
    behind = camera.centre_rig - 0.5 * camera.T_rig_from_camera[:3, 2]
    assert np.isnan(camera.project(behind)).all()


def test_an_undistorted_camera_is_a_plain_pinhole():
    camera = Camera("c", (640, 480), pinhole((640, 480), 1.0), np.zeros(5), np.eye(4))
    assert np.allclose(camera.rays_from_pixels([[319.5, 239.5]]), 0.0)
    assert np.allclose(camera.project([[0.0, 0.0, 1.0]]), [[319.5, 239.5]])


def test_the_corners_of_a_wide_lens_undistort_where_fixed_point_iteration_diverges():
    wide = Camera(
        "c",
        (640, 480),
        pinhole((640, 480), np.deg2rad(95.0)),
        np.array([-0.25, 0.05, 1e-3, -1e-3, 0.0]),
        np.eye(4),
    )
    rays = np.column_stack([np.linspace(-1.0, 1.0, 41), np.linspace(-0.75, 0.75, 41)])
    assert np.allclose(wide.rays_from_pixels(wide.pixels_from_rays(rays)), rays, atol=1e-9)


def test_a_pixel_beyond_the_lens_model_has_no_ray():
    folded = Camera(
        "c",
        (640, 480),
        pinhole((640, 480), np.deg2rad(62.5)),
        np.array([-0.8, 0.0, 0.0, 0.0, 0.0]),
        np.eye(4),
    )
    rays = folded.rays_from_pixels([[320.0, 240.0], [1e6, 240.0]])
    assert np.isfinite(rays[0]).all()
    assert np.isnan(rays[1]).all()
