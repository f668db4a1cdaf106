"""The rectified frame of two cameras: x along the baseline, so that epipolar lines are level.

Only rays are turned into it, never pictures: the cameras may be toed in, tilted, or of different
focal lengths. A point then has the same height y/z in both cameras, and its disparity is the
difference of x/z. Rays that point backwards in the frame give no height: infinity, or NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array


@dataclass(frozen=True, eq=False)
class RectifiedPair:
    """A common frame of two cameras: origin in the first one's centre, x to the second, z ahead."""

    R_rectified_from_first: Array  # (3, 3)
    R_rectified_from_second: Array  # (3, 3)
    R_rig_from_rectified: Array  # (3, 3)
    origin_rig: Array  # (3,) optical centre of the first camera
    baseline_m: float
    focal_px: float
    width_px: int


def rectified_pair(first: Camera, second: Camera) -> RectifiedPair | None:
    """The rectified frame of two cameras.

    None if they stand in one place or look along their baseline. If the second camera stands left
    of the first, the frame is turned by 180 deg about z: the disparity is positive all the same.
    """
    forward = first.T_rig_from_camera[:3, 2] + second.T_rig_from_camera[:3, 2]
    x = second.centre_rig - first.centre_rig
    y = np.cross(forward, x)
    baseline = float(np.linalg.norm(x))
    height = float(np.linalg.norm(y))
    # Below a tenth of a millimetre of baseline, or half a degree off its direction, there is no
    # disparity to speak of.
    if baseline < 1e-4 or height < 0.01 * baseline * float(np.linalg.norm(forward)):
        return None
    x = x / baseline
    y = y / height
    R_rig_from_rectified = np.stack([x, y, np.cross(x, y)], axis=1)
    return RectifiedPair(
        R_rectified_from_first=R_rig_from_rectified.T @ first.T_rig_from_camera[:3, :3],
        R_rectified_from_second=R_rig_from_rectified.T @ second.T_rig_from_camera[:3, :3],
        R_rig_from_rectified=R_rig_from_rectified,
        origin_rig=first.centre_rig.copy(),
        baseline_m=baseline,
        focal_px=0.25 * (sum(first.focal_px) + sum(second.focal_px)),
        width_px=first.size_px[0],
    )


def rectified_pairs(cameras: tuple[Camera, ...]) -> dict[tuple[int, int], RectifiedPair]:
    """The rectified frames of all pairs of cameras that have one, by the cameras' indices."""
    found = {}
    for i, j in combinations(range(len(cameras)), 2):
        pair = rectified_pair(cameras[i], cameras[j])
        if pair is not None:
            found[i, j] = pair
    return found


@njit(cache=True, error_model="numpy")
def rectify_ray(R_rectified_from_camera: Array, ray: Array) -> tuple[float, float]:
    """x/z and y/z in the rectified frame of a camera's ray (2,); infinite where it is backwards."""
    R = R_rectified_from_camera
    ahead = R[2, 0] * ray[0] + R[2, 1] * ray[1] + R[2, 2]
    if not ahead > 0.0:
        return np.inf, np.inf
    return (
        (R[0, 0] * ray[0] + R[0, 1] * ray[1] + R[0, 2]) / ahead,
        (R[1, 0] * ray[0] + R[1, 1] * ray[1] + R[1, 2]) / ahead,
    )


def rectify_rays(R_rectified_from_camera: Array, rays: Array) -> Array:
    """x/z, y/z (n, 2) of rays (n, 2); NaN for those that point backwards."""
    directions = np.column_stack([rays, np.ones(len(rays))]) @ R_rectified_from_camera.T  # (n, 3)
    return directions[:, :2] / np.where(directions[:, 2:] > 0.0, directions[:, 2:], np.nan)
