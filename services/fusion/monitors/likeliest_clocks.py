"""All cameras' clocks from what pairs of them were found to differ by, and what each claims."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# Motion that contradicts the announced clocks by more sigmas than this outweighs them.
_OUTWEIGHS = 4.0
# What residuals explain by chance is not learned: a shift counts for what is beyond so many sigmas.
_CHANCE = 1.3


@njit(cache=True, error_model="numpy")
def likeliest_clocks(told: Array, announced_s: Array, bounds_s: Array) -> tuple[Array, Array]:
    """How late clocks (C,) are, and the covariance (C, C), from what pairs and clocks themselves
    say.

    told (P, 5): two cameras, by how much the second's clock is later, the variance of that, and
    whether it rests on enough to outweigh announced_s (C,); bounds_s (C,).
    """
    cameras = len(announced_s)
    sigmas = announced_s.copy()
    pulled, weighted = np.zeros((cameras, cameras)), np.zeros(cameras)
    for first, second, shift_s, variance, enough in told:
        if not math.isfinite(variance):
            continue
        one, other = int(first), int(second)
        contradicts_s = _OUTWEIGHS * math.sqrt(sigmas[one] ** 2 + sigmas[other] ** 2 + variance)
        if enough and abs(shift_s) > contradicts_s:
            for c in (one, other):
                sigmas[c] = max(sigmas[c], min(0.5 * abs(shift_s), bounds_s[c]))
        beyond = max(1.0 - _CHANCE**2 * variance / max(shift_s**2, variance), 0.0)
        for c, sign in ((one, -1.0), (other, 1.0)):
            weighted[c] += sign * beyond * shift_s / variance
            pulled[c, c] += 1.0 / variance
        pulled[one, other] -= 1.0 / variance
        pulled[other, one] -= 1.0 / variance
    cov = np.linalg.inv(np.diag(1.0 / sigmas**2) + pulled)
    late_s = np.minimum(np.maximum(cov @ weighted, -bounds_s), bounds_s)
    return late_s, np.asarray(cov)
