"""Markers that the picture's edge cuts: their middles are those of the whole."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from services.pi_tracker.measure.cut_marker import part_of, short_by
from services.pi_tracker.step import TrackerStep

SIZE = (160, 120)
# A tip is so wide, and so long along x or y.
WIDE, LONG = 14.0, 18.0
# The picture is cut out of a larger one, of which the truth is.
MARGIN = 30
# Where tips are that the edge never reaches.
ELSEWHERE = (("blue", 60.0, 80.0), ("lime", 90.0, 50.0))


@pytest.fixture
def track(studio, tip, colors):
    """Markers of a green tip that goes through places, and of others; and its true middles."""

    def run(places, turn_rad=0.0, elsewhere=ELSEWHERE, wide=WIDE, names=("green", "blue", "lime")):
        step = TrackerStep("left", colors, Tracker(), SIZE, list(names))
        found = []
        for seq, (x, y) in enumerate(places):
            shapes = [(name, *at, wide, wide) for name, *at in elsewhere]
            shapes.append(("green", x, y, WIDE, LONG))
            tips = [
                tip(name, MARGIN + x, MARGIN + y, width, length, turn_rad=turn_rad)
                for name, x, y, width, length in shapes
            ]
            image, truth = studio.clean(tips, (SIZE[0] + 2 * MARGIN, SIZE[1] + 2 * MARGIN))
            image = np.ascontiguousarray(image[MARGIN:-MARGIN, MARGIN:-MARGIN])
            frame = studio.of(studio.bgr(image, 3.0, seq), seq)
            markers = {one.color: one for one in step.step(frame).markers}
            found.append((markers.get("green"), np.array(truth["green"]) - MARGIN))
        return found

    return run


@pytest.mark.parametrize("line", [-0.7, -0.2, 0.0, 0.4, 0.9])
def test_parts_of_a_disc(line):
    x, y = np.meshgrid(np.linspace(-1, 1, 1001), np.linspace(-1, 1, 1001))
    disc = x * x + y * y <= 1.0
    part = disc & (x <= line)
    assert part_of(np.array(line)) == pytest.approx(part.sum() / disc.sum(), abs=2e-3)
    assert short_by(np.array(line)) == pytest.approx(-x[part].mean(), abs=3e-3)


@pytest.mark.parametrize("side", ["left", "right", "top", "bottom"])
@pytest.mark.parametrize("turn_rad", [0.0, np.pi / 2])
def test_a_marker_that_leaves_the_picture_is_told_where_it_is(track, side, turn_rad):
    outwards = np.arange(-20.0, 4.0, 1.5)
    places = {
        "left": [(-off, 60.0) for off in outwards],
        "right": [(SIZE[0] - 1.0 + off, 60.0) for off in outwards],
        "top": [(110.0, -off) for off in outwards],
        "bottom": [(110.0, SIZE[1] - 1.0 + off) for off in outwards],
    }[side]
    found = track(places, turn_rad)
    whole = found[0][0]
    axis = 0 if side in ("left", "right") else 1
    ahead = 1.0 if side in ("right", "bottom") else -1.0
    for marker, truth in found:
        assert marker is not None
        off = np.array([marker.x_px, marker.y_px]) - truth
        assert abs(ahead * off[axis]) <= max(3.0 * marker.sigma_px, 0.4)
        assert np.abs(off).max() <= 1.2, "what is left of half of one is 3 px inside"
        assert marker.area_px == pytest.approx(whole.area_px, rel=0.3)
    # The less there is of it the less is known, and told.
    last = found[-1][0]
    assert last.sigma_px > 2.5 * whole.sigma_px
    assert last.quality < 0.5 * whole.quality


def test_a_marker_that_comes_in_is_as_large_as_the_others(track):
    inwards = [(-1.0, 60.0), (0.5, 60.0), (2.0, 60.0)]
    for marker, truth in track(inwards):
        assert marker is not None
        # As measured it is 4 px inside; it is a quarter longer than the others.
        off = np.abs(np.array([marker.x_px, marker.y_px]) - truth).max()
        assert off <= min(2.0, 2.0 * marker.sigma_px)


def test_where_no_marker_is_whole_it_is_a_disc(track):
    ((marker, truth),) = track([(0.0, 60.0)], elsewhere=(), names=("green",))
    assert marker is not None
    # It is longer than wide; as measured it is 3.4 px inside.
    assert np.abs(np.array([marker.x_px, marker.y_px]) - truth).max() <= 2.2
    assert 1.5 < marker.sigma_px < 3.0
    assert marker.quality < 0.9


def test_what_is_larger_than_a_marker_can_be_is_as_measured_and_unsure(track):
    small = (("blue", 60.0, 80.0), ("lime", 90.0, 50.0))
    ((marker, truth),) = track([(4.0, 60.0)], elsewhere=small, wide=8.0)
    assert marker is not None
    assert marker.x_px > truth[0] + 1.0
    assert marker.sigma_px > 1.5


def test_what_a_corner_cuts_is_as_measured_and_unsure(track):
    marker, truth = track([(140.0, 60.0), (150.0, 90.0), (158.0, 118.0)])[-1]
    assert marker is not None
    assert marker.x_px <= SIZE[0] - 0.5
    assert marker.y_px <= SIZE[1] - 0.5
    off = np.abs(np.array([marker.x_px, marker.y_px]) - truth).max()
    assert marker.sigma_px > 0.4 * off
