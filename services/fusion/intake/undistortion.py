"""Undistorted rays of pixels, compiled: the same model as rhot.geometry.camera.Camera, fast enough
for every frame of every camera.

Camera.rays_from_pixels takes hundreds of us for six pixels (small numpy calls), this 1 us; tests
hold the two equal. A pixel whose distortion cannot be undone (outside the lens model's range) comes
back as not valid, never as a wrong ray.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array

# Newton converges quadratically where the model is usable: 4 rounds reach 1e-12 for |k1| <= 0.4,
# the rest is reserve.
_ROUNDS = 12
# Residual, in normalised units, that counts as undone; 1e-9 is a millionth of a pixel.
_TOLERANCE = 1e-9


def rays(camera: Camera, pixels: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Rays (n, 2) as x/z, y/z of pixels (n, 2), normalised units per px there (n,), and which could
    be undistorted (n,).
    """
    n = len(pixels)
    out, scale, valid = np.empty((n, 2)), np.empty(n), np.empty(n, dtype=np.bool_)
    _undistort(
        np.ascontiguousarray(pixels, dtype=np.float64),
        camera.matrix,
        camera.distortion,
        out,
        scale,
        valid,
    )
    return out, scale, valid


@njit(cache=True)
def _undistort(
    pixels: Array,
    matrix: Array,
    distortion: Array,
    out: Array,
    scale: Array,
    valid: npt.NDArray[np.bool_],
) -> None:
    k1, k2, p1, p2, k3 = distortion[0], distortion[1], distortion[2], distortion[3], distortion[4]
    for n in range(pixels.shape[0]):
        yd = (pixels[n, 1] - matrix[1, 2]) / matrix[1, 1]
        xd = (pixels[n, 0] - matrix[0, 2] - matrix[0, 1] * yd) / matrix[0, 0]
        x, y, determinant, error = xd, yd, 1.0, np.inf
        for _ in range(_ROUNDS):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            slope = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)
            ex = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) - xd
            ey = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y - yd
            error = abs(ex) + abs(ey)
            a = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
            b = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
            d = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
            determinant = a * d - b * b
            # The model folds over where its Jacobian turns singular: no ray beyond belongs to the
            # pixel.
            if error < _TOLERANCE or not determinant > 0.0:
                break
            x, y = x - (d * ex - b * ey) / determinant, y - (a * ey - b * ex) / determinant
        out[n, 0], out[n, 1] = x, y
        valid[n] = error < _TOLERANCE and determinant > 0.0
        # Square root of the area one pixel covers: distortion stretches the two directions nearly
        # alike.
        scale[n] = (
            1.0 / np.sqrt(abs(matrix[0, 0] * matrix[1, 1] * determinant)) if valid[n] else 0.0
        )
