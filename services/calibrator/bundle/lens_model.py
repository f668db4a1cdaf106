"""The lens models of the bundle adjustment: projection with its Jacobians, and undistortion. Pure.

The models are those of rhot.geometry.camera: pinhole intrinsics and Brown-Conrady distortion k1,
k2, p1, p2, k3, here as one vector of nine numbers, the lens; or a fisheye's k1, k2, k3, k4 in the
places of k1, k2, p1, p2, and FISHEYE in that of k3, which marks it. The distortion, its derivative
and its inverse are rhot.geometry's own. A point behind the camera projects to NaN, and a pixel
that no ray of the model reaches has a NaN ray.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import FISHEYE_NUMBERS, Camera, distort, distortion_derivatives
from rhot.geometry.fisheye import fisheye_powers
from rhot.geometry.transforms import Array

# The order of a lens vector.
FX, FY, CX, CY, K1, K2, P1, P2, K3 = range(9)
LENS_SIZE = 9
# The number K3 of a fisheye lens: no k3 is infinite, and steps of an adjustment leave it as it is.
FISHEYE = float("inf")


def is_fisheye(lens: Array) -> np.ndarray:
    """Whether a lens (..., 9) is a fisheye; (...) bool."""
    return np.isinf(lens[..., K3])


def lens_camera(
    name: str, size_px: tuple[int, int], lens: Array, T_rig_from_camera: Array
) -> Camera:
    """rhot's Camera with the lens (9,)."""
    matrix = np.array([[lens[FX], 0.0, lens[CX]], [0.0, lens[FY], lens[CY]], [0.0, 0.0, 1.0]])
    return Camera(name, size_px, matrix, distortion_of(lens), T_rig_from_camera)


def distortion_of(lens: Array) -> Array:
    """The distortion of a lens (9,) as rhot's cameras have it: (5,), or (4,) of a fisheye."""
    return (lens[K1:K3] if is_fisheye(lens) else lens[K1:]).copy()


def lens_vector(matrix: Array, distortion: Array) -> Array:
    """The lens (9,) of a pinhole matrix (3, 3) and a camera's distortion (5,) or (4,)."""
    mark = [FISHEYE] if len(distortion) == FISHEYE_NUMBERS else []
    return np.array(
        [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion, *mark],
        dtype=np.float64,
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
    return _pixels(lens, _distorted(p_camera[:, :2] / z[:, None], lens))


def _distorted(xy: Array, lens: Array) -> Array:
    """Distorted image points (n, 2) of undistorted ones, by one lens (9,) or one each (n, 9)."""
    wide = is_fisheye(lens)
    if not np.any(wide):
        return distort(xy, lens[..., K1:].T)
    if np.all(wide):
        return distort(xy, lens[..., K1:K3].T)
    found = np.empty_like(xy)
    for chosen in (wide, ~wide):
        found[chosen] = _distorted(xy[chosen], lens[chosen])
    return found


def project_with_jacobians(lenses: Array, p_camera: Array) -> tuple[Array, Array, Array]:
    """Pixels (n, 2), and their Jacobians by the point (n, 2, 3) and by the lens (n, 2, 9).

    `lenses` is (n, 9), one row for each point (n, 3) in the camera frame. Model: OpenCV
    documentation of calib3d, "Detailed Description". rhot.geometry.camera has no Jacobians of the
    projection, as only an adjustment needs them.
    """
    wide = is_fisheye(lenses)
    if np.any(wide) and not np.all(wide):
        found = (np.empty((len(wide), 2)), np.empty((len(wide), 2, 3)), np.zeros((len(wide), 2, 9)))
        for chosen in (wide, ~wide):
            parts = project_with_jacobians(lenses[chosen], p_camera[chosen])
            for whole, part in zip(found, parts, strict=True):
                whole[chosen] = part
        return found
    numbers = slice(K1, K3) if np.any(wide) else slice(K1, LENS_SIZE)
    z = np.where(p_camera[:, 2] > 0.0, p_camera[:, 2], np.nan)
    xy = p_camera[:, :2] / z[:, None]
    x, y = xy.T
    fx, fy = lenses[:, FX], lenses[:, FY]
    distorted = distort(xy, lenses[:, numbers].T)
    (du_dx, du_dy), (dv_dx, dv_dy) = distortion_derivatives(xy, lenses[:, numbers].T)

    J_point = np.empty((len(z), 2, 3))
    J_point[:, 0] = np.stack([fx * du_dx, fx * du_dy, -fx * (du_dx * x + du_dy * y)], axis=1)
    J_point[:, 1] = np.stack([fy * dv_dx, fy * dv_dy, -fy * (dv_dx * x + dv_dy * y)], axis=1)
    J_point /= z[:, None, None]

    J_lens = np.zeros((len(z), 2, LENS_SIZE))
    J_lens[:, 0, FX] = distorted[:, 0]
    J_lens[:, 1, FY] = distorted[:, 1]
    J_lens[:, 0, CX] = 1.0
    J_lens[:, 1, CY] = 1.0
    by_numbers = _by_fisheye(xy) if np.any(wide) else _by_brown_conrady(xy)
    J_lens[:, 0, numbers] = fx[:, None] * by_numbers[0].T
    J_lens[:, 1, numbers] = fy[:, None] * by_numbers[1].T
    return _pixels(lenses, distorted), J_point, J_lens


def _by_brown_conrady(xy: Array) -> Array:
    """The derivative (2, 5, n) of distorted points (n, 2) by k1, k2, p1, p2, k3."""
    x, y = xy.T
    r2 = x * x + y * y
    return np.stack(
        [
            [x * r2, x * r2**2, 2.0 * x * y, r2 + 2.0 * x * x, x * r2**3],
            [y * r2, y * r2**2, r2 + 2.0 * y * y, 2.0 * x * y, y * r2**3],
        ]
    )


def _by_fisheye(xy: Array) -> Array:
    """The derivative (2, 4, n) of distorted points (n, 2) by k1, k2, k3, k4."""
    return xy.T[:, None, :] * fisheye_powers(xy)[None]


def _pixels(lens: Array, distorted: Array) -> Array:
    x, y = distorted.T
    return np.stack([lens[..., FX] * x + lens[..., CX], lens[..., FY] * y + lens[..., CY]], axis=1)
