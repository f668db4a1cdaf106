"""Where a finger ends: the circle in its round end, and what a click there means."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.measure.edges.tip import RoundEnd, TipWindow, _fitted, tip_of

END = RoundEnd(np.array([50.0, 0.2]), 15.0)


def strength_of(window, middle, radius):
    """Edges along a finger with a round end, as wide as blurred pictures have them, and weaker ones
    within it, as shading has them.
    """
    rows, columns = np.mgrid[: window.size[1], : window.size[0]].astype(np.float32)
    x, y = columns + window.low[0] - middle[0], rows + window.low[1] - middle[1]
    away = np.where(x > 0.0, np.hypot(x, y), np.abs(y))
    ridge = 8.0 * np.exp(-0.5 * np.square((away - radius) / 1.7))
    return (ridge + 4.0 * np.exp(-0.5 * np.square(away - radius + 6.0))).astype(np.float32)


def test_a_round_end_is_found_to_a_fraction_of_a_pixel():
    window = TipWindow(np.array([16.0, -28.0]), (70, 57), 17.0, 53.0)
    found = _fitted(strength_of(window, (50.3, 0.6), 15.2), window)
    assert found is not None
    assert np.hypot(*(found.middle - (50.3, 0.6))) < 0.3
    assert found.radius == pytest.approx(15.2, abs=0.3)
    assert _fitted(np.full((57, 70), 0.5, np.float32), window) is None


@pytest.mark.parametrize(
    ("clicked", "place", "said"),
    [
        ((47.0, 2.0), (50.0, 0.0), "the middle of the round end"),
        ((67.0, -2.0), (65.0, 0.0), "the very end"),
        ((57.5, 3.0), (57.5, 0.0), "8 px from the middle"),
    ],
)
def test_a_click_says_which_place_is_meant(clicked, place, said):
    tip = tip_of(np.array(clicked), END)
    assert tip.place == pytest.approx(place)
    assert said in tip.note


def test_a_tip_that_all_pictures_show_aside_turns_the_bone():
    tip = tip_of(np.array([49.0, 0.0]), RoundEnd(np.array([50.0, -2.6]), 15.0))
    assert tip.place == pytest.approx((50.0, -2.0))


def test_without_a_round_end_the_tip_is_where_it_was_clicked():
    tip = tip_of(np.array([49.0, 2.0]), None)
    assert tip.place == pytest.approx((49.0, 0.0))
    assert "no round end" in tip.note
