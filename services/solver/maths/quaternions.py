"""Quaternions of many rotations at once, as a kernel.

Alike in rhot/geometry/transforms.py, quaternion_from_rotation (Shepperd's method), which numba
cannot call; every message needs 26. Proven to agree by
tests/services/solver/maths/test_quaternions.py.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from rhot.kernels.packed import unowned


@njit(cache=True)
def quaternions_from_rotations(rotations: Array) -> Array:
    """Unit quaternions wxyz with w >= 0 of rotations (n, 3, 3); (n, 4)."""
    rotations, quaternions = unowned(rotations), np.empty((rotations.shape[0], 4))
    for n in range(rotations.shape[0]):
        w, x, y, z = _shepperd(rotations[n])
        size = math.sqrt(w * w + x * x + y * y + z * z)
        if w < 0.0:
            size = -size
        quaternions[n, 0] = w / size
        quaternions[n, 1] = x / size
        quaternions[n, 2] = y / size
        quaternions[n, 3] = z / size
    return quaternions


@njit(cache=True)
def _shepperd(r: Array) -> tuple[float, float, float, float]:
    """A quaternion wxyz of any length and sign of a rotation r (3, 3).

    The largest of the four squared components is the pivot: no division by a small number.
    """
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace >= r[0, 0] and trace >= r[1, 1] and trace >= r[2, 2]:
        return 1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    if r[0, 0] >= r[1, 1] and r[0, 0] >= r[2, 2]:
        x = 1.0 - trace + 2.0 * r[0, 0]
        return r[2, 1] - r[1, 2], x, r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]
    if r[1, 1] >= r[2, 2]:
        y = 1.0 - trace + 2.0 * r[1, 1]
        return r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], y, r[1, 2] + r[2, 1]
    z = 1.0 - trace + 2.0 * r[2, 2]
    return r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], z
