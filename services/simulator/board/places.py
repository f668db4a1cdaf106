"""Where a careful person holds a calibration board: near and far, in every corner of the pictures,
tilted, and always whole in the pictures of all cameras that are meant. Pure.

The place of that number is always the same. Place 0 is in the middle and faces the cameras.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import (
    Array,
    apply,
    inverse,
    rotation_from_vector,
    rotation_z,
    transform,
)
from services.simulator.board.sheet import COLS, ROWS, SQUARE_M, middle_m

# Parts of the picture in turn, as shares of half its size: corners, edges, middle.
_PARTS = ((-1, -1), (1, 1), (0, 0), (1, -1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0))
# The squares fill so much of the picture's width: nearer they are seen no more as a whole by two
# cameras, farther a corner is less certain and tilt tells less.
_FILLED = (0.40, 0.72)
# Tilt separates focal length from distance: a board at .3 rad and more does.
_TILT_RAD, _ROLL_RAD = (0.30, 0.68), 0.22
# Paper around the squares that a detector wants to see, m, and distance from the edge, px.
_RIM_M, _EDGE_PX = 0.012, 4.0
# In how many steps a board that is not seen whole is brought towards the middle, then farther away.
_STEPS, _FARTHER = 31, 1.1


def place(cameras: Sequence[Camera], number: int, seed: int) -> Array:
    """T_rig_from_board (4, 4) of a place that all these cameras see."""
    rng = np.random.default_rng([seed, number, 71])
    view, first = _view(cameras), cameras[0]
    half = 0.5 * np.array(first.size_px) / first.matrix[[0, 1], [0, 1]]
    filled = rng.uniform(*_FILLED) if number else float(np.mean(_FILLED))
    depth_m = (COLS + 1) * SQUARE_M / (2.0 * half[0] * filled)
    aim = np.array(_PARTS[(number - 1) % len(_PARTS)], dtype=float) if number else np.zeros(2)
    turned = _turned(rng) if number else np.eye(3)
    shares = np.linspace(1.0, 0.0, _STEPS)
    while True:
        for share in shares:
            middle = depth_m * np.array([*(share * aim * half), 1.0])
            T_view_from_board = transform(turned, middle - turned @ middle_m())
            T = np.asarray(view @ T_view_from_board)
            # Farther than a room nothing is: cameras that see nothing in common have no such place.
            if depth_m > 10.0 or all(_sees_whole(camera, T) for camera in cameras):
                return T
        depth_m, shares = depth_m * _FARTHER, np.zeros(1)


def _turned(rng: np.random.Generator) -> Array:
    """A board's turn, tilted to some side; (3, 3)."""
    side, tilt = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(*_TILT_RAD)
    tilted = rotation_from_vector(tilt * np.array([np.cos(side), np.sin(side), 0.0]))
    return np.asarray(tilted @ rotation_z(rng.uniform(-_ROLL_RAD, _ROLL_RAD)))


def _view(cameras: Sequence[Camera]) -> Array:
    """T_rig_from_view (4, 4): in the middle of the cameras, looking where they look together."""
    poses = np.array([camera.T_rig_from_camera for camera in cameras])
    ahead = poses[:, :3, 2].mean(axis=0)
    ahead /= np.linalg.norm(ahead)
    right = poses[:, :3, 0].mean(axis=0)
    right -= ahead * (right @ ahead)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    return np.asarray(transform(rotation, poses[:, :3, 3].mean(axis=0)))


def _sees_whole(camera: Camera, T_rig_from_board: Array) -> bool:
    """Whether the camera sees the printed side and all of the squares with some paper around."""
    low, high = -SQUARE_M - _RIM_M, np.array([COLS, ROWS]) * SQUARE_M + _RIM_M
    # Edges bend: their middles count too.
    xs, ys = (np.array([low, 0.5 * (low + end), end]) for end in high)
    rim = np.array([(x, y, 0.0) for x in xs for y in ys])
    T = inverse(camera.T_rig_from_camera) @ T_rig_from_board
    seen = apply(T, rim)
    if seen[:, 2].min() < 0.05 or T[:3, 2] @ seen.mean(axis=0) <= 0.0:
        return False
    pixels = camera.project(apply(T_rig_from_board, rim))
    inside = (pixels >= _EDGE_PX) & (pixels <= np.array(camera.size_px) - 1.0 - _EDGE_PX)
    return bool(inside.all())
