"""Points in the rig frame as pixels of one camera's picture. Pure."""

from __future__ import annotations

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array

# How far a projected pixel's ray may lie from the point's own, as a share of the focal length.
_SAME_RAY = 1e-6


def pixels_of(camera: Camera, points_rig: Array) -> Array:
    """Pixels (n, 2) of points (n, 3); NaN for those that the lens does not show.

    A polynomial of distortion turns back outside the picture, where it was fitted to nothing, and
    would draw there what lies far beside it: a pixel counts if its ray leads back to the point.
    """
    pixels = camera.project(points_rig)
    T = camera.T_camera_from_rig
    p_camera = points_rig @ T[:3, :3].T + T[:3, 3]  # (n, 3)
    seen = np.isfinite(pixels).all(axis=1)
    rays = np.full_like(pixels, np.nan)
    rays[seen] = camera.rays_from_pixels(pixels[seen])
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.abs(rays - p_camera[:, :2] / p_camera[:, 2:]).max(axis=1)
    return np.where((off < _SAME_RAY)[:, None], pixels, np.nan)
