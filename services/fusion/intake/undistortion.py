"""Undistortion of pixels to rays, compiled: the lens models of rhot.geometry.camera.

Fast enough for every frame of every camera. rhot.geometry.camera.Camera.rays_from_pixels is the
plain one: it takes hundreds of us for six pixels (small numpy calls), this one 1 us; a test holds
the two equal. A pixel whose distortion cannot be undone (outside the lens model's range) comes back
as not valid, never as a wrong ray.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.camera import FISHEYE_NUMBERS, Camera
from rhot.geometry.fisheye import WIDEST_RAD
from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools

# Newton converges quadratically where the model is usable: 4 rounds reach 1e-12 for |k1| <= 0.4,
# the rest is reserve.
_ROUNDS = 12
# Residual, in normalised units, that counts as undone; 1e-9 is a millionth of a pixel.
_TOLERANCE = 1e-9
# As rhot.geometry.fisheye has them.
_FISHEYE_ROUNDS, _FISHEYE_TOLERANCE = 20, 1e-12


class Undistorted(NamedTuple):
    """What n pixels are without the lens."""

    rays: Array  # (n, 2) x/z, y/z
    scale: Array  # (n,) normalised units per px at that pixel; 0 where not valid
    valid: Bools  # (n,) the distortion could be undone


def undistort(camera: Camera, pixels: Array) -> Undistorted:
    """The rays of pixels (n, 2)."""
    n = len(pixels)
    pixels = np.ascontiguousarray(pixels, dtype=np.float64)
    rays = np.empty((n, 2))
    scale = np.empty(n)
    valid = np.empty(n, dtype=np.bool_)
    undistort_all(pixels, camera.matrix, camera.distortion, rays, scale, valid)
    return Undistorted(rays, scale, valid)


@njit(cache=True)
def undistort_all(
    pixels: Array, matrix: Array, distortion: Array, rays: Array, scale: Array, valid: Bools
) -> None:
    """`undistort` for kernels, into arrays of the caller."""
    for n in range(pixels.shape[0]):
        yd = (pixels[n, 1] - matrix[1, 2]) / matrix[1, 1]
        xd = (pixels[n, 0] - matrix[0, 2] - matrix[0, 1] * yd) / matrix[0, 0]
        if len(distortion) == FISHEYE_NUMBERS:
            x, y, determinant, undone = _undistort_fisheye(xd, yd, distortion)
        else:
            x, y, determinant, undone = _undistort_point(xd, yd, distortion)
        rays[n, 0] = x
        rays[n, 1] = y
        valid[n] = undone
        # Square root of the area one pixel covers: distortion stretches the two directions nearly
        # alike. (A fisheye does not: at 60 degrees by 1.5 either way, at 80 by 2.9.)
        area = abs(matrix[0, 0] * matrix[1, 1] * determinant)
        scale[n] = 1.0 / np.sqrt(area) if undone else 0.0


@njit(cache=True)
def _undistort_fisheye(xd: float, yd: float, distortion: Array) -> tuple[float, float, float, bool]:
    """As _undistort_point, by the model of rhot.geometry.fisheye: (k1, k2, k3, k4)."""
    k1, k2, k3, k4 = distortion[0], distortion[1], distortion[2], distortion[3]
    seen = np.hypot(xd, yd)
    theta = min(seen, WIDEST_RAD)
    error = np.inf
    slope = 1.0
    for _ in range(_FISHEYE_ROUNDS):
        s = theta * theta
        error = theta * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4)))) - seen
        slope = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))
        if abs(error) < _FISHEYE_TOLERANCE or not np.isfinite(error):
            break
        step = min(max(error / max(slope, 1e-3), -0.3), 0.3)
        theta = min(max(theta - step, 0.0), WIDEST_RAD + 0.1)
    undone = abs(error) < _TOLERANCE and slope > 0.0 and theta <= WIDEST_RAD
    r = np.tan(theta)
    ratio = r / seen if seen > 1e-12 else 1.0
    # Along the radius and across it.
    determinant = slope / (1.0 + r * r) / ratio
    return xd * ratio, yd * ratio, determinant, undone


@njit(cache=True)
def _undistort_point(xd: float, yd: float, distortion: Array) -> tuple[float, float, float, bool]:
    """The point (x, y) that Brown-Conrady (k1, k2, p1, p2, k3) takes to (xd, yd), by Newton.

    Also the determinant of the model's Jacobian there, and whether the point is right.
    """
    k1, k2, p1, p2, k3 = distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]
    x = xd
    y = yd
    determinant = 1.0
    error = np.inf
    for _ in range(_ROUNDS):
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)
        ex = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - xd
        ey = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - yd
        error = abs(ex) + abs(ey)
        # The Jacobian [[a, b], [b, d]] of the distorted by the undistorted point.
        a = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
        b = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        d = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
        determinant = a * d - b * b
        # The model folds over where its Jacobian turns singular: no ray beyond belongs to the
        # pixel.
        if error < _TOLERANCE or not determinant > 0.0:
            break
        step_x = (d * ex - b * ey) / determinant
        step_y = (a * ey - b * ex) / determinant
        x -= step_x
        y -= step_y
    return x, y, determinant, error < _TOLERANCE and determinant > 0.0
