"""References as people type them."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import ConfigError
from studies.grasp.metrology.reference import EXAMPLE, parse_points, parse_reference, plane_of


def test_a_rectangle_and_a_length():
    rectangle = parse_reference(EXAMPLE)
    assert rectangle.size_mm == (80.0, 36.0)
    assert rectangle.points_px.tolist()[1] == [550.0, 60.0]
    plane = plane_of(rectangle, (640, 480)).plane
    assert plane.distance(*rectangle.points_px[:2])[0] == pytest.approx(80.0, rel=0.01)
    length = parse_reference("length=50:10,10:110,10")
    # Straightened: here a lens that halves all.
    plane = plane_of(length, (640, 480), straighten=lambda px: 0.5 * px).plane
    assert plane.distance((0, 0), (0, 10))[0] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("card=80x36:1,2", "begins with rectangle= or length="),
        ("rectangle=80x36:1,2:3,4", "2 size.s. in mm and 4 points"),
        ("rectangle=80:1,2:3,4:5,6:7,8", "should be 2 number"),
        ("length=far:1,2:3,4", "should be 1 number"),
        ("length=80:1;2:3,4", "should be 2 number"),
    ],
)
def test_what_is_no_reference_is_shown_one(text, wanted):
    with pytest.raises(ConfigError, match=wanted):
        parse_reference(text)


def test_points_are_counted():
    assert np.allclose(parse_points("1,2 3.5,-4", 2), [(1, 2), (3.5, -4)])
    with pytest.raises(ConfigError, match="3 points, and 4 are needed"):
        parse_points("1,2 3,4 5,6", 4)
