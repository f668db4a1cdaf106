"""The lens model of wide lenses: Kannala & Brandt, as OpenCV's module fisheye has it.

"A Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye Lenses"
(2006), equation 6: a ray at the angle theta to the axis is seen at the distance
theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) from the centre, in focal lengths. A
pinhole with Brown-Conrady distortion folds over on lenses of more than about 110 degrees; this one
does not. Rays are normalised image points (x/z, y/z) here as everywhere, so it ends short of 90
degrees to the axis: beyond WIDEST_RAD a pixel has no ray, and a point no pixel.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array

# 86 degrees: x/z is 14 there, and noise of .1 px is noise of .1 in it with f = 200 px.
WIDEST_RAD = 1.5
# Newton needs 6 rounds to 1e-14 for the strongest lens tried, |k1| = .1 at 86 degrees.
_ROUNDS = 20
_TOLERANCE = 1e-12


def distort_fisheye(xy: Array, distortion: Array) -> Array:
    """Where rays (n, 2) are seen, in focal lengths (n, 2); distortion is (4,) or (4, n).

    NaN beyond WIDEST_RAD.
    """
    scale, _ = _scale_and_slope(xy, distortion)
    return xy * scale[:, None]


def fisheye_derivatives(
    xy: Array, distortion: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """The 2x2 derivative, (n,) each, of the seen by the ray's image point (n, 2), by rows."""
    scale, slope = _scale_and_slope(xy, distortion)
    x, y = xy[:, 0], xy[:, 1]
    mixed = slope * x * y
    return (scale + slope * x * x, mixed), (mixed, scale + slope * y * y)


def fisheye_powers(xy: Array) -> Array:
    """The derivative (4, n) of the distance from the centre, over |xy|, by k1 to k4."""
    r = np.hypot(xy[:, 0], xy[:, 1])
    theta = np.arctan(r)
    ratio = np.where(r > 1e-8, theta / np.maximum(r, 1e-8), 1.0)
    return np.stack([ratio * theta ** (2 * power) for power in (1, 2, 3, 4)])


def undistort_fisheye(target: Array, distortion: Array) -> Array:
    """Rays (n, 2) that are seen at `target` (n, 2); NaN where none is."""
    seen = np.hypot(target[:, 0], target[:, 1])
    theta = np.minimum(seen, WIDEST_RAD)
    for _ in range(_ROUNDS):
        miss = seen - _distance(theta, distortion)
        if not np.nanmax(np.abs(miss), initial=0.0) > _TOLERANCE:
            break
        slope = _distance_slope(theta, distortion)
        step = miss / np.where(slope > 1e-3, slope, 1e-3)
        # Overshooting lands beyond the range in which the polynomial grows.
        theta = np.clip(theta + np.clip(step, -0.3, 0.3), 0.0, WIDEST_RAD + 0.1)
    good = (
        (np.abs(seen - _distance(theta, distortion)) < 1e-9)
        & (_distance_slope(theta, distortion) > 0.0)
        & (theta <= WIDEST_RAD)
    )
    ratio = np.where(seen > 1e-12, np.tan(theta) / np.maximum(seen, 1e-12), 1.0)
    return np.where(good[:, None], target * ratio[:, None], np.nan)


def _distance(theta: Array, distortion: Array) -> Array:
    k1, k2, k3, k4 = distortion
    s = theta * theta
    return theta * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))))


def _distance_slope(theta: Array, distortion: Array) -> Array:
    k1, k2, k3, k4 = distortion
    s = theta * theta
    return 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))


def _scale_and_slope(xy: Array, distortion: Array) -> tuple[Array, Array]:
    """Seen over |xy| (n,), and its derivative by |xy| over |xy| (n,)."""
    r = np.hypot(xy[:, 0], xy[:, 1])
    theta = np.arctan(r)
    safe = np.maximum(r, 1e-6)
    scale = np.where(r > 1e-6, _distance(theta, distortion) / safe, 1.0)
    by_r = _distance_slope(theta, distortion) / (1.0 + r * r)
    # At the centre, from the series of arctan.
    slope = np.where(
        r > 1e-4, (by_r - scale) / np.maximum(r, 1e-4) ** 2, 2.0 * distortion[0] - 2 / 3
    )
    beyond = theta > WIDEST_RAD
    return np.where(beyond, np.nan, scale), slope
