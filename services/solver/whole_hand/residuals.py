"""Residuals of the whole-hand problem and their normal equations: observed landmarks and the prior.

The 26 unknowns are the wrist's rotation (a rotation vector about the rig's axes) and position, then
the angles of the five digits. A landmark's residual is its distance whitened by its covariance: in
standard deviations, and the same however the rig's axes lie.

Functions that take a tuple of arrays are inlined by force, as in finger/dls_step.py: calls that
count references cost a tenth of the fit's time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.solver.maths.box_qp import Integers
from services.solver.maths.chains import CHAINS, HandChains
from services.solver.maths.kinematics import DigitFrames, digit_frames
from services.solver.maths.rotation_vectors import rotation_vector
from services.solver.whole_hand.landmarks import Observations
from services.solver.whole_hand.motion_prior import UNKNOWNS, PosePrior

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

    H: Array  # (26, 26)
    g: Array  # (26,)


@njit(cache=True)
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
    H, g = normal.H, normal.g
    H[:] = 0.0
    g[:] = 0.0
    cost = 0.0
    frames = digit_frames(chains, pose.angles)
    columns = np.arange(10, dtype=np.int64)
    p, J = np.empty(3), np.empty((3, 4))
    point, jacobian = np.empty(3), np.empty((3, 10))
    for index in range(observations.joint.size):
        depth = _wrist_point(frames, observations, index, p, J, columns)
        arm = pose.rotation @ p
        _rig_jacobian(pose.rotation, arm, J, depth, jacobian)
        for i in range(3):
            point[i] = arm[i] + pose.position_m[i]
        cost += _add_observation(observations, index, point, jacobian, columns[: 6 + depth], normal)
    for a in range(UNKNOWNS):
        for b in range(a):
            H[b, a] = H[a, b]
    return cost + _add_prior(prior, pose, normal)


@njit(cache=True, inline="always")
def _wrist_point(
    frames: DigitFrames,
    observations: Observations,
    index: int,
    p: Array,
    J: Array,
    columns: Integers,
) -> int:
    """One landmark in the wrist frame, p (3,), and its Jacobian J (3, 4) by its digit's angles.

    Returns how many of the angles move it; columns[6:] gets their places among the unknowns.
    """
    row, depth = observations.digit[index], observations.depth[index]
    if row < 0:
        p[:] = observations.offset_m[index]
        return depth
    k = 0
    while CHAINS[row, k] != observations.joint[index]:
        k += 1
    offset, F, root = observations.offset_m[index], frames.rotations[row, k], frames.roots_m[row, k]
    for i in range(3):
        p[i] = root[i] + F[i, 0] * offset[0] + F[i, 1] * offset[1] + F[i, 2] * offset[2]
    for a in range(depth):
        columns[6 + a] = 6 + 4 * row + a
        # Axis x lever arm. Abduction and the first flexion turn about the same root.
        x, y, z = frames.axes[row, a]
        origin = frames.roots_m[row, max(a - 1, 0)]
        u, v, w = p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]
        J[0, a], J[1, a], J[2, a] = y * w - z * v, z * u - x * w, x * v - y * u
    return depth


@njit(cache=True)
def _rig_jacobian(R: Array, arm: Array, J: Array, depth: int, out: Array) -> None:
    """Fill out (3, 10) with the derivative of a landmark in the rig frame.

    By rotation, position and the first `depth` angles of its digit. arm (3,): from the wrist to the
    landmark, rig axes; J (3, 4): by the angles, wrist frame.
    """
    # Rotation: e x arm.
    out[:, :6] = 0.0
    out[0, 1], out[0, 2] = arm[2], -arm[1]
    out[1, 0], out[1, 2] = -arm[2], arm[0]
    out[2, 0], out[2, 1] = arm[1], -arm[0]
    for i in range(3):
        out[i, 3 + i] = 1.0
        for a in range(depth):
            out[i, 6 + a] = R[i, 0] * J[0, a] + R[i, 1] * J[1, a] + R[i, 2] * J[2, a]


@njit(cache=True, inline="always")
def _add_observation(
    observations: Observations,
    index: int,
    point: Array,
    jacobian: Array,
    columns: Integers,
    normal: NormalEquations,
) -> float:
    """Add one landmark's normal equations, lower triangle of H; returns its Huber cost.

    point (3,): where the pose puts it, rig frame; jacobian (3, 10) of it by the unknowns `columns`,
    whitened here in place.
    """
    W = observations.whitening[index]
    e = np.empty(3)
    square = 0.0
    for i in range(2, -1, -1):
        e[i] = 0.0
        for k in range(i + 1):
            e[i] += W[i, k] * (point[k] - observations.point_m[index, k])
        square += e[i] * e[i]
        # From the last row up: those above are still as they came.
        for a in range(columns.size):
            jacobian[i, a] *= W[i, i]
            for k in range(i):
                jacobian[i, a] += W[i, k] * jacobian[k, a]
    distance = math.sqrt(square)
    weight = 1.0 if distance <= _HUBER_SIGMAS else _HUBER_SIGMAS / distance
    for i in range(3):
        for a in range(columns.size):
            ga = weight * jacobian[i, a]
            normal.g[columns[a]] += ga * e[i]
            for b in range(a + 1):
                normal.H[columns[a], columns[b]] += ga * jacobian[i, b]
    return square if distance <= _HUBER_SIGMAS else _HUBER_SIGMAS * (2.0 * distance - _HUBER_SIGMAS)


@njit(cache=True, inline="always")
def _add_prior(prior: PosePrior, pose: Pose, normal: NormalEquations) -> float:
    """Add the prior's information and gradient; returns its cost."""
    off = np.empty(UNKNOWNS)
    off[:3] = rotation_vector(pose.rotation @ prior.rotation.T)
    off[3:6] = pose.position_m - prior.position_m
    off[6:] = (pose.angles - prior.angles).ravel()
    gradient = prior.information @ off
    normal.H[:] += prior.information
    normal.g[:] += gradient
    return float(off @ gradient)
