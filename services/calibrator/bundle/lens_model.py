"""The lens model of the bundle adjustment: projection with its Jacobians, and undistortion. Pure.

The model is that of rhot.geometry.camera: pinhole intrinsics and Brown-Conrady distortion k1, k2,
p1, p2, k3, here as one vector of nine numbers, the lens. The distortion, its derivative and its
inverse are rhot.geometry.camera's own. A point behind the camera projects to NaN, and a pixel that
no ray of the model reaches has a NaN ray.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera, distort, distortion_derivatives
from rhot.geometry.transforms import Array

# The order of a lens vector.
FX, FY, CX, CY, K1, K2, P1, P2, K3 = range(9)
LENS_SIZE = 9


def lens_camera(
    name: str, size_px: tuple[int, int], lens: Array, T_rig_from_camera: Array
) -> Camera:
    """rhot's Camera with the lens (9,)."""
    matrix = np.array([[lens[FX], 0.0, lens[CX]], [0.0, lens[FY], lens[CY]], [0.0, 0.0, 1.0]])
    return Camera(name, size_px, matrix, lens[K1:].copy(), T_rig_from_camera)


def lens_vector(matrix: Array, distortion: Array) -> Array:
    """The lens (9,) of a pinhole matrix (3, 3) and a distortion (k1, k2, p1, p2, k3)."""
    return np.array(
        [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion], dtype=np.float64
    )


def rays_from_pixels(lens: Array, pixels: Array) -> Array:
    """Undistorted normalised image points (x/z, y/z) (n, 2) of pixels (n, 2), by one lens (9,).

    NaN where the model has no inverse.
    """
    return lens_camera("", (0, 0), lens, np.eye(4)).rays_from_pixels(pixels)


def project(lens: Array, p_camera: Array) -> Array:
    """Pixels (n, 2) of points (n, 3) in the camera frame; NaN behind the camera.

    `lens` is one lens (9,), or one for each point (n, 9). For the latter this is not a call of
    Camera.project_camera: the adjustment projects the corners of all cameras at once.
    """
    z = np.where(p_camera[:, 2] > 0.0, p_camera[:, 2], np.nan)
    return _pixels(lens, distort(p_camera[:, :2] / z[:, None], lens[..., K1:].T))


def project_with_jacobians(lenses: Array, p_camera: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2), and their Jacobians by the point (n, 2, 3) and by the lens (n, 2, 9).

    `lenses` is (n, 9), one row for each point (n, 3) in the camera frame. Model: OpenCV
    documentation of calib3d, "Detailed Description". rhot.geometry.camera has no Jacobians of the
    projection, as only an adjustment needs them.
    """
    z = np.where(p_camera[:, 2] > 0.0, p_camera[:, 2], np.nan)
    x, y = p_camera[:, 0] / z, p_camera[:, 1] / z
    fx, fy = lenses[:, FX], lenses[:, FY]
    xy = np.stack([x, y], axis=1)
    distortions = lenses[:, K1:].T  # (5, n)
    distorted = distort(xy, distortions)
    (du_dx, du_dy), (dv_dx, dv_dy) = distortion_derivatives(xy, distortions)

    J_point = np.empty((len(z), 2, 3))
    J_point[:, 0] = np.stack([fx * du_dx, fx * du_dy, -fx * (du_dx * x + du_dy * y)], axis=1)
    J_point[:, 1] = np.stack([fy * dv_dx, fy * dv_dy, -fy * (dv_dx * x + dv_dy * y)], axis=1)
    J_point /= z[:, None, None]

    r2 = x * x + y * y
    J_lens = np.zeros((len(z), 2, LENS_SIZE))
    J_lens[:, 0, FX] = distorted[:, 0]
    J_lens[:, 1, FY] = distorted[:, 1]
    J_lens[:, 0, CX] = 1.0
    J_lens[:, 1, CY] = 1.0
    for power, name in ((r2, K1), (r2 * r2, K2), (r2 * r2 * r2, K3)):
        J_lens[:, 0, name] = fx * x * power
        J_lens[:, 1, name] = fy * y * power
    J_lens[:, 0, P1] = fx * 2.0 * x * y
    J_lens[:, 1, P1] = fy * (r2 + 2.0 * y * y)
    J_lens[:, 0, P2] = fx * (r2 + 2.0 * x * x)
    J_lens[:, 1, P2] = fy * 2.0 * x * y
    return _pixels(lenses, distorted), J_point, J_lens


def _pixels(lens: Array, distorted: Array) -> Array:
    x, y = distorted.T
    return np.stack([lens[..., FX] * x + lens[..., CX], lens[..., FY] * y + lens[..., CY]], axis=1)
