"""The limit of a base joint that swings both ways (a rotor): box, circle, ellipse or parabola over
(abduction, flexion).

The seed's framework knew circular cones only, and says itself that a parabola fits a finger better
(RHOT section 11): abduction is free while the finger is straight and vanishes as it bends into a
fist. A rotor never widens the type I limits: whatever the shape, the result is inside the box. Pure
maths: no input is late here.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array

BOX, CIRCLE, ELLIPSE, PARABOLA = 0, 1, 2, 3


@njit(cache=True)
def swing(shape: int, limits: Array, abduction: float, flexion: float) -> tuple[float, float]:
    """The nearest allowed (abduction, flexion) of a shape inscribed in limits (2, 2), all in
    radians.

    CIRCLE and ELLIPSE touch the box's four sides (the circle only the nearer two); PARABOLA has its
    full width at the flexion's lower limit and its apex at the upper one. Circle and ellipse move a
    point along the ray from the centre, the parabola moves abduction only: what the hinge of
    flexion can reach is kept.
    """
    abduction = min(max(abduction, limits[0, 0]), limits[0, 1])
    flexion = min(max(flexion, limits[1, 0]), limits[1, 1])
    if shape == BOX:
        return abduction, flexion
    middle, centre = 0.5 * (limits[0, 0] + limits[0, 1]), 0.5 * (limits[1, 0] + limits[1, 1])
    half, reach = 0.5 * (limits[0, 1] - limits[0, 0]), 0.5 * (limits[1, 1] - limits[1, 0])
    if shape == PARABOLA:
        open_share = (limits[1, 1] - flexion) / (2.0 * reach) if reach > 0.0 else 1.0
        width = half * math.sqrt(max(open_share, 0.0))
        return min(max(abduction, middle - width), middle + width), flexion
    if shape == CIRCLE:
        half = reach = min(half, reach) if half > 0.0 else 0.0
    if half <= 0.0 or reach <= 0.0:
        return middle, (flexion if shape == ELLIPSE else centre)
    x, y = (abduction - middle) / half, (flexion - centre) / reach
    size = math.sqrt(x * x + y * y)
    if size <= 1.0:
        return abduction, flexion
    return middle + half * x / size, centre + reach * y / size
