"""Detections as views: numbered corners on the board, and pictures of another size left out."""

from __future__ import annotations

import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.board_views import board_view, same_size
from services.calibrator.board.detect import Detection


def detection(size_px: tuple[int, int] = (640, 480)) -> Detection:
    return Detection(np.array([1, 4]), np.array([[5.0, 6.0], [7.0, 8.0]]), size_px)


def test_a_view_has_the_points_of_the_corners_that_are_seen():
    view = board_view(Board(4, 3, 0.02), detection(), 1, 7)
    assert (view.camera, view.board) == (1, 7)
    np.testing.assert_allclose(view.points, [[0.02, 0.0, 0.0], [0.0, 0.02, 0.0]])


def test_pictures_of_another_size_than_most_are_left_out_with_the_reason():
    found = {"1": detection(), "2": detection((320, 240)), "3": detection()}
    size_px, kept, left_out = same_size("left", found)
    assert size_px == (640, 480)
    assert list(kept) == ["1", "3"]
    assert [(item.key, item.reason) for item in left_out] == [
        ("2", "is 320x240, the others 640x480")
    ]
    assert same_size("left", {}) == ((0, 0), {}, [])
