"""What is told of a marker that was measured, whole, partly covered, or in doubt. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

from rhot.messages import Marker
from services.pi_tracker.measure.centroid import Centroid

# Where half of a disc is occluded, the centre of the rest is 4 r / (3 pi) from the whole's: .24 of
# the square root of its area, in some direction; so much per coordinate and fraction. And never is
# all of it occluded.
_OCCLUSION_SIGMA, _MAX_OCCLUDED = 0.34, 0.9
# A marker whose place was predicted so much worse than the others' (times their median, and px) and
# whose area is another than it was may be something else, or have something else with it: its sigma
# is the rest of that, times the share of the area that is too little or too much. (Tuning rooms of
# benchmarks/rooms.py, points' largest errors without lag: a tip before a table of its colour 334 ->
# 158 mm, one before a thing of it 203 -> 139; thirteen tuning pictures without such things 1.002.)
_USUAL_TIMES, _USUAL_PX = 2.0, 3.0


def doubts_px(
    departures_px: Sequence[float], areas_px2: Sequence[float], wholes_px2: Sequence[float]
) -> list[float]:
    """Sigma that each marker of a frame has as it may be something else, px.

    departures_px: how far it is from where it was predicted; wholes_px2: its area where all shows.
    """
    if not departures_px:
        return []
    usual_px = _USUAL_TIMES * median(departures_px) + _USUAL_PX
    doubts = []
    for off_px, area, whole in zip(departures_px, areas_px2, wholes_px2, strict=True):
        alike = min(area, whole) / max(area, whole, 1.0)
        doubts.append(max(off_px - usual_px, 0.0) * (1.0 - alike))
    return doubts


def marker_of(
    name: str, centroid: Centroid, certainty: float, occluded: float, doubt_px: float
) -> Marker:
    """A marker of which the fraction `occluded` is covered.

    That moves the centre; where to is unknown, so sigma grows. doubt_px: one of doubts_px().
    """
    sigma_px = math.hypot(centroid.sigma_px, doubt_px)
    quality = centroid.quality * certainty
    if occluded > 0.0:
        whole_px2 = centroid.area_px / (1.0 - min(occluded, _MAX_OCCLUDED))
        sigma_px = math.hypot(sigma_px, _OCCLUSION_SIGMA * occluded * math.sqrt(whole_px2))
        quality *= 1.0 - occluded
    return Marker(
        color=name,
        # A hundredth of the best sigma is as fine as the position deserves.
        # Whole units first: to round decimals takes twice as long.
        x_px=round(1e3 * centroid.x_px) / 1e3,
        y_px=round(1e3 * centroid.y_px) / 1e3,
        area_px=round(10.0 * centroid.area_px) / 10.0,
        sigma_px=round(1e4 * sigma_px) / 1e4,
        quality=round(1e3 * quality) / 1e3,
    )
