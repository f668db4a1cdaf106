"""Detecting a board in a picture: numbered sub-pixel corners, or None without a whole board. Pure.

Which detector finds the corners does not matter for accuracy, since corner_refinement.py moves them
to sub-pixel places. So detectors are tried until one finds the board: the sector-based one stands
blur and noise, the classic one steep views (each misses pictures that the other one finds). A
chessboard must be seen whole; of a ChArUco board any part will do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import canonical_order
from services.calibrator.board.corner_refinement import (
    corner_spacing,
    is_regular_grid,
    refine_corners,
)

# Detectors work on pictures this wide at most: a board that fills a tenth of the picture still has
# squares of 10 px, and 5 Mpx take seconds.
_SEARCH_PX = 1280
# A ChArUco view with fewer corners fixes no pose.
_MIN_CHARUCO = 6
# Corners closer than this cannot be told apart to a tenth of a pixel.
_MIN_SPACING_PX = 4.0

# Flags of the sector-based detector when time does not matter.
_THOROUGH_FLAGS = (
    cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE,
    cv2.CALIB_CB_EXHAUSTIVE,
)
_CLASSIC_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE


@dataclass(frozen=True, eq=False)
class Detection:
    """The corners of one board in one picture of size_px (width, height)."""

    ids: np.ndarray  # (n,) int, ascending numbers of the corners
    corners: Array  # (n, 2) px
    size_px: tuple[int, int]


# The detections of each camera, by the key of the picture; equal keys are one instant.
Detections = dict[str, dict[str, Detection]]


def detect(image: np.ndarray, board: Board, *, quick: bool = False) -> Detection | None:
    """Detect the board in a picture (h, w) or (h, w, 3) uint8.

    None if the board is not there as a whole (of a ChArUco board, six corners or more in two rows
    and columns). quick tries the two fastest detectors only: they miss one picture in twenty, and a
    picture without a board costs a fifth.
    """
    grey = as_grey(image)
    if board.kind == "charuco":
        found = _charuco_corners(grey, board)
    else:
        found = _chessboard_corners(grey, board, quick)
    if found is None:
        return None
    ids, corners = found
    if float(corner_spacing(board, ids, corners).min()) < _MIN_SPACING_PX:
        return None
    corners = refine_corners(grey, board, ids, corners)
    if not is_regular_grid(board, ids, corners):
        return None
    return Detection(ids, corners, (grey.shape[1], grey.shape[0]))


def as_grey(image: np.ndarray) -> np.ndarray:
    """A contiguous grey uint8 picture (h, w)."""
    if image.ndim == 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if image.shape[2] == 3 else image[..., 0]
    return np.ascontiguousarray(image, dtype=np.uint8)


def reduced(grey: np.ndarray) -> tuple[np.ndarray, float]:
    """The picture at most _SEARCH_PX wide, and the size of one of its pixels in original pixels."""
    factor = max(grey.shape) / _SEARCH_PX
    if factor <= 1.0:
        return grey, 1.0
    size = (round(grey.shape[1] / factor), round(grey.shape[0] / factor))
    return cv2.resize(grey, size, interpolation=cv2.INTER_AREA), grey.shape[1] / size[0]


def _chessboard_corners(
    grey: np.ndarray, board: Board, quick: bool
) -> tuple[np.ndarray, Array] | None:
    """Numbers (n,) and corners (n, 2) from the first detector that finds a regular whole board."""
    ids = np.arange(board.size)
    for corners in _candidates(grey, board, quick):
        if len(corners) == board.size and is_regular_grid(board, ids, corners):
            return ids, canonical_order(grey, board.cols, board.rows, corners)
    return None


def _candidates(grey: np.ndarray, board: Board, quick: bool) -> Iterator[Array]:
    """What each detector finds, cheapest first (2 to 30 ms at 640x480, then 60 ms and more).

    Without a board, all are tried.
    """
    small, factor = reduced(grey)
    pattern = (board.cols, board.rows)
    yield from _classic(small, pattern, factor)
    yield from _sector_based(small, pattern, 0, factor)
    if quick:
        return
    for flags in _THOROUGH_FLAGS:
        yield from _sector_based(small, pattern, flags, factor)
    if factor > 1.0:
        yield from _sector_based(grey, pattern, _THOROUGH_FLAGS[0], 1.0)
    elif max(grey.shape) <= _SEARCH_PX / 2:
        double = cv2.resize(grey, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC)
        yield from _classic(double, pattern, 0.5)


def _sector_based(
    image: np.ndarray, pattern: tuple[int, int], flags: int, factor: float
) -> Iterator[Array]:
    found, corners = cv2.findChessboardCornersSB(image, pattern, flags=flags)
    if found:
        yield _rescaled(corners, factor)


def _classic(image: np.ndarray, pattern: tuple[int, int], factor: float) -> Iterator[Array]:
    found, corners = cv2.findChessboardCorners(image, pattern, flags=_CLASSIC_FLAGS)
    if found:
        yield _rescaled(corners, factor)


def _rescaled(corners: np.ndarray, factor: float) -> Array:
    """Corners (n, 2) in original pixels, of a picture whose pixels are `factor` of those.

    Pixel centres are whole numbers.
    """
    # OpenCV 4 gives (n, 1, 2), OpenCV 5 (n, 2).
    return (corners.reshape(-1, 2).astype(np.float64) + 0.5) * factor - 0.5


def _charuco_corners(grey: np.ndarray, board: Board) -> tuple[np.ndarray, Array] | None:
    """Ascending numbers (n,) and corners (n, 2) of the part of a ChArUco board that is seen."""
    for image, factor in _charuco_scales(grey):
        corners, ids, _, _ = cv2.aruco.CharucoDetector(charuco_board(board)).detectBoard(image)
        if ids is None or corners is None or len(ids) < _MIN_CHARUCO:
            continue
        order = np.argsort(np.asarray(ids).reshape(-1))
        numbers = np.asarray(ids).reshape(-1)[order].astype(np.int64)
        # Corners in one line fix no pose.
        if len(set(numbers % board.cols)) < 2 or len(set(numbers // board.cols)) < 2:
            continue
        return numbers, _rescaled(np.asarray(corners), factor)[order]
    return None


def _charuco_scales(grey: np.ndarray) -> Iterator[tuple[np.ndarray, float]]:
    small, factor = reduced(grey)
    yield small, factor
    if factor > 1.0:
        yield grey, 1.0


def charuco_board(board: Board) -> cv2.aruco.CharucoBoard:
    """OpenCV's description of a ChArUco board."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    squares = (board.cols + 1, board.rows + 1)
    described = cv2.aruco.CharucoBoard(
        squares, board.square_m, board.marker * board.square_m, dictionary
    )
    described.setLegacyPattern(board.legacy)
    return described
