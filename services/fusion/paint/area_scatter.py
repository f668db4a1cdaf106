"""What the areas of a hand's tips tell of its pose and of its paint's shape. Compiled.

A tip's area follows from its distance and from the angle between finger and viewing ray
(expected_area.py), and so does where its visible middle is (visible_paint.py). Areas can be
compared with the model's without a truth: how much their ratio scatters, over the tips of a hand
and over time, tells two things. What all of them have in common is size, blur and light.

* **Directions that are surer than told.** A pose is as unsure as people's hands differ, most of
  all where its fingers point. Areas scatter by what that makes of them, or by less. The share of
  told variances that they leave is .0 to .66 of twelve tuning cases of hands that the simulator
  draws, where directions' squared errors are .04 to .74 of these, and .67 or more of 21 others,
  where they are .4 to 2.4.
* **Paint that is unlike the model's.** On a hand whose fingers are not as the model has them (they
  bulge at the joint, end more pointed, skin goes along when they bend), areas and visible middles
  are both off. Root mean square, over 14 tuning cases of held_out.py's pictures and 19 tuning clips
  of other_renderer.py: scatter of the logarithm .03 to .09 (recorded hands .1 and .13) and .09 to
  .22; errors across the viewing rays .02 to .05 radii (.09 and .12) and .08 to .18. How badly the
  points fit the hand's bones (HandPose.model_misfit) told the two apart less well: three of the
  clips fit like hands of the tables and are .12 to .18 radii off.
"""

from __future__ import annotations

import math

from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.paint.known_paint import KnownPaint

# How long looks count, and the most that one stands for.
_MEMORY_S, _LOOK_S = 10.0, 0.1
# What scatter is expected at first, as much of it by directions, and how many seconds of one
# camera's looks at one tip that is worth.
_GUESS, _GUESS_S = 0.1, 2.0
# Directions are surer than told of hands that fit their bones so well, in variances, and are not
# from the second on: what is wrong of all fingers alike does not scatter. (Hands of tuning cases
# that the simulator draws have .24 to .78, and a small one 1.05; recorded ones .74 to 4.0. Asked
# for since a recorded hand of held_out.py, of .9 to 2.2, has areas that scatter by .06 only: its
# NEES was 3.8 and 4.5 without this, 1.8 and 1.5 without shares.)
_FITS, _UNFIT = 0.5, 1.0
# Scatter of areas that has nothing to do with directions, and the least share of a direction's
# variance that is believed. (Chosen with the constants below on both tuning halves by the mean log
# likelihood of points' errors, without lag and at two frames: without shares 1.14 and 1.69 of our
# pictures, -1.93 and -1.67 of the other renderer's; with them 1.44, 2.03, -1.94 and -1.67. With .04
# and .15 .05 to .1 less on the former.)
_NOISE, _LEAST_SHARE = 0.05, 0.1
# One standard deviation of the visible middle's place, in radii of paint, from the scatter: what
# hands of the model have of it says nothing, nor does a part of what directions make of it, and
# what is above is worth so much, up to a limit. (Likewise. A limit of .09 is as likely, .14 is .07
# to .09 less on the other renderer's clips; with .1 for .08 one of them is told 2.8 times too
# surely. Without the part the four are .02, .01, .00 and .01 less; with all that directions make,
# two hands that grab have a NEES of 1.8 and 2.1.)
_USUAL, _BY_DIRECTION, _WORTH, _MOST = 0.08, 0.4, 1.6, 0.11
# A look that is off by more than so many deviations counts as one that is off by that: it is rather
# of a tip that something hides from all cameras. (Without, our own tuning pictures in dim light had
# .11 by a few such.)
_FAR = 2.0


@njit(cache=True)
def take_look(
    sums: Array, usual: Array, ratio: float, by_direction: float, passed_s: float
) -> None:
    """Add a look at a tip to its sums (4,): of weights, in s, of ratios and of their squares, and
    of the squares that directions make.

    usual (2,): mean and deviation of its hand's ratios until then, of judge_hands; ratio: the
    logarithm of its area over the model's; by_direction: its standard deviation, as told
    directions are unsure; passed_s: since the look before.
    """
    if not math.isnan(usual[0]):
        far = _FAR * usual[1]
        ratio = min(max(ratio, usual[0] - far), usual[0] + far)
    kept, weight = math.exp(-passed_s / _MEMORY_S), min(passed_s, _LOOK_S)
    sums[0] = kept * sums[0] + weight
    sums[1] = kept * sums[1] + weight * ratio
    sums[2] = kept * sums[2] + weight * ratio * ratio
    sums[3] = kept * sums[3] + weight * by_direction * by_direction


@njit(cache=True)
def judge_hands(sums: Array, usual: Array, paint: KnownPaint) -> None:
    """What the sums (L, C, 4) of all looks at L tips say of each one's hand; nothing of -1.

    To usual (L, 2) the mean of its ratios, NaN without any, and their deviation; to paint how sure
    its directions are (direction_shares), and how unlike its model it is (shape_sds).
    """
    hands = paint.hands
    for hand in range(hands.max() + 1 if hands.size else 0):
        weight, total, squares, by_direction = 0.0, 0.0, 0.0, 0.0
        for row in range(hands.size):
            if hands[row] == hand:
                for camera in range(sums.shape[1]):
                    weight += sums[row, camera, 0]
                    total += sums[row, camera, 1]
                    squares += sums[row, camera, 2]
                    by_direction += sums[row, camera, 3]
        mean = total / weight if weight > 0.0 else math.nan
        scatter = max(squares - total * mean, 0.0) if weight > 0.0 else 0.0
        variance = (scatter + _GUESS_S * _GUESS**2) / (weight + _GUESS_S)
        told = (by_direction + _GUESS_S * _GUESS**2) / (weight + _GUESS_S)
        share = min(max((variance - _NOISE**2) / told, _LEAST_SHARE), 1.0)
        beyond = variance - max(_USUAL**2, _NOISE**2 + _BY_DIRECTION * told)
        shape_sd = min(_WORTH * math.sqrt(max(beyond, 0.0)), _MOST)
        for row in range(hands.size):
            if hands[row] == hand:
                usual[row, 0], usual[row, 1] = mean, math.sqrt(variance)
                fits = min(max((_UNFIT - paint.misfits[row]) / (_UNFIT - _FITS), 0.0), 1.0)
                paint.direction_shares[row] = math.sqrt(1.0 - fits * (1.0 - share))
                paint.shape_sds[row] = shape_sd
