"""Whole pictures without the lens's distortion, and markers that stay where the camera sees them."""

from __future__ import annotations

import pytest

from rhot.errors import SourceError
from rhot.files.calibration import Lens
from rhot.files.config import Tracker
from services.pi_tracker.image.rectify import Rectifier
from services.pi_tracker.step import TrackerStep

SIZE = (320, 240)
MATRIX = ((260.0, 0.0, 161.0), (0.0, 260.0, 118.0), (0.0, 0.0, 1.0))


@pytest.fixture
def lens():
    """As strong a barrel distortion as a Raspberry Pi camera's wide lens has."""
    return Lens(size_px=SIZE, matrix=MATRIX, distortion=(-0.25, 0.06, 0.001, -0.001, 0.0))


@pytest.fixture
def frame(studio, tip):
    """Two tips of one hand in a corner, at any layout: no further from each other than a hand
    reaches.
    """
    tips = [tip("green", 95.0, 70.0), tip("blue", 40.0, 35.0)]
    return lambda layout="i420": studio.frame(tips, 1, layout, size_px=SIZE, sigma=1.0)[0]


@pytest.mark.parametrize("layout", ["i420", "bgr"])
@pytest.mark.parametrize("method", ["lut", "paper"])
def test_markers_are_told_where_the_camera_shows_them(frame, colors, lens, layout, method):
    plain = TrackerStep("left", colors, Tracker(method=method), SIZE, ["green", "blue"])
    rectifying = TrackerStep(
        "left", colors, Tracker(method=method), SIZE, ["green", "blue"], lens=lens
    )
    expected = {marker.color: marker for marker in plain.step(frame(layout)).markers}
    found = {marker.color: marker for marker in rectifying.step(frame(layout)).markers}
    assert set(found) == set(expected) == {"green", "blue"}
    for name, marker in found.items():
        # Another sampling of the same picture; the seed's whole-pixel contours change more.
        assert (marker.x_px, marker.y_px) == pytest.approx(
            (expected[name].x_px, expected[name].y_px), abs=0.3 if method == "lut" else 1.0
        )


@pytest.mark.parametrize("width_px", [7.0, 8.0, 9.0])
def test_small_tips_are_found_in_rectified_pictures(studio, tip, colors, lens, width_px):
    for number in range(6):
        x, y = 40.0 + 0.37 * number, 35.0 + 0.23 * number
        tips = [
            tip("blue", x, y, width_px),
            tip("green", x + 6 * width_px, y + 4 * width_px, width_px),
        ]
        seen, _ = studio.frame(tips, number, size_px=SIZE)
        for known in (None, lens):
            step = TrackerStep("left", colors, Tracker(), SIZE, ["green", "blue"], lens=known)
            assert {marker.color for marker in step.step(seen).markers} == {"green", "blue"}


def test_the_rectified_picture_is_that_of_a_pinhole(frame, colors, lens):
    rectifier = Rectifier(lens)
    plain, rectified = (TrackerStep("left", colors, Tracker(), SIZE, ["blue"]) for _ in range(2))
    (shown,) = plain.step(frame()).markers
    (moved,) = rectified.step(rectifier.frame(frame())).markers
    # The camera's model says where the distorted marker belongs; in a corner that is pixels away.
    ray = rectifier._camera.rays_from_pixels([(shown.x_px, shown.y_px)])[0]
    straight = (MATRIX[0][0] * ray[0] + MATRIX[0][2], MATRIX[1][1] * ray[1] + MATRIX[1][2])
    assert (moved.x_px, moved.y_px) == pytest.approx(straight, abs=0.3)
    assert abs(moved.x_px - shown.x_px) > 3.0


def test_the_time_it_takes_is_told(frame, colors, lens):
    ticks = iter(range(0, 10**9, 10**6))
    step = TrackerStep("left", colors, Tracker(), SIZE, ["green"], lambda: next(ticks), lens=lens)
    step.step(frame())
    assert {"rectify", "search", "identity", "centroid", "step"} == set(step.times_ms)


def test_another_size_than_the_lens_is_refused(studio, lens):
    with pytest.raises(SourceError, match="rectify = false"):
        Rectifier(lens).frame(studio.frame([], size_px=(64, 64))[0])


def test_no_markers_no_places(lens):
    assert Rectifier(lens).back([]) == []
