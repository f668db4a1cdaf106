"""A tiny convex quadratic programme with bounds: min 1/2 x'Hx + g'x, low <= x <= high.

Primal active set (Nocedal & Wright, Numerical Optimization, algorithm 16.3, for bounds only):
finite for positive definite H, exact, and one Cholesky where no bound matters. 4 unknowns for a
digit, 26 for the hand. Pure maths: no input is late here.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array

Integers = npt.NDArray[np.int64]


@njit(cache=True)
def _solve_free(
    H: Array, g: Array, x: Array, free: Integers, count: int, L: Array, out: Array
) -> bool:
    """The step over the free unknowns with the others held; out[:count] gets it. False if H is not
    definite.

    L's diagonal holds reciprocals: one division a row.
    """
    for a in range(count):
        i = free[a]
        for b in range(a + 1):
            total = H[i, free[b]]
            for k in range(b):
                total -= L[a, k] * L[b, k]
            if a == b:
                if not total > 0.0:
                    return False
                L[a, a] = 1.0 / math.sqrt(total)
            else:
                L[a, b] = total * L[b, b]
    # Right-hand side: -(g + H x) is the descent at x, so the solution is a step from x.
    for a in range(count):
        i = free[a]
        total = -g[i]
        for j in range(x.size):
            total -= H[i, j] * x[j]
        for k in range(a):
            total -= L[a, k] * out[k]
        out[a] = total * L[a, a]
    for a in range(count - 1, -1, -1):
        total = out[a]
        for k in range(a + 1, count):
            total -= L[k, a] * out[k]
        out[a] = total * L[a, a]
    return True


@njit(cache=True)
def _start(g: Array, low: Array, high: Array, x: Array, held: Integers) -> None:
    """Begin at the feasible point nearest to zero and hold what stands at a bound and is pushed
    outwards.
    """
    for i in range(g.size):
        x[i] = min(max(0.0, low[i]), high[i])
        held[i] = 0
        if high[i] <= low[i]:
            held[i] = 2
        elif x[i] <= low[i] and g[i] > 0.0:
            held[i] = -1
        elif x[i] >= high[i] and g[i] < 0.0:
            held[i] = 1


@njit(cache=True)
def _release(H: Array, g: Array, x: Array, held: Integers) -> int:
    """The held unknown whose multiplier has the wrong sign most, or -1."""
    worst, which = 1e-14, -1
    for i in range(g.size):
        if abs(held[i]) == 1:
            slope = g[i]
            for j in range(g.size):
                slope += H[i, j] * x[j]
            if slope * held[i] > worst:
                worst, which = slope * held[i], i
    return which


@njit(cache=True)
def newton4(H: Array, g: Array, x: Array) -> bool:
    """Minimise 1/2 x'Hx + g'x over four unknowns without bounds: LDL', written out (a third of the
    time of loops).
    """
    d0 = H[0, 0]
    if not d0 > 0.0:
        return False
    r0 = 1.0 / d0
    l10, l20, l30 = H[1, 0] * r0, H[2, 0] * r0, H[3, 0] * r0
    d1 = H[1, 1] - l10 * H[1, 0]
    if not d1 > 0.0:
        return False
    r1 = 1.0 / d1
    c21, c31 = H[2, 1] - l20 * H[1, 0], H[3, 1] - l30 * H[1, 0]
    l21, l31 = c21 * r1, c31 * r1
    d2 = H[2, 2] - l20 * H[2, 0] - l21 * c21
    if not d2 > 0.0:
        return False
    r2 = 1.0 / d2
    c32 = H[3, 2] - l30 * H[2, 0] - l31 * c21
    l32 = c32 * r2
    d3 = H[3, 3] - l30 * H[3, 0] - l31 * c31 - l32 * c32
    if not d3 > 0.0:
        return False
    y0 = -g[0]
    y1 = -g[1] - l10 * y0
    y2 = -g[2] - l20 * y0 - l21 * y1
    y3 = -g[3] - l30 * y0 - l31 * y1 - l32 * y2
    x[3] = y3 / d3
    x[2] = y2 * r2 - l32 * x[3]
    x[1] = y1 * r1 - l21 * x[2] - l31 * x[3]
    x[0] = y0 * r0 - l10 * x[1] - l20 * x[2] - l30 * x[3]
    return True


@njit(cache=True)
def box_qp(
    H: Array, g: Array, low: Array, high: Array, x: Array, room: Array, lists: Integers
) -> bool:
    """Solve into x (n,); H (n, n) symmetric positive definite, bounds may be infinite. False if H
    is not definite.

    x is feasible in any case, and never worse than the feasible point nearest to zero. room (n + 1,
    n) and lists (2, n) are to work in: allocating them anew at each of many small problems costs as
    much as solving them.
    """
    n = g.size
    L, step, held, free = room[:n], room[n], lists[0], lists[1]
    _start(g, low, high, x, held)
    # Each round holds or releases one unknown; 4n rounds were never used up by 68,000 random
    # problems of 4 or 26 unknowns.
    for _ in range(4 * n + 4):
        count = 0
        for i in range(n):
            if held[i] == 0:
                free[count] = i
                count += 1
        if not _solve_free(H, g, x, free, count, L, step):
            return False
        length, block = 1.0, -1
        for a in range(count):
            i = free[a]
            left = high[i] - x[i] if step[a] > 0.0 else x[i] - low[i]
            if abs(step[a]) * length > left:
                length, block = left / abs(step[a]), a
        total = 0.0
        for a in range(count):
            total += abs(step[a])
        # Not a number (from H's upper triangle or g): nothing moves.
        if not math.isfinite(total):
            return False
        for a in range(count):
            x[free[a]] += length * step[a]
        if block >= 0:
            i = free[block]
            held[i] = 1 if step[block] > 0.0 else -1
            x[i] = high[i] if held[i] > 0 else low[i]
        else:
            which = _release(H, g, x, held)
            if which < 0:
                return True
            held[which] = 0
    return True
