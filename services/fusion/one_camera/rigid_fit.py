"""A shape moved as one piece onto points: Gauss-Newton over rotation and translation.

Each point has a covariance of its own. A point that one camera alone sees well is a needle along
that camera's ray, and shapes are put onto needles: six points of a known shape have a depth even
in one picture, by their size in it. Compiled; nothing here raises.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# How far a hand may move and turn between two instants a frame apart, 1 sigma, m and rad: more than
# any does, as points themselves say it well. It keeps a fit of three points in a row in its place.
MOVES_M, TURNS_RAD = 0.2, 1.0


class RigidFit(NamedTuple):
    """How a shape (n, 3) about its centre lies among points; arrays are written in place."""

    centre: Array  # (3,) m
    R: Array  # (3, 3) from the shape as given
    moved: Array  # (6,) translation (m) and rotation vector (rad), summed up over the steps
    information: Array  # (6, 6) of translation and rotation


@njit(cache=True, error_model="numpy")
def start_fit(shape: Array) -> RigidFit:
    """A shape (n, 3) where it was."""
    centre = np.zeros(3)
    for n in range(shape.shape[0]):
        centre += shape[n] / shape.shape[0]
    return RigidFit(centre, np.eye(3), np.zeros(6), np.zeros((6, 6)))


@njit(cache=True, error_model="numpy")
def jacobian(arm: Array, J: Array) -> None:
    """Of a place by translation and rotation, J (3, 6), at arm (3,) from the centre; in place."""
    J[:] = 0.0
    for i in range(3):
        J[i, i] = 1.0
    J[0, 4], J[0, 5] = arm[2], -arm[1]
    J[1, 3], J[1, 5] = -arm[2], arm[0]
    J[2, 3], J[2, 4] = arm[1], -arm[0]


@njit(cache=True, error_model="numpy")
def step_fit(fit: RigidFit, arms: Array, points: Array, weights: Array) -> float:
    """One step; returns the squared distance of shape and points before it, by their weights.

    arms (n, 3): the shape about its centre as it was; points (n, 3); weights (n, 3, 3): the inverse
    covariances of shape and points together.
    """
    information, moved = fit.information, fit.moved
    information[:] = 0.0
    right = np.zeros(6)
    squares = 0.0
    for k in range(6):
        information[k, k] = 1.0 / (MOVES_M**2 if k < 3 else TURNS_RAD**2)
        right[k] = -information[k, k] * moved[k]
        squares += information[k, k] * moved[k] ** 2
    R = fit.R
    arm, apart = np.empty(3), np.empty(3)
    WJ = np.empty((3, 6))
    for n in range(points.shape[0]):
        W = weights[n]
        for i in range(3):
            arm[i] = R[i, 0] * arms[n, 0] + R[i, 1] * arms[n, 1] + R[i, 2] * arms[n, 2]
            apart[i] = points[n, i] - fit.centre[i] - arm[i]
        x, y, z = arm
        for i in range(3):  # by the columns of jacobian(arm)
            WJ[i, 0], WJ[i, 1], WJ[i, 2] = W[i, 0], W[i, 1], W[i, 2]
            WJ[i, 3] = y * W[i, 2] - z * W[i, 1]
            WJ[i, 4] = z * W[i, 0] - x * W[i, 2]
            WJ[i, 5] = x * W[i, 1] - y * W[i, 0]
        for j in range(6):
            for i in range(3):
                information[i, j] += WJ[i, j]
            information[3, j] += y * WJ[2, j] - z * WJ[1, j]
            information[4, j] += z * WJ[0, j] - x * WJ[2, j]
            information[5, j] += x * WJ[1, j] - y * WJ[0, j]
            right[j] += apart[0] * WJ[0, j] + apart[1] * WJ[1, j] + apart[2] * WJ[2, j]
        for i in range(3):
            squares += apart[i] * (W[i, 0] * apart[0] + W[i, 1] * apart[1] + W[i, 2] * apart[2])
    step = right
    _solve(information, step)
    moved += step
    fit.centre[:] += step[:3]
    fit.R[:] = rotation(step[3:]) @ fit.R
    return squares


@njit(cache=True, error_model="numpy")
def _solve(A: Array, b: Array) -> None:
    """The solution of A x = b for a symmetric A (6, 6), positive definite as it has a prior: to b.

    A = L D L^T without roots; a call of LAPACK costs as much as the rest of a step.
    """
    L = np.zeros((6, 6))
    D = np.empty(6)
    for i in range(6):
        D[i] = A[i, i]
        for j in range(i):
            L[i, j] = A[i, j]
            for k in range(j):
                L[i, j] -= L[i, k] * L[j, k] * D[k]
            L[i, j] /= D[j]
            D[i] -= L[i, j] ** 2 * D[j]
            b[i] -= L[i, j] * b[j]
    for i in range(5, -1, -1):
        b[i] /= D[i]
        for j in range(i + 1, 6):
            b[i] -= L[j, i] * b[j]


@njit(cache=True, error_model="numpy")
def rotation(vector: Array) -> Array:
    """The rotation (3, 3) by a rotation vector (3,) (Rodrigues)."""
    angle = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
