"""A plane from points whose places in it are known, seen by a camera that is a camera.

A homography has eight numbers, a camera before a plane six and what is not known of its lens. The
two that are left bend a plane that is known by a small rectangle far from it: with 1 px of noise at
the corners of 80 x 36 mm, and at the joints, bones beside it were 3.7 % off (mean, square view),
and are 2.3 % with the camera's constraints (benchmarks/grasp_metrology.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array, rotation_from_vector
from studies.grasp.metrology.fit import Problem, fitted
from studies.grasp.metrology.plane import Plane, plane_from_points, project
from studies.grasp.metrology.segments import inverted
from studies.grasp.metrology.uncertainty import jacobian
from studies.grasp.metrology.view import LensPrior, lens_prior, pinhole_of


class _Pose(NamedTuple):
    """R_camera_from_plane (3, 3), the plane's origin in the camera (3,), in units of the points;
    the lens.
    """

    R: Array
    t: Array
    focal: float
    centre: Array

    def moved(self, step: Array, unit: float) -> _Pose:
        """step (9,): turn, shift by the points' size, logarithm of the focal length, centre."""
        return _Pose(
            self.R @ rotation_from_vector(step[:3]),
            self.t + unit * step[3:6],
            self.focal * float(np.exp(step[6])),
            self.centre + step[7:],
        )

    def homography(self) -> Array:
        """image_from_plane, of norm 1."""
        K = pinhole_of(self.focal, self.centre)
        H = K @ np.stack([self.R[:, 0], self.R[:, 1], self.t], axis=1)
        return H / np.linalg.norm(H)


def plane_seen_by_camera(
    points_px: npt.ArrayLike,
    points_mm: npt.ArrayLike,
    size_px: tuple[int, int],
    *,
    sigma_px: float = 0.5,
    matrix: Array | None = None,
) -> Plane:
    """As plane_from_points, for pictures of size_px without distortion. matrix: the lens's, where
    it is calibrated; else its focal length is about a phone's or webcam's.
    """
    px = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    mm = np.asarray(points_mm, dtype=np.float64).reshape(-1, 2)
    start = plane_from_points(px, mm, sigma_px).image_from_plane
    prior = lens_prior(size_px, matrix)
    unit = float(np.ptp(mm, axis=0).max())

    def residuals(pose: _Pose) -> Array:
        off = (project(pose.homography(), mm) - px).reshape(-1) / sigma_px
        return np.append(off, prior.misses(pose.focal, pose.centre))

    first = _first(start, prior)
    # Almost square to the camera a tilt and its mirror image look alike.
    starts = [first, first._replace(R=_mirrored(first))]

    def moved(pose: _Pose, step: Array) -> _Pose:
        return pose.moved(step, unit)

    # A rectangle's corners: none can be spared as an outlier.
    problem = Problem(9, 2 * len(px) + 3)
    fits = [fitted(problem, one, residuals, moved) for one in starts]
    pose, information = min(fits, key=lambda fit: float((residuals(fit[0]) ** 2).sum()))

    def seen(step: Array) -> Array:
        return pose.moved(step, unit).homography().reshape(-1)

    J = jacobian(seen, np.zeros(9))
    return Plane(pose.homography(), J @ inverted(information) @ J.T)


def _first(H: Array, prior: LensPrior) -> _Pose:
    """From a homography and the lens as it is expected."""
    columns = inverted(pinhole_of(prior.focal, prior.centre)) @ H
    scale = np.sqrt(np.linalg.norm(columns[:, 0]) * np.linalg.norm(columns[:, 1]))
    scale *= np.sign(columns[2, 2])
    x, y, t = (columns / scale).T
    left, _, right = np.linalg.svd(np.stack([x, y, np.cross(x, y)], axis=1))
    R = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return _Pose(R, t, prior.focal, prior.centre)


def _mirrored(pose: _Pose) -> Array:
    """The turn that tilts to the other side of the line of sight; (3, 3)."""
    sight = pose.t / np.linalg.norm(pose.t)
    normal = pose.R[:, 2]
    axis = np.cross(normal, sight)
    angle = np.arctan2(np.linalg.norm(axis), float(normal @ sight))
    if np.linalg.norm(axis) < 1e-9:
        return pose.R
    return rotation_from_vector(2.0 * angle * axis / np.linalg.norm(axis)) @ pose.R
