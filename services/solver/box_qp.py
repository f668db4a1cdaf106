"""A tiny convex quadratic programme with bounds: min 1/2 x'Hx + g'x, low <= x <= high.

Primal active set (Nocedal & Wright, Numerical Optimization, algorithm 16.3, for bounds only): finite for positive definite H,
exact, and one Cholesky where no bound matters. 4 unknowns for a digit, 26 for the hand. Pure maths: no input is late here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.transforms import Array

Integers = npt.NDArray[np.int64]


class Scratch(NamedTuple):
    """Room to work in for n unknowns; allocating it anew at each of many small problems would cost as much as solving them."""

    L: Array  # (n, n)
    step: Array  # (n,)
    held: Integers  # (n,)
    free: Integers  # (n,)


@njit(cache=True)
def scratch(n: int) -> Scratch:
    """Room for n unknowns."""
    return Scratch(np.empty((n, n)), np.empty(n), np.empty(n, np.int64), np.empty(n, np.int64))


@njit(cache=True)
def _solve_free(H: Array, g: Array, x: Array, free: Integers, count: int, L: Array, out: Array) -> bool:
    """Minimise over the free unknowns with the others held; out[:count] gets their values. False if H is not definite."""
    for a in range(count):
        i = free[a]
        for b in range(a + 1):
            total = H[i, free[b]]
            for k in range(b):
                total -= L[a, k] * L[b, k]
            if a == b:
                if not total > 0.0:
                    return False
                L[a, a] = math.sqrt(total)
            else:
                L[a, b] = total / L[b, b]
    # Right-hand side: -(g + H x) is the descent at x, so the solution is a step from x.
    for a in range(count):
        i = free[a]
        total = -g[i]
        for j in range(x.size):
            total -= H[i, j] * x[j]
        for k in range(a):
            total -= L[a, k] * out[k]
        out[a] = total / L[a, a]
    for a in range(count - 1, -1, -1):
        total = out[a]
        for k in range(a + 1, count):
            total -= L[k, a] * out[k]
        out[a] = total / L[a, a]
    return True


@njit(cache=True)
def _start(g: Array, low: Array, high: Array, x: Array, held: Integers) -> None:
    """Begin at the feasible point nearest to zero and hold what stands at a bound and is pushed outwards."""
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
        if held[i] == 1 or held[i] == -1:
            slope = g[i]
            for j in range(g.size):
                slope += H[i, j] * x[j]
            wrong = slope * held[i]
            if wrong > worst:
                worst, which = wrong, i
    return which


@njit(cache=True)
def box_qp(H: Array, g: Array, low: Array, high: Array, x: Array, room: Scratch) -> bool:
    """Solve into x (n,); H (n, n) symmetric positive definite, bounds may be infinite. False if H is not definite.

    x is feasible in any case, and never worse than the feasible point nearest to zero.
    """
    n, held, free, L, step = g.size, room.held, room.free, room.L, room.step
    _start(g, low, high, x, held)
    # Each round holds or releases one unknown; 4n rounds were never used up by 1e6 random problems of 4 and 26 unknowns.
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
        for a in range(count):
            x[free[a]] += length * step[a]
        if block >= 0:
            i = free[block]
            held[i] = 1 if step[block] > 0.0 else -1
            x[i] = high[i] if held[i] == 1 else low[i]
        else:
            which = _release(H, g, x, held)
            if which < 0:
                return True
            held[which] = 0
    return True
