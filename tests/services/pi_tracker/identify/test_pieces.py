"""A marker that a shadow's edge cuts in two is one again; what else is of its colour is not."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.identify.pieces import joined
from testing.synthetic_blobs import filled_blob

# The area that the marker of these pieces had, px^2: 29 and 4 cells make up .59 of it.
WHOLE_PX2 = 224.0
BODY, RIM = filled_blob(0, (158, 188, 164, 193)), filled_blob(0, (155, 188, 157, 190))


def test_pieces_beside_each_other_are_one_blob():
    (whole,) = joined([RIM, BODY], WHOLE_PX2)
    assert whole.rect == (155, 188, 164, 193)
    assert whole.cells == RIM.cells + BODY.cells
    assert whole.mask.shape == (5, 9)
    # What lies between them is closed, what lies beside them is not.
    assert np.all(whole.mask[:2])
    assert not np.any(whole.mask[3:, :2])


def test_the_order_of_pieces_does_not_matter():
    third = filled_blob(0, (160, 194, 163, 195))
    (one,), (other,) = joined([RIM, third, BODY], 300.0), joined([BODY, third, RIM], 300.0)
    assert one.rect == other.rect
    assert np.array_equal(one.mask, other.mask)


def test_what_is_farther_away_stays_alone():
    far = filled_blob(0, (153, 188, 155, 190))
    assert joined([far, BODY], WHOLE_PX2) == [BODY, far]


def test_a_whole_marker_takes_nothing_in():
    assert joined([RIM, BODY], 4.0 * BODY.cells / 0.8) == [BODY, RIM]
    assert joined([RIM, BODY], 0.0) == [BODY, RIM]
