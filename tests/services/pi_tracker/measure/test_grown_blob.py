"""A blob grows into what is nearly its colour, and into nothing else."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from rhot.files.calibration import ColorRange, Colors
from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.near_colors import near_colors
from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.identify.track import Track
from services.pi_tracker.image.yuv_planes import picture
from services.pi_tracker.measure.grown_blob import NO_GROWTH, Limit, grown, limit
from testing import synthetic_images

COLORS = Colors(colors={"cyan": ColorRange(hsv_low=(90, 100, 60), hsv_high=(99, 255, 255))})
TABLE = compile_colors(COLORS, ["cyan"])
NEAR = compile_colors(near_colors(COLORS), ["cyan"])
# Hues within the range, nearly, and of another paint; cells of the pictures.
OWN, NEARLY, OTHER = 95, 102, 120
SIZE = (40, 30)


def shown(*parts, ground=(128, 128, 128)):
    """A picture of rectangles of cells, each (x0, y0, x1, y1, hue)."""
    bgr = np.full((2 * SIZE[1], 2 * SIZE[0], 3), ground, np.uint8)
    for x0, y0, x1, y1, hue in parts:
        paint = cv2.cvtColor(np.uint8([[[hue, 200, 180]]]), cv2.COLOR_HSV2BGR)[0, 0]
        bgr[2 * y0 : 2 * y1, 2 * x0 : 2 * x1] = paint
    return picture(synthetic_images.frame_of(bgr, layout="i420"))


def the_blob(image):
    (blob,) = BlobDetector(TABLE, Tracker()).detect(image, whole(image.size))
    return blob


def after(image, marker_px2=0.0, found_px2=0.0):
    blob = the_blob(image)
    return grown(image, NEAR, blob, limit(blob, marker_px2, marker_px2, found_px2))


def areas(track):
    return track.area_px, track.whole_px2, track.found_px2


def test_the_half_that_a_range_misses_is_found():
    image = shown((10, 8, 16, 18, OWN), (16, 8, 21, 18, NEARLY))
    assert the_blob(image).rect[2] <= 17
    blob = after(image)
    assert blob.rect == (10, 8, 21, 18)
    assert blob.cells == np.count_nonzero(blob.mask) == 110
    assert blob.area_px == 440.0


def test_a_small_piece_grows_into_what_its_marker_had():
    image = shown((10, 8, 13, 11, OWN), (10, 8, 21, 19, NEARLY), (10, 8, 13, 11, OWN))
    unknown = after(image)
    assert unknown is not None
    assert unknown.cells <= 2.5 * 9
    assert after(image, 4 * 121.0, found_px2=4 * 60.0).rect == (10, 8, 21, 19)


@pytest.mark.parametrize("hue", [OTHER, 60])
def test_another_paint_beside_it_is_not_taken(hue):
    image = shown((10, 8, 16, 18, OWN), (16, 8, 22, 18, hue))
    assert after(image).rect[2] <= 17


def test_a_wall_of_nearly_its_colour_is_not_taken():
    image = shown((0, 0, *SIZE, NEARLY), (10, 8, 18, 16, OWN))
    blob = the_blob(image)
    for whole_px2 in (0.0, 300.0):
        assert grown(image, NEAR, blob, limit(blob, whole_px2, whole_px2, 0.7 * whole_px2)) is blob


def test_a_stripe_of_nearly_its_colour_that_goes_on_is_not_taken():
    """A finger before a striped thing: paint ends where it is looked for."""
    image = shown((10, 8, 18, 16, OWN), (18, 0, 22, SIZE[1], NEARLY))
    blob = the_blob(image)
    assert grown(image, NEAR, blob, Limit(most=250, reach=6)) is blob
    ends = shown((10, 8, 18, 16, OWN), (18, 4, 22, 20, NEARLY))
    assert grown(ends, NEAR, blob, Limit(most=250, reach=6)).rect == (10, 4, 22, 20)


def test_a_line_of_one_cell_does_not_connect():
    image = shown((10, 8, 16, 14, OWN), (16, 10, 19, 11, NEARLY), (19, 8, 24, 14, NEARLY))
    assert after(image, 4 * 80.0, 4 * 60.0).rect[2] <= 18


def test_a_marker_at_the_edge_of_the_picture_grows_too():
    image = shown((0, 0, 5, 8, OWN), (5, 0, 10, 8, NEARLY))
    assert after(image).rect == (0, 0, 10, 8)


def test_what_is_whole_is_left_alone():
    blob = the_blob(shown((10, 8, 20, 18, OWN)))
    assert limit(blob, *2 * [4.0 * blob.cells / 0.9], blob.area_px) == NO_GROWTH
    assert limit(blob, *2 * [4.0 * blob.cells / 0.7], blob.area_px).most > blob.cells
    assert grown(shown(), NEAR, blob, NO_GROWTH) is blob


def test_what_a_marker_has_grown_to_does_not_let_it_grow_on():
    image = shown((10, 8, 16, 14, OWN), (16, 6, 30, 20, NEARLY))
    blob = the_blob(image)
    track = Track(blob.x_px, blob.y_px, blob.area_px / 0.65, blob.area_px, 0)
    for frame in range(1, 60):
        found = grown(image, NEAR, blob, limit(blob, *areas(track)))
        assert found is blob
        # What is measured of few cells may be half as much again.
        track.update(blob.x_px, blob.y_px, found.area_px / 0.65, blob.area_px, frame * 33_000_000)


def test_of_a_marker_that_was_found_whole_a_piece_grows_to_all_of_it():
    """A dab comes into shade: most of it is out of its range, in one picture after another."""
    lit = shown((10, 8, 21, 19, OWN))
    shaded = shown((10, 8, 13, 11, OWN), (10, 8, 21, 19, NEARLY), (10, 8, 13, 11, OWN))
    blob, piece = the_blob(lit), the_blob(shaded)
    track = Track(blob.x_px, blob.y_px, blob.area_px / 0.85, blob.area_px, 0)
    for frame in range(1, 15):
        found = grown(shaded, NEAR, piece, limit(piece, *areas(track)))
        assert found.rect == blob.rect
        track.update(blob.x_px, blob.y_px, found.area_px / 0.85, piece.area_px, frame * 33_000_000)
    assert track.found_px2 < 0.2 * blob.area_px


def test_limits_of_a_huge_blob_are_within_bounds():
    blob = the_blob(shown((0, 0, *SIZE, OWN)))
    assert limit(blob, 0.0, 0.0, 0.0).reach == 24
    assert limit(blob, 1e-9, 1e-9, 0.0) == NO_GROWTH
    assert limit(blob._replace(cells=1, rect=(5, 5, 6, 6)), 1e6, 1e5, 4e5) == Limit(250000, 24)
