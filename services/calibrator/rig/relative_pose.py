"""The pose of one camera relative to another, from the boards that both saw. Pure.

Every pair of views guesses it, the guess that fits the median pair best is adjusted to all pairs.
Guesses are scored by reprojection and by the median, so that single bad pictures do not mislead
them. A pair of cameras that no guess fits is for the caller to refuse: the score comes along.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array, inverse
from services.calibrator.bundle.adjust import FreeUnknowns, adjust
from services.calibrator.bundle.initial_guess import guess_board_pose, reprojection_rms
from services.calibrator.bundle.lens_model import LENS_SIZE
from services.calibrator.bundle.residuals import State, View, rms
from services.calibrator.bundle.views import renumbered

# View pairs that vote on the relative pose; each votes with every numbering of its board.
_VOTERS = 30

# The lenses (9,) of two cameras, and their views of the same board.
Lenses = tuple[Array, Array]
ViewPair = tuple[View, View]
# The numberings (n,) in which a view may be meant (corner_order.possible_numberings): then
# view.pixels[numbering] belong to view.points.
Numberings = Sequence[np.ndarray]


@dataclass(frozen=True, eq=False)
class RelativePose:
    """T_second_from_first (4, 4), and how each view pair fits it.

    choices: the numbering of the second view that fits. errors_px: RMS px of the pair with it.
    """

    T_second_from_first: Array
    choices: tuple[int, ...]
    errors_px: tuple[float, ...]

    @property
    def median_px(self) -> float:
        """How well the median pair of views fits."""
        return float(np.median(self.errors_px))


def find_relative_pose(
    lenses: Lenses, pairs: list[ViewPair], numberings: Numberings
) -> RelativePose:
    """The best guess, adjusted to all pairs with the lenses held.

    Guesses by single views of small or distant boards are several pixels off.
    """
    guess = guess_relative_pose(lenses, pairs, numberings)
    if not np.isfinite(guess.median_px):
        return guess
    views = []
    for number, ((first, second), choice) in enumerate(zip(pairs, guess.choices, strict=True)):
        views.append(replace(first, camera=0, board=number))
        second = renumbered(second, numberings, choice)
        views.append(replace(second, camera=1, board=number))
    start = State(
        lenses=np.stack(lenses),
        T_camera_from_rig=np.stack([np.eye(4), guess.T_second_from_first]),
        T_rig_from_board=np.stack([guess_board_pose(lenses[0], first)[0] for first, _ in pairs]),
    )
    free = FreeUnknowns(np.zeros((2, LENS_SIZE), dtype=bool), np.array([False, True]))
    found = adjust(views, start, free)
    errors = tuple(
        rms(np.concatenate(found.residuals[2 * k : 2 * k + 2])) for k in range(len(pairs))
    )
    adjusted = RelativePose(found.state.T_camera_from_rig[1], guess.choices, errors)
    return adjusted if adjusted.median_px <= guess.median_px else guess


def guess_relative_pose(
    lenses: Lenses, pairs: list[ViewPair], numberings: Numberings
) -> RelativePose:
    """The relative pose by that one pair of views which fits the median pair best.

    Of no pairs it is the identity, with an infinite error.
    """
    first_poses = [guess_board_pose(lenses[0], first)[0] for first, _ in pairs]
    # The second view of each pair in all its numberings.
    options = [
        [renumbered(second, numberings, choice) for choice in range(len(numberings))]
        for _, second in pairs
    ]
    best = RelativePose(np.eye(4), (), (float("inf"),))
    # Voters spread over all pairs: neighbours in a series look alike.
    spread = np.linspace(0, len(pairs) - 1, min(_VOTERS, len(pairs)))
    for k in np.unique(spread.astype(np.int64)):
        for option in options[k]:
            T = guess_board_pose(lenses[1], option)[0] @ inverse(first_poses[k])
            scored = _scored(lenses[1], T, first_poses, options)
            if scored.median_px < best.median_px or not best.choices:
                best = scored
    return best


def _scored(
    lens: Array, T_second_from_first: Array, first_poses: list[Array], options: list[list[View]]
) -> RelativePose:
    """The relative pose with the numbering and the error of each pair."""
    choices, errors = [], []
    for T_first_from_board, views in zip(first_poses, options, strict=True):
        T_second_from_board = T_second_from_first @ T_first_from_board
        by_numbering = [reprojection_rms(lens, view, T_second_from_board) for view in views]
        # NaN, a corner behind the camera, would win the minimum.
        by_numbering = [error if np.isfinite(error) else float("inf") for error in by_numbering]
        choices.append(int(np.argmin(by_numbering)))
        errors.append(min(by_numbering))
    return RelativePose(T_second_from_first, tuple(choices), tuple(errors))


def nearest_numbering(
    lens: Array, view: View, T_camera_from_board: Array, numberings: Numberings
) -> int:
    """The numbering in which a view's board is turned most like the expected pose."""
    if len(numberings) == 1:
        return 0
    poses = [
        guess_board_pose(lens, renumbered(view, numberings, choice))[0]
        for choice in range(len(numberings))
    ]
    # The axes x and y of the board tell how it is turned.
    off = [np.linalg.norm(pose[:3, :2] - T_camera_from_board[:3, :2]) for pose in poses]
    return int(np.argmin(off))
