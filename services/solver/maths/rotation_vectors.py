"""Rotation vectors for the kernels: exponential and logarithm of SO(3).

rhot/geometry/transforms.py has the same maths for plain code; numba cannot call it. Kept apart, and
proven to agree by tests/services/solver/maths/test_rotation_vectors.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array


@njit(cache=True)
def apply_rotation_vector(R: Array, v: Array) -> Array:
    """exp(v) R for a rotation vector v (3,) rad in the frame that R (3, 3) leads to; (3, 3).

    Rodrigues' formula, with its series below 1e-4 rad.
    """
    angle = math.sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    a = 1.0 - angle * angle / 6.0 if angle < 1e-4 else math.sin(angle) / angle
    b = 0.5 - angle * angle / 24.0 if angle < 1e-4 else (1.0 - math.cos(angle)) / (angle * angle)
    x, y, z = v[0], v[1], v[2]
    out = np.empty((3, 3))
    for k in range(3):
        p, q, r = R[0, k], R[1, k], R[2, k]
        out[0, k] = (
            (1.0 - b * (y * y + z * z)) * p + (b * x * y - a * z) * q + (b * x * z + a * y) * r
        )
        out[1, k] = (
            (b * x * y + a * z) * p + (1.0 - b * (x * x + z * z)) * q + (b * y * z - a * x) * r
        )
        out[2, k] = (
            (b * x * z - a * y) * p + (b * y * z + a * x) * q + (1.0 - b * (x * x + y * y)) * r
        )
    return out


@njit(cache=True, inline="always")
def turned(R: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R (3, 3) times a vector: for three numbers a call of `@` costs more than the product."""
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@njit(cache=True)
def turn_between(A: Array, B: Array) -> tuple[float, float, float]:
    """The rotation vector (rad) of B A': what turns A (3, 3) into B (3, 3), about their axes."""
    R = np.empty((3, 3))
    for k in range(3):
        R[0, k], R[1, k], R[2, k] = turned(B, A[k, 0], A[k, 1], A[k, 2])
    return _skew_part(R)


@njit(cache=True)
def rotation_vector(R: Array) -> Array:
    """The rotation vector (3,) rad of R (3, 3)."""
    return np.array(_skew_part(R))


@njit(cache=True)
def _skew_part(R: Array) -> tuple[float, float, float]:
    """The rotation vector (rad) of R (3, 3), from its skew part.

    Near 180 deg only its length is reliable, which is all that Levenberg-Marquardt needs.
    """
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0))
    factor = 0.5 if sine < 1e-9 else 0.5 * angle / sine
    return factor * x, factor * y, factor * z
