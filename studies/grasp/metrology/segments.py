"""Line segments: fitted to points that should be straight, or detected in a picture."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array

# A detected segment below this share of the picture's diagonal says little about a direction: an
# end that is off by half a pixel turns 28 px by a degree.
_SHORTEST = 0.035


def segment_of(points_px: npt.ArrayLike) -> Array:
    """The segment (2, 2) that fits points (n, 2) best: total least squares, ends as far as the
    points reach. CalibrationError where they are one point.
    """
    points = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle)
    if len(points) < 2 or size[0] < 1e-9:
        raise CalibrationError(
            f"a line needs two points that are apart, and has {len(points)} at one place;"
            " give both ends of each edge"
        )
    reach = (points - middle) @ axes[0]
    return middle + np.array([[reach.min()], [reach.max()]]) * axes[0]


def detected(picture: npt.NDArray[np.uint8]) -> Array:
    """Segments (n, 2, 2) of a picture (h, w) or (h, w, 3), longest first: the line segment
    detector of von Gioi et al. 2012. The picture should be corrected for its lens.
    """
    gray = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    lines: Any = cv2.createLineSegmentDetector().detect(gray)[0]  # None where there are none
    segments = np.asarray([] if lines is None else lines, dtype=np.float64).reshape(-1, 2, 2)
    lengths = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    order = np.argsort(-lengths, kind="stable")
    long = lengths[order] >= _SHORTEST * np.hypot(*gray.shape)
    return segments[order[long]]


def homogeneous(points: npt.ArrayLike) -> Array:
    """(n, 2) -> (n, 3)."""
    flat = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    return np.concatenate([flat, np.ones((len(flat), 1))], axis=1)


def inverted(H: Array) -> Array:
    """The inverse of a matrix (n, n)."""
    return np.asarray(np.linalg.inv(H), dtype=np.float64)
