"""On which side of a tip's paint another finger hides it from one camera. Compiled.

What is left of a marker says how much is hidden, not where; the pose that points rest on does: a
finger is a capsule from its painted tip back along its direction, and one that passes before a tip
hides it from its own side on. The centre of what is left lies away from there.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.geometry.projection import NEAR_M
from services.fusion.paint.known_paint import MOST_UNSURE_RAD, POSE_AGE_NS, KnownPaint

# From the middle of a tip's paint, how far its finger goes on, and how far back it is about
# straight; points along it.
_ON_M, _BACK_M, _POINTS = 0.005, 0.035, 9
# What passes a tip nearer than this share of both radii hides some of it, and it is so much nearer.
# (Tuning half of our own pictures, maxima at lags 0 and 2: 7 and 10 % smaller with 1.05 than with
# .9, 8 and 9 with 1.25.)
_OVERLAP, _NEARER_M = 1.1, 0.003


@njit(cache=True)
def hidden_from(
    paint: KnownPaint,
    places: Array,
    row: int,
    instant_ns: int,
    camera: tuple[Array, Array],
    away: Array,
) -> bool:
    """Whether a finger passes before a tip; to away (2,) the way from it to the tip, in the image.

    A unit vector in rays. places (L, 3) of all landmarks, rig frame, NaN where unknown; camera:
    T_camera_from_rig as R (3, 3), t (3,).
    """
    R, t = camera
    tip = R @ places[row] + t
    if not tip[2] > NEAR_M or paint.radii_m[row] == 0.0:
        return False
    nearest, point = math.inf, np.empty(3)
    for other in range(places.shape[0]):
        told = abs(instant_ns - paint.stamps_ns[other]) <= POSE_AGE_NS
        told &= paint.direction_sigmas[other, 0] <= MOST_UNSURE_RAD
        if other == row or paint.radii_m[other] == 0.0 or not told:
            continue
        reach_m = _OVERLAP * (paint.radii_m[row] + paint.radii_m[other])
        for k in range(_POINTS):
            on_m = _ON_M - k * (_ON_M + _BACK_M) / (_POINTS - 1)
            for i in range(3):
                point[i] = t[i]
                for j in range(3):
                    at = places[other, j] + on_m * paint.directions[other, j]
                    point[i] += R[i, j] * at
            # Also of what is NaN.
            if not (NEAR_M < point[2] < tip[2] - _NEARER_M):
                continue
            x, y = tip[0] / tip[2] - point[0] / point[2], tip[1] / tip[2] - point[1] / point[2]
            gap = math.hypot(x, y) * point[2] / reach_m
            if 0.0 < gap < min(nearest, 1.0):
                nearest = gap
                length = math.hypot(x, y)
                away[0], away[1] = x / length, y / length
    return nearest < 1.0
