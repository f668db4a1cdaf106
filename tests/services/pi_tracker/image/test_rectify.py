"""Undistorted pictures, and markers that stay where the camera sees them."""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
import pytest

from rhot.errors import SourceError
from rhot.files.calibration import Lens
from rhot.files.rig_tables import Tracker
from rhot.geometry.camera import Camera
from services.pi_tracker.image.frame import Frame
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
    """Two tips of one hand in a corner: no further from each other than a hand reaches."""
    tips = [tip("green", 95.0, 70.0), tip("blue", 40.0, 35.0)]
    return lambda layout="i420": studio.frame(tips, 1, layout, size_px=SIZE, sigma=1.0)[0]


def frame_with(plane, values):
    """A frame with values (h, w) in one plane: bgr, or Y, U or V of I420."""
    if plane == "bgr":
        image = np.repeat(values[..., None], 3, axis=2).astype(np.uint8)
        return Frame("left", 0, 0, 0.0, SIZE, image, "bgr")
    image = np.full((SIZE[1] * 3 // 2, SIZE[0]), 128, np.uint8)
    plane_of(image, plane)[:] = values
    return Frame("left", 0, 0, 0.0, SIZE, image, "i420")


def plane_of(image, plane):
    """One plane (h, w) of an image, as a view."""
    if plane == "bgr":
        return image[..., 1]
    if plane == "Y":
        return image[: SIZE[1]]
    return image[SIZE[1] :].reshape(2, SIZE[1] // 2, SIZE[0] // 2)["UV".index(plane)]


def interpolated(values, places):
    """Values (h, w) at places (n, 2), bilinear; all of them inside."""
    x, y = places.T
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, below = x - column, y - row
    upper = (1 - right) * values[row, column] + right * values[row, column + 1]
    lower = (1 - right) * values[row + 1, column] + right * values[row + 1, column + 1]
    return (1 - below) * upper + below * lower


@pytest.mark.parametrize(("plane", "pitch"), [("bgr", 1), ("Y", 1), ("U", 2), ("V", 2)])
def test_a_rectified_picture_agrees_with_the_camera_model(lens, plane, pitch):
    """Test: a smooth picture, each pixel of which rhot/geometry/camera.py undistorts.

    Expected: the rectified picture, made with OpenCV's maps, shows it at that place: all planes.
    """
    width, height = SIZE[0] // pitch, SIZE[1] // pitch
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    elements = np.stack([x.ravel(), y.ravel()], axis=1)  # (n, 2) of the plane
    centre = 0.5 * (pitch - 1)
    pixels = elements * pitch + centre
    shown = np.rint(120.0 + 50.0 * np.sin(0.11 * pixels[:, 0]) + 50.0 * np.cos(0.09 * pixels[:, 1]))
    frame = frame_with(plane, shown.reshape(height, width))
    rectified = plane_of(Rectifier(lens).rectify(frame).image, plane).astype(float)

    camera = Camera("lens", SIZE, np.array(MATRIX), np.array(lens.distortion), np.eye(4))
    rays = camera.rays_from_pixels(pixels)
    focal, middle = np.diag(MATRIX)[:2], np.array(MATRIX)[:2, 2]
    places_px = rays * focal + middle
    assert np.abs(places_px - pixels).max() > 10.0  # the distortion is not small
    places = (places_px - centre) / pitch
    inside = ((places >= 0.0) & (places < [width - 1, height - 1])).all(axis=1)
    assert np.count_nonzero(inside) > 0.8 * len(pixels)
    error = interpolated(rectified, places[inside]) - shown[inside]
    # Rounding to whole levels twice. Levels change by up to 7.1 per pixel, so that even this little
    # would be .1 px.
    assert np.sqrt(np.mean(error**2)) < 0.5
    assert np.abs(error).max() < 2.0


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
        # Another sampling of the same picture; the paper's whole-pixel contours change more.
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
    (moved,) = rectified.step(rectifier.rectify(frame())).markers
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
        Rectifier(lens).rectify(studio.frame([], size_px=(64, 64))[0])


def test_no_markers_no_places(lens):
    assert Rectifier(lens).to_camera_pixels([]) == []


def test_what_the_camera_does_not_see_is_black_in_both_ranges(lens):
    """A lens that draws the corners in leaves none of its picture there."""
    bowed = msgspec.structs.replace(lens, distortion=(0.3, 0.0, 0.0, 0.0, 0.0))
    grey = frame_with("Y", np.full(SIZE[::-1], 120.0))
    for full_range, black in ((False, 16), (True, 0)):
        seen = Rectifier(bowed).rectify(dataclasses.replace(grey, full_range=full_range))
        assert seen.full_range is full_range
        assert seen.image[0, 0] == black
        assert seen.image[SIZE[1] // 2, SIZE[0] // 2] == 120
