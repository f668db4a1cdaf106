"""What board is that? Counts the inner corners of a chessboard in pictures of it, by vote. Pure.

A board that is cut off by the picture's edge, or partly lost in glare, is counted too small, so
sizes are weighed by how many pictures show them whole, the larger one first. No board in any
picture gives None.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import cv2
import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.detect import as_grey, detect, reduced

# The smallest grid to grow from. Growing from 5x4 counted 9x6 in 9 of 10 real pictures (OpenCV 5),
# from 3x3 in 5; 4x3 finds small boards.
_SEEDS = ((5, 4), (4, 3))
# Sizes that are sold, printed and shipped with tutorials, tried with the classic detector where
# growing fails.
_COMMON = (
    (9, 6),
    (8, 6),
    (7, 6),
    (7, 5),
    (8, 5),
    (10, 7),
    (6, 5),
    (6, 4),
    (5, 4),
    (9, 7),
    (11, 8),
    (8, 7),
    (7, 4),
    (11, 7),
    (7, 7),
    (6, 6),
    (5, 3),
    (4, 3),
)
# Pictures asked: enough for a vote, and 5 Mpx pictures cost a tenth of a second each.
_VOTERS = 16
# A size that a fifth of the pictures show beats a smaller one that more of them show in part.
_SHARE = 0.2


def guess_corners(images: Iterable[np.ndarray]) -> tuple[int, int] | None:
    """(cols, rows) of the chessboard in these pictures, cols >= rows.

    None if no picture shows one.
    """
    pictures = [as_grey(image) for _, image in zip(range(_VOTERS), images, strict=False)]
    votes = Counter(
        size for picture in pictures if (size := _grown(reduced(picture)[0])) is not None
    )
    total = sum(votes.values())
    likely = [size for size, count in votes.items() if count >= max(1.0, _SHARE * total)]
    for size in sorted(likely, key=lambda size: (size[0] * size[1], size), reverse=True):
        # Growing may add a row that is none; a size counts if a detector told that size finds it.
        if any(detect(picture, Board(*size, 1.0), quick=True) for picture in pictures):
            return size
    for size in _COMMON:
        if any(_classic(reduced(picture)[0], size) for picture in pictures[:6]):
            return size
    return None


def _grown(image: np.ndarray) -> tuple[int, int] | None:
    for seed in _SEEDS:
        flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, _, meta = cv2.findChessboardCornersSBWithMeta(image, seed, flags)
        if found and meta is not None:
            rows, cols = sorted(np.shape(meta)[:2])
            if rows >= 3:
                return int(cols), int(rows)
    return None


def _classic(image: np.ndarray, size: tuple[int, int]) -> bool:
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    return bool(cv2.findChessboardCorners(image, size, flags=flags)[0])
