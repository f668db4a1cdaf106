"""How far two colours are apart: d' of their chromaticity, and the gap between their hue ranges.

d' is the distance of two clouds of chroma over luma in units of their spread (Fisher's
discriminant): at 6 a bound half way misjudges one cell in 700, at 4 one in 40, at 2 one in 6.
Shading does not change it. Pure.
"""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import ColorRange
from services.pi_tracker.detect.hsv_range import hue_centre, hue_width
from services.pi_tracker.image.chroma import Cells
from services.pi_tracker.image.hue import Array, hue_difference

# Fewer cells than this say nothing about a cloud.
_MIN_CELLS = 8
# Tails clipped from a cloud before its covariance, and the least standard deviation: rounding of
# chroma at mid luma.
_TAIL, _MIN_SIGMA = 0.02, 0.004


def separation(a: Cells, b: Cells) -> float:
    """d' of two clouds of cells (n,), -1 if one has too few."""
    if a.y.size < _MIN_CELLS or b.y.size < _MIN_CELLS:
        return -1.0
    cloud_a, cloud_b = _clipped(a.chromaticity), _clipped(b.chromaticity)
    difference = np.median(cloud_a, axis=0) - np.median(cloud_b, axis=0)  # (2,)
    covariance = (np.cov(cloud_a.T) + np.cov(cloud_b.T)) / 2.0 + np.eye(2) * _MIN_SIGMA**2
    return float(np.sqrt(difference @ np.linalg.solve(covariance, difference)))


def _clipped(chromaticity: Array) -> Array:
    """A cloud (n, 2) with its tails clipped."""
    low, high = np.quantile(chromaticity, [_TAIL, 1.0 - _TAIL], axis=0)
    return np.clip(chromaticity, low, high)


def hue_gap(a: ColorRange, b: ColorRange) -> int:
    """Hue steps between two ranges, 0 if they touch, negative by how much they overlap."""
    apart = abs(hue_difference(hue_centre(a), hue_centre(b)))
    return round(apart - (hue_width(a) + hue_width(b)) / 2.0)
