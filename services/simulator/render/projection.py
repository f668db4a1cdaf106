"""A camera's rays and its projection, as the renderer needs them. Pure."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array

Array32 = npt.NDArray[np.float32]
# Numbers of a fisheye's lens parameters; Brown-Conrady has nine.
_FISHEYE_LENS = 8


def pixel_rays(camera: Camera) -> Array32:
    """Unit direction of every pixel's ray in the camera frame.

    (h, 3, w) float32, so that rows are contiguous.
    """
    w, h = camera.size_px
    x, y = np.meshgrid(np.arange(w, dtype=np.float64), np.arange(h, dtype=np.float64))
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)
    xy = camera.rays_from_pixels(pixels)
    # A lens model that folds over has no ray for its outermost pixels. Real lenses show a dim rim
    # there; a pinhole without distortion stands for it.
    undistorted = Camera(
        camera.name, camera.size_px, camera.matrix, np.zeros(5), camera.T_rig_from_camera
    )
    xy = np.where(np.isnan(xy), undistorted.rays_from_pixels(pixels), xy)
    rays = np.concatenate([xy, np.ones((h * w, 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return np.ascontiguousarray(rays.reshape(h, w, 3).transpose(0, 2, 1).astype(np.float32))


def lens_parameters(camera: Camera) -> Array:
    """Intrinsics and distortion for `project`: fx, fy, cx, cy, then k1, k2, p1, p2, k3 of
    Brown-Conrady, (9,), or k1, k2, k3, k4 of a fisheye, (8,).
    """
    m = camera.matrix
    return np.concatenate([[m[0, 0], m[1, 1], m[0, 2], m[1, 2]], camera.distortion])


# Compiled twin of rhot.geometry.camera.Camera.project_camera, for cameras without skew; a test
# compares the two.
@njit(cache=True, nogil=True, error_model="numpy")
def project(lens: Array, x: float, y: float, z: float) -> tuple[float, float]:
    """Pixel of a point in front of the camera, distortion included."""
    x, y = x / z, y / z
    r2 = x * x + y * y
    if len(lens) == _FISHEYE_LENS:
        r = np.sqrt(r2)
        theta = np.arctan(r)
        s = theta * theta
        seen = theta * (1.0 + s * (lens[4] + s * (lens[5] + s * (lens[6] + s * lens[7]))))
        ratio = seen / r if r > 1e-6 else 1.0
        return lens[0] * x * ratio + lens[2], lens[1] * y * ratio + lens[3]
    radial = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]))
    xd = x * radial + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x)
    yd = y * radial + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y
    return lens[0] * xd + lens[2], lens[1] * yd + lens[3]
