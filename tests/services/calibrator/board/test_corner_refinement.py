"""Sub-pixel corners against the truth of rendered boards."""

from __future__ import annotations

import numpy as np
import pytest

from services.calibrator.board.board import Board
from services.calibrator.board.corner_refinement import (
    corner_spacing,
    is_regular_grid,
    refine_corners,
)


@pytest.mark.parametrize(
    ("blur_px", "noise", "limit_px"), [(0.7, 2.0, 0.06), (2.5, 2.0, 0.08), (1.0, 10.0, 0.15)]
)
def test_corners_of_a_rendered_board_are_found_to_a_twentieth_of_a_pixel(
    make_bench, blur_px, noise, limit_px
):
    bench = make_bench(positions=2)
    camera, board = bench.cameras[0], bench.board
    generator = np.random.default_rng(2)
    for key in bench.poses:
        true = bench.corners(camera, key)
        image = bench.picture(camera, key, blur_px=blur_px, noise=noise)
        found = refine_corners(
            image, board, np.arange(board.size), true + generator.normal(0.0, 0.7, true.shape)
        )
        assert np.sqrt(np.mean(np.sum((found - true) ** 2, axis=1))) < limit_px


def test_a_corner_without_a_saddle_stays():
    board = Board(3, 3, 0.02)
    corners = 30.0 + 20.0 * board.grid
    np.testing.assert_array_equal(
        refine_corners(np.full((120, 120), 80, dtype=np.uint8), board, np.arange(9), corners),
        corners,
    )


def test_spacing_is_the_nearest_neighbour_and_infinite_without_one():
    board = Board(3, 3, 0.02)
    ids = np.array([0, 1, 8])
    assert corner_spacing(
        board, ids, np.array([[0.0, 0.0], [10.0, 0.0], [40.0, 40.0]])
    ).tolist() == [
        10.0,
        10.0,
        np.inf,
    ]


def test_a_corner_out_of_line_is_no_board():
    board = Board(5, 4, 0.02)
    corners = 20.0 * board.grid
    assert is_regular_grid(board, np.arange(20), corners)
    corners[7] += 15.0
    assert not is_regular_grid(board, np.arange(20), corners)
    corners[7] = np.nan
    assert not is_regular_grid(board, np.arange(20), corners)
