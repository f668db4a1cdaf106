"""The seed's depth law: distance from the disparity of two cameras alone, D = k * x^z, RHOT eq.
(9), or with k of eq. (10).

The disparity is taken between rays turned into the common rectified frame of the two cameras (x
along the baseline), so that the cameras need not be parallel; pictures are never rectified. The
lateral position follows from the ray. The law is a fit: k and z belong to one rig (`rhot calibrate
depth`), and the seed's k = 4543.3, z = -1.035 only to 75 mm and 527.3 px. No disparity, or a
negative one, gives the status of rays that do not meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.files.config import Disparity
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.fusion.geometry.triangulation import Triangulation, TriangulationStatus


@dataclass(frozen=True, eq=False)
class RectifiedPair:
    """Two cameras brought to a common frame: origin in the first one's centre, x towards the
    second, z ahead.
    """

    R_rectified_from_first: Array  # (3, 3)
    R_rectified_from_second: Array  # (3, 3)
    R_rig_from_rectified: Array  # (3, 3)
    origin_rig: Array  # (3,) optical centre of the first camera
    baseline_m: float
    focal_px: float
    width_px: int


def rectified_pair(a: Camera, b: Camera) -> RectifiedPair | None:
    """The rectified frame of two cameras; None if they stand in one place or look along their
    baseline.

    If the second camera stands left of the first, the frame is turned by 180 deg about z: the
    disparity is positive all the same.
    """
    forward = a.T_rig_from_camera[:3, 2] + b.T_rig_from_camera[:3, 2]
    x = b.centre_rig - a.centre_rig
    y = np.cross(forward, x)
    baseline, height = float(np.linalg.norm(x)), float(np.linalg.norm(y))
    # Below a tenth of a millimetre of baseline, or half a degree off its direction, there is no
    # disparity to speak of.
    if baseline < 1e-4 or height < 0.01 * baseline * float(np.linalg.norm(forward)):
        return None
    x, y = x / baseline, y / height
    R = np.stack([x, y, np.cross(x, y)], axis=1)  # R_rig_from_rectified
    focal = 0.25 * (sum(a.focal_px) + sum(b.focal_px))
    R_a, R_b = a.T_rig_from_camera[:3, :3], b.T_rig_from_camera[:3, :3]
    return RectifiedPair(
        R.T @ R_a, R.T @ R_b, R, a.centre_rig.copy(), baseline, focal, a.size_px[0]
    )


def depth_law(settings: Disparity, pair: RectifiedPair) -> tuple[float, float]:
    """k (cm px^-z) and z of D = k * x^z: the fitted law, or the geometry of eq.

    (10) with its alignment angle phi.
    """
    if settings.law == "power":
        return settings.k, settings.z
    half_view = np.arctan(0.5 * pair.width_px / pair.focal_px)
    k = 100.0 * pair.baseline_m * pair.width_px / (2.0 * np.tan(half_view + settings.phi_rad))
    return float(k), -1.0


def locate(
    pair: RectifiedPair, rays: Array, sigmas: Array, law: tuple[float, float], max_distance_m: float
) -> Triangulation:
    """The point seen along the rays (2, 2) of the pair's first and second camera with sigmas (2,),
    by the law (k, z).

    residual_sigma is the epipolar error: how far the two rays' heights differ, in sigmas.
    """
    first, second = (
        pair.R_rectified_from_first @ [*rays[0], 1.0],
        pair.R_rectified_from_second @ [*rays[1], 1.0],
    )
    nothing = Triangulation(TriangulationStatus.BEHIND, np.zeros(3), np.zeros((3, 3)), float("inf"))
    if first[2] <= 0.0 or second[2] <= 0.0:
        return nothing
    (x1, y1), (x2, y2) = first[:2] / first[2], second[:2] / second[2]
    disparity_px = pair.focal_px * (x1 - x2)
    k, z = law
    # A tenth of a pixel is beyond any reach, and the power law would overflow near zero.
    if disparity_px < 0.1:
        return nothing
    depth = 0.01 * k * disparity_px**z
    height_sigma = float(np.hypot(sigmas[0], sigmas[1]))
    share = sigmas[1] ** 2 / height_sigma**2
    y = share * y1 + (1.0 - share) * y2
    p_rectified = depth * np.array([x1, y, 1.0])
    slope = z * depth / disparity_px * pair.focal_px
    J = np.array(
        [
            [depth + slope * x1, -slope * x1, 0.0],
            [slope * y, -slope * y, depth],
            [slope, -slope, 0.0],
        ]
    )
    height_variance = (share * sigmas[0]) ** 2 + ((1.0 - share) * sigmas[1]) ** 2
    cov = J @ np.diag([sigmas[0] ** 2, sigmas[1] ** 2, height_variance]) @ J.T
    R = pair.R_rig_from_rectified
    status = (
        TriangulationStatus.OK
        if np.linalg.norm(p_rectified) <= max_distance_m
        else TriangulationStatus.BEYOND
    )
    return Triangulation(
        status, R @ p_rectified + pair.origin_rig, R @ cov @ R.T, float(abs(y1 - y2) / height_sigma)
    )
