"""Triangulation of many points from the rays of several cameras: iterated linear least squares.

Plain numpy; services/fusion/geometry/triangulation.py is the compiled one for live use. That one
goes on to the least reprojection error by Gauss-Newton, one point at a time, and gives its
covariance and a status. On exact rays the two agree; on noisy ones this one stops beside that
minimum (tests/services/fusion/geometry/test_triangulation.py). Rays that are NaN (pixels outside
the lens model) give NaN points; a point behind a camera comes back as it is, and its residual shows
it.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array


def triangulate(T_camera_from_rig: Array, rays: Array, focals_px: Array) -> Array:
    """Points (n, 3) in the rig frame from rays (c, n, 2) of cameras at T (c, 4, 4).

    They are weighted by their focal lengths (c,) px. Focal lengths may be given for every ray (c,
    n); 0 leaves one out. Parallel rays give a point far away, or a numpy.linalg.LinAlgError.

    Iterated linear triangulation (Hartley & Sturm, "Triangulation", 1997, section 5): each round
    divides an equation by the depth it had before, so that what is minimised are pixels.
    """
    focals = np.broadcast_to(
        focals_px if focals_px.ndim == 2 else focals_px[:, None], rays.shape[:2]
    )
    weight = focals  # (c, n)
    points = np.zeros((rays.shape[1], 3))
    # The second round has the depths; the third changes less than rounding.
    for _ in range(3):
        A = (
            rays[..., None] * T_camera_from_rig[:, None, None, 2, :]
            - T_camera_from_rig[:, None, :2, :]
        )  # (c, n, 2, 4)
        A = A * weight[:, :, None, None]
        equations = A.transpose(1, 0, 2, 3).reshape(rays.shape[1], 2 * len(rays), 4)
        normal = np.einsum("nij,nik->njk", equations[..., :3], equations[..., :3])  # (n, 3, 3)
        right = -np.einsum("nij,ni->nj", equations[..., :3], equations[..., 3])  # (n, 3)
        points = np.linalg.solve(normal, right[..., None])[..., 0]
        depth = (
            np.einsum("cj,nj->cn", T_camera_from_rig[:, 2, :3], points)
            + T_camera_from_rig[:, None, 2, 3]
        )
        weight = focals / np.maximum(np.abs(depth), 1e-6)
    return points
