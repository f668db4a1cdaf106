"""Sub-pixel corners: a saddle surface fitted around every corner, and the test whether corners form
a board. Pure.

Where two black squares touch, a slightly blurred picture is a saddle: z = a x^2 + b x y + c y^2 + d
x + e y + f, fitted to the grey values by least squares, has its stationary point in the corner
(Lucchese & Mitra, "Using saddle points for subpixel feature detection", 2002; Placht et al.,
"ROCHADE", 2014). All pixels in the window count, where cornerSubPix uses gradients only: on the
real pairs at 640x480 (320x240) the held-out board fit is .0108 (.0109) squares against .0149
(.0161) of cornerSubPix, and a rendered board blurred by 2.5 px is found to .05 px instead of .41. A
corner without a saddle stays where the detector put it.
"""

from __future__ import annotations

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board

# Radius in distances to the nearest corner. It must not reach the next corner, nor the border of a
# board with cut outer squares. Real pairs: .0113 squares at .15, .0110 at .20, .0109 at .25, .0108
# at .30 and .35.
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
# A corner may wander this share of a square from where neighbours expect it: real lenses and
# perspective stay below .15.
_REGULAR = 0.3


def spacing(board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Distance in px of every corner (n, 2) to its nearest neighbour on the board.

    (n,), inf where it has none.
    """
    nearest = np.full(len(corners), np.inf)
    pairs = board.neighbours(ids)
    length = np.linalg.norm(corners[pairs[:, 0]] - corners[pairs[:, 1]], axis=1)
    np.minimum.at(nearest, pairs[:, 0], length)
    np.minimum.at(nearest, pairs[:, 1], length)
    return nearest


def refine(image: np.ndarray, board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Corners (n, 2) moved to the saddle of the picture (h, w) grey.

    A corner that runs away stays where it was.
    """
    near = spacing(board, ids, corners)
    typical = float(np.median(near[np.isfinite(near)])) if np.any(np.isfinite(near)) else 0.0
    near = np.where(np.isfinite(near), near, typical)
    share = (
        _WINDOW
        if board.kind == "chessboard"
        else min(_WINDOW, _MARKER_SHARE * (1.0 - board.marker) / np.sqrt(2.0))
    )
    radii = np.clip(np.round(share * near), *_WINDOW_PX).astype(np.int64)
    blurred = cv2.GaussianBlur(
        image.astype(np.float32), (0, 0), float(np.clip(_BLUR * typical, *_BLUR_PX))
    )
    fits = {int(radius): _fit(int(radius)) for radius in np.unique(radii)}
    return np.array(
        [
            _saddle(blurred, corner, int(radius), *fits[int(radius)])
            for corner, radius in zip(corners, radii, strict=True)
        ]
    )


def _fit(radius: int) -> tuple[np.ndarray, Array]:
    """The pixels of a round window (k, k) bool, and the matrix (6, n) from their grey values to a,
    b, c, d, e, f.

    Pixels weigh less towards the rim, so that one pixel more or less changes nothing.
    """
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1].astype(np.float64)
    distance = np.hypot(x, y)
    inside = distance <= radius
    x, y, weight = x[inside], y[inside], 1.0 - distance[inside] / (radius + 1.0)
    terms = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    return inside, np.linalg.pinv(terms * weight[:, None]) * weight


def _saddle(
    blurred: np.ndarray, start: Array, radius: int, inside: np.ndarray, to_surface: Array
) -> Array:
    corner = start.copy()
    side = 2 * radius + 1
    for _ in range(_STEPS):
        patch = cv2.getRectSubPix(blurred, (side, side), (float(corner[0]), float(corner[1])))
        a, b, c, d, e, _ = to_surface @ patch[inside]
        determinant = 4.0 * a * c - b * b
        # Not a saddle but a bowl, a ridge or a plane: no corner here.
        if not determinant < -((_CONTRAST / radius**2) ** 2):
            return start
        step = np.array([b * e - 2.0 * c * d, b * d - 2.0 * a * e]) / determinant
        length = float(np.hypot(*step))
        corner += step * min(1.0, 0.5 * radius / max(length, 1e-12))
        if not np.hypot(*(corner - start)) <= radius:
            return start
        if length < 1e-4:
            break
    return corner


def is_regular(board: Board, ids: np.ndarray, corners: Array) -> bool:
    """Whether the corners (n, 2) lie like a board: each where its two neighbours in line expect it."""
    if not np.all(np.isfinite(corners)):
        return False
    full = np.full((board.size, 2), np.nan)
    full[ids] = corners
    grid = full.reshape(board.rows, board.cols, 2)
    for axis in (0, 1):
        before, here, after = (
            np.take(grid, np.arange(start, grid.shape[axis] - 2 + start), axis=axis)
            for start in range(3)
        )
        bend = np.linalg.norm(before + after - 2.0 * here, axis=-1)
        step = np.minimum(
            np.linalg.norm(after - here, axis=-1), np.linalg.norm(here - before, axis=-1)
        )
        known = np.isfinite(bend)
        if np.any(bend[known] > 2.0 * _REGULAR * step[known]):
            return False
    return True
