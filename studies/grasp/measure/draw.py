"""A picture with the finger that was measured in it: joints, segments, angles, confidence. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise

import cv2
import numpy as np

from services.pi_tracker.image.frame import Image
from studies.grasp.measure.joints import Finger, Place, Seen
from studies.grasp.measure.plane import FingerPlan, Segment, label
from studies.grasp.measure.recordings import Finding
from studies.grasp.recording import GraspFrame

# BGR; told apart by colour-blind people, too (Okabe & Ito 2008): blue, vermilion, green, orange,
# purple.
_COLORS: dict[Finger, tuple[int, int, int]] = {
    "index": (178, 114, 0),
    "thumb": (0, 94, 213),
    "middle": (115, 158, 0),
    "ring": (0, 159, 230),
    "little": (167, 121, 204),
}
_WHITE = (255, 255, 255)
# OpenCV draws between pixels in so many bits of fraction.
_SHIFT = 4
# The size of type and strokes suits this height.
_HEIGHT_PX = 720.0
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def drawn(image: Image, seen: Seen, findings: Mapping[Finger, Finding], index: int) -> Image:
    """A copy of the picture (h, w, 3) with every finger of its frame (by index) on it."""
    picture = np.ascontiguousarray(image).copy()
    size = max(picture.shape[0] / _HEIGHT_PX, 0.6)
    rows = []
    for finger, (plan, recording) in findings.items():
        frame = recording.frames[index]
        lines = [plan.base] if plan.base else []
        names = list(plan.joints.values())
        lines += [Segment(*pair) for pair in pairwise(names)]
        for start, end in lines:
            if start in seen.places and end in seen.places:
                _line(picture, seen.places[start], seen.places[end], _COLORS[finger], size)
        for name in dict.fromkeys([*(plan.base or ()), *names]):
            if name in seen.places:
                _dot(picture, seen.places[name], _COLORS[finger], size)
        for joint, angle in frame.angles_rad.items():
            place = seen.places.get(plan.joints[joint])
            if place is not None:
                at = (round(place.x_px + 12 * size), round(place.y_px - 10 * size))
                _text(picture, f"{label(plan, joint)} {math.degrees(angle):.0f}", at, size)
        rows.append((f"{frame.time_s:.3f} s  {finger}  " + _angles(plan, frame), frame))
    for row, (text, frame) in enumerate(rows):
        _caption(picture, row, text, frame, size)
    return picture


def _at(place: Place) -> tuple[int, int]:
    return round(place.x_px * 2**_SHIFT), round(place.y_px * 2**_SHIFT)


def _line(image: Image, a: Place, b: Place, color: tuple[int, int, int], size: float) -> None:
    for width, shade in ((4, _WHITE), (2, color)):
        thickness = max(1, round(width * size))
        cv2.line(image, _at(a), _at(b), shade, thickness, cv2.LINE_AA, _SHIFT)


def _dot(image: Image, place: Place, color: tuple[int, int, int], size: float) -> None:
    radius = round(6 * size * 2**_SHIFT)
    cv2.circle(image, _at(place), radius, _WHITE, max(1, round(2 * size)), cv2.LINE_AA, _SHIFT)
    cv2.circle(image, _at(place), radius // 3, color, cv2.FILLED, cv2.LINE_AA, _SHIFT)


def _angles(plan: FingerPlan, frame: GraspFrame) -> str:
    return "  ".join(
        f"{label(plan, joint)} {math.degrees(angle):.1f}"
        f"+-{math.degrees(frame.angles_sigma_rad[joint]):.1f}"
        for joint, angle in frame.angles_rad.items()
    )


def _caption(image: Image, row: int, text: str, frame: GraspFrame, size: float) -> None:
    """One line of a finger at the lower edge: what was measured, how surely, and what was not."""
    note = f"  {frame.note}" if frame.note else ""
    bottom = image.shape[0] - round((14 + 30 * row) * size)
    _text(image, f"{text}  confidence {frame.confidence:.2f}{note}", (8, bottom), size)


def _text(image: Image, text: str, at: tuple[int, int], size: float) -> None:
    """White on a darkened box; (x, y) is where its line begins."""
    scale, thickness = 0.6 * size, max(1, round(size))
    (width, height), below = cv2.getTextSize(text, _FONT, scale, thickness)
    rows = slice(max(at[1] - height - 3, 0), max(at[1] + below, 0))
    columns = slice(max(at[0] - 3, 0), max(at[0] + width + 3, 0))
    image[rows, columns] = image[rows, columns] // 3
    cv2.putText(image, text, at, _FONT, scale, _WHITE, thickness, cv2.LINE_AA)


def with_grid(image: Image, step_px: int = 50) -> Image:
    """A copy of the picture with a grid of pixel coordinates, for `--seed` without a browser."""
    picture = np.ascontiguousarray(image).copy()
    height, width = picture.shape[:2]
    shade = picture.copy()
    for x in range(0, width, step_px):
        cv2.line(shade, (x, 0), (x, height), _WHITE, 1)
    for y in range(0, height, step_px):
        cv2.line(shade, (0, y), (width, y), _WHITE, 1)
    picture = cv2.addWeighted(shade, 0.5, picture, 0.5, 0.0)
    for x in range(step_px, width, 2 * step_px):
        _text(picture, str(x), (x + 2, 12), 0.6)
    for y in range(step_px, height, 2 * step_px):
        _text(picture, str(y), (2, y - 3), 0.6)
    return picture
