"""Sub-pixel corners: cornerSubPix with a window of its own for every corner, and the test whether corners form a board. Pure.

The window must average over as much edge as there is and must not reach the next corner, nor the border of a board whose
outer squares are cut. So it follows the distance to the nearest neighbour, corner by corner.
"""

from __future__ import annotations

import cv2
import numpy as np

from rhot.transforms import Array
from services.calibrator.boards import Board

# Half window in distances to the nearest corner. Real pairs at 640x480 (and 320x240): held-out board fit .0169 (.0169) squares
# at .18-.20, .0149 (.0161) at .25, .0140 (.0163) at .30, .0146 (.0177) at .35, where cut outer squares come into reach.
_WINDOW = 0.25
# 2 px is the least that holds an edge on both sides; above 30 px blur, not noise, decides.
_WINDOW_PX = (2, 30)
# ChArUco: the corners of markers begin (1 - marker) / 2 squares away, diagonally. Their edges must stay out of the window.
_MARKER_SHARE = 0.9
# A corner may wander this share of a square from where neighbours expect it: real lenses and perspective stay below .15.
_REGULAR = 0.3


def spacing(board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Distance in px of every corner (n, 2) to its nearest neighbour on the board; (n,), inf where it has none."""
    nearest = np.full(len(corners), np.inf)
    pairs = board.neighbours(ids)
    length = np.linalg.norm(corners[pairs[:, 0]] - corners[pairs[:, 1]], axis=1)
    np.minimum.at(nearest, pairs[:, 0], length)
    np.minimum.at(nearest, pairs[:, 1], length)
    return nearest


def refine(image: np.ndarray, board: Board, ids: np.ndarray, corners: Array) -> Array:
    """Corners (n, 2) moved to the saddle of the picture (h, w) grey; a corner that runs away stays where it was."""
    near = spacing(board, ids, corners)
    share = _WINDOW if board.kind == "chessboard" else min(_WINDOW, _MARKER_SHARE * (1.0 - board.marker) / 2.0)
    windows = np.clip(np.round(share * np.where(np.isfinite(near), near, 0.0)), *_WINDOW_PX).astype(np.int64)
    refined = corners.copy()
    for window in np.unique(windows):
        chosen = windows == window
        start = np.ascontiguousarray(corners[chosen].reshape(-1, 1, 2), dtype=np.float32)
        # 1e-4 px in at most 100 steps: cornerSubPix converges linearly, and coarser limits show in the residual.
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
        refined[chosen] = cv2.cornerSubPix(image, start, (int(window), int(window)), (-1, -1), stop).reshape(-1, 2)
    ran = np.linalg.norm(refined - corners, axis=1) > np.maximum(windows, 0.3 * np.where(np.isfinite(near), near, 0.0))
    refined[ran] = corners[ran]
    return refined


def is_regular(board: Board, ids: np.ndarray, corners: Array) -> bool:
    """Whether the corners (n, 2) lie like a board: each where its two neighbours in line expect it."""
    if not np.all(np.isfinite(corners)):
        return False
    full = np.full((board.size, 2), np.nan)
    full[ids] = corners
    grid = full.reshape(board.rows, board.cols, 2)
    for axis in (0, 1):
        before, here, after = (np.take(grid, np.arange(start, grid.shape[axis] - 2 + start), axis=axis) for start in range(3))
        bend = np.linalg.norm(before + after - 2.0 * here, axis=-1)
        step = np.minimum(np.linalg.norm(after - here, axis=-1), np.linalg.norm(here - before, axis=-1))
        known = np.isfinite(bend)
        if np.any(bend[known] > 2.0 * _REGULAR * step[known]):
            return False
    return True
