"""Subsets of views, and views numbered anew."""

from __future__ import annotations

import numpy as np

from services.calibrator.bundle.residuals import State, View
from services.calibrator.bundle.views import renumbered, subset, views_of_board

CORNERS = np.arange(8.0).reshape(4, 2)
VIEWS = [View(0, board, np.arange(4), np.zeros((4, 3)), CORNERS) for board in (0, 1, 2, 2)]


def test_a_subset_is_numbered_anew_with_its_poses():
    poses = np.stack([np.eye(4) * k for k in range(3)])
    views, state = subset(VIEWS, State(np.zeros((1, 9)), np.eye(4)[None], poses), [2, 0])
    assert [view.board for view in views] == [1, 0, 0]
    np.testing.assert_array_equal(state.T_rig_from_board, poses[[2, 0]])
    assert len(views_of_board(VIEWS, 2)) == 2


def test_a_numbering_permutes_the_pixels_and_the_only_one_leaves_them():
    turned = renumbered(VIEWS[0], [np.arange(4), np.array([3, 2, 1, 0])], 1)
    np.testing.assert_array_equal(turned.pixels, CORNERS[::-1])
    # The only numbering is that of the whole board, of which a view may show a part.
    assert renumbered(VIEWS[0], [np.arange(54)], 0) is VIEWS[0]
