"""How unlike its model's the paint of a hand is, by how large its tips look. Compiled.

A tip's area follows from its distance and from the angle between finger and viewing ray
(expected_area.py), and so does where its visible middle is (visible_paint.py). On a hand whose
fingers are not as the model has them (they bulge at the joint, end more pointed, skin goes along
when they bend), both are off, and directions that are wrong show in both, too. Areas can be
compared with the model's without a truth: how much their ratio scatters, over the tips of a hand
and over time, tells how far the visible middle may be off. What all of them have in common is size,
blur and light.

Root mean square, over 14 tuning cases of held_out.py's pictures and 19 tuning clips of
other_renderer.py: scatter of the logarithm .03 to .09 (recorded hands .1 and .13) and .09 to .22;
errors across the viewing rays .02 to .05 radii (.09 and .12) and .08 to .18. How badly the points
fit the hand's bones (HandPose.model_misfit) told the two apart less well: three of the clips fit
like hands of the tables and are .12 to .18 radii off.
"""

from __future__ import annotations

import math

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
# (Chosen on both tuning halves: the mean log likelihood of their points' errors, without lag and at
# two frames, .97 and 1.41 of our pictures, -2.30 and -1.91 of the other renderer's while
# model_misfit stood for the scatter, is 1.14, 1.69, -1.93 and -1.67. From one set of points,
# without _FAR: a limit of .09 is as likely, .14 is .07 to .09 less on the latter; with .1 for .075
# one of its clips is told 2.8 times too surely.)
_USUAL, _WORTH, _MOST = 0.075, 1.4, 0.11
# A look that is off by more than so many deviations counts as one that is off by that: it is rather
# of a tip that something hides from all cameras. (Without, our own tuning pictures in dim light had
# .11 by a few such.)
_FAR = 2.0


@njit(cache=True)
def take_look(sums: Array, usual: Array, ratio: float, passed_s: float) -> None:
    """Add a look at a tip to its sums (3,): of weights, in s, and of ratios and of their squares.

    usual (2,): mean and deviation of its hand's ratios until then, of tell_shapes; ratio: the
    logarithm of its area over the model's; passed_s: since the look before.
    """
    if not math.isnan(usual[0]):
        far = _FAR * usual[1]
        ratio = min(max(ratio, usual[0] - far), usual[0] + far)
    kept, weight = math.exp(-passed_s / _MEMORY_S), min(passed_s, _LOOK_S)
    sums[0] = kept * sums[0] + weight
    sums[1] = kept * sums[1] + weight * ratio
    sums[2] = kept * sums[2] + weight * ratio * ratio


@njit(cache=True)
def tell_shapes(sums: Array, hands: Ints, usual: Array, shape_sds: Array) -> None:
    """What the sums (L, C, 3) of all looks at L tips say of each one's hand (L,); nothing of -1.

    To usual (L, 2) the mean of its ratios, NaN without any, and their deviation; to shape_sds (L,)
    how unlike its model it is, in radii of paint.
    """
    for hand in range(hands.max() + 1 if hands.size else 0):
        weight, total, squares = 0.0, 0.0, 0.0
        for row in range(hands.size):
            if hands[row] == hand:
                for camera in range(sums.shape[1]):
                    weight += sums[row, camera, 0]
                    total += sums[row, camera, 1]
                    squares += sums[row, camera, 2]
        mean = total / weight if weight > 0.0 else math.nan
        scatter = max(squares - total * mean, 0.0) if weight > 0.0 else 0.0
        variance = (scatter + _GUESS_S * _GUESS**2) / (weight + _GUESS_S)
        shape_sd = min(_WORTH * math.sqrt(max(variance - _USUAL**2, 0.0)), _MOST)
        for row in range(hands.size):
            if hands[row] == hand:
                usual[row, 0], usual[row, 1] = mean, math.sqrt(variance)
                shape_sds[row] = shape_sd
