"""Which way a landmark came lately: hands stop and turn round along their way.

A hand that flaps, claps or taps turns sharply, but hardly sideways. A model that knows so explains
a sharp turn in one view by the way itself, and not by the depth that the other view has not told
yet: across the way it stays calm. The way is a tensor (3, 3), the mean of v v^T over recent
velocities v (m^2/s^2): a straight way has one direction, a curved one a plane, a resting hand none.
Compiled; nothing here raises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.motion_model import Gaussian, Step

# How long a way is remembered. A hand that flaps 1.7 times a second passes a turn in .05 s.
MEMORY_S = 0.15
# A landmark much slower than this may set off in any direction; m/s.
SLOW_M_S = 0.1


@njit(cache=True, error_model="numpy")
def unknown_way(way: Array) -> None:
    """A way (3, 3) of which nothing is known yet: all directions alike; in place."""
    way[:] = np.eye(3) * (SLOW_M_S**2 / 3.0)


@njit(cache=True, error_model="numpy")
def update_way(before: Array, state: Array, dt_s: float, after: Array) -> None:
    """The way (3, 3) dt_s later, with the velocity of a state (9,); written to after (3, 3)."""
    velocity = state[3:6]
    keep = math.exp(-dt_s / MEMORY_S)
    for i in range(3):
        for j in range(3):
            after[i, j] = keep * before[i, j] + (1.0 - keep) * velocity[i] * velocity[j]
        after[i, i] += (1.0 - keep) * SLOW_M_S**2 / 3.0


@njit(cache=True, error_model="numpy")
def add_noise_along(way: Array, step: Step, ratio: float, predicted: Gaussian) -> None:
    """The noise of a step (3, 3) along a way (3, 3), times ratio: to a prediction, in place."""
    Q = step.Q
    scale = ratio / (way[0, 0] + way[1, 1] + way[2, 2])
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for n in range(3):
                    predicted.cov[3 * i + k, 3 * j + n] += scale * Q[i, j] * way[k, n]
