"""A rectangle's corners, pointed at by hand, to a tenth of a pixel: where its four sides cross.

Each side is the line through the steepest steps of brightness across it, near what was pointed at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array

# How far from the line between two clicks a side is looked for: clicks are off by 1 to 2 px, and
# lenses bend a side of 250 px by 2.
_REACH_PX, _STEP_PX = 6.0, 0.25
# Samples along a side, and how much of it is left out at its ends, where the other sides are.
_SAMPLES, _MARGIN = 60, 0.12
# A step of fewer grey levels is noise; one that is weaker than a third of the strongest near by is
# another edge.
_WEAKEST, _WEAKER = 4.0, 0.33
# A side needs so many of its samples within so many px of one line.
_SHARE, _OFF_PX = 0.5, 0.6
# No corner is surer: rendered cards after JPEG at quality 60 were off by .11 px, 95 % by .29.
_SIGMA_PX = 0.15


class Corners(NamedTuple):
    """points_px (4, 2), of a picture without distortion; sigma_px; refined: whether the picture's
    own edges were found, else they are the clicks.
    """

    points_px: Array
    sigma_px: float
    refined: bool


def corners_of(
    picture: npt.NDArray[np.uint8],
    clicks_px: Array,
    sigma_px: float,
    straighten: Callable[[Array], Array],
) -> Corners:
    """The corners (4, 2) of a rectangle that clicks (4, 2) px, good to sigma_px, are near."""
    clicks = Corners(straighten(clicks_px), sigma_px, refined=False)
    gray = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    gray = np.asarray(cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 0.8), dtype=np.float32)
    lines, spread = [], []
    for start, end in zip(clicks_px, np.roll(clicks_px, -1, axis=0), strict=True):
        side = _side(gray, start, end, straighten)
        if side is None:
            return clicks
        lines.append(side[0])
        spread.append(side[1])
    # A corner is where its side begins and the one before ends.
    crossing = np.cross(np.roll(lines, 1, axis=0), lines)
    if np.abs(crossing[:, 2]).min() < 1e-6:
        return clicks
    points = crossing[:, :2] / crossing[:, 2:]
    if np.hypot(*(points - clicks.points_px).T).max() > 3.0 * sigma_px + 2.0:
        return clicks
    return Corners(points, max(_SIGMA_PX, 2.0 * max(spread)), refined=True)


def _side(
    gray: npt.NDArray[np.float32],
    start: Array,
    end: Array,
    straighten: Callable[[Array], Array],
) -> tuple[Array, float] | None:
    """A side's line (3,) of a picture without distortion, and its sigma across in px."""
    length = float(np.hypot(*(end - start)))
    along = (end - start) / max(length, 1e-9)
    normal = np.array([-along[1], along[0]])
    reach = min(_REACH_PX, 0.2 * length)
    middle = start + np.linspace(_MARGIN, 1.0 - _MARGIN, _SAMPLES)[:, None] * (end - start)
    offsets = np.arange(-reach, reach + _STEP_PX, _STEP_PX)
    at = (middle[:, None] + offsets[:, None] * normal).astype(np.float32)  # (samples, offsets, 2)
    profile = cv2.remap(gray, at[..., 0], at[..., 1], cv2.INTER_LINEAR)
    slope = np.gradient(np.asarray(profile, dtype=np.float64), axis=1) / _STEP_PX
    strongest = float(np.median(np.abs(slope).max(axis=1)))
    best: tuple[float, Array, float] | None = None
    for sign in (1.0, -1.0):
        size, where = _peaks(sign * slope, offsets)
        good = size > max(_WEAKEST / 2.0, _WEAKER * strongest)
        if good.mean() < _SHARE:
            continue
        fit = _line(straighten(middle[good] + where[good, None] * normal))
        if fit is not None:
            away = abs(float(np.median(where[good])))
            if best is None or away < best[0]:
                best = (away, *fit)
    return best[1:] if best else None


def _peaks(slope: Array, offsets: Array) -> tuple[Array, Array]:
    """Of each sample the steepest step and where it is, by a parabola; (n,) each."""
    at = np.clip(slope.argmax(axis=1), 1, slope.shape[1] - 2)
    rows = np.arange(len(slope))
    before, here, after = slope[rows, at - 1], slope[rows, at], slope[rows, at + 1]
    bend = before - 2.0 * here + after
    shift = np.where(bend < -1e-9, 0.5 * (before - after) / np.minimum(bend, -1e-9), 0.0)
    return here, offsets[at] + _STEP_PX * np.clip(shift, -1.0, 1.0)


def _line(points: Array) -> tuple[Array, float] | None:
    """The line that most points (n, 2) are near, and its sigma; None without one."""
    weight = np.ones(len(points))
    for _ in range(12):
        middle = np.average(points, axis=0, weights=weight)
        x, y = np.linalg.svd((points - middle) * np.sqrt(weight)[:, None])[2][1]
        off = (points - middle) @ (x, y)
        # Tukey's weights, from wide to narrow: a crossing shadow or cable is left out.
        width = max(3.0 * 1.4826 * float(np.median(np.abs(off))), _OFF_PX)
        weight = np.clip(1.0 - (off / width) ** 2, 0.0, None) ** 2 + 1e-6
    near = np.abs(off) < _OFF_PX
    if near.sum() < _SHARE * _SAMPLES:
        return None
    sigma = float(off[near].std()) / np.sqrt(near.sum())
    return np.array([x, y, -(middle @ (x, y))]), sigma
