"""Residuals of the whole-hand problem and their normal equations: observed landmarks and the prior.

The 26 unknowns are the wrist's rotation (a rotation vector about the rig's axes) and position, then
the angles of the five digits. A landmark's residual is its distance whitened by its covariance: in
standard deviations, and the same however the rig's axes lie.

Functions that take a tuple of arrays are inlined by force, as in finger/dls_step.py: calls that
count references cost a tenth of the fit's time. Vectors of three are written out: a slice or a
product with `@` costs more than its nine products. Sums may be fused and added up in another order
(`FUSED`): over 2,500 messages no pose was moved by more than 1e-12 rad or m.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.chains import CHAINS, HandChains
from services.solver.maths.kinematics import FUSED, DigitFrames, digit_frames
from services.solver.maths.rotation_vectors import turn_between, turned
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.priors.motion_prior import UNKNOWNS, PosePrior

# Standard deviations beyond which a landmark counts linearly (Huber): a millimetre-accurate one
# that is 5 mm off is no longer noise but may still be a bone measured short.
_HUBER_SIGMAS = 5.0


class Pose(NamedTuple):
    """The hand's pose, as arrays that the fit changes in place."""

    rotation: Array  # (3, 3) wrist in the rig frame
    position_m: Array  # (3,)
    angles: Array  # (5, 4) rad


class NormalEquations(NamedTuple):
    """Gauss-Newton's matrix and gradient (half the cost's), of the residuals weighed."""

    H: Array  # (26, 26) its lower triangle; what is above is not kept up
    g: Array  # (26,)


@njit(cache=True, fastmath=FUSED)
def normal_equations(
    chains: HandChains,
    observations: Observations,
    prior: PosePrior,
    pose: Pose,
    normal: NormalEquations,
) -> float:
    """Fill H and g of the whole problem at a pose; returns the cost.

    The cost is the sum of squares in standard deviations, with Huber's.
    """
    cost = _begin_with_prior(prior, pose, normal)
    frames = digit_frames(chains, pose.angles)
    jacobian = np.empty((3, 10))
    for n in range(observations.joint.size):
        error = whitened(frames, observations, n, pose, jacobian)
        cost += _add_observation(observations, n, jacobian, error, normal)
    return cost


@njit(cache=True, inline="always")
def whitened(
    frames: DigitFrames, observations: Observations, n: int, pose: Pose, J: Array
) -> tuple[float, float, float]:
    """The error of one landmark, and its Jacobian into J (3, 10), both in standard deviations.

    J is by rotation, position and the angles of its digit that move it, as many as its depth.
    """
    R, W, row = pose.rotation, observations.whitening, observations.digit[n]
    offset = observations.offset_m
    px, py, pz = offset[n, 0], offset[n, 1], offset[n, 2]
    if row >= 0:
        k = 0
        while CHAINS[row, k] != observations.joint[n]:
            k += 1
        F = frames.rotations
        u = F[row, k, 0, 0] * px + F[row, k, 0, 1] * py + F[row, k, 0, 2] * pz
        v = F[row, k, 1, 0] * px + F[row, k, 1, 1] * py + F[row, k, 1, 2] * pz
        w = F[row, k, 2, 0] * px + F[row, k, 2, 1] * py + F[row, k, 2, 2] * pz
        # Not by other names: those of the frames' arrays would be counted as references.
        px, py = u + frames.roots_m[row, k, 0], v + frames.roots_m[row, k, 1]
        pz = w + frames.roots_m[row, k, 2]
    w00, w11, w22 = W[n, 0, 0], W[n, 1, 1], W[n, 2, 2]
    w10, w20, w21 = W[n, 1, 0], W[n, 2, 0], W[n, 2, 1]
    # From the wrist to the landmark, rig axes; turning moves it by e x arm.
    x, y, z = turned(R, px, py, pz)
    J[0, 0], J[1, 0], J[2, 0] = 0.0, -w11 * z, w22 * y - w21 * z
    J[0, 1], J[1, 1], J[2, 1] = w00 * z, w10 * z, w20 * z - w22 * x
    J[0, 2], J[1, 2], J[2, 2] = -w00 * y, w11 * x - w10 * y, w21 * x - w20 * y
    J[0, 3], J[1, 3], J[2, 3] = w00, w10, w20
    J[0, 4], J[1, 4], J[2, 4] = 0.0, w11, w21
    J[0, 5], J[1, 5], J[2, 5] = 0.0, 0.0, w22
    x += pose.position_m[0] - observations.point_m[n, 0]
    y += pose.position_m[1] - observations.point_m[n, 1]
    z += pose.position_m[2] - observations.point_m[n, 2]
    e0, e1, e2 = w00 * x, w10 * x + w11 * y, w20 * x + w21 * y + w22 * z
    for a in range(observations.depth[n]):
        # Axis x lever arm. Abduction and the first flexion turn about the same root.
        o = max(a - 1, 0)
        u, v = px - frames.roots_m[row, o, 0], py - frames.roots_m[row, o, 1]
        w = pz - frames.roots_m[row, o, 2]
        x, y, z = frames.axes[row, a, 0], frames.axes[row, a, 1], frames.axes[row, a, 2]
        x, y, z = turned(R, y * w - z * v, z * u - x * w, x * v - y * u)
        J[0, 6 + a], J[1, 6 + a] = w00 * x, w10 * x + w11 * y
        J[2, 6 + a] = w20 * x + w21 * y + w22 * z
    return e0, e1, e2


