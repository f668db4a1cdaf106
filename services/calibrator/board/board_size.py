"""Counting the inner corners of an unknown chessboard, by a vote of pictures of it. Pure.

A board that is cut off by the picture's edge, or partly lost in glare, is counted too small. So
sizes are weighed by how many pictures show them whole, the larger one first.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import islice

import cv2
import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.detect import as_grey, detect, reduced

# The smallest grid from which the detector grows a larger one. Growing from 5x4 counted 9x6 in 9 of
# 10 real pictures (OpenCV 5), from 3x3 in 5; 4x3 finds small boards.
_SMALLEST_GRIDS = ((5, 4), (4, 3))
# Sizes that are sold, printed and shipped with tutorials, tried with the classic detector where
# growing fails.
_COMMON_SIZES = (
    *((9, 6), (8, 6), (7, 6), (7, 5), (8, 5), (10, 7)),
    *((6, 5), (6, 4), (5, 4), (9, 7), (11, 8), (8, 7)),
    *((7, 4), (11, 7), (7, 7), (6, 6), (5, 3), (4, 3)),
)
# Pictures asked: enough for a vote, and 5 Mpx pictures cost a tenth of a second each.
_VOTERS = 16
# Pictures in which every common size is tried, which costs up to 18 searches each.
_TRIED = 6
# A size that a fifth of the pictures show beats a smaller one that more of them show in part.
_SHARE = 0.2


def find_board_size(images: Iterable[np.ndarray]) -> tuple[int, int] | None:
    """Inner corners (cols, rows) of the chessboard in these pictures, cols >= rows.

    None if no picture shows one.
    """
    pictures = [as_grey(image) for image in islice(images, _VOTERS)]
    votes: Counter[tuple[int, int]] = Counter()
    for picture in pictures:
        size = _grown_size(reduced(picture)[0])
        if size is not None:
            votes[size] += 1
    total = sum(votes.values())
    likely = [size for size, count in votes.items() if count >= max(1.0, _SHARE * total)]
    for size in sorted(likely, key=lambda size: (size[0] * size[1], size), reverse=True):
        # Growing may add a row that is none: a size counts if a detector that is told it finds it.
        if any(detect(picture, Board(*size, 1.0), quick=True) for picture in pictures):
            return size
    for size in _COMMON_SIZES:
        if any(_shows(reduced(picture)[0], size) for picture in pictures[:_TRIED]):
            return size
    return None


def _grown_size(image: np.ndarray) -> tuple[int, int] | None:
    """The size to which the sector-based detector grows a small grid."""
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    for smallest in _SMALLEST_GRIDS:
        found, _, meta = cv2.findChessboardCornersSBWithMeta(image, smallest, flags)
        if found and meta is not None:
            rows, cols = sorted(np.shape(meta)[:2])
            if rows >= 3:
                return int(cols), int(rows)
    return None


def _shows(image: np.ndarray, size: tuple[int, int]) -> bool:
    """Whether the classic detector finds a board of that size."""
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    return bool(cv2.findChessboardCorners(image, size, flags=flags)[0])
