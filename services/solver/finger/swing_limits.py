"""The limit of a base joint that swings both ways: a shape over (abduction, flexion).

Box, circle, ellipse or parabola. Papers on FABRIK call such a joint a rotor. The RHOT paper's
framework knew circular cones only, and says itself that a parabola fits a finger better (section
11): abduction is free while the finger is straight and vanishes as it bends into a fist. A shape
never widens the type I limits: the result is always inside the box. The angles' limits themselves
are in rhot.hand.Digit.limits_rad.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array

BOX, CIRCLE, ELLIPSE, PARABOLA = 0, 1, 2, 3


@njit(cache=True)
def clamp_swing(shape: int, limits: Array, abduction: float, flexion: float) -> tuple[float, float]:
    """The nearest allowed (abduction, flexion) of a shape inscribed in limits (2, 2), rad.

    CIRCLE and ELLIPSE touch the box's four sides (the circle only the nearer two); PARABOLA has its
    full width at the flexion's lower limit and its apex at the upper one. Circle and ellipse move a
    point along the ray from the centre, the parabola moves abduction only: what the hinge of
    flexion can reach is kept.
    """
    abduction = min(max(abduction, limits[0, 0]), limits[0, 1])
    flexion = min(max(flexion, limits[1, 0]), limits[1, 1])
    if shape == BOX:
        return abduction, flexion
    # Centre and half axes of the box: abduction, flexion.
    centre0, centre1 = 0.5 * (limits[0, 0] + limits[0, 1]), 0.5 * (limits[1, 0] + limits[1, 1])
    half0, half1 = 0.5 * (limits[0, 1] - limits[0, 0]), 0.5 * (limits[1, 1] - limits[1, 0])
    if shape == PARABOLA:
        open_share = (limits[1, 1] - flexion) / (2.0 * half1) if half1 > 0.0 else 1.0
        width = half0 * math.sqrt(max(open_share, 0.0))
        return min(max(abduction, centre0 - width), centre0 + width), flexion
    if shape == CIRCLE:
        half0 = half1 = min(half0, half1) if half0 > 0.0 else 0.0
    if half0 <= 0.0 or half1 <= 0.0:
        return centre0, (flexion if shape == ELLIPSE else centre1)
    x, y = (abduction - centre0) / half0, (flexion - centre1) / half1
    radius = math.sqrt(x * x + y * y)
    if radius <= 1.0:
        return abduction, flexion
    return centre0 + half0 * x / radius, centre1 + half1 * y / radius
