"""Pictures of a hand with eight red dots on thumb and index finger, a blue one beside it."""

from __future__ import annotations

import cv2
import numpy as np

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.image.frame import Frame

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


def dot_picture(seq: int, places: np.ndarray, blue: tuple[int, int] = (500, 60)) -> Frame:
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


def dot_places(number: int) -> np.ndarray:
    """The hand drifts, the index finger's tip bends down past the thumb's."""
    places = REST + np.array([1.5, 0.5]) * number
    share = number / 20.0
    places[6] += share * np.array([-30.0, 45.0])
    places[7] += share * np.array([-75.0, 115.0])
    return places
