"""Sub-pixel corners: a saddle surface fitted around each, and the test that they form a grid. Pure.

Where two black squares touch, a slightly blurred picture is a saddle: z = a x^2 + b x y + c y^2
+ d x + e y + f, fitted to the grey values by least squares, has its stationary point in the corner
(Lucchese & Mitra, "Using saddle points for subpixel feature detection", 2002; Placht et al.,
"ROCHADE", 2014). All pixels in the window count, where OpenCV's cornerSubPix uses gradients only.
On the real pairs at 640x480 (320x240) the held-out board fit is .0108 (.0109) squares against
.0149 (.0161) of cornerSubPix, and a rendered board blurred by 2.5 px is found to .05 px instead of
.41. A corner without a saddle stays where the detector put it.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board

# Radius of the window in distances to the nearest corner. It must not reach the next corner, nor
# the border of a board with cut outer squares. Real pairs: .0113 squares at .15, .0110 at .20,
# .0109 at .25, .0108 at .30 and .35.
_WINDOW = 0.3
# ChArUco: a marker's corner begins (1 - marker) / 2 squares away both ways; its edges must stay out
# of the window.
_MARKER_SHARE = 0.9
# 2 px is the least that holds an edge on both sides; beyond 30 px lens distortion bends the edges.
_WINDOW_PX = (2, 30)
# Blur before the fit, in distances to the nearest corner: rendered boards with noise of 12 grey
# levels .10 px without, .09 with.
_BLUR, _BLUR_PX = 0.03, (0.5, 3.0)
# A saddle rises and falls by this many grey levels at the window's rim, at least: below, it is
# noise.
_CONTRAST = 4.0
# Newton's steps converge at once when the start is within half the window; twelve reach it from
# anywhere in it.
_STEPS = 12
# A step shorter than this many px ends the search: a thousandth of the corners' own error.
_CONVERGED_PX = 1e-4
# A corner may lie this share of a square from where its neighbours expect it: real lenses and
# perspective stay below .15.
_REGULAR = 0.3


class _Window(NamedTuple):
    """A round window around a corner, and the least-squares fit of a saddle to its pixels."""

    radius: int
    inside: np.ndarray  # (2 radius + 1, 2 radius + 1) bool
    fit: Array  # (6, n) from the grey values inside to a, b, c, d, e, f


def corner_spacing(board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Distance (n,) in px of each corner (n, 2) to its nearest neighbour on the board.

    Infinite where a corner has no neighbour among `ids`.
    """
    nearest = np.full(len(corners), np.inf)
    pairs = board.neighbours(ids)
    length = np.linalg.norm(corners[pairs[:, 0]] - corners[pairs[:, 1]], axis=1)
    np.minimum.at(nearest, pairs[:, 0], length)
    np.minimum.at(nearest, pairs[:, 1], length)
    return nearest


def refine_corners(image: np.ndarray, board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Corners (n, 2) moved to the saddle points of a grey picture (h, w).

    A corner without a saddle in its window stays where it was.
    """
    spacing = corner_spacing(board, ids, corners)
    known = np.isfinite(spacing)
    typical = float(np.median(spacing[known])) if np.any(known) else 0.0
    spacing = np.where(known, spacing, typical)
    radii = np.clip(np.round(_window_share(board) * spacing), *_WINDOW_PX).astype(np.int64)
    sigma_px = float(np.clip(_BLUR * typical, *_BLUR_PX))
    blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma_px)
    windows = {int(radius): _window(int(radius)) for radius in np.unique(radii)}
    return np.array(
        [
            _saddle_point(blurred, corner, windows[int(radius)])
            for corner, radius in zip(corners, radii, strict=True)
        ]
    )


def _window_share(board: Board) -> float:
    """Radius of the window in distances to the nearest corner."""
    if board.kind == "chessboard":
        return _WINDOW
    return min(_WINDOW, float(_MARKER_SHARE * (1.0 - board.marker) / np.sqrt(2.0)))


def _window(radius: int) -> _Window:
    """The window of a radius in px.

    Pixels weigh less towards the rim, so that one pixel more or less changes nothing.
    """
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1].astype(np.float64)
    distance = np.hypot(x, y)
    inside = distance <= radius
    x, y, weight = x[inside], y[inside], 1.0 - distance[inside] / (radius + 1.0)
    terms = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    return _Window(radius, inside, np.linalg.pinv(terms * weight[:, None]) * weight)


def _saddle_point(blurred: np.ndarray, start: Array, window: _Window) -> Array:
    """The saddle point (2,) near the start, by Newton's method; the start if there is none."""
    corner = start.copy()
    radius = window.radius
    side = 2 * radius + 1
    for _ in range(_STEPS):
        patch = cv2.getRectSubPix(blurred, (side, side), (float(corner[0]), float(corner[1])))
        a, b, c, d, e, _ = window.fit @ patch[window.inside]
        determinant = 4.0 * a * c - b * b
        # Not a saddle but a bowl, a ridge or a plane: no corner here.
        if not determinant < -((_CONTRAST / radius**2) ** 2):
            return start
        step = np.array([b * e - 2.0 * c * d, b * d - 2.0 * a * e]) / determinant
        length = float(np.hypot(*step))
        corner += step * min(1.0, 0.5 * radius / max(length, 1e-12))
        if not np.hypot(*(corner - start)) <= radius:
            return start
        if length < _CONVERGED_PX:
            break
    return corner


def is_regular_grid(board: Board, ids: np.ndarray, corners: Array) -> bool:
    """Whether the corners (n, 2) lie like a board: each where its neighbours in line expect it."""
    if not np.all(np.isfinite(corners)):
        return False
    full = np.full((board.size, 2), np.nan)
    full[ids] = corners
    grid = full.reshape(board.rows, board.cols, 2)
    return _is_straight(grid) and _is_straight(grid.transpose(1, 0, 2))


def _is_straight(grid: Array) -> bool:
    """Whether the lines of corners (k, m, 2) along the first axis go on as they came.

    Corners that were not detected are NaN.
    """
    before, here, after = grid[:-2], grid[1:-1], grid[2:]
    bend = np.linalg.norm(before + after - 2.0 * here, axis=-1)
    step = np.minimum(np.linalg.norm(after - here, axis=-1), np.linalg.norm(here - before, axis=-1))
    known = np.isfinite(bend)
    return not np.any(bend[known] > 2.0 * _REGULAR * step[known])
