"""One numbering of a board, whichever corner a detector began with."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import mirrored, normalised, turns


def test_turns_are_the_rotations_of_the_grid():
    assert [turn.tolist() for turn in turns(3, 2)] == [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]]
    assert len(turns(3, 3)) == 4
    assert mirrored(3, 2).tolist() == [2, 1, 0, 5, 4, 3]


@pytest.mark.parametrize("size", [(9, 6), (8, 5)])
def test_any_numbering_of_a_coloured_board_becomes_the_same(make_bench, size):
    """Test: a picture's corners turned by 180 degrees, and mirrored.

    Expected: the numbering with black beyond the first corner.
    """
    bench = make_bench(positions=1, board=Board(*size, 0.025))
    camera = bench.cameras[0]
    image, true = bench.picture(camera, "01"), bench.corners(camera, "01")
    for turn in turns(*size):
        np.testing.assert_allclose(normalised(image, *size, true[turn]), true)
        np.testing.assert_allclose(normalised(image, *size, true[turn][mirrored(*size)]), true)


def test_a_symmetric_board_is_only_unmirrored(make_bench):
    bench = make_bench(positions=1, board=Board(8, 6, 0.025))
    image, true = bench.picture(bench.cameras[0], "01"), bench.corners(bench.cameras[0], "01")
    turned = true[turns(8, 6)[1]]
    np.testing.assert_allclose(normalised(image, 8, 6, turned), turned)
    np.testing.assert_allclose(normalised(image, 8, 6, turned[mirrored(8, 6)]), turned)
