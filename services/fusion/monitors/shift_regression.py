"""By how much one camera's clock differs from another's: a robust regression over heights.

A landmark's height in one camera less that in another is its constant error plus the clocks'
difference times its speed. What remains is not white: a detector's errors last for some frames,
neighbouring landmarks share them, and a wrong marker is wrong for seconds. So the variance of what
is found comes from what it leaves, over instants and not over rows, with the correlation between
neighbouring instants; rows that do not fit the others lose their weight. Pure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints

# Rounds of reweighting: from the third on nothing changes that matters.
_ROUNDS = 4
# Rows beyond this many sigmas have no weight (Tukey's biweight: 95 % efficient for white noise).
_TUKEY = 4.7
# Instants, at ten a second, over which residuals are taken to be correlated.
_LAGS = 5
# The least correlation that is assumed, as a factor of the variance: errors correlated by .7 from
# frame to frame at 30 fps are by .34 from instant to instant: (1 + .34) / (1 - .34). Between
# neighbours it shows in the sums over instants.
_CORRELATED = 2.0
# With fewer instants than this a variance from residuals is a guess, and nothing is learned; with
# so many its root is twice as large as the residuals say.
_INSTANTS_MIN, _INSTANTS_GUESS = 3, 4.0
# Residuals as large as announced are noise; what is left beyond is of a kind that nobody announced,
# and counts for up to so many times its variance. With 1, errors of 3 px that last for some frames
# move the clocks of a slow hand (.15 m/s) by 20 ms.
_UNKNOWN_KIND = 12.0
# A landmark that moves by less than so many sigmas of what is left, over the span in which its
# speed was measured, counts as still: noise would pass for motion, and confirm whichever shift is
# looked from (a slow hand under 3 px of lasting errors moved its clocks by 30 ms without this).
_MOVING = 3.0


class Heights(NamedTuple):
    """n height differences of a pair's landmarks at some instants; normalised units, s."""

    instants: Ints  # (n,) number of the instant, ascending by one
    landmarks: Ints  # (n,)
    heights: Array  # (n,) each with the second camera's clock taken to read later by ...
    shifts: Array  # (n,) ... this, s
    speeds: Array  # (n,) of the heights, 1/s
    spans: Array  # (n,) over which speeds were measured, s
    variances: Array  # (n,) of the heights, as far as they are known beforehand
    weights: Array  # (n,) 0 to 1: of older rows less


class Shift(NamedTuple):
    """What a regression found. variance is infinite if nothing is found; then shift_s is 0."""

    shift_s: float  # by how much later the second camera's clock reads
    variance: float  # s^2
    height: float  # the mean constant height difference
    scale: float  # what is left, in the sigmas that were expected


NOTHING = Shift(0.0, math.inf, 0.0, 1.0)


def fit_shift(rows: Heights, near_s: float, height_sigma: float) -> Shift:
    """The shift that explains heights best, searched from near_s.

    height_sigma: of a landmark's constant height difference, before anything is known.
    """
    return Shift(*_fit(Heights._make(map(np.ascontiguousarray, rows)), near_s, height_sigma))


@njit(cache=True)
def _fit(rows: Heights, near_s: float, height_sigma: float) -> tuple[float, float, float, float]:
    """fit_shift of contiguous columns."""
    if len(rows.heights) == 0 or rows.instants[-1] - rows.instants[0] < _INSTANTS_MIN:
        return 0.0, math.inf, 0.0, 1.0
    own = rows.landmarks - rows.landmarks.min()
    ridge = 1.0 / height_sigma**2
    shift_s, scale, speeds = near_s, 1.0, rows.speeds
    weights: Array = rows.weights / rows.variances
    recent = rows.weights > 0.1 * rows.weights.max()
    total: Array = np.empty(0)
    apart, heights, constant = speeds, rows.heights, speeds
    for n in range(_ROUNDS):
        heights = rows.heights + rows.shifts * speeds  # (n,) as if the clocks agreed
        total = np.asarray(np.bincount(own, weights) + ridge)  # (L,)
        constant = np.bincount(own, weights * (heights - shift_s * speeds)) / total
        relative = np.abs(heights - shift_s * speeds - constant[own]) / np.sqrt(rows.variances)
        scale = max(1.0, 1.48 * np.median(relative[recent]))
        fits = np.maximum(1.0 - (relative / (_TUKEY * scale)) ** 2, 0.0) ** 2
        weights = np.asarray(rows.weights * fits / (scale**2 * rows.variances))  # (n,)
        if n:
            noise = scale * np.sqrt(rows.variances)
            speeds = np.where(np.abs(rows.speeds) * rows.spans > _MOVING * noise, rows.speeds, 0.0)
            heights = rows.heights + rows.shifts * speeds
        total = np.asarray(np.bincount(own, weights) + ridge)
        mean_speed = np.bincount(own, weights * speeds) / total
        mean_height = np.bincount(own, weights * heights) / total
        apart = speeds - mean_speed[own]  # (n,)
        information = np.sum(weights * (speeds * apart))
        if not information > 0.0:
            return 0.0, math.inf, _overall(total - ridge, mean_height), scale
        shift_s = np.sum(weights * (heights * apart)) / information
        constant = mean_height - shift_s * mean_speed
    residuals = heights - shift_s * speeds - constant[own]
    variance = _variance(rows.instants, weights * apart * residuals, weights * apart**2)
    variance *= _UNKNOWN_KIND - (_UNKNOWN_KIND - 1.0) / scale
    return shift_s, variance, _overall(total - ridge, constant), scale


@njit(cache=True)
def _overall(known: Array, constant: Array) -> float:
    """The mean of landmarks' constants (L,), by how well they are known."""
    return np.sum(known * constant) / max(known.sum(), 1e-300)


@njit(cache=True)
def _variance(instants: Ints, scores: Array, information: Array) -> float:
    """The variance of a shift, from its rows' scores and information (n,): Newey and West's."""
    numbers = instants - instants[0]
    of_instant = np.bincount(numbers, scores)  # (N,)
    known = np.bincount(numbers, information)  # (N,)
    total = known.sum()
    # Of how many instants it would be if they told alike.
    n = total**2 / np.sum(known * known)
    if n < _INSTANTS_MIN:
        return math.inf
    meat = np.sum(of_instant * of_instant)
    for lag in range(1, min(_LAGS, len(of_instant) - 1) + 1):
        products = np.sum(of_instant[lag:] * of_instant[:-lag])
        meat += 2.0 * (1.0 - lag / (_LAGS + 1.0)) * products
    meat *= (1.0 + _INSTANTS_GUESS / n) ** 2
    return max(meat / total**2, _CORRELATED / total)
