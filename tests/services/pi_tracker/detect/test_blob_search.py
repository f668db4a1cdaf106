"""Blobs: which colour, where, how many."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from services.pi_tracker.detect import blob_search
from services.pi_tracker.detect.blob_search import BlobDetector
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.search_region import whole
from services.pi_tracker.image.yuv_planes import picture


def blobs_of(detector, frame):
    image = picture(frame)
    return detector.detect(image, whole(image.size))


def test_six_tips_are_six_blobs(studio, tip, detector):
    tips = [tip(name, 30.0 + 40 * i, 40.0) for i, name in enumerate(studio.paints)]
    frame, truth = studio.frame(tips, size_px=(280, 90))
    found = blobs_of(detector, frame)
    names = list(studio.paints)
    assert sorted(blob.color for blob in found) == list(range(6))
    for blob in found:
        assert (blob.x_px, blob.y_px) == pytest.approx(truth[names[blob.color]], abs=2.0)
        assert np.count_nonzero(blob.mask) >= blob.cells
        assert blob.mask.shape == (blob.rect[3] - blob.rect[1], blob.rect[2] - blob.rect[0])


def test_touching_colours_are_told_apart(studio, tip, detector):
    frame, truth = studio.frame(
        [tip("green", 28.0, 32.0, turn_rad=1.57), tip("blue", 37.5, 32.0, turn_rad=1.57)]
    )
    found = {blob.color: blob for blob in blobs_of(detector, frame)}
    assert set(found) == {0, 1}
    assert (found[0].x_px, found[0].y_px) == pytest.approx(truth["green"], abs=1.5)
    assert (found[1].x_px, found[1].y_px) == pytest.approx(truth["blue"], abs=1.5)


def test_a_rectangle_limits_the_search(studio, tip, detector):
    frame, _ = studio.frame([tip("green", 20.0, 20.0), tip("blue", 50.0, 50.0)])
    assert [blob.color for blob in detector.detect(picture(frame), (16, 16, 32, 32))] == [1]


def test_an_empty_picture_has_no_blobs(studio, detector):
    frame, _ = studio.frame([])
    assert blobs_of(detector, frame) == []


@pytest.mark.parametrize("erode", [1, 2])
def test_the_coarse_search_of_some_rows_misses_nothing(studio, colors, monkeypatch, erode):
    rng = np.random.default_rng(4)
    for _ in range(20):
        wall = np.full((240, 320, 3), 120, np.uint8)
        for _ in range(12):
            x, y, w, h = (int(n) for n in rng.integers((4, 0, 1, 1), (290, 220, 16, 16)))
            wall[y : y + h, x : x + w] = studio.paints[list(studio.paints)[rng.integers(6)]]
        frame, found = studio.of(wall), []
        for min_cells in (0, 1 << 30):
            monkeypatch.setattr(blob_search, "_COARSE_MIN_CELLS", min_cells)
            detector = BlobDetector(
                compile_colors(colors, list(studio.paints)), Tracker(erode=erode, dilate=1)
            )
            found.append(
                {
                    (blob.color, blob.rect, blob.cells, blob.mask.tobytes())
                    for blob in blobs_of(detector, frame)
                }
            )
        assert found[0] == found[1] != set()


def test_a_crescent_beside_another_paint_is_found_when_asked_for_and_a_seam_between_two_never(
    studio, colors
):
    names = ["green", "cyan", "blue"]
    detector = BlobDetector(compile_colors(colors, names), Tracker(erode=0, dilate=0))
    paints = [np.array(studio.paints[name], np.uint8) for name in names]
    for right, keep_thin, expected in ((1, False, {1}), (1, True, {0, 1}), (2, True, {1, 2})):
        # A column of cells of one paint beside, or between, larger patches of others.
        wall = np.full((64, 64, 3), 120, np.uint8)
        wall[20:40, 30:32] = paints[0]
        wall[20:40, 32:48] = paints[right]
        if right == 2:
            wall[20:40, 14:30] = paints[1]
        image = picture(studio.of(wall))
        found = detector.detect(image, whole(image.size), keep_thin)
        assert {blob.color for blob in found} == expected


@pytest.mark.parametrize(("min_area", "seen"), [(12.0, True), (600.0, False)])
def test_specks_below_the_least_area_are_left_out(studio, tip, colors, min_area, seen):
    detector = BlobDetector(compile_colors(colors, ["green"]), Tracker(min_area_px=min_area))
    frame, _ = studio.frame([tip("green", 30.0, 30.0)])
    assert bool(blobs_of(detector, frame)) is seen


@pytest.mark.parametrize(
    "settings",
    [
        Tracker(gaussian_px=0, erode=0, dilate=0),
        Tracker(gaussian_px=7, erode=1, dilate=2),
        Tracker(),
    ],
)
def test_mask_filters_do_not_move_a_blob(studio, tip, colors, settings):
    detector = BlobDetector(compile_colors(colors, ["green"]), settings)
    frame, truth = studio.frame(
        [tip("green", 31.0, 33.0, width_px=16.0, length_px=16.0)], sigma=1.0
    )
    blob = blobs_of(detector, frame)[0]
    rows, columns = np.nonzero(blob.mask)
    centre = 2 * (blob.rect[0] + columns.mean()) + 0.5, 2 * (blob.rect[1] + rows.mean()) + 0.5
    assert centre == pytest.approx(truth["green"], abs=1.0)


def test_of_a_room_full_of_colour_only_the_largest_blobs_are_examined(studio, detector):
    """Test: confetti, 7,000 specks of six colours.

    Expected: the number of blobs is bounded, and a large one is among them.
    """
    rng = np.random.default_rng(3)
    confetti = rng.integers(0, 256, (120, 160, 3), dtype=np.uint8).repeat(4, 0).repeat(4, 1)
    confetti[200:240, 300:340] = studio.paints["green"]
    found = blobs_of(detector, studio.of(confetti))
    # A few small ones beside the one of many colours.
    assert 100 < len(found) <= 7 * 64
    largest = max(found, key=lambda blob: blob.cells)
    assert (largest.color, largest.x_px, largest.y_px) == (
        list(studio.paints).index("green"),
        pytest.approx(320, abs=6),
        pytest.approx(220, abs=6),
    )
