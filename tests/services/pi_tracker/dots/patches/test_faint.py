"""Faint dots: what a moving dot leaves of its paint on the skin is found, other things are not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import search_region
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.dots.dot import Patch
from services.pi_tracker.dots.patches.faint import FaintFinder
from services.pi_tracker.image.blob import Blob
from services.pi_tracker.image.frame import Frame, Image
from services.pi_tracker.image.yuv_planes import Picture, picture

SIZE = (640, 360)
PAINT, SKIN, RED, GREY = (150, 40, 170), (110, 140, 200), (60, 65, 170), (128, 128, 128)
RANGE = ColorRange(hsv_low=(150, 128, 76), hsv_high=(168, 255, 255))
TABLE = compile_colors(Colors(colors={"magenta": RANGE}), ["magenta"])
RADIUS = 5.0
AREA_PX2 = float(np.pi * RADIUS**2)
NOISE = 1.0
STILL, MOVING = (200.0, 150.0), (300.0, 200.0)


def drawn(
    *discs: tuple[float, float, float], skin: tuple[int, int, int] = SKIN, red: bool = False
) -> Picture:
    """Dots (x, y, so far it moves to the right while the shutter is open) on skin, with noise."""
    image: Image = np.full((SIZE[1], SIZE[0], 3), skin, np.uint8)
    if red:
        image[170:230, 330:380] = RED
    paint = np.zeros(SIZE[::-1], np.float64)
    steps = 32
    for x, y, moves in discs:
        for k in range(steps):
            disc = np.zeros(SIZE[::-1], np.uint8)
            at = x + moves * (k / (steps - 1) - 0.5)
            centre = (round(16 * at), round(16 * y))
            cv2.circle(disc, centre, round(16 * RADIUS), 255, -1, cv2.LINE_AA, shift=4)
            paint += disc / (255.0 * steps)
    mixed = image + paint[..., None] * (np.array(PAINT) - image)
    noise = np.random.default_rng(1).normal(0.0, NOISE, mixed.shape)
    return picture(
        Frame("side", 0, 0, 0.0, SIZE, np.clip(mixed + noise, 0, 255).astype(np.uint8), "bgr")
    )


def blobs_of(image: Picture) -> list[Blob]:
    return BlobDetector(TABLE, Tracker()).detect(image, search_region.whole(image.size))


def begun(skin: tuple[int, int, int] = SKIN) -> FaintFinder:
    """Has seen both dots at rest."""
    finder, image = FaintFinder(), drawn((*STILL, 0.0), (*MOVING, 0.0), skin=skin)
    assert len(blobs_of(image)) == 2
    finder.note(image, blobs_of(image), [0.0, 0.0])
    return finder


def found(finder: FaintFinder, image: Picture) -> list[Patch]:
    return finder.find(image, blobs_of(image), (STILL, MOVING), AREA_PX2, NOISE)


@pytest.mark.parametrize("moves_px", [24.0, 30.0])
def test_a_dot_that_blurs_into_the_skin_is_found_where_it_was_on_average(moves_px: float) -> None:
    image = drawn((*STILL, 0.0), (MOVING[0] + 12.0, MOVING[1], moves_px))
    assert len(blobs_of(image)) == 1, "a plain search finds the one at rest alone"
    (patch,) = found(begun(), image)
    assert (patch.x_px, patch.y_px) == pytest.approx((MOVING[0] + 12.0, MOVING[1]), abs=1.5)
    assert 0.5 * AREA_PX2 < patch.area_px < 1.3 * AREA_PX2


def test_only_near_where_one_is_missing() -> None:
    """Expected: two diameters are 20 px, and dots at rest have not moved."""
    assert found(begun(), drawn((*STILL, 0.0), (MOVING[0] + 40.0, MOVING[1], 18.0))) == []
    both = drawn((*STILL, 0.0), (*MOVING, 0.0), (MOVING[0], MOVING[1] + 20.0, 18.0))
    assert found(begun(), both) == [], "none is missing"


def test_a_red_thing_beside_the_skin_is_no_dot() -> None:
    """Expected: its chroma is paint's and three times the skin's, which no mixture is."""
    assert found(begun(), drawn((*STILL, 0.0), red=True)) == []


def test_skin_alone_has_no_dots() -> None:
    assert found(begun(), drawn((*STILL, 0.0))) == []


def test_nothing_is_found_before_paint_and_skin_are_known() -> None:
    image = drawn((*STILL, 0.0), (*MOVING, 18.0))
    assert found(FaintFinder(), image) == []


def test_on_grey_there_is_no_line_that_paint_could_leave() -> None:
    """Expected: no hue of skin, no share of paint, whatever noise says."""
    for _ in range(3):
        assert found(begun(GREY), drawn((*STILL, 0.0), skin=GREY)) == []
