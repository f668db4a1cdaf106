"""A hand that moves as one rigid body: landmarks' velocities projected onto such motions.

What a resting hand's model starts from: no landmark of it moves by itself. Compiled.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools
from services.fusion.geometry.normal_equations import invert_symmetric
from services.fusion.kalman.motion.motion_models import centred


@njit(cache=True, error_model="numpy")
def body_projection(x: Array, alive: Bools) -> Array:
    """The projection (3 N, 3 N) of landmarks' velocities onto those of a rigid body."""
    count = alive.shape[0]
    number = np.count_nonzero(alive)
    arms = centred(x, alive)  # (N, 3)
    inertia = np.zeros((3, 3))
    for n in range(count):
        for i in range(3):
            for j in range(3):
                inertia[i, j] -= arms[n, i] * arms[n, j]
            inertia[i, i] += arms[n, 0] ** 2 + arms[n, 1] ** 2 + arms[n, 2] ** 2
    inverse = np.zeros((3, 3))
    if number < 3 or not invert_symmetric(inertia, inverse):
        inverse[:] = 0.0
    projection = np.zeros((3 * count, 3 * count))
    left = np.zeros((3, 3))
    right = np.zeros((3, 3))
    for n in range(count):
        _cross_matrix(arms[n], left)
        for k in range(count):
            if alive[n] and alive[k]:
                _cross_matrix(arms[k], right)
                block = left @ inverse @ right.T
                for i in range(3):
                    block[i, i] += 1.0 / number
                projection[3 * n : 3 * n + 3, 3 * k : 3 * k + 3] = block
    return projection


@njit(cache=True, error_model="numpy")
def _cross_matrix(v: Array, out: Array) -> None:
    """[v]x (3, 3): out @ w = v x w."""
    out[0, 1], out[0, 2] = -v[2], v[1]
    out[1, 0], out[1, 2] = v[2], -v[0]
    out[2, 0], out[2, 1] = -v[1], v[0]


@njit(cache=True, error_model="numpy")
def body_transform(x: Array, alive: Bools) -> Array:
    """T (D, D): T x is the state (D,) whose landmarks move as one rigid body."""
    axes = 3 * alive.shape[0]
    projection = body_projection(x, alive)
    T = np.eye(x.shape[0])
    T[axes : 2 * axes, axes : 2 * axes] = projection
    T[2 * axes : 3 * axes, 2 * axes : 3 * axes] = projection
    return T
