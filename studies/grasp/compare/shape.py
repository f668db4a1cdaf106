"""How alike two paths of a tip are: Procrustes distance, and dynamic time warping. Pure.

Paths are those of the tip from the MCP joint in the finger's plane, divided by the length of the
finger: people of any size can be compared. Procrustes: what is left, RMS over frames, once one path
has been shifted and turned onto the other (not scaled: size is taken out by the length), so that a
base line drawn a little differently makes no difference. Dynamic time warping (Sakoe & Chiba 1978):
the same without turning, but with frames paired as fits best, so that pace makes none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array

# Frames may be paired with others so far away, as a share of the path: a finger that curls before
# the knuckle moves, and one that does so afterwards, differ and shall.
_WARP_SHARE = 0.25


class Alignment(NamedTuple):
    """One path turned and shifted onto another."""

    distance: float  # RMS over frames
    turn_rad: float
    path: Array  # (n, 2) as it lies there


def procrustes(path: Array, onto: Array) -> Alignment:
    """Rigid alignment of path (n, 2) onto another (n, 2), frame by frame (Kabsch 1976)."""
    centre, other = path.mean(axis=0), onto.mean(axis=0)
    a, b = path - centre, onto - other
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    c, s = np.cos(turn), np.sin(turn)
    moved = a @ np.array([[c, s], [-s, c]]) + other
    return Alignment(_rms(moved - onto), turn, moved)


class Warping(NamedTuple):
    """Frames of two paths, paired."""

    distance: float  # RMS over pairs
    pairs: Array  # (m, 2) numbers of frames, both from the first to the last
    lag: float  # share of the path by which frames are paired with later ones, on the average


def warping(path: Array, onto: Array) -> Warping:
    """Dynamic time warping of path (n, 2) and onto (k, 2)."""
    n, k = len(path), len(onto)
    gaps = ((path[:, None] - onto[None]) ** 2).sum(axis=2)
    window = max(_WARP_SHARE * max(n, k), abs(n - k) + 1)
    # Lists: numpy takes four times as long for single numbers.
    rows_of_gaps, above, total = gaps.tolist(), [0.0, *[np.inf] * k], []
    total.append(above)
    for i in range(n):
        row, middle, before = [np.inf] * (k + 1), i * (k - 1) / max(n - 1, 1), rows_of_gaps[i]
        for j in range(max(0, int(middle - window)), min(k, int(middle + window) + 1)):
            row[j + 1] = before[j] + min(above[j], above[j + 1], row[j])
        total.append(row)
        above = row
    pairs = _way_back(np.array(total))
    rows, columns = pairs[:, 0], pairs[:, 1]
    lag = float(np.mean(rows / max(n - 1, 1) - columns / max(k - 1, 1)))
    return Warping(float(np.sqrt(gaps[rows, columns].mean())), pairs, lag)


def warped(path: Array, onto: Array) -> Array:
    """The points of path that are paired with each frame of onto, their mean where several are."""
    pairs = warping(path, onto).pairs
    columns = np.arange(len(onto))
    return np.array([path[pairs[pairs[:, 1] == k, 0]].mean(axis=0) for k in columns])


def _way_back(total: Array) -> Array:
    """The cheapest way from the last pair to the first."""
    i, j = total.shape[0] - 1, total.shape[1] - 1
    pairs = [(i - 1, j - 1)]
    while (i, j) != (1, 1):
        steps = ((i - 1, j - 1), (i - 1, j), (i, j - 1))
        i, j = min(steps, key=lambda at: total[at])
        pairs.append((i - 1, j - 1))
    return np.array(pairs[::-1])


def _rms(gaps: Array) -> float:
    return float(np.sqrt((gaps**2).sum(axis=1).mean()))
