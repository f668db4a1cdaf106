"""No joint of what is told moves faster than its landmarks say that it may: corrections glide.

A message can change what is believed of a hand that did not move: noise of a millimetre bends a
straight finger by 20 deg, a tip that comes back turns the palm, a rival wins. That is right, and a
hand that jumps is wrong all the same. So the pose that is told follows the one that is believed,
joint by joint, no faster than a hand moves whose landmarks stay where they are; what the landmarks
themselves moved between two messages is allowed beside that, so real motion is not held back. The
belief is left alone; how far it is away goes into the told covariance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.box_qp import Integers
from services.solver.maths.rotation_vectors import (
    apply_rotation_vector,
    rotation_vector,
    turn_between,
)
from services.solver.whole_hand.hand_estimate import HandEstimate
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS

# How fast the wrist turns and a joint bends at most where no landmark moves. Tuning half of
# benchmarks/solver_jumps.py, recordings with their own bones, eight seeds of noise, jumps: 3 with
# nothing held back, 2 at 400 deg/s of turn, 1 at 300, 0 at 200; bends at 150 deg/s as at 200.
# Errors on simulated gestures, played once to four times as fast: 4.80 deg of flexion and 3.12 of
# orientation without, 4.80 and 3.11 with this.
_TURN_RAD_S, _BEND_RAD_S = np.deg2rad([200.0, 200.0])
# A joint that bends by 1 rad moves its tip by about so much, from the last bone's 20 mm to a whole
# finger's 80. At 20 mm a millimetre of noise at 30 Hz allows for 15 deg.
_LEVER_M = 0.05


class Told(NamedTuple):
    """What was told with a message, and the landmarks that it was told of."""

    estimate: HandEstimate
    names: tuple[str, ...]
    points_m: Array  # (m, 3)

    def then(
        self,
        own: HandEstimate,
        names: tuple[str, ...],
        observations: Observations,
        limits_rad: Array,
        seconds: float,
    ) -> Told:
        """What is told some seconds later, where own is believed; limits_rad (5, 4, 2)."""
        after_m = observations.point_m
        if is_quiet(self.estimate.rotation, self.estimate.angles_rad, own, seconds):
            return Told(own, names, after_m)
        if names == self.names:
            before_m, now_m, digits = self.points_m, after_m, observations.digit
        else:
            now = [n for n, name in enumerate(names) if name in self.names]
            before_m = self.points_m[[self.names.index(names[n]) for n in now]]
            now_m, digits = after_m[now], observations.digit[now]
        seen = before_m, now_m, digits
        return Told(_glided(self.estimate, own, seen, limits_rad, seconds), names, after_m)


@njit(cache=True)
def is_quiet(rotation: Array, angles: Array, own: HandEstimate, seconds: float) -> bool:
    """Whether what is believed (own) is so near to what was told last that nothing is held back.

    rotation (3, 3) and angles (5, 4): of what was told.
    """
    x, y, z = turn_between(rotation, own.rotation)
    most = 0.0
    for row in range(5):
        for k in range(4):
            most = max(most, abs(own.angles_rad[row, k] - angles[row, k]))
    turn = math.sqrt(x * x + y * y + z * z)
    return turn <= _TURN_RAD_S * seconds and most <= _BEND_RAD_S * seconds


@njit(cache=True)
def _glided(
    last: HandEstimate,
    own: HandEstimate,
    seen: tuple[Array, Array, Integers],
    limits: Array,
    seconds: float,
) -> HandEstimate:
    """What is told where own is believed and last was told.

    seen: landmarks (m, 3) of both messages, then and now, and the digit of each, -1 of others.
    """
    move = np.array(turn_between(last.rotation, own.rotation))
    size = math.sqrt(move @ move)
    bend = _BEND_RAD_S * seconds
    turned, left_m = _motion(seen[0], seen[1])
    bends = np.full(5, bend)
    for n in range(left_m.size):
        if seen[2][n] >= 0:
            row = seen[2][n]
            bends[row] = max(bends[row], bend + left_m[n] / _LEVER_M)
    share = min((_TURN_RAD_S * seconds + turned) / max(size, 1e-9), 1.0)
    # What is left of the turn takes the rest with it, as it goes with it in the covariance: so
    # landmarks stay where they were seen.
    rest = np.zeros(UNKNOWNS - 3)
    off = np.empty(UNKNOWNS)
    off[:3] = (1.0 - share) * move
    if share < 1.0:
        by_turn = np.linalg.solve(own.covariance[:3, :3], off[:3])
        for i in range(UNKNOWNS - 3):
            for k in range(3):
                rest[i] -= own.covariance[3 + i, k] * by_turn[k]
    off[3:6] = -rest[:3]
    rotation = apply_rotation_vector(last.rotation, share * move)
    told = np.empty((5, 4))
    for row in range(5):
        for k in range(4):
            before, low, high = last.angles_rad[row, k], limits[row, k, 0], limits[row, k, 1]
            angle = own.angles_rad[row, k] + rest[3 + 4 * row + k]
            angle = before + min(max(angle - before, -bends[row]), bends[row])
            told[row, k] = min(max(angle, low), high)
            off[6 + 4 * row + k] = own.angles_rad[row, k] - told[row, k]
    return HandEstimate(
        rotation,
        own.position_m + rest[:3],
        told,
        own.covariance + np.outer(off, off),
        own.cost,
        own.iterations,
    )


@njit(cache=True)
def _motion(before: Array, after: Array) -> tuple[float, Array]:
    """By how much points (m, 3) turned as one piece (rad), and how far each moved beside that (m,).

    Kabsch 1976.
    """
    m = before.shape[0]
    left = np.zeros(m)
    if m < 3:
        return 0.0, left
    a, b = np.empty((m, 3)), np.empty((m, 3))
    for i in range(3):
        a[:, i] = before[:, i] - before[:, i].mean()
        b[:, i] = after[:, i] - after[:, i].mean()
    H = b.T @ a
    U, _, Vt = np.linalg.svd(H)
    x, y, z = H
    if (
        x[0] * (y[1] * z[2] - y[2] * z[1])
        - x[1] * (y[0] * z[2] - y[2] * z[0])
        + x[2] * (y[0] * z[1] - y[1] * z[0])
    ) < 0.0:
        U[:, 2] *= -1.0
    R = U @ Vt
    for n in range(m):
        u, v, w = a[n]
        for i in range(3):
            left[n] += (b[n, i] - R[i, 0] * u - R[i, 1] * v - R[i, 2] * w) ** 2
    turn = rotation_vector(R)
    return math.sqrt(turn @ turn), np.sqrt(left)
