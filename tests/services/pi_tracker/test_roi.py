"""Rectangles around markers."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from services.pi_tracker import roi

SIZE = (320, 240)


def rects():
    corner = st.tuples(st.integers(0, 319), st.integers(0, 239))
    extent = st.tuples(st.integers(1, 80), st.integers(1, 80))
    return st.builds(lambda c, e: (c[0], c[1], min(c[0] + e[0], 320), min(c[1] + e[1], 240)), corner, extent)


@given(rect=rects(), margin=st.integers(0, 500))
def test_a_region_stays_in_the_image_and_holds_its_marker(rect, margin):
    x0, y0, x1, y1 = roi.around(rect, margin, SIZE)
    assert 0 <= x0 <= rect[0] < rect[2] <= x1 <= 320
    assert 0 <= y0 <= rect[1] < rect[3] <= y1 <= 240
    assert x1 - rect[2] == min((margin + 1) // 2, 320 - rect[2])


@given(rect=st.tuples(*[st.integers(-10_000, 10_000)] * 4))
def test_a_region_of_nonsense_still_has_a_cell(rect):
    x0, y0, x1, y1 = roi.around(rect, 40, SIZE)
    assert 0 <= x0 < x1 <= 320
    assert 0 <= y0 < y1 <= 240


@given(some=st.lists(rects(), max_size=7))
def test_joined_rectangles_cover_the_same(some):
    joined = roi.joined(some)
    assert len(joined) <= len(some)
    for rect in some:
        assert any(o[0] <= rect[0] and o[1] <= rect[1] and o[2] >= rect[2] and o[3] >= rect[3] for o in joined)


def test_the_regions_of_a_hand_become_one():
    markers = [(100, 80, 106, 87), (112, 70, 118, 78), (124, 74, 130, 80), (110, 120, 118, 128)]
    assert len(roi.joined(roi.around(rect, 40, SIZE) for rect in markers)) == 1


def test_a_cut_blob_is_one_that_may_go_on_outside():
    rect = (10, 0, 60, 50)
    assert roi.cut((10, 5, 14, 9), rect, SIZE)
    assert roi.cut((50, 5, 60, 9), rect, SIZE)
    assert not roi.cut((20, 0, 30, 9), rect, SIZE)  # the image ends there, too
    assert not roi.cut((20, 5, 30, 9), rect, SIZE)
    assert not roi.cut((300, 5, 320, 9), roi.whole(SIZE), SIZE)
