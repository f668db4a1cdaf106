"""Regions of interest around markers."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from services.pi_tracker.detect import search_region

SIZE = (320, 240)


def rects():
    corner = st.tuples(st.integers(0, 319), st.integers(0, 239))
    extent = st.tuples(st.integers(1, 80), st.integers(1, 80))
    return st.builds(
        lambda c, e: (c[0], c[1], min(c[0] + e[0], 320), min(c[1] + e[1], 240)), corner, extent
    )


@given(rect=rects(), margin=st.integers(0, 500))
def test_a_region_stays_in_the_image_and_holds_its_marker(rect, margin):
    x0, y0, x1, y1 = search_region.around(rect, margin, SIZE)
    assert 0 <= x0 <= rect[0] < rect[2] <= x1 <= 320
    assert 0 <= y0 <= rect[1] < rect[3] <= y1 <= 240
    assert x1 - rect[2] == min((margin + 1) // 2, 320 - rect[2])


@given(rect=st.tuples(*[st.integers(-10_000, 10_000)] * 4))
def test_a_region_of_nonsense_still_has_a_cell(rect):
    x0, y0, x1, y1 = search_region.around(rect, 40, SIZE)
    assert 0 <= x0 < x1 <= 320
    assert 0 <= y0 < y1 <= 240


@given(some=st.lists(rects(), min_size=1, max_size=7))
def test_the_bounding_rect_covers_all_and_no_more(some):
    x0, y0, x1, y1 = search_region.bounding_rect(some)
    assert all(x0 <= r[0] and y0 <= r[1] and x1 >= r[2] and y1 >= r[3] for r in some)
    assert any(r[0] == x0 for r in some)
    assert any(r[3] == y1 for r in some)


def test_the_margin_follows_the_motion():
    still = (10, 10, 60, 50)
    assert search_region.motion_margin(still, still, 40) == 8
    assert search_region.motion_margin(still, (12, 10, 60, 53), 40) == 8 + 2 * 2 * 3
    assert search_region.motion_margin(still, (90, 10, 140, 50), 40) == 40
    assert search_region.motion_margin(still, still, 5) == 5
    assert search_region.motion_margin(None, still, 40) == 40


def test_a_clipped_blob_is_one_that_may_go_on_outside():
    rect = (10, 0, 60, 50)
    assert search_region.is_clipped((10, 5, 14, 9), rect, SIZE)
    assert search_region.is_clipped((50, 5, 60, 9), rect, SIZE)
    assert not search_region.is_clipped((20, 0, 30, 9), rect, SIZE)  # the image ends there, too
    assert not search_region.is_clipped((20, 5, 30, 9), rect, SIZE)
    assert not search_region.is_clipped((300, 5, 320, 9), search_region.whole(SIZE), SIZE)
