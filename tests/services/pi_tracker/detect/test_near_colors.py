"""Ranges a little wider, that do not meet."""

from __future__ import annotations

import pytest

from rhot.files.calibration import ColorRange, Colors
from services.pi_tracker.detect.color_table import compile_colors
from services.pi_tracker.detect.near_colors import gap, near_colors, near_tables
from testing import synthetic_images


def span(low, high, saturation=100, value=60):
    return ColorRange(hsv_low=(low, saturation, value), hsv_high=(high, 240, 250))


def wider(**ranges):
    return near_colors(Colors(date="d", tool="t", colors=ranges)).colors


def test_a_colour_alone_is_wider_by_the_most_hues_and_paler():
    assert wider(blue=span(100, 110))["blue"] == ColorRange(
        hsv_low=(95, 85, 51), hsv_high=(115, 240, 250)
    )


def test_neighbours_share_what_is_between_them():
    found = wider(cyan=span(90, 100), blue=span(106, 120))
    assert (found["cyan"].hsv_high[0], found["blue"].hsv_low[0]) == (102, 104)
    assert (found["cyan"].hsv_low[0], found["blue"].hsv_high[0]) == (85, 125)


@pytest.mark.parametrize("other", [span(98, 120), span(100, 120), span(101, 120)])
def test_ranges_that_meet_do_not_grow_into_each_other(other):
    found = wider(cyan=span(90, 100), blue=other)
    assert found["cyan"].hsv_high[0] == 100
    assert found["blue"].hsv_low[0] == other.hsv_low[0]


def test_hues_go_on_through_red():
    found = wider(violet=span(140, 150), magenta=span(160, 170))
    assert (found["violet"].hsv_high[0], found["magenta"].hsv_low[0]) == (154, 156)
    assert gap(span(176, 3), span(160, 170), -1) == 5
    assert gap(span(176, 3), span(160, 170), 1) == 90


def test_paint_of_a_hue_like_skins_is_no_paler_and_keeps_away_from_skin():
    found = wider(magenta=span(162, 175), blue=span(105, 120))
    assert found["magenta"].hsv_low == (157, 100, 60)
    assert found["magenta"].hsv_high[0] == 177
    assert found["blue"].hsv_low == (100, 85, 51)


def test_a_calibrations_own_cells_keep_their_class():
    colors = synthetic_images.ranges()
    names = list(colors.colors)
    own, near = compile_colors(colors, names), compile_colors(near_colors(colors), names)
    for before, after in zip(own.layers, near.layers, strict=False):
        claimed = before.view("u1").reshape(-1, 4)[:, 0] > 0
        assert (after.view("u1").reshape(-1, 4)[claimed, 0] > 0).all()


def test_colours_with_hues_in_common_have_tables_of_their_own():
    ranges = {"violet": span(123, 144), "blue": span(111, 133), "green": span(50, 70)}
    colors = Colors(date="d", tool="t", colors=ranges)
    tables = near_tables(colors, ["green", "violet", "blue"])
    assert tables.all.names == ("green", "violet", "blue")
    assert {number: table.names for number, table in tables.alone.items()} == {
        1: ("violet",),
        2: ("blue",),
    }
    own = tables.alone[1].layers[0].view("u1").reshape(-1, 4)[:, 0] > 0
    together = tables.all.layers[0].view("u1").reshape(-1, 4)[:, 0]
    # All of what is nearly violet, of which blue has a part when they share.
    assert (together[own] == 3).any()
    assert own[together == 2].all()
    assert not near_tables(colors, ["green", "blue"]).alone
