"""Intersection of rays with tapered capsules, in the frame of one camera. Compiled kernels. Pure.

A capsule is the convex hull of two balls (a rounded cone). While a frame is exposed its ends move
along parabolas in u = -1..1 (motion_paths.py). A capsule must lie in front of the camera; one that
does not is not drawn.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import Ints
from services.simulator.render.projection import Array32

# Fields of a placed capsule (PLACED,). First what depends on the instant, written by
# `place_capsule`: the balls' centres a and b and the axis b - a (xyz each), the radii ...
END_A, AXIS, END_B = 0, 3, 6
RADIUS_A, RADIUS_B, TAPER = 9, 10, 11
# ... and products of these that the intersection needs: -axis . a; the power |centre|^2 - radius^2
# of each ball; the squared slant length of the cone (0: no cone) and the constant of its quadratic
# equation; the length of the axis.
AXIS_SQUARED, AXIS_DOT_A, POWER_A, POWER_B = 12, 13, 14, 15
SLANT_SQUARED, CONE_CONSTANT, LENGTH, INVERSE_LENGTH = 16, 17, 18, 19
# Then what shading needs, written once a frame by `write_attributes`: palmar direction (xyz),
# surface, surface and length of the painted end, whether dabs stick to it, number of the instant.
PALMAR, SURFACE, END_SURFACE, END_LENGTH, DABBED, INSTANT = 20, 23, 24, 25, 26, 27
# The rest is of solids (ray_solid.py), up to how an uneven painted end leans: whether it does, and
# by how much it is longer on the palm's side, on the right, and on both alike.
END_LEAN = 40
PLACED = 44
# Distance of what a ray does not meet.
FAR = 1e9


class NearestHits(NamedTuple):
    """The nearest capsule along each pixel's ray of one row of w pixels."""

    distance: Array  # (w,) m, FAR where there is none
    along: Array  # (w,) as `intersect` gives it
    capsule: Ints  # (w,)


@njit(cache=True, nogil=True, error_model="numpy")
def place_capsule(ends: Array, radius: Array, u: float, g: Array) -> None:
    """Everything about a capsule at instant u that does not depend on the ray; g (PLACED,).

    ends (2, 3, 3) are the parabolas of both centres, radius (2,).
    """
    ra, rb = radius[0], radius[1]
    axis_squared, axis_dot_a, a_squared, b_squared = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        a = ends[0, 0, i] + u * (ends[0, 1, i] + u * ends[0, 2, i])
        b = ends[1, 0, i] + u * (ends[1, 1, i] + u * ends[1, 2, i])
        g[END_A + i], g[AXIS + i], g[END_B + i] = a, b - a, b
        axis_squared += (b - a) * (b - a)
        axis_dot_a -= (b - a) * a
        a_squared += a * a
        b_squared += b * b
    taper = ra - rb
    slant_squared = axis_squared - taper * taper
    g[RADIUS_A], g[RADIUS_B], g[TAPER] = ra, rb, taper
    g[AXIS_SQUARED], g[AXIS_DOT_A] = axis_squared, axis_dot_a
    g[POWER_A], g[POWER_B] = a_squared - ra * ra, b_squared - rb * rb
    # One ball inside the other leaves no cone between them.
    g[SLANT_SQUARED] = slant_squared if slant_squared > 1e-12 else 0.0
    g[CONE_CONSTANT] = (
        slant_squared * a_squared
        - axis_dot_a * axis_dot_a
        + 2.0 * axis_dot_a * taper * ra
        - axis_squared * ra * ra
    )
    g[LENGTH] = math.sqrt(axis_squared)
    g[INVERSE_LENGTH] = 1.0 / max(g[LENGTH], 1e-9)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy", inline="always")
