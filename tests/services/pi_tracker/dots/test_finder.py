"""Dots of one colour in pictures: found, named, told as markers, from the step and its messages."""

from __future__ import annotations

import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from rhot.messages import Marker
from services.cli.offline.looking_back import looked_back
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep

SIZE = (640, 360)
NAMES = (*finger_landmarks("thumb"), *finger_landmarks("index"))
DOTS = {"red": {name: f"red.{name}" for name in NAMES}}
COLORS = Colors(
    colors={
        "red": ColorRange(hsv_low=(170, 120, 60), hsv_high=(8, 255, 255)),
        "blue": ColorRange(hsv_low=(105, 120, 60), hsv_high=(125, 255, 255)),
    }
)
REST = np.array(
    [
        [130, 290],
        [190, 265],
        [232, 245],
        [268, 228],
        [180, 150],
        [250, 120],
        [290, 112],
        [322, 108],
    ],
    float,
)


def _frame(seq: int, places: np.ndarray, blue: tuple[int, int] = (500, 60)) -> Frame:
    """A picture with soft red discs on skin, a blue one, noise, and JPEG."""
    large = np.full((4 * SIZE[1] // 2, 4 * SIZE[0] // 2, 3), (70, 90, 80), np.uint8)
    for k in range(3):
        for chain in (places[:4], places[4:]):
            a, b = (np.round(2 * chain[k + j]).astype(int).tolist() for j in (0, 1))
            cv2.line(large, a, b, (110, 140, 200), 60)
    for x, y in places:
        middle = (round(32 * x), round(32 * y))
        cv2.circle(large, middle, 16 * 15, (35, 25, 190), -1, shift=4)
    cv2.circle(large, (2 * blue[0], 2 * blue[1]), 16, (180, 60, 20), -1)
    image = cv2.resize(cv2.GaussianBlur(large, (0, 0), 2.0), SIZE, interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(seq).normal(0.0, 3.0, image.shape)
    image = np.clip(image + noise, 0, 255).astype(np.uint8)
    packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 70])[1]
    bgr = cv2.imdecode(packed, cv2.IMREAD_COLOR)
    return Frame("side", seq, seq * 33_333_333, 0.0, SIZE, bgr, "bgr")


def _places(number: int) -> np.ndarray:
    """The hand drifts, the index finger's tip bends down past the thumb's."""
    places = REST + np.array([1.5, 0.5]) * number
    share = number / 20.0
    places[6] += share * np.array([-30.0, 45.0])
    places[7] += share * np.array([-75.0, 115.0])
    return places


def _by_name(markers: list[Marker]) -> dict[str, tuple[float, float]]:
    return {marker.color: (marker.x_px, marker.y_px) for marker in markers}


@pytest.mark.parametrize("seeded", [True, False])
def test_eight_dots_of_one_colour_are_eight_markers_beside_another_colour(seeded: bool) -> None:
    places = _places(0)
    seeds = {n: (x + 3.0, y + 2.0) for n, (x, y) in zip(NAMES, places, strict=True)}
    step = TrackerStep(
        "side",
        COLORS,
        Tracker(),
        SIZE,
        ["blue", "red"],
        dots=DOTS,
        seeds=seeds if seeded else None,
    )
    for number in range(21):
        truth = _places(number)
        found = _by_name(step.step(_frame(number, truth)).markers)
        assert found["blue"] == pytest.approx((500, 60), abs=1.0)
        for name, (x, y) in zip(NAMES, truth, strict=True):
            assert found[f"red.{name}"] == pytest.approx((x, y), abs=4.0), (number, name)
    assert not step.notes


def test_new_ranges_leave_the_dots_their_names() -> None:
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)}
    step = TrackerStep("side", COLORS, Tracker(), SIZE, ["red"], dots=DOTS, seeds=seeds)
    before = _by_name(step.step(_frame(0, REST)).markers)
    step.apply_colors(COLORS, "side.colors.json")
    after = _by_name(step.step(_frame(1, REST)).markers)
    assert set(before) == set(after) == set(DOTS["red"].values())
    for name, place in before.items():
        assert after[name] == pytest.approx(place, abs=1.0)


def test_a_recording_is_told_again_with_hindsight() -> None:
    """Frame by frame, in their order; markers of other colours stay as they are."""
    seeds = {n: (x, y) for n, (x, y) in zip(NAMES, REST, strict=True)}
    step = TrackerStep(
        "side",
        COLORS,
        Tracker(),
        SIZE,
        ["blue", "red"],
        dots=DOTS,
        seeds=seeds,
        remembers_dots=True,
    )
    live = [step.step(_frame(number, _places(number))) for number in range(12)]
    again = list(looked_back(live, {"side": step}, 1, Path(tempfile.gettempdir()), False))
    assert [frame.seq for frame in again] == list(range(12))
    for number, frame in enumerate(again):
        found = _by_name(frame.markers)
        assert len(frame.markers) == len(found) == 9
        assert found["blue"] == _by_name(live[number].markers)["blue"]
        for name, (x, y) in zip(NAMES, _places(number), strict=True):
            assert found[f"red.{name}"] == pytest.approx((x, y), abs=4.0), (number, name)
