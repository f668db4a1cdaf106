"""Patches of paint, found where a person points."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CalibrationError
from services.pi_tracker.colors.paint_patch import find_patch
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.chroma import Cells, cells_of

SIZE = (160, 120)


@pytest.fixture
def scene(studio, tip):
    """Cells of a green and a blue tip, each on a finger."""

    def make(layout="i420", **options):
        tips = [
            tip("green", 50.0, 60.0, width_px=14.0, length_px=16.0),
            tip("blue", 110.0, 50.0, width_px=12.0, length_px=14.0),
        ]
        frame, truth = studio.frame(tips, size_px=SIZE, layout=layout, **options)
        return cells_of(frame), truth

    return make


@pytest.mark.parametrize("layout", ["i420", "bgr"])
@pytest.mark.parametrize(
    "place",
    [
        {},
        {"x": -3.0, "y": 2.0},
        {"w": 20.0, "h": 20.0},
        {"w": 44.0, "h": 40.0},
    ],
    ids=["click", "beside the middle", "box", "loose box"],
)
def test_the_patch_is_found_and_nothing_else(scene, layout, place):
    cells, truth = scene(layout)
    x, y = truth["green"]
    w, h = place.get("w", 0.0), place.get("h", 0.0)
    pointer = Pointer(
        "green", 0, x + place.get("x", 0.0) - w / 2, y + place.get("y", 0.0) - h / 2, w, h
    )
    patch = find_patch(cells, pointer)
    rows, columns = np.nonzero(patch.mask)
    # The paint is 14 px wide and 16 long: some 200 px, 50 cells.
    assert 30 <= len(rows) <= 70
    assert abs(2 * columns.mean() + 0.5 - x) < 2.0
    assert abs(2 * rows.mean() + 0.5 - y) < 2.0
    assert not np.any(patch.core & ~patch.mask)
    hue, _, _ = cells[patch.core].hsv()
    assert np.all(np.abs(hue - 57.0) < 14.0)


def test_a_box_that_cuts_the_patch_knows_the_rest_of_it(scene):
    cells, truth = scene()
    x, y = truth["green"]
    patch = find_patch(cells, Pointer("green", 0, x - 8, y - 8, 8, 16))
    assert np.count_nonzero(patch.whole) > 1.3 * np.count_nonzero(patch.mask)


def test_a_neighbour_in_a_loose_box_is_left_alone(studio, tip):
    """Fingers held together: a box about one tip holds half of the next, too."""
    tips = [
        tip("green", 60.0, 60.0, width_px=12.0, length_px=12.0),
        tip("blue", 76.0, 60.0, width_px=12.0, length_px=12.0),
    ]
    frame, truth = studio.frame(tips, size_px=SIZE)
    cells = cells_of(frame)
    for color, hue_about in (("green", 57.0), ("blue", 109.0)):
        x, y = truth[color]
        patch = find_patch(cells, Pointer(color, 0, x - 12, y - 12, 24, 24))
        hue, _, _ = cells[patch.core].hsv()
        # Blur mixes a little of the neighbour in.
        assert abs(float(np.median(hue)) - hue_about) < 8.0


@pytest.mark.parametrize(
    ("pointer", "message"),
    [
        (Pointer("green", 0, 10.0, 10.0), r"click green=10,10: is on something grey"),
        (Pointer("green", 0, 400.0, 10.0), r"outside the picture, which is 160x120"),
        (Pointer("green", 0, -1.0, 10.0), r"outside the picture"),
        (Pointer("green", 0, 150.0, 100.0, 40.0, 50.0), r"outside the picture"),
        (Pointer("green", 0, 5.0, 5.0, 20.0, 20.0), r"no colour of its own"),
        (Pointer("green", 0, 50.0, 60.0, 1.0, 1.0), r"too small"),
        (Pointer("green", 0, 50.0, 60.0, -5.0, 9.0), r"too small"),
    ],
)
def test_places_without_paint_say_so(scene, pointer, message):
    cells, _ = scene()
    with pytest.raises(CalibrationError, match=message):
        find_patch(cells, pointer)


def test_a_box_may_reach_beyond_the_picture(studio, tip):
    frame, _ = studio.frame([tip("green", 6.0, 60.0, width_px=14.0, length_px=16.0)], size_px=SIZE)
    patch = find_patch(cells_of(frame), Pointer("green", 0, -8.0, 46.0, 28.0, 28.0))
    assert np.count_nonzero(patch.mask) > 10


def test_a_coloured_wall_is_no_marker(studio, tip):
    frame, _ = studio.frame([tip("blue", 80.0, 60.0)], size_px=SIZE, wall=(90, 170, 80))
    with pytest.raises(CalibrationError, match="goes on far beyond the click"):
        find_patch(cells_of(frame), Pointer("green", 0, 20.0, 20.0))


@pytest.mark.parametrize("beyond", [False, True], ids=["a hand", "more than a click looks at"])
def test_magenta_does_not_run_into_dark_skin(beyond):
    """Chroma of dark skin is hardly more than noise, and its direction near that of magenta."""
    height, width = (480, 640) if beyond else (60, 60)
    rows, columns = np.mgrid[: height // 2, : width // 2]
    middle = (height // 4, width // 4)
    paint = np.hypot(rows - middle[0], columns - middle[1]) < 6.0
    noise = np.random.default_rng(0).normal(0.0, 0.7, (3, *paint.shape))
    skin = Cells(*(np.array([30.0, -2.5, 6.5])[:, None, None] + noise))
    cells = Cells(
        np.where(paint, 55.0 + noise[0], skin.y),
        np.where(paint, 6.0 + noise[1], skin.u),
        np.where(paint, 26.0 + noise[2], skin.v),
    )
    patch = find_patch(cells, Pointer("magenta", 0, width / 2, height / 2))
    assert np.count_nonzero(patch.mask & ~paint) <= 0.1 * np.count_nonzero(paint)
    assert np.count_nonzero(patch.mask & paint) >= 0.9 * np.count_nonzero(paint)
