"""The camera: a pinhole with Brown-Conrady distortion, or a wide lens (fisheye.py), and where it
stands in the rig.

Frames: `camera` is x right, y down, z forward (OpenCV); pixel (0, 0) is the centre of the top left
pixel. A point behind the camera projects to NaN, and a pixel that no ray of the lens model reaches
undistorts to NaN. An uncalibrated camera is the caller's matter: rhot.files.config loads what
exists and says what is missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.geometry.fisheye import distort_fisheye, fisheye_derivatives, undistort_fisheye
from rhot.geometry.transforms import Array, inverse

# How many numbers of distortion a fisheye has; Brown-Conrady has five.
FISHEYE_NUMBERS = 4


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera.

    matrix is the pinhole matrix (3, 3) in px. distortion is (k1, k2, p1, p2, k3) of Brown-Conrady
    or (k1, k2, k3, k4) of the fisheye model, as OpenCV orders them: how many there are says which
    it is. T_rig_from_camera (4, 4) in metres places the optical centre in the rig.
    """

    name: str
    size_px: tuple[int, int]
    matrix: Array  # (3, 3)
    distortion: Array  # (5,) or (4,)
    T_rig_from_camera: Array  # (4, 4)

    @property
    def focal_px(self) -> tuple[float, float]:
        """(fx, fy) in px."""
        return float(self.matrix[0, 0]), float(self.matrix[1, 1])

    @property
    def centre_rig(self) -> Array:
        """The optical centre in the rig frame; (3,) metres."""
        return self.T_rig_from_camera[:3, 3]

    @property
    def T_camera_from_rig(self) -> Array:  # noqa: N802 - frames cancel by name
        """Rig frame to camera frame; (4, 4)."""
        return inverse(self.T_rig_from_camera)

    def project(self, p_rig: npt.ArrayLike) -> Array:
        """Pixels (n, 2) of points (n, 3) in the rig frame; NaN behind the camera.

        OpenCV documentation of `projectPoints`, and of `fisheye::projectPoints`.
        """
        T = self.T_camera_from_rig
        p_camera = (
            np.asarray(p_rig, dtype=np.float64).reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
        )  # (n, 3)
        return self.project_camera(p_camera)

    def project_camera(self, p_camera: npt.ArrayLike) -> Array:
        """Pixels (n, 2) of points (n, 3) in the camera frame; NaN behind the camera."""
        p = np.asarray(p_camera, dtype=np.float64).reshape(-1, 3)
        z = np.where(p[:, 2] > 0.0, p[:, 2], np.nan)
        return self.pixels_from_rays(p[:, :2] / z[:, None])

    def pixels_from_rays(self, rays: npt.ArrayLike) -> Array:
        """Distorted pixels (n, 2) of normalised image points (x/z, y/z) (n, 2)."""
        xy = np.asarray(rays, dtype=np.float64).reshape(-1, 2)
        distorted = distort(xy, self.distortion)
        m = self.matrix
        return np.stack(
            [
                m[0, 0] * distorted[:, 0] + m[0, 1] * distorted[:, 1] + m[0, 2],
                m[1, 1] * distorted[:, 1] + m[1, 2],
            ],
            axis=1,
        )

    def rays_from_pixels(self, pixels: npt.ArrayLike) -> Array:
        """Undistorted normalised image points (x/z, y/z) (n, 2) of pixels (n, 2).

        NaN where the lens model has no inverse.
        """
        px = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        m = self.matrix
        y = (px[:, 1] - m[1, 2]) / m[1, 1]
        x = (px[:, 0] - m[0, 2] - m[0, 1] * y) / m[0, 0]
        return undistort(np.stack([x, y], axis=1), self.distortion)


def undistort(target: Array, distortion: Array) -> Array:
    """Image points (n, 2) that a lens takes to `target` (n, 2); NaN where it takes none there.

    distortion is (5,) of Brown-Conrady or (4,) of a fisheye. Newton's method: the usual fixed-point
    iteration diverges at the corners of wide-angle lenses.
    """
    if len(distortion) == FISHEYE_NUMBERS:
        return undistort_fisheye(target, distortion)
    if not np.any(distortion):
        return target.copy()
    xy = target.copy()
    # Damped steps at most: quadratic convergence needs 5 for |k1| = 0.4.
    for _ in range(30):
        miss = target - distort(xy, distortion)
        if not np.nanmax(np.abs(miss), initial=0.0) > 1e-13:
            break
        (a, b), (c, d) = distortion_derivatives(xy, distortion)
        determinant = a * d - b * c
        safe = np.where(np.abs(determinant) < 1e-6, np.nan, determinant)
        step = (
            np.stack([d * miss[:, 0] - b * miss[:, 1], a * miss[:, 1] - c * miss[:, 0]], axis=1)
            / safe[:, None]
        )
        # A step is kept within a quarter of the unit ray: overshooting lands on the far branch of a
        # barrel lens.
        length = np.linalg.norm(step, axis=1, keepdims=True)
        xy = xy + step * np.minimum(1.0, 0.25 / np.maximum(length, 1e-12))
    off = np.abs(distort(xy, distortion) - target).max(axis=1)
    (a, b), (c, d) = distortion_derivatives(xy, distortion)
    good = (off < 1e-9) & (a * d - b * c > 0.0)
    return np.where(good[:, None], xy, np.nan)


def distortion_derivatives(
    xy: Array, distortion: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """The 2x2 derivative, (n,) each, of the distorted by the undistorted image point (n, 2), by
    rows; distortion as for `distort`.
    """
    if len(distortion) == FISHEYE_NUMBERS:
        return fisheye_derivatives(xy, distortion)
    k1, k2, p1, p2, k3 = distortion
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3))
    mixed = x * y * slope + 2.0 * (p1 * x + p2 * y)
    return (
        (radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, mixed),
        (mixed, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x),
    )


def distort(xy: Array, distortion: Array) -> Array:
    """Distortion of normalised points; (n, 2) -> (n, 2).

    distortion is (5,) of Brown-Conrady or (4,) of a fisheye, or (5, n) or (4, n) for a lens of each
    point's own.
    """
    if len(distortion) == FISHEYE_NUMBERS:
        return distort_fisheye(xy, distortion)
    k1, k2, p1, p2, k3 = distortion
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=1,
    )


def pinhole(size_px: tuple[int, int], hfov_rad: float) -> Array:
    """Pinhole matrix (3, 3) of an ideal camera with a horizontal field of view of hfov_rad.

    RHOT, section 9.2: 640 px over 62.5 deg give f = 527.3 px.
    """
    width, height = size_px
    focal_px = 0.5 * width / np.tan(0.5 * hfov_rad)
    return np.array(
        [[focal_px, 0.0, (width - 1) / 2.0], [0.0, focal_px, (height - 1) / 2.0], [0.0, 0.0, 1.0]]
    )