def intersect(g: Array, x: float, y: float, z: float) -> tuple[float, float]:
    """(distance, along) of the first point where a unit ray from the origin meets a capsule.

    distance is FAR if there is none. along is 0 on ball a, SLANT_SQUARED on ball b and between
    the two on the cone. Closed form after I. Quilez, "Ray-surface intersection functions", rounded
    cone; the balls lie inside the hull, so the nearest candidate is right.
    """
    d2 = g[SLANT_SQUARED]
    m2 = g[AXIS] * x + g[AXIS + 1] * y + g[AXIS + 2] * z
    m3 = -(x * g[END_A] + y * g[END_A + 1] + z * g[END_A + 2])
    nearest, nearest_along = FAR, 0.0
    if d2 > 0.0:
        k2 = d2 - m2 * m2
        k1 = d2 * m3 + m2 * (g[TAPER] * g[RADIUS_A] - g[AXIS_DOT_A])
        h = k1 * k1 - g[CONE_CONSTANT] * k2
        if h < 0.0:
            return FAR, 0.0
        t = -(math.sqrt(h) + k1) / k2
        along = g[AXIS_DOT_A] - g[RADIUS_A] * g[TAPER] + t * m2
        if along > 0.0 and along < d2:
            if k2 > 0.0:
                return t, along
            nearest, nearest_along = t, along
    h = m3 * m3 - g[POWER_A]
    if h > 0.0:
        t = -m3 - math.sqrt(h)
        if t < nearest:
            nearest, nearest_along = t, 0.0
    m6 = -(x * g[END_B] + y * g[END_B + 1] + z * g[END_B + 2])
    h = m6 * m6 - g[POWER_B]
    if h > 0.0:
        t = -m6 - math.sqrt(h)
        if t < nearest:
            nearest, nearest_along = t, d2
    return nearest, nearest_along


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def intersect_row(
    g: Array, rays: Array32, first: int, last: int, capsule: int, nearest: NearestHits
) -> None:
    """`intersect` for the pixels first..last of a row's rays (3, w), keeping the nearest hit.

    Free of branches, so that it compiles to SIMD.
    """
    ax, ay, az = g[END_A], g[END_A + 1], g[END_A + 2]
    bx, by, bz = g[END_B], g[END_B + 1], g[END_B + 2]
    ux, uy, uz = g[AXIS], g[AXIS + 1], g[AXIS + 2]
    d2, k0, ca, cb = g[SLANT_SQUARED], g[CONE_CONSTANT], g[POWER_A], g[POWER_B]
    q = g[TAPER] * g[RADIUS_A] - g[AXIS_DOT_A]
    y0 = g[AXIS_DOT_A] - g[RADIUS_A] * g[TAPER]
    rx, ry, rz = rays[0], rays[1], rays[2]
    depth, reach, owner = nearest.distance, nearest.along, nearest.capsule
    for i in range(first, last + 1):
        x, y, z = float(rx[i]), float(ry[i]), float(rz[i])
        m2 = ux * x + uy * y + uz * z
        m3 = -(x * ax + y * ay + z * az)
        m6 = -(x * bx + y * by + z * bz)
        k2 = d2 - m2 * m2
        k1 = d2 * m3 + m2 * q
        h = k1 * k1 - k0 * k2
        tc = -(math.sqrt(max(h, 0.0)) + k1) / (k2 + 1e-300)
        along = y0 + tc * m2
        cone = (h >= 0.0) & (along > 0.0) & (along < d2)
        t = tc if cone else FAR
        where = along if cone else 0.0
        h = m3 * m3 - ca
        ta = -m3 - math.sqrt(max(h, 0.0)) if h > 0.0 else FAR
        where = 0.0 if ta < t else where
        t = min(t, ta)
        h = m6 * m6 - cb
        tb = -m6 - math.sqrt(max(h, 0.0)) if h > 0.0 else FAR
        where = d2 if tb < t else where
        t = min(t, tb)
        nearer = t < depth[i]
        depth[i] = t if nearer else depth[i]
        reach[i] = where if nearer else reach[i]
        owner[i] = capsule if nearer else owner[i]


@njit(cache=True, nogil=True)
def write_attributes(palms: Array, kind: Ints, end_m: Array, g: Array) -> None:
    """Write what does not move into a table of placed capsules g (instants, c, PLACED).

    palms (c, 3, 3), of which the value at u = 0 counts; kind (c, 4); end_m (c, 4).
    """
    for k in range(g.shape[0]):
        for c in range(g.shape[1]):
            for i in range(3):
                g[k, c, PALMAR + i] = palms[c, 0, i]
            g[k, c, SURFACE] = kind[c, 0]
            g[k, c, END_SURFACE] = kind[c, 1]
            g[k, c, END_LENGTH] = end_m[c, 0]
            g[k, c, END_LEAN] = 1.0 if np.any(end_m[c, 1:] != 0.0) else 0.0
            for i in range(3):
                g[k, c, END_LEAN + 1 + i] = end_m[c, 1 + i]
            g[k, c, DABBED] = kind[c, 2]
            g[k, c, INSTANT] = k
