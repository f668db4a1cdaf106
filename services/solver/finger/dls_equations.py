"""What damped least squares minimises for one digit: its goal, and the normal equations of it.

The residual is the painted point's distance to its target, with the coupling or the last bone's
orientation beside it, and a prior on the angles. Lengths are divided by the digit's own, so that
metres, pixels and people make no difference.

The forward kinematics stand here once more, in the form that the equations need; tests compare them
with services/solver/maths/kinematics.py.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array

# What is asked for: the painted point alone; with the last bone's axes; with last flexion = ratio *
# second flexion.
POSITION, POSE, COUPLED = 0, 1, 2

# The coupling's residual (rad) against the position's (digit lengths). 0.01 costs at most 0.01 mm
# at the tip of a finger whose DIP is 20 deg off the ratio; 0.01 to 0.1 made no difference to the
# iterations.
COUPLING_WEIGHT = 0.01


class Goal(NamedTuple):
    """What one digit is asked for, in its canonical frame."""

    kind: int  # POSITION, POSE or COUPLED
    point: Array  # (3,) in the chain's unit of length
    rotation: Array  # (3, 3) axes of the last bone, for POSE
    # (2, 4) angles to stay near, and how strongly (0: not at all), in digit lengths per radian.
    prior: Array


class Problem(NamedTuple):
    """One digit and its goal, lengths in units of the digit's own."""

    kind: int
    bones: Array  # (2, 3) lengths of the bones; the painted point as Chain.tool
    limits: Array  # (4, 2) as in Chain
    coupling: Array  # (2,) as in Chain
    point: Array  # (3,) as in Goal
    rotation: Array  # (3, 3) as in Goal
    prior: Array  # (2, 4) as in Goal


def tip_goal(kind: int, point: Array, rotation: Array | None = None) -> Goal:
    """A goal without a prior: point (3,) and, for POSE, rotation (3, 3)."""
    return Goal(
        kind,
        np.asarray(point, dtype=np.float64),
        np.eye(3) if rotation is None else rotation,
        np.zeros((2, 4)),
    )


@njit(cache=True, inline="always")
def normal_equations(problem: Problem, q: Array, H: Array, g: Array) -> tuple[float, float]:
    """Fill H (4, 4) and g (4,) at angles q (4,); returns the cost and the distance left.

    H = J'J and g = -J'e, half the gradient of the cost, for e = target - point. J'J and J'e are the
    same in every frame, and in the one that turns with abduction the geometric Jacobian
    (kinematics.tip_jacobian) is nearly empty: d p / d abduction = (z, 0, -x), d p / d flexion_j =
    (0, z_j, -y_j), with (y_j, z_j) from joint j to the point. Inlined by force: see dls_step.py.
    """
    bones, point = problem.bones, problem.point
    s0, c0 = math.sin(q[0]), math.cos(q[0])
    s, c = math.sin(q[1] + q[2] + q[3]), math.cos(q[1] + q[2] + q[3])
    x, y3, z3 = bones[1, 0], c * bones[1, 1] + s * bones[1, 2], c * bones[1, 2] - s * bones[1, 1]
    y2, z2 = y3 - bones[0, 1] * math.sin(q[1] + q[2]), z3 - bones[0, 1] * math.cos(q[1] + q[2])
    y1, z1 = y2 - bones[0, 0] * math.sin(q[1]), z2 - bones[0, 0] * math.cos(q[1])
    ex = c0 * point[0] - s0 * point[2] - x
    ey = point[1] - y1
    ez = s0 * point[0] + c0 * point[2] - z1
    squared_distance = ex * ex + ey * ey + ez * ez
    H[0, 0] = z1 * z1 + x * x
    H[1, 0], H[1, 1] = x * y1, z1 * z1 + y1 * y1
    H[2, 0], H[2, 1], H[2, 2] = x * y2, z1 * z2 + y1 * y2, z2 * z2 + y2 * y2
    H[3, 0], H[3, 1], H[3, 2] = x * y3, z1 * z3 + y1 * y3, z2 * z3 + y2 * y3
    H[3, 3] = z3 * z3 + y3 * y3
    g[0] = x * ez - z1 * ex
    g[1] = y1 * ez - z1 * ey
    g[2] = y2 * ez - z2 * ey
    g[3] = y3 * ez - z3 * ey
    cost = squared_distance
    if problem.kind == POSE:
        u, v, w = rotation_error(problem.rotation, s0, c0, s, c)
        cost += u * u + v * v + w * w
        # The axis of abduction is y, that of the three flexions -x.
        g[0] -= v
        H[0, 0] += 1.0
        for a in range(1, 4):
            g[a] += u
            for b in range(1, a + 1):
                H[a, b] += 1.0
    elif problem.kind == COUPLED:
        cost += _add_coupling(problem.coupling, q, H, g)
    return _add_prior(problem.prior, q, H, g, cost), math.sqrt(squared_distance)


@njit(cache=True)
def rotation_error(
    rotation: Array, s0: float, c0: float, s: float, c: float
) -> tuple[float, float, float]:
    """Rotation vector (rad) from the last bone's axes to rotation (3, 3).

    In the frame that turns with abduction. s0, c0 are sine and cosine of abduction, s, c of the sum
    of flexions. Exact also beyond 90 deg, where the study's differential folds back.
    """
    r = rotation
    # The rotation asked for, seen in the frame that turns with abduction.
    g00, g20 = c0 * r[0, 0] - s0 * r[2, 0], s0 * r[0, 0] + c0 * r[2, 0]
    g01, g21 = c0 * r[0, 1] - s0 * r[2, 1], s0 * r[0, 1] + c0 * r[2, 1]
    g02, g22 = c0 * r[0, 2] - s0 * r[2, 2], s0 * r[0, 2] + c0 * r[2, 2]
    g10, g11, g12 = r[1, 0], r[1, 1], r[1, 2]
    x = g21 * c + g22 * s + g11 * s - g12 * c
    y = g02 * c - g01 * s - g20
    z = g10 - g01 * c - g02 * s
    trace = g00 + g11 * c + g12 * s - g21 * s + g22 * c
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    factor = 0.5 if sine < 1e-9 else 0.5 * math.atan2(sine, 0.5 * (trace - 1.0)) / sine
    return factor * x, factor * y, factor * z


@njit(cache=True)
def _add_coupling(coupling: Array, q: Array, H: Array, g: Array) -> float:
    """Add the equation last flexion = ratio * second flexion; returns its cost."""
    ratio, weight = coupling[0], (COUPLING_WEIGHT * coupling[1]) ** 2
    off = ratio * q[2] - q[3]
    g[2] += weight * ratio * off
    g[3] -= weight * off
    H[2, 2] += weight * ratio * ratio
    H[3, 3] += weight
    H[3, 2] -= weight * ratio
    return weight * off * off


@njit(cache=True)
def _add_prior(prior: Array, q: Array, H: Array, g: Array, cost: float) -> float:
    """Add the prior on the angles and fill H's upper triangle; returns the cost with the prior's.

    The four terms are added to the cost one after the other: their sum would round differently.
    """
    for a in range(4):
        weight = prior[1, a] ** 2
        off = prior[0, a] - q[a]
        cost += weight * off * off
        g[a] -= weight * off
        H[a, a] += weight
        for b in range(a):
            H[b, a] = H[a, b]
    return cost
