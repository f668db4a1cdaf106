"""Where the landmarks of many frames are for given angles, with derivatives.

All in the wrist frame. A frame's 26 unknowns are a small turn and shift of the wrist (both in the
wrist frame) and the 20 angles; the person's are the measures of hand_parameters.Geometry. Plain
numpy over all frames at once, for a calibration has a hundred: the forward kinematics of rhot.hand
with derivatives, which a test proves to agree with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.hand.hand_parameters import Geometry, Shape

UNKNOWNS = 26
# The joint about whose root each of a chain's angles turns: abduction and first flexion share
# theirs.
_ROOT = (0, 0, 1, 2)


class Marks(NamedTuple):
    """n frames, m landmarks."""

    points: Array  # (n, m, 3)
    J: Array  # (n, m, 3, 26) by a frame's unknowns
    by_measure: Array  # (n, m, 3, measures) by the person's


def marks_of(shape: Shape, measures: Geometry, angles: Array, side: float) -> Marks:
    """Landmarks for angles (n, 5, 4); side +1 right hand, -1 left."""
    n, m = len(angles), len(shape.names)
    roots, axes, frames = _chains(measures, angles, side)
    points = np.empty((n, m, 3))
    J = np.zeros((n, m, 3, UNKNOWNS))
    by_measure = np.zeros((n, m, 3, shape.measures))
    for i, (row, k) in enumerate(shape.places):
        own = by_measure[:, i]
        own[:, :, 60 + 3 * i : 63 + 3 * i] = np.eye(3) if row < 0 else frames[:, row, min(k, 2)]
        if row < 0:
            points[:, i] = measures.offsets[i] + _fixed(measures, row, k, own)
        else:
            p = roots[:, row, k] + frames[:, row, min(k, 2)] @ measures.offsets[i]
            points[:, i] = p
            for a in range(min(k + 2, 4)):
                J[:, i, :, 6 + 4 * row + a] = np.cross(axes[:, row, a], p - roots[:, row, _ROOT[a]])
            for bone in range(k):
                own[:, :, 3 * row + bone] = -frames[:, row, bone, :, 2]
            own[:, :, 15 + 3 * row : 18 + 3 * row] = np.eye(3)
            own[:, :, 45 + 3 * row : 48 + 3 * row] = _cross_columns(p - measures.bases[row])
        J[:, i, :, :3] = _cross_columns(points[:, i])
        J[:, i, :, 3:6] = np.eye(3)
    return Marks(points, J, by_measure)


def _chains(measures: Geometry, angles: Array, side: float) -> tuple[Array, Array, Array]:
    """Roots (n, 5, 4, 3) and axes (n, 5, 4, 3) of the joints, and the bones' frames (n, 5, 3, 3,
    3).
    """
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


def _fixed(measures: Geometry, row: int, k: int, own: Array) -> Array:
    """The joint of a landmark that no angle moves; fills its derivatives."""
    if row == -2:
        own[:, :, 30 + 3 * k : 33 + 3 * k] = np.eye(3)
        return measures.metacarpals[k]
    if k == 0:
        return np.zeros(3)
    # The palm is half way along the middle metacarpal.
    own[:, :, 36:39] = 0.5 * np.eye(3)
    own[:, :, 21:24] = 0.5 * np.eye(3)
    return 0.5 * (measures.metacarpals[2] + measures.bases[2])


def _cross_columns(v: Array) -> Array:
    """Columns e_j x v; (n, 3) -> (n, 3, 3)."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack(
        [np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], axis=2
    )
