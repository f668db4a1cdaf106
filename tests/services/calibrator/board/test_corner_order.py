"""One numbering of a board, whichever corner a detector began with."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import (
    canonical_order,
    mirrored_numbering,
    possible_numberings,
    rotated_numberings,
)


def test_numberings_are_the_rotations_of_the_grid():
    assert [numbering.tolist() for numbering in rotated_numberings(3, 2)] == [
        [0, 1, 2, 3, 4, 5],
        [5, 4, 3, 2, 1, 0],
    ]
    assert len(rotated_numberings(3, 3)) == 4
    assert mirrored_numbering(3, 2).tolist() == [2, 1, 0, 5, 4, 3]


def test_only_chessboards_leave_a_doubt():
    assert len(possible_numberings(Board(8, 6, 0.025))) == 2
    assert len(possible_numberings(Board(8, 6, 0.025, "charuco"))) == 1


@pytest.mark.parametrize("size", [(9, 6), (8, 5)])
def test_any_numbering_of_a_coloured_board_becomes_the_same(make_bench, size):
    """Test: a picture's corners turned by 180 degrees, and mirrored.

    Expected: the numbering with black beyond the first corner.
    """
    bench = make_bench(positions=1, board=Board(*size, 0.025))
    camera = bench.cameras[0]
    image, true = bench.picture(camera, "01"), bench.corners(camera, "01")
    for numbering in rotated_numberings(*size):
        np.testing.assert_allclose(canonical_order(image, *size, true[numbering]), true)
        np.testing.assert_allclose(
            canonical_order(image, *size, true[numbering][mirrored_numbering(*size)]), true
        )


def test_a_symmetric_board_is_only_unmirrored_numbering(make_bench):
    bench = make_bench(positions=1, board=Board(8, 6, 0.025))
    image, true = bench.picture(bench.cameras[0], "01"), bench.corners(bench.cameras[0], "01")
    turned = true[rotated_numberings(8, 6)[1]]
    np.testing.assert_allclose(canonical_order(image, 8, 6, turned), turned)
    np.testing.assert_allclose(
        canonical_order(image, 8, 6, turned[mirrored_numbering(8, 6)]), turned
    )
