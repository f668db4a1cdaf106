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


class Means(NamedTuple):
    """Of each of L landmarks: weights added up, and weighted means of speeds and heights."""

    weight: Array  # (L,) the ridge that draws means towards 0 included
    speed: Array  # (L,)
    height: Array  # (L,) as if the clocks agreed


NOTHING = Shift(0.0, math.inf, 0.0, 1.0)


def fit_shift(rows: Heights, near_s: float, height_sigma: float) -> Shift:
    """The shift that explains heights best, searched from near_s.

    height_sigma: of a landmark's constant height difference, before anything is known.
    """
    return Shift(
        *fitted_shift(Heights._make(map(np.ascontiguousarray, rows)), near_s, height_sigma)
    )


@njit(cache=True, error_model="numpy")
def fitted_shift(
    rows: Heights, near_s: float, height_sigma: float
) -> tuple[float, float, float, float]:
    """fit_shift of contiguous columns, for kernels: what Shift has."""
    n = len(rows.heights)
    if n == 0 or rows.instants[-1] - rows.instants[0] < _INSTANTS_MIN:
        return 0.0, math.inf, 0.0, 1.0
    own = rows.landmarks - rows.landmarks.min()
    number, ridge = own.max() + 1, 1.0 / height_sigma**2
    sigmas, relative, recent = np.sqrt(rows.variances), np.empty(n), np.empty(n)
    weights, speeds = rows.weights / rows.variances, rows.speeds.copy()
    means = Means(np.empty(number), np.empty(number), np.empty(number))
    constant = np.empty(number)
    least_recent = 0.1 * rows.weights.max()
    shift_s, scale = near_s, 1.0
    for k in range(_ROUNDS):
        _average(rows, own, weights, speeds, ridge, means)
        constant[:] = means.height - shift_s * means.speed
        count = 0
        for i in range(n):
            left = rows.heights[i] + (rows.shifts[i] - shift_s) * speeds[i] - constant[own[i]]
            relative[i] = abs(left) / sigmas[i]
            if rows.weights[i] > least_recent:
                recent[count] = relative[i]
                count += 1
        scale = max(1.0, 1.48 * np.median(recent[:count]))
        for i in range(n):
            fits = max(1.0 - (relative[i] / (_TUKEY * scale)) ** 2, 0.0) ** 2
            weights[i] = rows.weights[i] * fits / (scale * sigmas[i]) ** 2
            if k:
                noise = scale * sigmas[i]
                moves = abs(rows.speeds[i]) * rows.spans[i] > _MOVING * noise
                speeds[i] = rows.speeds[i] if moves else 0.0
        _average(rows, own, weights, speeds, ridge, means)
        information, explained = 0.0, 0.0
        for i in range(n):
            pull = weights[i] * (speeds[i] - means.speed[own[i]])
            information += pull * speeds[i]
            explained += pull * (rows.heights[i] + rows.shifts[i] * speeds[i])
        if not information > 0.0:
            return 0.0, math.inf, _overall(means.weight - ridge, means.height), scale
        shift_s = explained / information
        constant[:] = means.height - shift_s * means.speed
    variance = _variance(rows, own, weights, speeds, means.speed, constant, shift_s)
    variance *= _UNKNOWN_KIND - (_UNKNOWN_KIND - 1.0) / scale
    return shift_s, variance, _overall(means.weight - ridge, constant), scale


@njit(cache=True, error_model="numpy")
def _average(
    rows: Heights, own: Ints, weights: Array, speeds: Array, ridge: float, means: Means
) -> None:
    """Means, filled in place, of rows (n,) whose landmarks are own (n,) from 0."""
    means.weight[:] = ridge
    means.speed[:] = 0.0
    means.height[:] = 0.0
    for i in range(len(own)):
        k = own[i]
        means.weight[k] += weights[i]
        means.speed[k] += weights[i] * speeds[i]
        means.height[k] += weights[i] * (rows.heights[i] + rows.shifts[i] * speeds[i])
    for k in range(len(means.weight)):
        means.speed[k] /= means.weight[k]
        means.height[k] /= means.weight[k]


@njit(cache=True)
def _overall(known: Array, constant: Array) -> float:
    """The mean of landmarks' constants (L,), by how well they are known."""
    return np.sum(known * constant) / max(known.sum(), 1e-300)


@njit(cache=True, error_model="numpy")
def _variance(
    rows: Heights,
    own: Ints,
    weights: Array,
    speeds: Array,
    mean_speeds: Array,
    constant: Array,
    shift_s: float,
) -> float:
    """The variance of a shift, from its rows' scores and information by instant: Newey and West's.

    own, weights, speeds (n,) of the rows; mean_speeds, constant (L,) of the landmarks.
    """
    number = rows.instants[-1] - rows.instants[0] + 1
    scores, known = np.zeros(number), np.zeros(number)
    for i in range(len(own)):
        k, instant = own[i], rows.instants[i] - rows.instants[0]
        apart = speeds[i] - mean_speeds[k]
        left = rows.heights[i] + (rows.shifts[i] - shift_s) * speeds[i] - constant[k]
        scores[instant] += weights[i] * apart * left
        known[instant] += weights[i] * apart**2
    total = known.sum()
    # Of how many instants it would be if they told alike.
    n = total**2 / np.sum(known * known)
    if n < _INSTANTS_MIN:
        return math.inf
    meat = np.sum(scores * scores)
    for lag in range(1, min(_LAGS, number - 1) + 1):
        products = np.sum(scores[lag:] * scores[:-lag])
        meat += 2.0 * (1.0 - lag / (_LAGS + 1.0)) * products
    meat *= (1.0 + _INSTANTS_GUESS / n) ** 2
    return max(meat / total**2, _CORRELATED / total)
