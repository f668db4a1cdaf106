"""How much smaller a painted tip looks than the pose that points rest on lets expect. Compiled.

A tip's area follows from its distance and from the angle between finger and viewing ray
(visible_paint.py); what hides a tip from all cameras alike shows in nothing else. How the area of
whole paint compares with the model's (longer paint, a darker colour, a thicker finger) is learned
while tracking, as a level of its logarithm that rises fast and falls slowly: what is hidden is
hidden for a short while. Blur and dim light make all tips smaller at once. Rendered tips that show
whole keep that to 3 to 12 % (tuning half, one standard deviation; recorded hands that are not the
tables' to 11 to 26 %).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.paint.known_paint import MOST_UNSURE_RAD, turn_on

# The level's times upwards and downwards. (NEES of tuning captures is the same within 3 % with 3
# and with 30 s downwards.)
_RISE_S, _FALL_S = 0.5, 10.0
# Logarithm of the ratio of areas that says nothing, and how much more for paint whose shape is
# unlike the model's by a radius. (Chosen on the tuning halves of held_out.py and other_renderer.py
# by the likelihood of errors: with .08 it is .015 nats a point less without lag on the latter, and
# the same otherwise.)
_USUAL, _UNLIKE = 0.05, 1.0
# Nearer to the ray that comes along the finger the area changes fast with the angle, and its ratio
# to the model's tells nothing of paint.
_LEAST_ANGLE = math.radians(70.0)


class AreaLook(NamedTuple):
    """A tip's area against its pose. Logarithms; NaN where its direction does not tell."""

    level: float  # of area over expected area of paint that shows whole, learned
    below: float  # how much less shows than that
    ratio: float  # of the area to the model's; also NaN where that changes fast with the angle
    by_direction: float  # standard deviation of that ratio, as the direction is unsure


@njit(cache=True)
def against_pose(
    ray: Array,
    table: Array,
    told: tuple[Array, Array, float],
    sigma_rad: float,
    area: float,
    before: tuple[float, float],
) -> AreaLook:
    """A tip after one more look.

    ray (3,): from the camera to it, m; told: direction (3,), how it turns (3,) rad/s, how long ago,
    s; area: in the rays' units; before: the level, how long ago, s. As it was, and NaN, without a
    place, which is NaN, or without a distance.
    """
    away_m = math.sqrt(ray @ ray)
    if not (away_m > 0.0 and area > 0.0):
        return AreaLook(before[0], math.nan, math.nan, math.nan)
    aim = np.empty(3)
    turn_on(told[0], told[1], told[2], aim)
    cosine = float(ray @ aim) / away_m
    angle = math.acos(min(max(cosine, -1.0), 1.0))
    expected = _expected_areas(table, angle, sigma_rad)
    level, below = _less_than_expected(expected, area * away_m**2, before[0], before[1])
    ratio, by_direction = math.nan, math.nan
    if angle > _LEAST_ANGLE and sigma_rad < MOST_UNSURE_RAD:
        # About one of the direction's two axes: the areas at less and at more of an angle.
        turn = sigma_rad / math.sqrt(2.0)
        less, more = _area(table, angle - turn), _area(table, angle + turn)
        if less > 0.0 and more > 0.0:
            ratio = math.log(area * away_m**2 / _area(table, angle))
            by_direction = 0.5 * math.log(more / less)
    return AreaLook(level, below, ratio, by_direction)


@njit(cache=True)
def _expected_areas(table: Array, angle: float, sigma_rad: float) -> tuple[float, float]:
    """The least and the most that a table (k,) of areas by angle, 0 to pi, says within a sigma."""
    least = most = _area(table, angle)
    for side in (-sigma_rad, sigma_rad):
        area = _area(table, angle + side)
        least, most = min(least, area), max(most, area)
    return least, most


@njit(cache=True)
def _area(table: Array, angle: float) -> float:
    """By angle, 0 to pi, between finger and viewing ray; table (k,) of areas over these."""
    place = min(max(angle, 0.0), math.pi) / math.pi * (table.size - 1)
    k = min(int(place), table.size - 2)
    return float(table[k] + (place - k) * (table[k + 1] - table[k]))


@njit(cache=True)
def _less_than_expected(
    expected: tuple[float, float], area: float, level: float, passed_s: float
) -> tuple[float, float]:
    """The level after one more look at paint; how much less of it shows, as a logarithm.

    expected: the least and the most of _expected_areas; area: as it is seen, in the same units;
    level: before, passed_s ago, NaN at first.
    """
    least, most = expected
    # A finger that points away may hide all of its paint: then nothing is expected.
    if least <= 0.0:
        return level, math.nan
    ratio = math.log(area / most)
    if math.isnan(level):
        level = ratio
    time_s = _RISE_S if ratio > level else _FALL_S
    level += (1.0 - math.exp(-passed_s / time_s)) * (ratio - level)
    return level, level - math.log(area / least)


@njit(cache=True)
def usually_less(less: Array) -> float:
    """By how much all tips of a look are smaller at once, as blur and dim light make them.

    less (n,): of against_pose, NaN where nothing is known. 0 of fewer than three tips.
    """
    known = less[~np.isnan(less)]
    return max(float(np.median(known)), 0.0) if known.size >= 3 else 0.0


@njit(cache=True)
def hidden_share(less: float, shape_sd: float) -> float:
    """The share of paint that must be hidden, 0 to 1; 0 of what is not known.

    shape_sd: how unlike the model's it may be, in radii.
    """
    beyond = less - _USUAL - _UNLIKE * shape_sd
    return 1.0 - math.exp(-beyond) if beyond > 0.0 else 0.0
