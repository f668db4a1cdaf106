"""HSV ranges in terms of chroma and luma."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.calibration import ColorRange
from services.pi_tracker.detect.hsv_range import (
    hue_centre,
    hue_distance,
    hue_of_all_chroma,
    hue_width,
    luma_interval,
)


@pytest.mark.parametrize(
    ("low", "high", "width", "centre"), [(40, 80, 40, 60.0), (170, 10, 20, 180.0), (5, 5, 0, 5.0)]
)
def test_hues_may_wrap_through_red(low, high, width, centre):
    color_range = ColorRange(hsv_low=(low, 0, 0), hsv_high=(high, 255, 255))
    assert hue_width(color_range) == width
    assert hue_centre(color_range) == centre
    distance = hue_distance(color_range, np.array([centre % 180.0, high, (centre + 90.0) % 180.0]))
    assert distance[0] == 0.0
    assert distance[1] <= 1.0
    assert width > 100 or distance[2] > 1.0


def test_every_chroma_of_a_range_without_bounds_has_every_luma():
    chroma = hue_of_all_chroma()
    everything = ColorRange(hsv_low=(0, 0, 0), hsv_high=(179, 255, 255))
    low, high = luma_interval(everything, chroma)
    assert (low.min(), low.max(), high.min(), high.max()) == (0.0, 0.0, 255.0, 255.0)


def test_a_range_that_is_empty_in_itself_has_no_luma():
    chroma = hue_of_all_chroma()
    low, high = luma_interval(ColorRange(hsv_low=(0, 200, 0), hsv_high=(179, 100, 255)), chroma)
    # Black has every saturation.
    assert (low > high)[chroma.spread > 0.0].all()
