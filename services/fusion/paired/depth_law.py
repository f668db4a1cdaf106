"""The RHOT paper's depth law: distance from the disparity of two cameras alone.

D = k * x^z, RHOT eq. (9), or with k of eq. (10). The disparity x is taken in the rectified frame of
the two cameras (rectified_pair.py), so that they need not be parallel; the lateral position follows
from the ray. The law is a fit: k and z belong to one rig (`rhot calibrate depth`), and the paper's
k = 4543.3, z = -1.035 only to 75 mm and 527.3 px. No disparity, or a negative one, gives the status
of rays that do not meet.
"""

from __future__ import annotations

import math

import numpy as np

from rhot.files.rig_tables import Disparity
from rhot.geometry.transforms import Array
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_ray
from services.fusion.geometry.triangulation import Triangulation, TriangulationStatus

# A tenth of a pixel of disparity is beyond any reach, and the power law would overflow near zero.
_MIN_DISPARITY_PX = 0.1


def depth_law(settings: Disparity, pair: RectifiedPair) -> tuple[float, float]:
    """k (cm px^-z) and z of D = k * x^z.

    The fitted law, or the geometry of eq. (10) with its alignment angle phi.
    """
    if settings.law == "power":
        return settings.k, settings.z
    half_view = np.arctan(0.5 * pair.width_px / pair.focal_px)
    k = 100.0 * pair.baseline_m * pair.width_px / (2.0 * np.tan(half_view + settings.phi_rad))
    return float(k), -1.0


def locate(
    pair: RectifiedPair, rays: Array, sigmas: Array, law: tuple[float, float], max_distance_m: float
) -> Triangulation:
    """The point seen along the rays (2, 2) of a pair of cameras, by the law (k, z).

    sigmas (2,) are those of the rays, the first camera's first. residual_sigma is the epipolar
    error: how far the two rays' heights differ, in sigmas.
    """
    nothing = Triangulation(TriangulationStatus.BEHIND, np.zeros(3), np.zeros((3, 3)), float("inf"))
    x1, y1 = rectify_ray(pair.R_rectified_from_first, rays[0])
    x2, y2 = rectify_ray(pair.R_rectified_from_second, rays[1])
    if not math.isfinite(x1 + x2):
        return nothing
    disparity_px = pair.focal_px * (x1 - x2)
    if disparity_px < _MIN_DISPARITY_PX:
        return nothing
    k, z = law
    depth = 0.01 * k * disparity_px**z
    # The height is the mean of both rays', weighted by their variances.
    height_sigma = float(np.hypot(sigmas[0], sigmas[1]))
    share = sigmas[1] ** 2 / height_sigma**2
    y = share * y1 + (1.0 - share) * y2
    p_rectified = depth * np.array([x1, y, 1.0])
    cov = _covariance(p_rectified, (x1, y), z * depth / disparity_px * pair.focal_px, sigmas, share)
    R = pair.R_rig_from_rectified
    within_reach = np.linalg.norm(p_rectified) <= max_distance_m
    return Triangulation(
        TriangulationStatus.OK if within_reach else TriangulationStatus.BEYOND,
        R @ p_rectified + pair.origin_rig,
        R @ cov @ R.T,
        float(abs(y1 - y2) / height_sigma),
    )


def _covariance(
    p_rectified: Array, ray: tuple[float, float], slope: float, sigmas: Array, share: float
) -> Array:
    """Covariance (3, 3) of a point at depth p_rectified[2] along a ray (x, y).

    slope: derivative of the depth by x of the first ray. share: weight of the first ray's height.
    """
    depth = p_rectified[2]
    x, y = ray
    # Jacobian of the point by x of both rays and their mean height.
    J = np.array(
        [
            [depth + slope * x, -slope * x, 0.0],
            [slope * y, -slope * y, depth],
            [slope, -slope, 0.0],
        ]
    )
    height_variance = (share * sigmas[0]) ** 2 + ((1.0 - share) * sigmas[1]) ** 2
    return J @ np.diag([sigmas[0] ** 2, sigmas[1] ** 2, height_variance]) @ J.T
