"""Least squares of a 3D point by normal equations A x = b, A symmetric (3, 3), b (3,); compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array


@njit(cache=True, error_model="numpy")
def add_equation(row: Array, value: float, A: Array, b: Array) -> None:
    """Add the equation row x = value, row (3,), to A (3, 3) and b (3,) in place."""
    for i in range(3):
        b[i] += row[i] * value
        for j in range(3):
            A[i, j] += row[i] * row[j]


@njit(cache=True, error_model="numpy")
def solve_symmetric(A: Array, b: Array, x: Array) -> bool:
    """The solution (3,) to x; False if A is singular to working precision."""
    A_inverse = np.empty((3, 3))
    if not invert_symmetric(A, A_inverse):
        return False
    multiply(A_inverse, b, x)
    return True


@njit(cache=True, error_model="numpy")
def multiply(A_inverse: Array, b: Array, x: Array) -> None:
    """A^-1 b (3,) to x: the solution where the inverse is needed as well, for the covariance."""
    for i in range(3):
        x[i] = A_inverse[i, 0] * b[0] + A_inverse[i, 1] * b[1] + A_inverse[i, 2] * b[2]


@njit(cache=True, error_model="numpy")
def invert_symmetric(A: Array, out: Array) -> bool:
    """Inverse of a symmetric (3, 3) by cofactors; False if it is singular to working precision."""
    c00 = A[1, 1] * A[2, 2] - A[1, 2] * A[1, 2]
    c01 = A[0, 2] * A[1, 2] - A[0, 1] * A[2, 2]
    c02 = A[0, 1] * A[1, 2] - A[0, 2] * A[1, 1]
    determinant = A[0, 0] * c00 + A[0, 1] * c01 + A[0, 2] * c02
    # Two cameras 75 mm apart looking 2 m away give 1e-3 of the bound; parallel rays 1e-17.
    if not determinant > 1e-12 * A[0, 0] * A[1, 1] * A[2, 2]:
        return False
    out[0, 0] = c00
    out[0, 1] = c01
    out[0, 2] = c02
    out[1, 1] = A[0, 0] * A[2, 2] - A[0, 2] * A[0, 2]
    out[1, 2] = A[0, 1] * A[0, 2] - A[0, 0] * A[1, 2]
    out[2, 2] = A[0, 0] * A[1, 1] - A[0, 1] * A[0, 1]
    out[1, 0] = out[0, 1]
    out[2, 0] = out[0, 2]
    out[2, 1] = out[1, 2]
    out /= determinant
    return True
