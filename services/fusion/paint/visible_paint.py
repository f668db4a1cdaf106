"""What is visible of paint: its middle and its area, of a finger tip by ray-casting; a dab's depth.

The tip is a tapered capsule (radius of the paint at its end) that ends in a half ball, painted over
extent_m from its end; the landmark is the middle of the painted stretch of the axis. Seen from
afar, the centroid of what is visible lies off the landmark along the finger's direction in the
image, by an amount that depends only on the angle between finger and viewing ray. Skin is taken as
evenly bright; nothing else hides the paint.

The taper counts: a last bone is a millimetre thicker at its joint than at its end. Of a plain
capsule, rendered tips that pointed at the cameras were located .2 to .5 mm towards the hand and .5
to 1.4 mm too deep, those that pointed away .2 mm towards their end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# Angles of the table, 0 to 180 deg: 3 deg apart, linear between them is right to 20 um for a 7 mm
# finger.
_ANGLES = 61
# Rays per radius in each direction: edges are then known to 1 / 40 radius, the centroid to 10 um.
_FINENESS = 40


@njit(cache=True)
def _visible(
    radius_m: float, extent_m: float, taper: float, sine: float, cosine: float
) -> tuple[float, float]:
    """From the landmark to the visible centroid, m, and the visible area, m^2, across the rays.

    By parallel rays over a grid.

    The finger points along (sine, 0, cosine), rays along (0, 0, 1); u is a ray's x, w its y.
    """
    step = radius_m / _FINENESS
    # A taper of sine s makes the radius (r + a s) / sqrt(1 - s^2) at a behind the ball's centre.
    thickest = (radius_m + taper * extent_m) / math.sqrt(1.0 - taper * taper)
    n_u = int((0.5 * extent_m + thickest) / step) + 1
    n_w = int(thickest / step) + 1
    # From the landmark to the centre of the end's ball.
    centre_u = (0.5 * extent_m - radius_m) * sine
    area = 0.0
    moment = 0.0
    for i in range(-n_u, n_u + 1):
        u = i * step - centre_u
        for j in range(n_w):
            w = (j + 0.5) * step
            z = _first_hit(u, w, radius_m, taper, sine, cosine)
            # Painted: no further than extent_m from the end.
            if math.isfinite(z) and u * sine + z * cosine >= radius_m - extent_m:
                area += 1.0
                moment += i * step
    # Of one half: w and -w are alike.
    return moment / area if area > 0.0 else 0.0, 2.0 * area * step * step


@njit(cache=True)
def _first_hit(
    u: float, w: float, radius_m: float, taper: float, sine: float, cosine: float
) -> float:
    """z at which the ray through (u, w) meets the capsule; infinite if it does not.

    The centre of the end's ball is the origin; its cone widens away from (sine, 0, cosine).
    """
    z = np.inf
    inside = radius_m**2 - u * u - w * w
    if inside > 0.0:
        z = -math.sqrt(inside)
    # Points q = (u, w, z) of the cone, a behind the origin along the finger's direction: (|q|^2 -
    # a^2) (1 - taper^2) = (radius + a taper)^2, from where it touches the ball on.
    behind = -u * sine
    a = 1.0 - taper * taper - cosine * cosine
    b = cosine * (behind + radius_m * taper)
    c = (1.0 - taper * taper) * (u * u + w * w - behind * behind)
    c -= (radius_m + behind * taper) ** 2
    if a < 0.0 < cosine:
        # The ray comes along the finger, from within the cone: the finger hides its own end.
        return -np.inf
    discriminant = b * b - a * c
    if abs(a) > 1e-9 and discriminant > 0.0:
        # Along the finger from before its end the ray comes in by the second root: the first is on
        # the other half of the double cone.
        for root in (-math.sqrt(discriminant), math.sqrt(discriminant)):
            side = (-b + root) / a
            if side < z and behind - side * cosine >= -radius_m * taper and (a < 0.0 or root < 0.0):
                z = side
    return z


class PaintTables(NamedTuple):
    """What shows of a painted tip, of angles from 0 (the finger points away) to pi."""

    shifts_m: Array  # (61,) what paint_centroid.centroid_shift looks up
    areas_m2: Array  # (61,) across the viewing ray


@njit(cache=True)
def _fill_tables(
    radius_m: float, extent_m: float, taper: float, shifts: Array, areas: Array
) -> None:
    for k in range(shifts.shape[0]):
        angle = math.pi * k / (shifts.shape[0] - 1)
        shifts[k], areas[k] = _visible(radius_m, extent_m, taper, math.sin(angle), math.cos(angle))


def paint_tables(radius_m: float, extent_m: float, taper: float = 0.0) -> PaintTables:
    """What shows of a tip that is painted over extent_m; zeros for flat dabs.

    taper: by how much the radius of the balls that the finger is made of grows away from its end,
    as a share of the way; less than 1.
    """
    tables = PaintTables(np.zeros(_ANGLES), np.zeros(_ANGLES))
    if radius_m > 0.0 and extent_m > 0.0:
        _fill_tables(radius_m, extent_m, taper, *tables)
    return tables


def dab_sag_m(radius_m: float, limb_m: float) -> float:
    """How deep under its highest point two cameras locate a dab of radius_m.

    On skin that curves both ways with radius limb_m, as at a joint. Each camera weighs the skin by
    how much it faces it, so the centre of a cap moves from view to view as the middle of its *rim*
    does: from a direction t off the axis, a cap of half-angle p on a ball R has its centre at R
    cos(p) sin(t) beside the ball's. On a cylinder it is 3/4 of that deep. 0 for a limb of no
    thickness.
    """
    return limb_m - math.sqrt(limb_m**2 - radius_m**2) if limb_m > radius_m else 0.0
