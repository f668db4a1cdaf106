"""Rigid transforms and quaternions.

Conventions (docs/reference/frames.md): right-handed, metres, radians; quaternions are (w, x, y, z)
with w >= 0; `T_a_from_b` is a (4, 4) matrix with p_a = T_a_from_b @ p_b, so that names cancel:
T_a_from_c = T_a_from_b @ T_b_from_c. Input that is not finite is the caller's error: these
functions neither check nor repair it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def rotation_x(angle_rad: float) -> Array:
    """Rotation about +x by angle_rad; (3, 3)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle_rad: float) -> Array:
    """Rotation about +y by angle_rad; (3, 3)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle_rad: float) -> Array:
    """Rotation about +z by angle_rad; (3, 3)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_from_vector(vector_rad: npt.ArrayLike) -> Array:
    """Rotation by |vector_rad| about its direction (Rodrigues); (3,) -> (3, 3)."""
    vector = np.asarray(vector_rad, dtype=np.float64)
    angle = float(np.sqrt(vector @ vector))
    # Below 1e-12 rad the second-order term is under double precision: the first order is exact.
    cross = skew(vector)
    if angle < 1e-12:
        return np.eye(3) + cross
    return (
        np.eye(3)
        + np.sin(angle) / angle * cross
        + (1.0 - np.cos(angle)) / angle**2 * (cross @ cross)
    )


def vector_from_rotation(rotation: Array) -> Array:
    """The rotation vector of a rotation, of length 0..pi rad; (3, 3) -> (3,).

    Right at 180 deg too.
    """
    w, x, y, z = quaternion_from_rotation(rotation)
    imaginary = np.array([x, y, z])
    norm = float(np.sqrt(imaginary @ imaginary))
    if norm < 1e-12:
        return 2.0 * imaginary
    return 2.0 * np.arctan2(norm, w) / norm * imaginary


def skew(vector: Array) -> Array:
    """The matrix K with K @ u = vector x u; (3,) -> (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternion wxyz with w >= 0 of a rotation; (3, 3) -> (4,).

    Shepperd's method (1978): the largest of the four squared components is the pivot, so no
    division is by a small number, not even at 180 deg where w = 0.
    """
    r = np.asarray(rotation, dtype=np.float64)
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    pivots = np.array([trace, r[0, 0], r[1, 1], r[2, 2]])
    match int(np.argmax(pivots)):
        case 0:
            q = np.array([1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        case 1:
            q = np.array(
                [r[2, 1] - r[1, 2], 1.0 - trace + 2 * r[0, 0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]]
            )
        case 2:
            q = np.array(
                [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], 1.0 - trace + 2 * r[1, 1], r[1, 2] + r[2, 1]]
            )
        case _:
            q = np.array(
                [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1.0 - trace + 2 * r[2, 2]]
            )
    q = q / np.sqrt(q @ q)
    return -q if q[0] < 0.0 else q


def rotation_from_quaternion(orientation_wxyz: npt.ArrayLike) -> Array:
    """Rotation of a quaternion wxyz of any non-zero length; (4,) -> (3, 3)."""
    q = np.asarray(orientation_wxyz, dtype=np.float64)
    w, x, y, z = q / np.sqrt(q @ q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_multiply(a_wxyz: npt.ArrayLike, b_wxyz: npt.ArrayLike) -> Array:
    """Hamilton product a * b with w >= 0; (4,), (4,) -> (4,)."""
    aw, ax, ay, az = np.asarray(a_wxyz, dtype=np.float64)
    bw, bx, by, bz = np.asarray(b_wxyz, dtype=np.float64)
    q = np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )
    return -q if q[0] < 0.0 else q


def transform(rotation: Array, position_m: npt.ArrayLike) -> Array:
    """T (4, 4) from a rotation (3, 3) and a translation (3,) in metres."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = position_m
    return T


def inverse(T_a_from_b: Array) -> Array:
    """T_b_from_a; exact for rigid transforms, (4, 4) -> (4, 4)."""
    R = T_a_from_b[:3, :3].T
    return transform(R, -R @ T_a_from_b[:3, 3])


def apply(T_a_from_b: Array, p_b: npt.ArrayLike) -> Array:
    """Points of frame b in frame a; (..., 3) -> (..., 3)."""
    return np.asarray(p_b, dtype=np.float64) @ T_a_from_b[:3, :3].T + T_a_from_b[:3, 3]


def angle_between(rotation_a: Array, rotation_b: Array) -> float:
    """The angle of the rotation from a to b, 0..pi rad."""
    return float(np.linalg.norm(vector_from_rotation(rotation_a.T @ rotation_b)))
