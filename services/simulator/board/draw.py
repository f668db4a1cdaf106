"""A board in a picture, each row at its own instant and over its exposure. Compiled kernel. Pure.

Whether a pixel shows ink, paper or neither is asked at its corners; where they differ, at 64 points
of its area. These stand in a sheared grid: no two in a row or column of the pixel, so that an edge
along it moves in 64 steps, not in eight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array, apply
from services.simulator.board.sheet import Sheet, outline

Array32 = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int64]
# Points along one side of a pixel, and instants of an exposure.
_SIDE, _INSTANTS = 8, 4
# What a ray meets.
_INK, _PAPER, _NOTHING, _MIXED = 0, 1, 2, 3
# Points along each edge of the paper whose pixels bound it, and what is added, px: lenses bend.
_ALONG, _AROUND_PX = 12, 3
_NEAREST_M = 0.02


class Canvas(NamedTuple):
    """The parts of a picture on its way that a board is drawn into."""

    rays: Array32  # (h, 3, w) unit vectors
    vignette: Array32  # (h, w)
    depth: Array32  # (h, w) m along the ray; not changed
    light: Array32  # (h, w, 3) linear RGB


class RowTimes(NamedTuple):
    """When rows are exposed, in u: -1 is the first instant of a frame, 1 the last."""

    first_row: float
    row_step: float
    exposure: float


def homographies(T_camera_from_board: Array) -> Array:
    """Coefficients of a parabola in u through the poses (3, 4, 4) at u = -1, 0, 1; (3, 3, 3).

    Columns of each matrix: the camera's x and y axis of the board, and its origin.
    """
    first, middle, last = T_camera_from_board[:, :3][:, :, [0, 1, 3]]
    return np.stack([middle, 0.5 * (last - first), 0.5 * (last + first) - middle])


def bounds(camera: Camera, sheet: Sheet, T_rig_from_board: Array) -> Ints | None:
    """First and last row and column (4,) that the paper at poses (k, 4, 4) can touch.

    None if it is not before the camera, or beside the picture.
    """
    rim = outline(sheet.paper_m, _ALONG)
    points = np.concatenate([apply(T, rim) for T in T_rig_from_board])
    if apply(camera.T_camera_from_rig, points)[:, 2].min() < _NEAREST_M:
        return None
    pixels = camera.project(points)
    width, height = camera.size_px
    low, high = pixels.min(axis=0) - _AROUND_PX, pixels.max(axis=0) + _AROUND_PX
    if not np.all(np.isfinite([low, high])):
        return None
    x0, y0 = max(0, int(low[0])), max(0, int(low[1]))
    x1, y1 = min(width - 1, int(high[0])), min(height - 1, int(high[1]))
    return np.array([y0, y1, x0, x1]) if x0 <= x1 and y0 <= y1 else None


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def draw_board(
    sheet: Sheet, path: Array, times: RowTimes, box: Ints, tones: Array, canvas: Canvas
) -> None:
    """Draw into the light of a picture what lies in front of it, in the rows and columns box (4,).

    path (3, 3, 3) is of `homographies`, tones (2, 3) the light that ink and paper send back.
    """
    back = np.empty((_INSTANTS, 3, 3))
    rays = np.empty((3, 3))
    for row in range(box[0], box[1] + 1):
        for k in range(_INSTANTS):
            instant = (k + 0.5) / _INSTANTS - 0.5
            u = times.first_row + row * times.row_step + instant * times.exposure
            _invert(path[0] + u * path[1] + u * u * path[2], back[k])
        _find_rays(canvas.rays, row, box[2], rays)
        left = _side(sheet, back, rays, -0.5)
        for x in range(box[2], box[3] + 1):
            _find_rays(canvas.rays, row, x, rays)
            right = _side(sheet, back, rays, 0.5)
            what = left if left == right else _MIXED
            left = right
            if what == _NOTHING or _depth(back[_INSTANTS // 2], rays) >= canvas.depth[row, x]:
                continue
            if what != _MIXED:
                for i in range(3):
                    canvas.light[row, x, i] = tones[what, i] * canvas.vignette[row, x]
                continue
            ink, paper = _count(sheet, back, rays)
            behind = _SIDE * _SIDE - ink - paper
            for i in range(3):
                light = (ink * tones[0, i] + paper * tones[1, i]) * canvas.vignette[row, x]
                light += behind * canvas.light[row, x, i]
                canvas.light[row, x, i] = light / (_SIDE * _SIDE)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _invert(matrix: Array, out: Array) -> None:
    """The inverse of a 3x3 matrix by its cofactors: LAPACK takes seconds to be compiled in."""
    m = matrix
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            r, s = (j + 1) % 3, (j + 2) % 3
            out[j, i] = m[p, r] * m[q, s] - m[p, s] * m[q, r]
    scale = 1.0 / (m[0, 0] * out[0, 0] + m[0, 1] * out[1, 0] + m[0, 2] * out[2, 0])
    for i in range(3):
        for j in range(3):
            out[i, j] *= scale


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _find_rays(of: Array32, row: int, x: int, rays: Array) -> None:
    """A pixel's ray, and how it changes from pixel to pixel, across and down."""
    next_row, next_x = min(row + 1, of.shape[0] - 1), min(x + 1, of.shape[2] - 1)
    for i in range(3):
        rays[0, i] = of[row, i, x]
        # The last column and row look back.
        rays[1, i] = of[row, i, next_x] - of[row, i, next_x - 1]
        rays[2, i] = of[next_row, i, x] - of[next_row - 1, i, x]


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _depth(back: Array, rays: Array) -> float:
    """How far the board's plane is along a pixel's ray, m; infinite if it is behind."""
    across = back[2, 0] * rays[0, 0] + back[2, 1] * rays[0, 1] + back[2, 2] * rays[0, 2]
    return 1.0 / across if across > 0.0 else np.inf


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _met(sheet: Sheet, back: Array, rays: Array, right: float, down: float) -> int:
    """What the ray through a point of a pixel meets; right and down in px from its middle."""
    dx = rays[0, 0] + right * rays[1, 0] + down * rays[2, 0]
    dy = rays[0, 1] + right * rays[1, 1] + down * rays[2, 1]
    dz = rays[0, 2] + right * rays[1, 2] + down * rays[2, 2]
    scale = back[2, 0] * dx + back[2, 1] * dy + back[2, 2] * dz
    if scale <= 0.0:
        return _NOTHING
    x = (back[0, 0] * dx + back[0, 1] * dy + back[0, 2] * dz) / scale
    y = (back[1, 0] * dx + back[1, 1] * dy + back[1, 2] * dz) / scale
    if x < sheet.paper_m[0, 0] or y < sheet.paper_m[0, 1]:
        return _NOTHING
    if x > sheet.paper_m[1, 0] or y > sheet.paper_m[1, 1]:
        return _NOTHING
    column = math.floor((x - sheet.first_m[0]) * sheet.per_m)
    line = math.floor((y - sheet.first_m[1]) * sheet.per_m)
    if column < 0 or line < 0 or line >= sheet.texels.shape[0] or column >= sheet.texels.shape[1]:
        return _PAPER
    return int(sheet.texels[line, column])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _side(sheet: Sheet, back: Array, rays: Array, right: float) -> int:
    """What both ends of one side of a pixel show at the exposure's beginning and end, if it is one
    thing: sides are shared, so each pixel asks for one.
    """
    what = _met(sheet, back[0], rays, right, -0.5)
    if (
        _met(sheet, back[0], rays, right, 0.5) != what
        or _met(sheet, back[_INSTANTS - 1], rays, right, -0.5) != what
        or _met(sheet, back[_INSTANTS - 1], rays, right, 0.5) != what
    ):
        return _MIXED
    return what


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _count(sheet: Sheet, back: Array, rays: Array) -> tuple[int, int]:
    """How many points of a pixel show ink, and paper."""
    ink, paper = 0, 0
    for i in range(_SIDE):
        for j in range(_SIDE):
            right = (i + (j + 0.5) / _SIDE) / _SIDE - 0.5
            down = (j + (i + 0.5) / _SIDE) / _SIDE - 0.5
            what = _met(sheet, back[(i + 2 * j) % _INSTANTS], rays, right, down)
            if what == _INK:
                ink += 1
            elif what == _PAPER:
                paper += 1
    return ink, paper
