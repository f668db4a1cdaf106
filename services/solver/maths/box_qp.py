"""A tiny convex quadratic programme with bounds: min 1/2 x'Hx + g'x, low <= x <= high.

Primal active set (Nocedal & Wright, Numerical Optimization, algorithm 16.3, for bounds only):
finite for positive definite H, exact, and one Cholesky factorisation where no bound is active. 4
unknowns for a digit, 26 for the hand.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.cholesky import factorise

Integers = npt.NDArray[np.int64]

# State of an unknown: free, held at its low or high bound, or fixed, where the two are equal.
_FREE, _AT_LOW, _AT_HIGH, _FIXED = 0, -1, 1, 2


class Workspace(NamedTuple):
    """Arrays to work in.

    Allocating them anew for each of many small problems costs as much as solving them.
    """

    L: Array  # (n, n) Cholesky factor of the free unknowns
    step: Array  # (n,) step over the free unknowns
    state: Integers  # (n,) of each unknown, as above
    free: Integers  # (n,) indices of the free unknowns


@njit(cache=True)
def workspace(n: int) -> Workspace:
    """A workspace for n unknowns."""
    return Workspace(np.empty((n, n)), np.empty(n), np.empty(n, np.int64), np.empty(n, np.int64))


@njit(cache=True)
def box_qp(H: Array, g: Array, low: Array, high: Array, x: Array, work: Workspace) -> bool:
    """Solve into x (n,); H (n, n) symmetric positive definite, bounds may be infinite.

    Of H only the lower triangle is read. False if H is not definite. x is feasible in any case, and
    never worse than the feasible point nearest to zero.
    """
    n = g.size
    step, state, free = work.step, work.state, work.free
    _start(g, low, high, x, state)
    # Each round holds or releases one unknown; 4n rounds were never used up by 68,000 random
    # problems of 4 or 26 unknowns.
    for _ in range(4 * n + 4):
        count = 0
        for i in range(n):
            if state[i] == _FREE:
                free[count] = i
                count += 1
        if not _newton_step(H, g, x, count, work):
            return False
        length, blocking = _step_length(x, low, high, count, work)
        total = 0.0
        for a in range(count):
            total += abs(step[a])
        # Not a number (from g): nothing moves.
        if not math.isfinite(total):
            return False
        for a in range(count):
            x[free[a]] += length * step[a]
        if blocking >= 0:
            i = free[blocking]
            state[i] = _AT_HIGH if step[blocking] > 0.0 else _AT_LOW
            x[i] = high[i] if state[i] > 0 else low[i]
        else:
            released = _wrong_multiplier(H, g, x, state)
            if released < 0:
                return True
            state[released] = _FREE
    return True


@njit(cache=True)
def _start(g: Array, low: Array, high: Array, x: Array, state: Integers) -> None:
    """Start at the feasible point nearest to zero; hold what the gradient pushes out of a bound."""
    for i in range(g.size):
        x[i] = min(max(0.0, low[i]), high[i])
        state[i] = _FREE
        if high[i] <= low[i]:
            state[i] = _FIXED
        elif x[i] <= low[i] and g[i] > 0.0:
            state[i] = _AT_LOW
        elif x[i] >= high[i] and g[i] < 0.0:
            state[i] = _AT_HIGH


@njit(cache=True)
def _newton_step(H: Array, g: Array, x: Array, count: int, work: Workspace) -> bool:
    """Newton's step of the `count` free unknowns, the others held, into work.step[:count].

    False if H is not definite.
    """
    L, step, free = work.L, work.step, work.free
    for a in range(count):
        for b in range(a + 1):
            L[a, b] = H[free[a], free[b]]
    if not factorise(L, count, 0.0):
        return False
    # Right-hand side: -(g + H x) is the descent at x, so the solution is a step from x.
    # Nearly always it starts at zero, where the gradient is g.
    at_zero = not x.any()
    for a in range(count):
        total = -g[free[a]] if at_zero else -_slope(H, g, x, free[a])
        for k in range(a):
            total -= L[a, k] * step[k]
        step[a] = total * L[a, a]
    # By rows of L, of which processors do several numbers at once.
    for a in range(count - 1, -1, -1):
        step[a] *= L[a, a]
        for k in range(a):
            step[k] -= L[a, k] * step[a]
    return True


@njit(cache=True)
def _slope(H: Array, g: Array, x: Array, i: int) -> float:
    """The gradient g + H x along unknown i, from H's lower triangle."""
    slope = g[i]
    for j in range(i):
        slope += H[i, j] * x[j]
    for j in range(i, x.size):
        slope += H[j, i] * x[j]
    return slope


@njit(cache=True)
def _step_length(
    x: Array, low: Array, high: Array, count: int, work: Workspace
) -> tuple[float, int]:
    """Share of the step, at most 1, that keeps within the bounds, and which free unknown blocks."""
    step, free = work.step, work.free
    length, blocking = 1.0, -1
    for a in range(count):
        i = free[a]
        left = high[i] - x[i] if step[a] > 0.0 else x[i] - low[i]
        if abs(step[a]) * length > left:
            length, blocking = left / abs(step[a]), a
    return length, blocking


@njit(cache=True)
def _wrong_multiplier(H: Array, g: Array, x: Array, state: Integers) -> int:
    """The held unknown whose multiplier has the wrong sign most, or -1."""
    worst, which = 1e-14, -1
    for i in range(g.size):
        if abs(state[i]) == 1:
            slope = _slope(H, g, x, i)
            if slope * state[i] > worst:
                worst, which = slope * state[i], i
    return which
