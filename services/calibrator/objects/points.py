"""Points of the rig and a tracker's poses at them: the rigid transform with a lever arm. Pure.

A point x of the rig frame that sits at m in the tracker's frame satisfies

    x = R (p + Q m) + t        p, Q: the tracker's pose in the lighthouses' frame
    p = A x + b - Q m          A = R^T, b = -R^T t

The second line is linear in all fifteen unknowns, so the start needs no guess; Gauss-Newton on the
first line then gives least squares in metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array, apply, rotation_from_vector, transform

# Twelve equations for nine unknowns.
MIN_POINTS = 4
# Steps converge quadratically; ten are more than any recording took.
_MAX_STEPS = 20
# Directions of the lever arm that rotations hardly show are left at zero.
_RCOND = 1e-4
# The second largest spread of the points, as a share of the largest, that tells a line.
_MIN_SPREAD = 0.02


@dataclass(frozen=True, eq=False)
class PointRegistration:
    """T_rig_from_lighthouse, the point's place in the tracker's frame, and what is left.

    residuals_m are rig points as the tracker's poses give them, minus those measured.
    """

    T_rig_from_lighthouse: Array  # (4, 4)
    marker_m: Array  # (3,)
    residuals_m: Array  # (n, 3)

    @property
    def rms_m(self) -> float:
        """Root mean square of the residuals' lengths."""
        return float(np.sqrt(np.mean(np.sum(self.residuals_m**2, axis=1))))


def register_points(points_rig: Array, T_lighthouse_from_tracker: Array) -> PointRegistration:
    """The registration from points (n, 3) measured in the rig frame by other means, and the
    tracker's poses (n, 4, 4) at them.

    Plain least squares: all points count alike. Without a turn about two axes the part of the
    lever arm that no pose shows is taken as zero. Raises CalibrationError for fewer than four
    points, or points on a line.
    """
    points = np.asarray(points_rig, dtype=np.float64).reshape(-1, 3)
    poses = np.asarray(T_lighthouse_from_tracker, dtype=np.float64).reshape(-1, 4, 4)
    if len(points) < MIN_POINTS or len(points) != len(poses):
        raise CalibrationError(
            f"{len(points)} points and {len(poses)} poses: as many poses as points are needed, "
            f"{MIN_POINTS} at least"
        )
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[1] <= _MIN_SPREAD * spread[0]:
        raise CalibrationError("all points lie on a line: measure points beside it")
    weight = np.ones(len(points))
    T, marker = closed_form(points, poses[:, :3, 3], poses[:, :3, :3], weight)
    T, marker = least_squares(points, poses[:, :3, 3], poses[:, :3, :3], weight, T, marker)
    at = apply(T, poses[:, :3, 3] + poses[:, :3, :3] @ marker)
    return PointRegistration(T, marker, at - points)


def closed_form(
    points: Array, positions: Array, rotations: Array, weight: Array
) -> tuple[Array, Array]:
    """T_rig_from_lighthouse and marker (3,) from rig points (n, 3), poses and weights (n,).

    The linear solution, its A brought to the nearest rotation (Kabsch), then t and m anew.
    """
    share = weight / weight.sum()
    x0, p0 = share @ points, share @ positions
    Q0 = np.einsum("n,nij->ij", share, rotations)
    x, p, Q = points - x0, positions - p0, rotations - Q0
    root = np.sqrt(share)
    linear = np.zeros((len(x), 3, 12))
    for axis in range(3):
        linear[:, axis, 3 * axis : 3 * axis + 3] = x
    linear[:, :, 9:] = -Q
    left = (linear * root[:, None, None]).reshape(-1, 12)
    found = np.linalg.lstsq(left, (p * root[:, None]).reshape(-1), rcond=_RCOND)[0]
    U, _, Vt = np.linalg.svd(found[:9].reshape(3, 3))
    A = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    lever = (-Q * root[:, None, None]).reshape(-1, 3)
    marker = np.linalg.lstsq(lever, ((p - x @ A.T) * root[:, None]).reshape(-1), rcond=_RCOND)[0]
    R = A.T
    return transform(R, x0 - R @ (p0 + Q0 @ marker)), marker


def least_squares(
    points: Array, positions: Array, rotations: Array, weight: Array, T: Array, marker: Array
) -> tuple[Array, Array]:
    """The same by Gauss-Newton from a start: the least weighted squares in metres."""
    root = np.sqrt(weight / weight.sum())
    for _ in range(_MAX_STEPS):
        at = positions + rotations @ marker
        centre = root**2 @ at
        turned = (at - centre) @ T[:3, :3].T
        miss = points - (turned + T[:3, :3] @ centre + T[:3, 3])
        J = np.zeros((len(points), 3, 9))
        J[:, :, :3] = -cross_matrices(turned)
        J[:, :, 3:6] = np.eye(3)
        J[:, :, 6:] = T[:3, :3] @ rotations
        step = np.linalg.lstsq(
            (J * root[:, None, None]).reshape(-1, 9),
            (miss * root[:, None]).reshape(-1),
            rcond=_RCOND,
        )[0]
        R = rotation_from_vector(step[:3]) @ T[:3, :3]
        T = transform(R, T[:3, :3] @ centre + T[:3, 3] + step[3:6] - R @ centre)
        marker = marker + step[6:]
        if float(np.abs(step).max()) < 1e-10:
            break
    return T, marker


def cross_matrices(vectors: Array) -> Array:
    """K (n, 3, 3) with K @ u = vector x u, of vectors (n, 3)."""
    K = np.zeros((len(vectors), 3, 3))
    K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    return np.asarray(K - K.transpose(0, 2, 1))
