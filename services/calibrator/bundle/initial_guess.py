"""Initial guesses an adjustment can improve: a lens by its focal length, the pose of a board. Pure.

Guesses are scored by reprojection, so a caller sees from the score that none fits.
"""

from __future__ import annotations

import cv2
import numpy as np

from rhot.geometry.transforms import Array, transform
from services.calibrator.bundle.lens_model import (
    CX,
    CY,
    FISHEYE,
    FX,
    FY,
    K3,
    LENS_SIZE,
    project,
    rays_from_pixels,
)
from services.calibrator.bundle.residuals import View, rms

# Focal lengths tried, in picture widths: fields of view of 127 to 14 degrees, 20 % apart.
_FOCALS = 0.25 * 1.2 ** np.arange(16)
# Distance of a board whose pose no method finds, in sizes of the board: wrong, but in front of the
# camera, so that an adjustment can begin.
_FAR = 5.0


def ideal_lens(size_px: tuple[int, int], focal_px: float, *, fisheye: bool = False) -> Array:
    """A lens (9,) without distortion, its principal point in the middle of the picture."""
    lens = np.zeros(LENS_SIZE)
    lens[K3] = FISHEYE if fisheye else 0.0
    lens[[FX, FY]] = focal_px
    lens[[CX, CY]] = (size_px[0] - 1) / 2.0, (size_px[1] - 1) / 2.0
    return lens


def guess_lens(size_px: tuple[int, int], views: list[View], *, fisheye: bool = False) -> Array:
    """The ideal lens (9,) of that focal length with which the boards' views fit best.

    Scored by the median view: a strongly distorting lens bends some views more than a wrong focal
    length does.
    """
    scores = []
    for factor in _FOCALS:
        lens = ideal_lens(size_px, factor * size_px[0], fisheye=fisheye)
        scores.append(float(np.median([guess_board_pose(lens, view)[1] for view in views])))
    best = _FOCALS[int(np.argmin(scores))] * size_px[0]
    return ideal_lens(size_px, best, fisheye=fisheye)


def guess_board_pose(lens: Array, view: View) -> tuple[Array, float]:
    """T_camera_from_board (4, 4) of one view, and its reprojection RMS in px (inf: no pose fits).

    Collins & Bartoli, "Infinitesimal Plane-Based Pose Estimation" (2014): the better of the two
    poses with which a plane may be seen.
    """
    rays = rays_from_pixels(lens, view.pixels)
    size = float(np.ptp(view.points, axis=0).max())
    best, least = transform(np.eye(3), [0.0, 0.0, _FAR * size]), float("inf")
    if not np.all(np.isfinite(rays)):
        return best, least
    # Scaled to about 1, so that millimetre boards and metre boards are solved alike.
    points = np.ascontiguousarray(view.points / size).reshape(-1, 1, 3)
    try:
        count, vectors, shifts, _ = cv2.solvePnPGeneric(
            points, rays.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return best, least
    for vector, shift in zip(vectors[:count], shifts[:count], strict=True):
        R = cv2.Rodrigues(vector)[0].astype(np.float64)
        T = transform(R, size * np.asarray(shift).reshape(3))
        error = reprojection_rms(lens, view, T)
        if error < least:
            best, least = T, error
    return best, least


def reprojection_rms(lens: Array, view: View, T_camera_from_board: Array) -> float:
    """Reprojection RMS in px of one view's corners; NaN with a corner behind the camera."""
    R, t = T_camera_from_board[:3, :3], T_camera_from_board[:3, 3]
    return rms(view.pixels - project(lens, view.points @ R.T + t))
