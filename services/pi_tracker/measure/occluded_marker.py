"""What is told of a marker that was measured, whole or partly covered. Pure."""

from __future__ import annotations

import math

from rhot.messages import Marker
from services.pi_tracker.measure.centroid import Centroid

# Where half of a disc is occluded, the centre of the rest is 4 r / (3 pi) from the whole's: .24 of
# the square root of its area, in some direction; so much per coordinate and fraction. And never is
# all of it occluded.
_OCCLUSION_SIGMA, _MAX_OCCLUDED = 0.34, 0.9


def marker_of(name: str, centroid: Centroid, certainty: float, occluded: float) -> Marker:
    """A marker of which the fraction `occluded` is covered.

    That moves the centre; where to is unknown, so sigma grows.
    """
    sigma_px, quality = centroid.sigma_px, centroid.quality * certainty
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
