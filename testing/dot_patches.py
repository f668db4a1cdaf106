"""Patches as the tracker of dots gets them: of made-up pictures, and of eight dots at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.hypothesis import Patches
from services.pi_tracker.dots.patches.parts import parts_of
from testing.synthetic_dots import DotFrame

# Thumb and index finger in a picture of SIZE; (8, 2) px.
SIZE = (1280, 720)
NAMES = (*finger_landmarks("thumb"), *finger_landmarks("index"))
THUMB = np.array([[400.0, 500.0], [490.0, 470.0], [550.0, 440.0], [600.0, 415.0]])
INDEX = np.array([[480.0, 300.0], [590.0, 260.0], [650.0, 250.0], [700.0, 245.0]])
REST = np.concatenate([THUMB, INDEX])


def patches_at(places: npt.NDArray[np.float64]) -> list[Patch]:
    """A patch at each of places (n, 2)."""
    return [Patch(float(x), float(y), 300.0) for x, y in places]


def patches_of(frame: DotFrame, dot_area_px2: float) -> list[Patch]:
    """The blobs of a frame, those cut that may be several dots."""
    found: list[Patch] = []
    for number, blob in enumerate(frame.blobs):
        rows, columns = np.nonzero(blob.mask)
        x = 2.0 * (float(columns.mean()) + blob.rect[0]) + 0.5
        y = 2.0 * (float(rows.mean()) + blob.rect[1]) + 0.5
        parts = parts_of(blob, dot_area_px2)
        if len(parts) == 1:
            found.append(Patch(x, y, blob.area_px))
        else:
            found += [Patch(*place, area, 2.0, 0.5, number, (x, y)) for *place, area in parts]
    return found


def share_right(
    told: Sequence[tuple[int, ...]], pictures: Sequence[Patches], frames: Sequence[DotFrame]
) -> float:
    """The share of dots that show whose patch (of each picture, -1 for none) is at their place."""
    right = []
    for own, patches, frame in zip(told, pictures, frames, strict=True):
        near = max(10.0, 1.3 * frame.radius)
        for dot in np.flatnonzero(frame.visible > 0.35):
            away = patches.places[own[dot]] - frame.places[dot]
            right.append(own[dot] >= 0 and bool(np.hypot(*away) < near))
    return float(np.mean(right))
