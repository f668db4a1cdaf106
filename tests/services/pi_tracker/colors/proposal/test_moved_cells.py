"""What moves from picture to picture."""

from __future__ import annotations

import numpy as np

from services.pi_tracker.colors.proposal.moved_cells import moved_shares
from services.pi_tracker.image.chroma import Cells

SHAPE = (40, 60)


def picture(squares, light=1.0):
    """A grey wall with coloured squares at (row, column): (u, v)."""
    y, u, v = np.full(SHAPE, 120.0), np.zeros(SHAPE), np.zeros(SHAPE)
    for (row, column), (blue, red) in squares.items():
        u[row : row + 8, column : column + 8] = blue
        v[row : row + 8, column : column + 8] = red
    return Cells(light * y, light * u, light * v)


def test_what_is_elsewhere_in_the_others_moved_and_a_thing_did_not():
    pictures = [picture({(5, 10 * n): (40, -20), (25, 20): (40, -20)}) for n in range(4)]
    shares = moved_shares(pictures)
    for n, share in enumerate(shares):
        assert np.median(share[6:12, 10 * n + 1 : 10 * n + 7]) == 1.0
        assert share[26:32, 21:27].max() == 0.0


def test_a_thing_that_is_hidden_at_times_has_moved_by_so_much():
    thing, hand = {(5, 20): (40, -20)}, {(5, 20): (-10, 30)}
    shares = moved_shares([picture(thing), picture(hand), picture(thing), picture(thing)])
    assert np.allclose([share[8, 23] for share in shares], [1 / 3, 1.0, 1 / 3, 1 / 3])


def test_a_shadow_is_no_motion_and_one_picture_tells_nothing():
    thing = {(5, 20): (40, -20)}
    shares = moved_shares([picture(thing), picture(thing, light=0.5)])
    assert max(share.max() for share in shares) == 0.0
    assert moved_shares([picture(thing)])[0].max() == 0.0
