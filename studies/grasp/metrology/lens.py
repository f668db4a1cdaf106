"""A lens's distortion from edges that are straight in the world (plumb lines: Brown 1971; Devernay
& Faugeras 1995, whom the finger paper follows).

k1, k2 for a focal length that need not be true: only their product with its powers bends pictures.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.camera import distortion_derivatives, undistort
from rhot.geometry.transforms import Array
from studies.grasp.metrology.fit import Problem, fitted
from studies.grasp.metrology.segments import inverted

# What lenses of phones and webcams have; wide priors, for edges that say nothing of k2.
_K1_SIGMA, _K2_SIGMA = 0.4, 0.2
# Fewer points of an edge show no bend.
_FEWEST = 3
# Edges that span less of the picture's diagonal show less bend than noise.
_SHORTEST = 0.1


class StraightLens(NamedTuple):
    """matrix (3, 3) as was assumed; distortion (k1, k2, 0, 0, 0) with k's covariance (2, 2);
    bend_px before and rms_px after: how far points are from their straight edges, RMS.
    """

    matrix: Array
    distortion: Array
    covariance: Array
    bend_px: float
    rms_px: float

    def straightened(self, points_px: npt.ArrayLike) -> Array:
        """Points (n, 2) px as a lens without distortion would show them; (n, 2) px."""
        return straightened(points_px, self.matrix, self.distortion)


def straightened(points_px: npt.ArrayLike, matrix: Array, distortion: Array) -> Array:
    """Points (n, 2) px as the lens without its distortion would show them; (n, 2) px, NaN where
    the model reaches none.
    """
    points = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    size = np.array([matrix[0, 0], matrix[1, 1]])
    return undistort((points - matrix[:2, 2]) / size, distortion) * size + matrix[:2, 2]


def assumed_matrix(size_px: tuple[int, int]) -> Array:
    """For a lens of which only the bend is known: the focal length is the longer side."""
    focal = float(max(size_px))
    return np.array(
        [[focal, 0.0, (size_px[0] - 1) / 2.0], [0.0, focal, (size_px[1] - 1) / 2.0], [0, 0, 1.0]]
    )


def lens_from_edges(
    edges: Sequence[npt.ArrayLike],
    size_px: tuple[int, int],
    sigma_px: float = 0.3,
    matrix: Array | None = None,
) -> StraightLens:
    """The distortion that makes edges straight: each is points (n, 2) px along it, 3 or more.

    Distances are taken in the distorted picture, where the noise is: an undistorted picture that
    shrinks would make all edges straight. Huber's weights, one for each edge's point.
    """
    matrix = assumed_matrix(size_px) if matrix is None else matrix
    lines = _long_enough(edges, float(np.hypot(*size_px)))
    rays = [(line - matrix[:2, 2]) / np.diag(matrix)[:2] for line in lines]
    focal = float(np.sqrt(matrix[0, 0] * matrix[1, 1]))

    def residuals(k: Array) -> Array:
        return np.append(_bends(rays, k) * (focal / sigma_px), k / (_K1_SIGMA, _K2_SIGMA))

    k, information = fitted(Problem(2, 2), np.zeros(2), residuals, np.add)
    before, after = residuals(np.zeros(2))[:-2], residuals(k)[:-2]
    return StraightLens(
        matrix,
        np.array([k[0], k[1], 0.0, 0.0, 0.0]),
        inverted(information) * max(1.0, float(np.mean(np.minimum(after**2, 9.0)))),
        float(np.sqrt(np.mean(before**2))) * sigma_px,
        float(np.sqrt(np.mean(after**2))) * sigma_px,
    )


def _long_enough(edges: Sequence[npt.ArrayLike], diagonal: float) -> list[Array]:
    """Edges of enough points; CalibrationError where none is long enough to bend."""
    lines = [np.asarray(edge, dtype=np.float64).reshape(-1, 2) for edge in edges]
    lines = [line for line in lines if len(line) >= _FEWEST]
    if not any(np.hypot(*np.ptp(line, axis=0)) >= _SHORTEST * diagonal for line in lines):
        raise CalibrationError(
            f"{len(edges)} edges, none with {_FEWEST} points or more that span"
            f" {_SHORTEST * diagonal:.0f} px: give points along long straight edges, near the"
            " picture's border too"
        )
    return lines


def _bends(rays: list[Array], k: Array) -> Array:
    """How far the points (n, 2) of each edge are from straight, in the distorted picture."""
    distortion = np.array([k[0], k[1], 0.0, 0.0, 0.0])
    flat = undistort(np.concatenate(rays), distortion)
    if not np.isfinite(flat).all():
        return np.full(len(flat), np.inf)
    (a, b), (c, d) = distortion_derivatives(flat, distortion)
    bends, start = [], 0
    for ray in rays:
        part = slice(start, start + len(ray))
        start += len(ray)
        offset = flat[part] - flat[part].mean(axis=0)
        x, y = np.linalg.svd(offset, full_matrices=False)[2][1]
        # The normal's distance, taken back through the lens.
        back = np.hypot(a[part] * x + b[part] * y, c[part] * x + d[part] * y)
        bends.append((offset[:, 0] * x + offset[:, 1] * y) * back)
    return np.concatenate(bends)
