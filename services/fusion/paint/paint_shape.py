"""How unlike its model's the paint of a hand is, by how large its tips look. Compiled.

A tip's area follows from its distance and from the angle between finger and viewing ray
(expected_area.py), and so does where its visible middle is (visible_paint.py). On a hand whose
fingers are not as the model has them (they bulge at the joint, end more pointed, skin goes along
when they bend), both are off, and directions that are wrong show in both, too. Areas can be
compared with the model's without a truth: how much their ratio scatters, over the tips of a hand
and over time, tells how far the visible middle may be off. What all of them have in common is size,
blur and light.

Root mean square, over 14 tuning cases of held_out.py's pictures and 19 tuning clips of
other_renderer.py: scatter of the logarithm .03 to .08 (recorded hands .1 and .13) and .09 to .22;
errors across the viewing rays .02 to .05 radii (.09 and .12) and .08 to .18. How badly the points
fit the hand's bones (HandPose.model_misfit) told the two apart less well: three of the clips fit
like hands of the tables and are .12 to .18 radii off.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints

# How long looks count, and the most that one stands for.
_MEMORY_S, _LOOK_S = 10.0, 0.1
# What scatter is expected at first, and how many seconds of one camera's looks at one tip that is
# worth.
_GUESS, _GUESS_S = 0.1, 2.0
# One standard deviation of the visible middle's place, in radii of paint, from the scatter: what
# hands of the model have of it says nothing, and what is above is worth so much, up to a limit.
# (Chosen on both tuning halves, whose likelihood of errors without lag and at two frames was .96,
# 1.41 of our pictures and -2.30, -1.91 of the other renderer's with model_misfit for the scatter,
# and is 1.13, 1.70 and -2.08, -1.81 with this.)
_USUAL, _WORTH, _MOST = 0.08, 1.4, 0.11
# Nearer to the ray that comes along the finger the area changes fast with the angle.
LEAST_ANGLE = math.radians(70.0)


@njit(cache=True)
def take_look(sums: Array, ratio: float, passed_s: float) -> None:
    """Add a look at a tip to its sums (3,): of weights, in s, and of ratios and of their squares.

    ratio: the logarithm of its area over the model's; passed_s: since the look before.
    """
    kept, weight = math.exp(-passed_s / _MEMORY_S), min(passed_s, _LOOK_S)
    sums[0] = kept * sums[0] + weight
    sums[1] = kept * sums[1] + weight * ratio
    sums[2] = kept * sums[2] + weight * ratio * ratio


@njit(cache=True)
def tell_shapes(sums: Array, hands: Ints, shape_sds: Array) -> None:
    """What the sums (L, C, 3) of all looks at L tips say of each one's hand (L,), to shape_sds (L,)
    in radii of paint.
    """
    for hand in range(hands.max() + 1 if hands.size else 0):
        of_hand = np.zeros(3)
        for row in range(hands.size):
            if hands[row] == hand:
                for camera in range(sums.shape[1]):
                    of_hand += sums[row, camera]
        shape_sd = _shape_sd(of_hand)
        for row in range(hands.size):
            if hands[row] == hand:
                shape_sds[row] = shape_sd


@njit(cache=True)
def _shape_sd(sums: Array) -> float:
    """In radii of paint, by the sums (3,) of all looks at a hand."""
    weight = sums[0]
    scatter = sums[2] - sums[1] * sums[1] / weight if weight > 0.0 else 0.0
    variance = (max(scatter, 0.0) + _GUESS_S * _GUESS**2) / (weight + _GUESS_S)
    return min(_WORTH * math.sqrt(max(variance - _USUAL**2, 0.0)), _MOST)
