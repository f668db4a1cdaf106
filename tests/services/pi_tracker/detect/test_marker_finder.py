"""Search, identity and measurement together: markers that others occlude."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.step import TrackerStep

SIZE = (160, 100)


@pytest.fixture
def shows(studio):
    """A frame with a green patch at x = 60 and a blue one before it, at a given place.

    The blue one may have a rim of another colour.
    """

    def make(seq, blue_x, rim_px=0):
        image = np.full((SIZE[1], SIZE[0], 3), 140.0, np.float32)
        image[40:52, 60:76] = studio.paints["green"]
        image[36:60, blue_x - rim_px : blue_x] = 90.0
        image[36:60, blue_x : blue_x + 24] = studio.paints["blue"]
        return studio.of(studio.bgr(image, 2.0, seq), seq)

    return make


def markers(step, frame):
    return {marker.color: marker for marker in step.step(frame).markers}


# The last is a single column of cells, which the mask filters take away.
@pytest.mark.parametrize(("left_px", "rim_px"), [(8, 0), (4, 0), (2, 6)])
def test_what_is_left_of_a_marker_is_found_where_it_must_be_and_said_to_be_little(
    shows, colors, left_px, rim_px
):
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"])
    for seq in range(6):
        free = markers(step, shows(seq, 110))
    partly = markers(step, shows(6, 60 + left_px + rim_px, rim_px))
    assert set(partly) == {"green", "blue"}
    assert partly["green"].x_px == pytest.approx(60 + left_px / 2, abs=2.0)
    assert partly["green"].quality < 0.7 * free["green"].quality
    # The middle of the whole is at 67.5.
    assert abs(partly["green"].x_px - 67.5) < 3.0 * partly["green"].sigma_px


def test_a_marker_that_is_gone_is_not_guessed(shows, colors):
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"])
    for seq in range(6):
        markers(step, shows(seq, 110))
    assert set(markers(step, shows(6, 56))) == {"blue"}
    # And found again at once.
    assert set(markers(step, shows(7, 110))) == {"green", "blue"}


def test_without_having_been_seen_a_sliver_is_nothing(shows, colors):
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"])
    assert set(markers(step, shows(0, 62))) == {"blue"}


@pytest.mark.parametrize("hues", [3, 30])
def test_a_marker_out_of_its_range_is_found_where_it_must_be_if_it_is_nearly_its_color(
    studio, colors, hues
):
    """By some hues; what is quite another colour is not it."""

    def shows(seq, paint):
        image = np.full((SIZE[1], SIZE[0], 3), 140.0, np.float32)
        image[40:60, 60:80] = paint
        image[40:60, 120:140] = studio.paints["blue"]
        return studio.of(studio.bgr(image, 0.0, seq), seq)

    high = colors.colors["green"].hsv_high
    shaded = cv2.cvtColor(np.uint8([[[high[0] + hues, 220, 150]]]), cv2.COLOR_HSV2BGR)[0, 0]
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"])
    assert "green" not in markers(step, shows(0, shaded))
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"])
    for seq in range(6):
        markers(step, shows(seq, studio.paints["green"]))
    found = markers(step, shows(6, shaded))
    assert set(found) == ({"green", "blue"} if hues == 3 else {"blue"})
    if hues == 3:
        assert found["green"].x_px == pytest.approx(69.5, abs=0.5)


@pytest.mark.parametrize("is_blue", [False, True])
def test_a_marker_whose_hue_is_nearer_to_another_paints_is_found_unless_it_is_that(studio, is_blue):
    """Where two ranges have hues in common: a dab looks bluer, or goes and blue comes there."""
    ranges = {
        "violet": ColorRange(hsv_low=(123, 90, 30), hsv_high=(144, 255, 255)),
        "blue": ColorRange(hsv_low=(111, 90, 30), hsv_high=(133, 255, 255)),
    }
    violet, both, blue = (
        cv2.cvtColor(np.uint8([[[hue, 220, 150]]]), cv2.COLOR_HSV2BGR)[0, 0]
        for hue in (137, 126, 118)
    )

    def shows(seq, dab, blue_x):
        image = np.full((SIZE[1], SIZE[0], 3), 140.0, np.float32)
        image[40:54, 60:74] = dab
        image[40:54, blue_x : blue_x + 14] = blue
        return studio.of(studio.bgr(image, 0.0, seq), seq)

    colors = Colors(date="d", tool="t", colors=ranges)
    step = TrackerStep("left", colors, Tracker(), SIZE, list(ranges))
    for seq in range(6):
        assert set(markers(step, shows(seq, violet, 120 - 10 * seq * is_blue))) == set(ranges)
    found = markers(step, shows(6, 140.0 if is_blue else both, 60 if is_blue else 120))
    assert set(found) == ({"blue"} if is_blue else set(ranges))
    if not is_blue:
        assert found["violet"].x_px == pytest.approx(66.5, abs=0.5)
        assert found["blue"].x_px == pytest.approx(126.5, abs=0.5)