@njit(cache=True, inline="always")
def _add_observation(
    observations: Observations,
    n: int,
    J: Array,
    error: tuple[float, float, float],
    normal: NormalEquations,
) -> float:
    """Add a landmark's normal equations, from its whitened Jacobian and error; returns its cost."""
    H, g = normal.H, normal.g
    e0, e1, e2 = error
    square = e0 * e0 + e1 * e1 + e2 * e2
    distance = math.sqrt(square)
    weight = 1.0 if distance <= _HUBER_SIGMAS else _HUBER_SIGMAS / distance
    for a in range(6):
        x, y, z = weight * J[0, a], weight * J[1, a], weight * J[2, a]
        g[a] += x * e0 + y * e1 + z * e2
        for b in range(a + 1):
            H[a, b] += x * J[0, b] + y * J[1, b] + z * J[2, b]
    # Where its digit's angles are among the unknowns.
    first = 6 + 4 * observations.digit[n]
    for a in range(observations.depth[n]):
        x, y, z = weight * J[0, 6 + a], weight * J[1, 6 + a], weight * J[2, 6 + a]
        g[first + a] += x * e0 + y * e1 + z * e2
        for b in range(6):
            H[first + a, b] += x * J[0, b] + y * J[1, b] + z * J[2, b]
        for b in range(a + 1):
            H[first + a, first + b] += x * J[0, 6 + b] + y * J[1, 6 + b] + z * J[2, 6 + b]
    return square if distance <= _HUBER_SIGMAS else _HUBER_SIGMAS * (2.0 * distance - _HUBER_SIGMAS)


@njit(cache=True, fastmath=FUSED)
def _begin_with_prior(prior: PosePrior, pose: Pose, normal: NormalEquations) -> float:
    """Fill H and g with the prior's information and gradient; returns its cost."""
    H, g, off = normal.H, normal.g, np.empty(UNKNOWNS)
    off[0], off[1], off[2] = turn_between(prior.rotation, pose.rotation)
    for i in range(3):
        off[3 + i] = pose.position_m[i] - prior.position_m[i]
    for a in range(20):
        off[6 + a] = pose.angles[a // 4, a % 4] - prior.angles[a // 4, a % 4]
    cost = 0.0
    for a in range(UNKNOWNS):
        slope = 0.0
        for b in range(UNKNOWNS):
            H[a, b] = prior.information[a, b]
            slope += H[a, b] * off[b]
        g[a] = slope
        cost += slope * off[a]
    return cost
