"""Where a camera sees the centre of a painted finger tip, against the point of the bone that stands
for it.

The tip is a capsule (radius of the paint) that ends in a half ball, painted over extent_m from its
end; the landmark is the middle of the painted stretch of the axis. Seen from afar, the centroid of
what is visible lies off the landmark along the finger's direction in the picture, by an amount that
depends only on the angle between finger and viewing ray: `centroid_shift`. What that does to a
point located from several cameras follows by least squares: `located_shift`. Skin is taken as
evenly bright; nothing else hides the paint.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.triangulation import invert_symmetric
from services.fusion.kalman.measurement import project

# Angles of the table, 0 to 180 deg: 3 deg apart, linear between them is right to 20 um for a 7 mm
# finger.
_ANGLES = 61
# Rays per radius in each direction: edges are then known to 1 / 40 radius, the centroid to 10 um.
_FINENESS = 40


@njit(cache=True)
def _centroid_shift(radius_m: float, extent_m: float, sine: float, cosine: float) -> float:
    """By parallel rays over a grid.

    The finger points along (sine, 0, cosine), rays along (0, 0, 1).
    """
    step = radius_m / _FINENESS
    half = 0.5 * extent_m + radius_m
    n_u, n_w = int(half / step) + 1, _FINENESS
    centre_u = (0.5 * extent_m - radius_m) * sine
    area, moment = 0.0, 0.0
    for i in range(-n_u, n_u + 1):
        u = i * step - centre_u
        for j in range(n_w):
            w = (j + 0.5) * step
            z = np.inf
            inside = radius_m**2 - u * u - w * w
            if inside > 0.0:
                z = -math.sqrt(inside)
            # Cylinder about the finger's direction d: |q|^2 - (q.d)^2 = r^2 for q = (u, w, z), on
            # the side away from the end.
            a, b = sine * sine, -u * sine * cosine
            c = u * u * (1.0 - sine * sine) + w * w - radius_m**2
            discriminant = b * b - a * c
            if a > 1e-9 and discriminant > 0.0:
                side = (-b - math.sqrt(discriminant)) / a
                if side < z and u * sine + side * cosine <= 0.0:
                    z = side
            if z < np.inf and u * sine + z * cosine >= radius_m - extent_m:
                area += 1.0
                moment += i * step
    return moment / area if area > 0.0 else 0.0


@njit(cache=True)
def _fill(radius_m: float, extent_m: float, table: Array) -> None:
    for k in range(table.shape[0]):
        angle = math.pi * k / (table.shape[0] - 1)
        table[k] = _centroid_shift(radius_m, extent_m, math.sin(angle), math.cos(angle))


def shift_table(radius_m: float, extent_m: float) -> Array:
    """centroid_shift for angles from 0 (the finger points away) to pi (it points at the camera).

    (61,) m, zero for flat dabs.
    """
    table = np.zeros(_ANGLES)
    if radius_m > 0.0 and extent_m > 0.0:
        _fill(radius_m, extent_m, table)
    return table


@njit(cache=True)
def centroid_shift(table: Array, cosine: float) -> float:
    """Metres from the landmark to the visible centroid, towards the finger's end, for the cosine of
    finger and viewing ray.
    """
    place = math.acos(min(1.0, max(-1.0, cosine))) / math.pi * (table.shape[0] - 1)
    k = min(int(place), table.shape[0] - 2)
    return table[k] + (place - k) * (table[k + 1] - table[k])


@njit(cache=True)
def located_shift(
    table: Array, p_rig: Array, direction: Array, R: Array, t: Array, out: Array
) -> bool:
    """Where cameras R (C, 3, 3), t (C, 3) locate the visible centroid, minus the landmark p_rig
    (3,); to out (3,). False if they cannot.

    direction (3,) is the finger's, towards its end, of unit length.
    """
    A, inverse, b, ray, H, across = (
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros(3),
        np.empty(2),
        np.empty((2, 3)),
        np.empty(3),
    )
    for c in range(R.shape[0]):
        if not project(p_rig, R[c], t[c], ray, H):
            return False
        length, cosine = 0.0, 0.0
        for i in range(3):
            # The viewing ray in the rig frame: p - centre, centre = -R^T t.
            across[i] = (
                p_rig[i] + R[c, 0, i] * t[c, 0] + R[c, 1, i] * t[c, 1] + R[c, 2, i] * t[c, 2]
            )
            length += across[i] ** 2
            cosine += across[i] * direction[i]
        length = math.sqrt(length)
        cosine /= length
        sine = math.sqrt(max(1.0 - cosine * cosine, 1e-12))
        shift = centroid_shift(table, cosine)
        for i in range(3):
            across[i] = (direction[i] - cosine * across[i] / length) / sine * shift
        for k in range(2):
            seen = H[k, 0] * across[0] + H[k, 1] * across[1] + H[k, 2] * across[2]
            for i in range(3):
                b[i] += H[k, i] * seen
                for j in range(3):
                    A[i, j] += H[k, i] * H[k, j]
    if not invert_symmetric(A, inverse):
        return False
    for i in range(3):
        out[i] = inverse[i, 0] * b[0] + inverse[i, 1] * b[1] + inverse[i, 2] * b[2]
    return True
