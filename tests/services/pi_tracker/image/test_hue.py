"""Hues are angles: differences wrap, means are circular, and OpenCV's hue is ours."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.pi_tracker.image.hue import hue_difference, hue_of_chroma, mean_hue

HUES = st.floats(0.0, 180.0, exclude_max=True)


@given(hue=HUES, other=HUES)
def test_a_difference_is_the_shorter_way_and_leads_back(hue, other):
    difference = hue_difference(hue, other)
    assert -90.0 <= difference <= 90.0
    assert np.cos((other + difference - hue) * np.pi / 90.0) == pytest.approx(1.0)


@given(centre=HUES, spread=st.floats(0.0, 40.0))
def test_the_mean_lies_in_the_middle_wherever_hues_wrap(centre, spread):
    hues = np.array([centre - spread, centre, centre + spread]) % 180.0
    assert hue_difference(mean_hue(hues, np.ones(3)), centre) == pytest.approx(0.0, abs=1e-6)


def test_hues_are_those_of_opencv():
    bgr = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    expected = cv2.cvtColor(bgr, cv2.COLOR_BGR2HSV)[..., 0].astype(float)
    blue, green, red = np.moveaxis(bgr.astype(float), 2, 0)
    # BT.601, the inverse of what hue.py has.
    u = 0.439216 * blue - 0.290993 * green - 0.148223 * red
    v = -0.071427 * blue - 0.367788 * green + 0.439216 * red
    found = hue_of_chroma(u, v)
    clear = found.spread > 30.0
    assert np.abs(hue_difference(found.hue, expected))[clear].max() < 0.6
