"""How far apart two landmarks of a hand are in a picture."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.hand import BASIC_LANDMARKS
from services.pi_tracker.identify.hand_layout import HandLayout

# One colour a landmark, as a hand's table has them.
HAND = {f"of {name}": ("right", name) for name in BASIC_LANDMARKS}
OTHERS = {"other hand": ("left", "wrist"), "joint": ("right", "index_proximal")}
COLORS = (*HAND, *OTHERS, "cup")
LAYOUT = HandLayout(COLORS, {**HAND, **OTHERS})


def nearness(name, other, widths, side_px=14):
    """Of two markers so many of their widths apart."""
    colors = np.array([COLORS.index(name), COLORS.index(other)])
    distance2, areas = np.full((2, 2), (widths * side_px) ** 2), np.full((2, 2), side_px**2)
    found = LAYOUT.nearness(colors, distance2, areas)
    assert found[0, 1] == found[1, 0] or np.isnan(found[0, 1])
    return found[0, 1]


@pytest.mark.parametrize("side_px", [8, 14, 40])
@pytest.mark.parametrize(
    ("name", "other", "usual", "too_far"),
    [
        ("of index_tip", "of middle_tip", 2.5, 13.0),
        ("of little_tip", "of ring_tip", 2.5, 13.0),
        ("of index_tip", "of little_tip", 6.0, 20.0),
        ("of thumb_tip", "of index_tip", 5.0, 18.0),
        ("of thumb_tip", "of little_tip", 9.0, 23.0),
        ("of wrist", "of middle_tip", 12.0, 28.0),
        ("of wrist", "of thumb_tip", 9.0, 25.0),
    ],
)
def test_landmarks_are_as_far_apart_as_hands_are(name, other, usual, too_far, side_px):
    """In widths of the markers, whatever the distance."""
    assert nearness(name, other, usual, side_px) > 0.8
    assert nearness(name, other, too_far, side_px) < 0.1


def test_a_tip_may_touch_another_but_not_the_wrist():
    assert nearness("of thumb_tip", "of index_tip", 0.0) > 0.9
    assert nearness("of wrist", "of index_tip", 1.5) < 0.1


@pytest.mark.parametrize("other", ["other hand", "joint", "cup"])
def test_nothing_is_known_of_other_hands_joints_and_things(other):
    assert np.isnan(nearness("of index_tip", other, 3.0))
    unknown = HandLayout(("red", "blue"), {})
    assert np.isnan(unknown.nearness(np.array([0, 1]), np.ones((2, 2)), np.ones((2, 2)))).all()
