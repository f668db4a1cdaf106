"""Patches of blobs: a blob that several dots have run together into is cut into as many parts.

Pure. A blob is cut where it is both larger and longer than one dot can be; where each part is one
dot's, each has a centre of its own, if a rough one. Dots that hide behind each other entirely are
not seen here: they share a patch later (hypothesis.py).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.blob import Blob

Array = npt.NDArray[np.float64]

# A blob of more than so many times a dot's area may be two. (Dots of one hand differ by a third.)
_LARGE = 1.35
# And it is where its variance along its longer axis is so many times that of a disc of one dot's
# area: of two discs side by side it is 5 times, of two that overlap by half 2.4 times.
_LONG = 2.2
# It is cut into as few parts as leave each this round: a disc's variance along any axis is its area
# / (4 pi), that of a disc and a half side by side twice that. (Cut by area alone, two dots nearer
# to the camera than the others were three: `grab`, seeds 2, 10, 14 and 17 of benchmarks/dots.py:
# 74, 95, 97 and 87 % right live, 99.6 % or more so.) No part is smaller than this share of a dot:
# of few cells none is round, and a dot that shows more than others was four.
_ROUND, _LEAST_PART = 1.5, 0.5
_MAX_PARTS, _ROUNDS = 4, 8


def parts_of(blob: Blob, dot_area_px2: float) -> list[tuple[float, float, float]]:
    """Centres (x, y) px and areas px^2 of the dots that a blob may be; one is not cut."""
    whole = [(blob.x_px, blob.y_px, blob.area_px)]
    if dot_area_px2 <= 0.0 or blob.area_px < _LARGE * dot_area_px2:
        return whole
    rows, columns = np.nonzero(blob.mask)
    cells = np.stack([columns, rows], axis=1).astype(np.float64)  # (c, 2)
    values, vectors = np.linalg.eigh(np.asarray(np.cov(cells.T), np.float64))
    # A disc of area A has variance A / (4 pi) along any axis; a cell is 4 px^2.
    if values[1] < _LONG * dot_area_px2 / 4.0 / (4.0 * np.pi):
        return whole
    most = min(_MAX_PARTS, int(blob.area_px / (_LEAST_PART * dot_area_px2)))
    for count in range(2, most + 1):
        centres, own = _cut(cells, np.asarray(vectors[:, 1], np.float64), count)
        if all(_is_round(cells[own == k]) for k in range(count)):
            break
    left, top = blob.rect[0], blob.rect[1]
    x, y = 2.0 * (centres[:, 0] + left) + 0.5, 2.0 * (centres[:, 1] + top) + 0.5
    areas = 4.0 * np.bincount(own, minlength=count)
    return [(float(x[k]), float(y[k]), float(areas[k])) for k in range(count) if areas[k] > 0.0]


def _cut(cells: Array, axis: Array, count: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """Centres (count, 2) of parts of cells (c, 2) in a row along an axis, and each cell's part."""
    along = (cells - cells.mean(axis=0)) @ axis
    shares = np.quantile(along, (np.arange(count) + 0.5) / count)
    return _k_means(cells, cells.mean(axis=0) + np.outer(shares, axis))


def _is_round(cells: Array) -> bool:
    """Whether a part is no longer than one dot's: of no cells or one, yes."""
    if len(cells) < 2:
        return True
    values = np.linalg.eigvalsh(np.asarray(np.cov(cells.T), np.float64))
    return bool(values[1] < _ROUND * len(cells) / (4.0 * np.pi))


def _k_means(points: Array, centres: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """Lloyd's algorithm: centres (k, 2), and the centre of each point (c,)."""
    own = np.zeros(len(points), np.int64)
    for _ in range(_ROUNDS):
        own = np.argmin(np.sum((points[:, None] - centres[None]) ** 2, axis=2), axis=1)
        counts = np.maximum(np.bincount(own, minlength=len(centres)), 1)[:, None]
        sums = np.stack([np.bincount(own, points[:, k], len(centres)) for k in (0, 1)], axis=1)
        centres = sums / counts
    return centres, own
