"""How capsules and dabs move, in the camera frame and in the picture, while one frame is exposed.
Compiled kernels. Pure.

A path is a parabola in u: u = -1 is the first instant that any row is exposed, u = 1 the last. Over
the 24 ms of a frame a waving hand leaves it by less than 0.1 mm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import Ints
from services.simulator.render.buffers import CameraView, CapsulePaths, DabPaths
from services.simulator.render.projection import project
from services.simulator.render.ray_capsule import FAR

# Added to a capsule's radius in the picture: room for the error of the parabola, px.
_MARGIN_PX = 1.5
# A ball off the optical axis is seen as an ellipse, longer than f * radius / depth.
_OUTLINE_FACTOR = 1.08
# Balls that come nearer to the camera than this are not drawn.
_NEAREST_M = 0.02


class BodyPoses(NamedTuple):
    """All f body frames of a scene at u = -1, 0 and 1, in the rig frame."""

    positions: Array  # (3, f, 3) m
    rotations: Array  # (3, f, 3, 3)


@njit(cache=True, nogil=True, error_model="numpy")
def fit_parabola(at_start: Array, at_middle: Array, at_end: Array, out: Array) -> None:
    """Coefficients out (3, n) of the parabola in u through three instants (n,)."""
    for i in range(out.shape[1]):
        out[0, i] = at_middle[i]
        out[1, i] = 0.5 * (at_end[i] - at_start[i])
        out[2, i] = 0.5 * (at_start[i] + at_end[i]) - at_middle[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _to_camera(
    position: Array, rotation: Array, offset: Array, view: CameraView, out: Array
) -> None:
    """A point fixed to a body frame at `offset` (3,), in the camera frame; out (3,)."""
    p_rig = np.empty(3)
    for i in range(3):
        p_rig[i] = position[i]
        for j in range(3):
            p_rig[i] += rotation[i, j] * offset[j]
    R, t = view.rotation, view.translation
    for i in range(3):
        out[i] = t[i] + R[i, 0] * p_rig[0] + R[i, 1] * p_rig[1] + R[i, 2] * p_rig[2]


@njit(cache=True, nogil=True, error_model="numpy")
def trace_capsules(poses: BodyPoses, view: CameraView, capsules: CapsulePaths) -> None:
    """Fill ends, palms and tracks of all capsules."""
    positions, rotations = poses.positions, poses.rotations
    p_camera, outline = np.empty((3, 3)), np.empty((3, 3))
    for c in range(capsules.frame.shape[0]):
        for end in range(2):
            frame, radius = capsules.frame[c, end], capsules.radius[c, end]
            for k in range(3):
                offset = capsules.offset[c, end]
                _to_camera(positions[k, frame], rotations[k, frame], offset, view, p_camera[k])
                _outline(view.lens, p_camera[k], radius, outline[k])
            fit_parabola(p_camera[0], p_camera[1], p_camera[2], capsules.ends[c, end])
            fit_parabola(outline[0], outline[1], outline[2], capsules.tracks[c, end])
        _palm_path(rotations, capsules.frame[c, 0], view.rotation, capsules.palms[c])


@njit(cache=True, nogil=True, error_model="numpy")
def _outline(lens: Array, p_camera: Array, radius: float, out: Array) -> None:
    """Centre x, y and radius of a ball in the picture, px; out (3,)."""
    nearest_m = p_camera[2] - radius
    if nearest_m > _NEAREST_M:
        out[0], out[1] = project(lens, p_camera[0], p_camera[1], p_camera[2])
        out[2] = _OUTLINE_FACTOR * lens[0] * radius / nearest_m
    else:
        out[0], out[1], out[2] = FAR, FAR, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _palm_path(rotations: Array, frame: int, R: Array, out: Array) -> None:
    """Parabola out (3, 3) of the palmar direction, -y of a body frame, in the camera frame."""
    direction = np.empty((3, 3))
    for k in range(3):
        for i in range(3):
            direction[k, i] = -(
                R[i, 0] * rotations[k, frame, 0, 1]
                + R[i, 1] * rotations[k, frame, 1, 1]
                + R[i, 2] * rotations[k, frame, 2, 1]
            )
    fit_parabola(direction[0], direction[1], direction[2], out)


@njit(cache=True, nogil=True, error_model="numpy")
def trace_dabs(poses: BodyPoses, view: CameraView, dabs: DabPaths) -> None:
    """Fill the paths of all dabs."""
    p_camera = np.empty((3, 3))
    for d in range(dabs.frame.shape[0]):
        frame = dabs.frame[d]
        for k in range(3):
            position, rotation = poses.positions[k, frame], poses.rotations[k, frame]
            _to_camera(position, rotation, dabs.offset[d], view, p_camera[k])
        fit_parabola(p_camera[0], p_camera[1], p_camera[2], dabs.paths[d])


@njit(cache=True, nogil=True, error_model="numpy")
def dabs_at(dabs: DabPaths, u: float, out: Array) -> None:
    """Where the dabs are at instant u; out (d, 3)."""
    paths = dabs.paths
    for d in range(paths.shape[0]):
        for i in range(3):
            out[d, i] = paths[d, 0, i] + u * (paths[d, 1, i] + u * paths[d, 2, i])


@njit(cache=True, nogil=True, error_model="numpy")
def find_rows(tracks: Array, height: int, rows: Ints) -> None:
    """First and last row, rows (c, 2), that each capsule can touch at any instant.

    Empty for what is too near.
    """
    for c in range(tracks.shape[0]):
        low, high = FAR, -FAR
        for end in range(2):
            for k in range(3):
                u = k - 1.0
                y = tracks[c, end, 0, 1] + u * (tracks[c, end, 1, 1] + u * tracks[c, end, 2, 1])
                r = (
                    tracks[c, end, 0, 2]
                    + u * (tracks[c, end, 1, 2] + u * tracks[c, end, 2, 2])
                    + _MARGIN_PX
                )
                low, high = min(low, y - r), max(high, y + r)
        if high - low > 10.0 * height:
            low, high = FAR, -FAR
        rows[c, 0] = int(max(0.0, min(low, height)))
        rows[c, 1] = int(max(-1.0, min(high + 1.0, height - 1.0)))


@njit(cache=True, nogil=True, error_model="numpy")
def find_columns(track: Array, u: float, row: int, width: int) -> tuple[int, int]:
    """First and last column where a capsule can touch a row at instant u; (0, -1) if nowhere.

    track (2, 3, 3) as in CapsulePaths.tracks.
    """
    ax = track[0, 0, 0] + u * (track[0, 1, 0] + u * track[0, 2, 0])
    ay = track[0, 0, 1] + u * (track[0, 1, 1] + u * track[0, 2, 1])
    ar = track[0, 0, 2] + u * (track[0, 1, 2] + u * track[0, 2, 2])
    bx = track[1, 0, 0] + u * (track[1, 1, 0] + u * track[1, 2, 0])
    by = track[1, 0, 1] + u * (track[1, 1, 1] + u * track[1, 2, 1])
    br = track[1, 0, 2] + u * (track[1, 1, 2] + u * track[1, 2, 2])
    r = max(ar, br) + _MARGIN_PX
    # The part s0..s1 of the axis that comes within r of the row.
    s0, s1 = 0.0, 1.0
    dy = by - ay
    if abs(dy) > 1e-9:
        p, q = (row - r - ay) / dy, (row + r - ay) / dy
        s0, s1 = max(0.0, min(p, q)), min(1.0, max(p, q))
    elif abs(row - ay) > r:
        return 0, -1
    if s0 > s1:
        return 0, -1
    x0, x1 = ax + s0 * (bx - ax), ax + s1 * (bx - ax)
    low, high = min(x0, x1) - r, max(x0, x1) + r
    return int(max(0.0, min(low, width))), int(max(-1.0, min(high + 1.0, width - 1.0)))
