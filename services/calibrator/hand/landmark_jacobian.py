"""Forward kinematics of the painted landmarks, with Jacobians, for many frames at once.

All in the wrist frame. A frame's 26 unknowns are a small rotation and shift of the wrist (both in
the wrist frame) and the 20 angles; the hand's are the measures of HandGeometry. Plain numpy over
all frames at once, for a calibration has a hundred: the forward kinematics of rhot.hand with
derivatives, which a test proves to agree with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.hand_parameters import (
    BASE_ROWS,
    METACARPAL_ROWS,
    OFFSET_ROWS,
    ROTATION_ROWS,
    HandGeometry,
    HandParameters,
    triple,
)

# Of a frame: rotation (3) and shift (3) of the wrist, 20 angles.
POSE_UNKNOWNS, FIRST_ANGLE = 26, 6
# The joint about whose root each of a chain's angles rotates: abduction and first flexion share
# theirs.
_ROOT = (0, 0, 1, 2)


class Landmarks(NamedTuple):
    """Landmarks of n frames, m each, and their Jacobians."""

    points: Array  # (n, m, 3)
    by_pose: Array  # (n, m, 3, 26), by a frame's unknowns
    by_measure: Array  # (n, m, 3, measures), by the hand's


def landmarks_of(
    parameters: HandParameters, measures: HandGeometry, angles: Array, side: float
) -> Landmarks:
    """Landmarks for angles (n, 5, 4); side +1 right hand, -1 left."""
    n, m = len(angles), len(parameters.names)
    roots, axes, frames = _chains(measures, angles, side)
    points = np.empty((n, m, 3))
    by_pose = np.zeros((n, m, 3, POSE_UNKNOWNS))
    by_measure = np.zeros((n, m, 3, parameters.measures))
    for i, (row, k) in enumerate(parameters.joint_of):
        own = by_measure[:, i]
        own[:, :, triple(OFFSET_ROWS, i)] = np.eye(3) if row < 0 else frames[:, row, min(k, 2)]
        if row < 0:
            points[:, i] = measures.offsets[i] + _fixed(measures, row, k, own)
        else:
            p = roots[:, row, k] + frames[:, row, min(k, 2)] @ measures.offsets[i]
            points[:, i] = p
            for a in range(min(k + 2, 4)):
                lever = p - roots[:, row, _ROOT[a]]
                by_pose[:, i, :, FIRST_ANGLE + 4 * row + a] = _cross(axes[:, row, a], lever)
            for bone in range(k):
                own[:, :, 3 * row + bone] = -frames[:, row, bone, :, 2]
            own[:, :, triple(BASE_ROWS, row)] = np.eye(3)
            own[:, :, triple(ROTATION_ROWS, row)] = _cross_columns(p - measures.bases[row])
        by_pose[:, i, :, :3] = _cross_columns(points[:, i])
        by_pose[:, i, :, 3:6] = np.eye(3)
    return Landmarks(points, by_pose, by_measure)


def _chains(measures: HandGeometry, angles: Array, side: float) -> tuple[Array, Array, Array]:
    """Roots and axes of the joints, both (n, 5, 4, 3), and the bones' frames (n, 5, 3, 3, 3)."""
    n = len(angles)
    roots, axes, frames = np.empty((n, 5, 4, 3)), np.empty((n, 5, 4, 3)), np.empty((n, 5, 3, 3, 3))
    for row in range(5):
        s, c = np.sin(side * angles[:, row, 0, None]), np.cos(angles[:, row, 0, None])
        x, y, z = measures.rotations[row].T
        bone = np.stack([c * x - s * z, np.broadcast_to(y, (n, 3)), s * x + c * z], axis=2)
        axes[:, row, 0], roots[:, row, 0] = side * y, measures.bases[row]
        for k in range(3):
            s, c = np.sin(angles[:, row, k + 1, None]), np.cos(angles[:, row, k + 1, None])
            x, y, z = bone[:, :, 0], bone[:, :, 1], bone[:, :, 2]
            axes[:, row, k + 1] = -x
            bone = np.stack([x, c * y - s * z, s * y + c * z], axis=2)
            frames[:, row, k] = bone
            roots[:, row, k + 1] = roots[:, row, k] - measures.lengths[row, k] * bone[:, :, 2]
    return roots, axes, frames


def _fixed(measures: HandGeometry, row: int, k: int, own: Array) -> Array:
    """The joint (3,) of a landmark that no angle moves; fills its derivatives own."""
    if row == -2:
        own[:, :, triple(METACARPAL_ROWS, k)] = np.eye(3)
        return measures.metacarpals[k]
    if k == 0:
        return np.zeros(3)
    # The palm is half way along the middle metacarpal.
    own[:, :, triple(METACARPAL_ROWS, 2)] = 0.5 * np.eye(3)
    own[:, :, triple(BASE_ROWS, 2)] = 0.5 * np.eye(3)
    return 0.5 * (measures.metacarpals[2] + measures.bases[2])


def _cross(a: Array, b: Array) -> Array:
    """a x b; (n, 3), (n, 3) -> (n, 3). With numpy's an estimate takes twice as long."""
    product = np.empty_like(b)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        product[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return product


def _cross_columns(v: Array) -> Array:
    """Columns e_j x v; (n, 3) -> (n, 3, 3)."""
    columns = np.zeros((len(v), 3, 3))
    x, y, z = v.T
    columns[:, 1, 0], columns[:, 2, 0], columns[:, 2, 1] = -z, y, -x
    columns[:, 0, 1], columns[:, 0, 2], columns[:, 1, 2] = z, -y, x
    return columns
