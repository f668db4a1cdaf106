"""Finds the pixels where one ray is not enough: outlines, edges of paint, and where these move
while the shutter is open. Compiled kernels. Pure.

Inside a surface a second ray would see nearly the same: shading is smooth there.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.simulator.hands.bodies import CAPSULE, Ints
from services.simulator.render.buffers import CapsulePaths, FrameBuffers
from services.simulator.render.projection import Array32

# Neighbours further apart in depth than this are different things: half a finger.
_STEP_M = 4e-3
# Solids have edges, where light changes by more than texture does: a matt wall's by 5 %.
_CREASE_LIGHT = 0.02
# Less movement than this while the shutter is open is not worth several instants.
STILL_PX = 0.3
# Longest motion that is followed, px: flags are bytes, and what crosses a third of the picture
# within one exposure is no hand at work.
_MAX_MOTION_PX = 200.0


@njit(cache=True, nogil=True, error_model="numpy")
def flag_edges(capsules: CapsulePaths, buffers: FrameBuffers, exposure: float) -> float:
    """Flag every pixel that needs several rays, by 1 + the px that its outline moves while the
    shutter is open; returns the longest motion.

    exposure is in units of u. flags must be 0.
    """
    height, width = buffers.depth.shape
    longest = 0.0
    flags, columns, kind = buffers.flags, buffers.columns, capsules.kind
    for y in range(height - 1):
        first = min(columns[y, 0], columns[y + 1, 0])
        last = max(columns[y, 1], columns[y + 1, 1])
        label, label_below = buffers.label[y], buffers.label[y + 1]
        depth, depth_below = buffers.depth[y], buffers.depth[y + 1]
        for x in range(max(0, first - 1), min(width - 1, last + 1)):
            right = label[x] != label[x + 1] or abs(depth[x] - depth[x + 1]) > _STEP_M
            down = label[x] != label_below[x] or abs(depth[x] - depth_below[x]) > _STEP_M
            if label[x] > 0 and kind[buffers.capsule[y, x], 3] != CAPSULE:
                right = right or _crease(buffers.light, y, x, y, x + 1)
                down = down or _crease(buffers.light, y, x, y + 1, x)
            if not right and not down:
                continue
            flags[y, x] = max(flags[y, x], 1)
            front_y, front_x, nearest = y, x, depth[x]
            if right:
                flags[y, x + 1] = max(flags[y, x + 1], 1)
                if depth[x + 1] < nearest:
                    front_x, nearest = x + 1, depth[x + 1]
            if down:
                flags[y + 1, x] = max(flags[y + 1, x], 1)
                if depth_below[x] < nearest:
                    front_y, front_x = y + 1, x
            # What is in front makes the outline, and its motion smears it.
            track = capsules.tracks[buffers.capsule[front_y, front_x]]
            vx, vy = _motion_px(track, front_y, front_x, exposure)
            motion = math.hypot(vx, vy)
            if motion > STILL_PX:
                motion = min(motion, _MAX_MOTION_PX)
                longest = max(longest, motion)
                _flag_path(flags, y, x, vx, vy, 1 + int(motion))
    return longest


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _crease(light: Array32, y: int, x: int, v: int, w: int) -> bool:
    """Whether two neighbours on a solid are faces in different light."""
    return abs(light[y, x, 1] - light[v, w, 1]) > _CREASE_LIGHT


@njit(cache=True, nogil=True, error_model="numpy")
def _motion_px(track: Array, y: int, x: int, exposure: float) -> tuple[float, float]:
    """How far (x and y, px) the end of a capsule nearer to a pixel moves during the exposure."""
    to_a = (track[0, 0, 0] - x) ** 2 + (track[0, 0, 1] - y) ** 2
    to_b = (track[1, 0, 0] - x) ** 2 + (track[1, 0, 1] - y) ** 2
    end = 0 if to_a < to_b else 1
    return track[end, 1, 0] * exposure, track[end, 1, 1] * exposure


@njit(cache=True, nogil=True, error_model="numpy")
def _flag_path(
    flags: npt.NDArray[np.uint8], y: int, x: int, vx: float, vy: float, value: int
) -> None:
    """Flag the path, 3 px wide, that the content of a pixel takes while the shutter is open."""
    height, width = flags.shape
    steps = int(max(abs(vx), abs(vy)) * 0.5 + 1.0)
    for k in range(-steps, steps + 1):
        cx = math.floor(x + 0.5 * vx * k / steps + 0.5)
        cy = math.floor(y + 0.5 * vy * k / steps + 0.5)
        for v in range(max(0, cy - 1), min(height, cy + 2)):
            for w in range(max(0, cx - 1), min(width, cx + 2)):
                flags[v, w] = max(flags[v, w], value)


@njit(cache=True, nogil=True, error_model="numpy")
def widen_columns(columns: Ints, margin: int, wide: Ints) -> None:
    """wide (h, 2): the touched columns of each row and of `margin` rows above and below it,
    `margin` wider, on even boundaries.

    Rows without any: first > last.
    """
    height = columns.shape[0]
    for y in range(height):
        wide[y, 0], wide[y, 1] = 1 << 30, -1
    for y in range(height):
        if columns[y, 1] < columns[y, 0]:
            continue
        first = max(0, columns[y, 0] - margin) // 2 * 2
        last = (columns[y, 1] + margin) // 2 * 2 + 1
        # Chroma belongs to pairs of rows: both of a pair are equally wide.
        for v in range(max(0, y - margin) // 2 * 2, min(height, (y + margin) // 2 * 2 + 2)):
            wide[v, 0], wide[v, 1] = min(wide[v, 0], first), max(wide[v, 1], last)
