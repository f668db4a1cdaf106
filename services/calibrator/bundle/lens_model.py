"""The camera model as the adjustment needs it: projection with derivatives, and undistortion that
converges. Pure.

The model is rhot.geometry.camera's (pinhole, Brown-Conrady k1, k2, p1, p2, k3); a lens is one
vector of nine numbers. Points behind a camera project to NaN; a pixel that no ray of the model
reaches undistorts to NaN.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera, distort, distortion_derivatives, undistort
from rhot.geometry.transforms import Array

# Order of a lens vector.
FX, FY, CX, CY, K1, K2, P1, P2, K3 = range(9)
LENS_SIZE = 9


def lens_camera(
    name: str, size_px: tuple[int, int], lens: Array, T_rig_from_camera: Array
) -> Camera:
    """rhot's Camera of a lens vector (9,)."""
    matrix = np.array([[lens[FX], 0.0, lens[CX]], [0.0, lens[FY], lens[CY]], [0.0, 0.0, 1.0]])
    return Camera(name, size_px, matrix, lens[K1:].copy(), T_rig_from_camera)


def lens_vector(matrix: Array, distortion: Array) -> Array:
    """The lens vector (9,) of a pinhole matrix (3, 3) and (k1, k2, p1, p2, k3)."""
    return np.array(
        [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion], dtype=np.float64
    )


def project(lens: Array, p_camera: Array) -> Array:
    """Pixels (n, 2) of points (n, 3) in the camera frame, of one lens (9,) or a lens for each point
    (n, 9).
    """
    z = np.where(p_camera[:, 2] > 0.0, p_camera[:, 2], np.nan)
    return _pixels(lens, distort(p_camera[:, :2] / z[:, None], lens[..., K1:].T))


def project_with_derivatives(lens: Array, p_camera: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2), their derivatives by the point in the camera frame (n, 2, 3) and by the lens
    (n, 2, 9).

    lens is (n, 9): one row for each point. OpenCV's documentation of calib3d gives the model.
    """
    z = np.where(p_camera[:, 2] > 0.0, p_camera[:, 2], np.nan)
    x, y = p_camera[:, 0] / z, p_camera[:, 1] / z
    fx, fy = lens[:, FX], lens[:, FY]
    xy = np.stack([x, y], axis=1)
    distorted = distort(xy, lens[:, K1:].T)
    (a, b), (c, d) = distortion_derivatives(xy, lens[:, K1:].T)
    by_point = np.empty((len(z), 2, 3))
    by_point[:, 0] = np.stack([fx * a, fx * b, -fx * (a * x + b * y)], axis=1) / z[:, None]
    by_point[:, 1] = np.stack([fy * c, fy * d, -fy * (c * x + d * y)], axis=1) / z[:, None]
    r2 = x * x + y * y
    by_lens = np.zeros((len(z), 2, LENS_SIZE))
    by_lens[:, 0, FX], by_lens[:, 1, FY] = distorted.T
    by_lens[:, 0, CX] = by_lens[:, 1, CY] = 1.0
    for power, name in ((r2, K1), (r2 * r2, K2), (r2 * r2 * r2, K3)):
        by_lens[:, 0, name], by_lens[:, 1, name] = fx * x * power, fy * y * power
    by_lens[:, 0, P1], by_lens[:, 1, P1] = fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y)
    by_lens[:, 0, P2], by_lens[:, 1, P2] = fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y
    return _pixels(lens, distorted), by_point, by_lens


def rays(lens: Array, pixels: Array) -> Array:
    """Undistorted image points (x/z, y/z) (n, 2) of pixels (n, 2).

    NaN where the model has no inverse.
    """
    return undistort((pixels - lens[[CX, CY]]) / lens[[FX, FY]], lens[K1:])


def _pixels(lens: Array, distorted: Array) -> Array:
    x, y = distorted.T
    return np.stack([lens[..., FX] * x + lens[..., CX], lens[..., FY] * y + lens[..., CY]], axis=1)
