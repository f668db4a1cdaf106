"""Projection of a 3D point into a camera, and its Jacobian; compiled.

A camera is only its pose (extrinsics) here: its image is in undistorted rays (x/z, y/z), which
services/fusion/intake/undistortion.py makes of pixels. The plain projection, to pixels and with the
lens, is rhot.geometry.camera.Camera.project; a test holds the two equal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints

# No hand works closer to the lens than this; the Jacobian grows without bound there.
NEAR_M = 0.02


class Extrinsics(NamedTuple):
    """T_camera_from_rig of C cameras, as arrays for compiled functions."""

    R: Array  # (C, 3, 3)
    t: Array  # (C, 3) metres

    def of(self, cameras: list[int] | Ints) -> Extrinsics:
        """Those of some cameras, by index, in that order."""
        return Extrinsics(self.R[cameras], self.t[cameras])


def extrinsics(cameras: tuple[Camera, ...]) -> Extrinsics:
    """The extrinsics of all cameras."""
    T = np.array([camera.T_camera_from_rig for camera in cameras]).reshape(-1, 4, 4)
    return Extrinsics(
        np.ascontiguousarray(T[:, :3, :3]),
        np.ascontiguousarray(T[:, :3, 3]),
    )


@njit(cache=True, error_model="numpy")
def project(p_rig: Array, R: Array, t: Array, ray: Array, H: Array) -> bool:
    """Ray (2,) of a point (3,) in the rig frame, and the Jacobian H (2, 3) of ray by point.

    R (3, 3) and t (3,) are T_camera_from_rig of one camera. Both results are written in place.
    False, and nothing written, if the point is not in front of the camera.
    """
    return project_at(p_rig[0], p_rig[1], p_rig[2], R, t, ray, H)


@njit(cache=True, error_model="numpy")
def project_at(
    x_rig: float, y_rig: float, z_rig: float, R: Array, t: Array, ray: Array, H: Array
) -> bool:
    """The same of a point by its coordinates."""
    x = R[0, 0] * x_rig + R[0, 1] * y_rig + R[0, 2] * z_rig + t[0]
    y = R[1, 0] * x_rig + R[1, 1] * y_rig + R[1, 2] * z_rig + t[1]
    z = R[2, 0] * x_rig + R[2, 1] * y_rig + R[2, 2] * z_rig + t[2]
    if not z > NEAR_M:
        return False
    ray[0] = x / z
    ray[1] = y / z
    for j in range(3):
        H[0, j] = (R[0, j] - ray[0] * R[2, j]) / z
        H[1, j] = (R[1, j] - ray[1] * R[2, j]) / z
    return True
