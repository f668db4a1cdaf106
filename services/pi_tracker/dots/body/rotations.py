"""Rotations and cross products of many vectors at once. Pure."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def turned(vectors: Array) -> Array:
    """Rotations (k, 3, 3) by vectors (k, 3), rad."""
    angles = np.linalg.norm(vectors, axis=1) + 1e-12
    x, y, z = (vectors / angles[:, None]).T
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    wide = angles[:, None, None]
    return np.asarray(np.eye(3) + np.sin(wide) * skew + (1.0 - np.cos(wide)) * skew @ skew)


def mirrored(rotations: Array, sides: Array) -> Array:
    """Camera from hand (k, 3, 3), a left hand being a right one mirrored."""
    frames = rotations.copy()
    frames[:, :, 0] *= sides[:, None]
    return frames


def cross(first: Array, second: Array) -> Array:
    """Cross products (..., 3); numpy's own takes five times as long for a few."""
    product = np.empty(np.broadcast_shapes(first.shape, second.shape))
    for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
        product[..., k] = first[..., a] * second[..., b] - first[..., b] * second[..., a]
    return product


def about_y(cosines: Array, sines: Array) -> Array:
    """Rotations (..., 3, 3) about y by angles of these cosines and sines (...,)."""
    turn = np.zeros((*cosines.shape, 3, 3))
    turn[..., 0, 0] = turn[..., 2, 2] = cosines
    turn[..., 1, 1] = 1.0
    turn[..., 0, 2], turn[..., 2, 0] = sines, -sines
    return turn


def about_minus_x(cosines: Array, sines: Array) -> Array:
    """The same about -x: as fingers bend."""
    turn = np.zeros((*cosines.shape, 3, 3))
    turn[..., 0, 0] = 1.0
    turn[..., 1, 1] = turn[..., 2, 2] = cosines
    turn[..., 1, 2], turn[..., 2, 1] = sines, -sines
    return turn
