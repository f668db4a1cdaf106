"""Views chosen, and numbered anew, for an adjustment of their own. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from services.calibrator.bundle.residuals import State, View


def single_view(view: View) -> View:
    """The view as the only one, of the only camera and board."""
    return replace(view, camera=0, board=0)


def views_of_board(views: Iterable[View], board: int) -> list[View]:
    """The views of one board position."""
    return [view for view in views if view.board == board]


def subset(views: Iterable[View], state: State, boards: Iterable[int]) -> tuple[list[View], State]:
    """The views and the state of these board positions, which are numbered anew in that order."""
    numbers = {int(board): number for number, board in enumerate(boards)}
    kept = [replace(view, board=numbers[view.board]) for view in views if view.board in numbers]
    poses = state.T_rig_from_board[np.array(list(numbers), dtype=np.int64)]
    return kept, replace(state, T_rig_from_board=poses)


def renumbered(view: View, numberings: Sequence[np.ndarray], choice: int) -> View:
    """The view in that one of the numberings (k, n) of its board which is chosen.

    With one numbering only there is no doubt: the view, perhaps of a part of the board, stays as it
    is.
    """
    if len(numberings) == 1:
        return view
    return replace(view, pixels=view.pixels[numberings[choice]])
