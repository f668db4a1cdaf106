"""Cholesky factorisations for the kernels: a 4x4 Newton step and the inverse of a covariance."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array


@njit(cache=True)
def newton_step4(H: Array, g: Array, x: Array) -> bool:
    """Solve H x = -g for H (4, 4), g (4,) into x (4,): the minimum of 1/2 x'Hx + g'x.

    LDL' written out, in a third of the time of loops. False, and x undefined, where H is not
    positive definite.
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


@njit(cache=True, fastmath={"contract"})
def factorise(L: Array, n: int, least: float) -> bool:
    """The Cholesky factor of a matrix (n, n) whose lower triangle is at the beginning of L, there.

    Its diagonal holds reciprocals: one division a row. False where a pivot is not above `least`,
    which counts as 1e-12. Two rows and two columns at once: four sums that do not wait for each
    other, in 3/5 of the time.
    """
    definite = True
    for a in range(0, n - 1, 2):
        for b in range(0, a, 2):
            p, q, r, s = L[a, b], L[a, b + 1], L[a + 1, b], L[a + 1, b + 1]
            for k in range(b):
                p -= L[a, k] * L[b, k]
                q -= L[a, k] * L[b + 1, k]
                r -= L[a + 1, k] * L[b, k]
                s -= L[a + 1, k] * L[b + 1, k]
            L[a, b], L[a + 1, b] = p * L[b, b], r * L[b, b]
            L[a, b + 1] = (q - L[a, b] * L[b + 1, b]) * L[b + 1, b + 1]
            L[a + 1, b + 1] = (s - L[a + 1, b] * L[b + 1, b]) * L[b + 1, b + 1]
        p, r, s = L[a, a], L[a + 1, a], L[a + 1, a + 1]
        for k in range(a):
            p -= L[a, k] * L[a, k]
            r -= L[a + 1, k] * L[a, k]
            s -= L[a + 1, k] * L[a + 1, k]
        L[a, a] = _reciprocal_root(p, least)
        L[a + 1, a] = r * L[a, a]
        s -= L[a + 1, a] * L[a + 1, a]
        L[a + 1, a + 1] = _reciprocal_root(s, least)
        definite = definite and p > least and s > least
    if n % 2 == 1:
        a = n - 1
        for b in range(n):
            p = L[a, b]
            for k in range(b):
                p -= L[a, k] * L[b, k]
            L[a, b] = p * L[b, b] if b < a else _reciprocal_root(p, least)
        definite = definite and p > least
    return definite


@njit(cache=True)
def _reciprocal_root(pivot: float, least: float) -> float:
    return 1.0 / math.sqrt(pivot) if pivot > least else 1e6


@njit(cache=True, fastmath={"contract"})
def spd_inverse(A: Array) -> Array:
    """Inverse of a symmetric positive definite matrix (n, n).

    A matrix that is not definite is treated as barely so. What follows the factor is added up in
    rows, of which processors do several numbers at once, in 2/3 of the time.
    """
    n = A.shape[0]
    L = np.empty((n, n))
    for a in range(n):
        for b in range(a + 1):
            L[a, b] = A[a, b]
    factorise(L, n, 1e-12)
    M = np.zeros((n, n))  # L^-1
    for a in range(n):
        for k in range(a):
            share = -L[a, k] * L[a, a]
            for b in range(k + 1):
                M[a, b] += share * M[k, b]
        M[a, a] = L[a, a]
    inverse = np.zeros((n, n))  # M'M
    for k in range(n):
        for a in range(k + 1):
            share = M[k, a]
            for b in range(a + 1):
                inverse[a, b] += share * M[k, b]
    for a in range(n):
        for b in range(a):
            inverse[b, a] = inverse[a, b]
    return inverse
