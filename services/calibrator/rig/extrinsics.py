"""The extrinsics of a rig's cameras, by joining them one after the other. Pure.

Each camera is joined to those already placed through the partner with which it shares most boards.
A pair that no relative pose fits is refused with a CalibrationError that names the cause.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import possible_numberings
from services.calibrator.bundle.initial_guess import guess_board_pose
from services.calibrator.bundle.residuals import View
from services.calibrator.bundle.views import renumbered
from services.calibrator.rig.pair_diagnosis import MIN_SHARED, CameraPair, diagnose
from services.calibrator.rig.relative_pose import (
    Numberings,
    ViewPair,
    find_relative_pose,
    nearest_numbering,
)

# Median error of a pair of cameras, px at 640 px width: .2 on the real pairs; wrong pairings give
# 10 and more.
_FITS_PX = 3.0


@dataclass(frozen=True, eq=False)
class Cameras:
    """The cameras of a rig before it is known where they are: names, picture sizes and lenses."""

    names: list[str]
    sizes: list[tuple[int, int]]
    lenses: Array  # (c, 9)


def find_extrinsics(cameras: Cameras, views: list[View], board: Board) -> tuple[Array, list[View]]:
    """T_camera_from_rig (c, 4, 4), and the views with one numbering of the board for all cameras.

    The first camera is the rig frame. Raises CalibrationError if a camera shares too few boards
    with the others, or no pose fits it to them.
    """
    numberings = possible_numberings(board)
    placed = _Placed(cameras.lenses, {0: np.eye(4)}, [view for view in views if view.camera == 0])
    while len(placed.T_camera_from_rig) < len(cameras.names):
        anchor, camera = _next_pair(cameras.names, placed, views)
        pair = CameraPair(
            names=(cameras.names[anchor], cameras.names[camera]),
            second_size_px=cameras.sizes[camera],
            lenses=(cameras.lenses[anchor], cameras.lenses[camera]),
            views=_common_views(placed.views, views, anchor, camera),
        )
        found = find_relative_pose(pair.lenses, pair.views, numberings)
        limit_px = _FITS_PX * max(cameras.sizes[camera][0] / 640.0, 1.0)
        if not found.median_px <= limit_px:
            raise CalibrationError(diagnose(pair, board, found, limit_px))
        placed.T_camera_from_rig[camera] = (
            found.T_second_from_first @ placed.T_camera_from_rig[anchor]
        )
        choices = {
            second.board: choice
            for (_, second), choice in zip(pair.views, found.choices, strict=True)
        }
        mine = [view for view in views if view.camera == camera]
        placed.add(mine, choices, numberings)
    extrinsics = [placed.T_camera_from_rig[k] for k in range(len(cameras.names))]
    return np.stack(extrinsics), placed.views


@dataclass(eq=False)
class _Placed:
    """The cameras placed so far, and their views in one numbering of the board."""

    lenses: Array  # (c, 9)
    T_camera_from_rig: dict[int, Array]
    views: list[View]

    def add(self, views: list[View], choices: dict[int, int], numberings: Numberings) -> None:
        """Add a placed camera's views, with the numbering chosen for each board.

        Boards without a choice, as the anchor did not see them, are numbered like the view of any
        other camera that is placed.
        """
        partners = {view.board: view for view in reversed(self.views)}
        added = []
        for view in views:
            choice = choices.get(view.board)
            partner = partners.get(view.board)
            if choice is None and partner is not None:
                choice = self._numbering_like(partner, view, numberings)
            added.append(renumbered(view, numberings, choice or 0))
        self.views.extend(added)

    def _numbering_like(self, partner: View, view: View, numberings: Numberings) -> int:
        T_partner_from_board = guess_board_pose(self.lenses[partner.camera], partner)[0]
        T_rig_from_board = (
            np.linalg.inv(self.T_camera_from_rig[partner.camera]) @ T_partner_from_board
        )
        expected = self.T_camera_from_rig[view.camera] @ T_rig_from_board
        return nearest_numbering(self.lenses[view.camera], view, expected, numberings)


def _next_pair(names: list[str], placed: _Placed, views: list[View]) -> tuple[int, int]:
    """The placed camera and the other one that share most boards."""
    boards: dict[int, set[int]] = {camera: set() for camera in range(len(names))}
    for view in views:
        boards[view.camera].add(view.board)
    shared = {
        (anchor, camera): len(boards[anchor] & boards[camera])
        for anchor in placed.T_camera_from_rig
        for camera in range(len(names))
        if camera not in placed.T_camera_from_rig
    }
    # On a draw the earliest camera, so that the result does not depend on the order of a
    # dictionary.
    (anchor, camera), count = max(
        shared.items(), key=lambda item: (item[1], -item[0][1], -item[0][0])
    )
    if count < MIN_SHARED:
        raise CalibrationError(
            f"cameras {names[anchor]!r} and {names[camera]!r} see the board together in {count} "
            f"pictures only, at least {MIN_SHARED} are needed (12 to 20 are good). Take pictures "
            "of the board where both see it whole, at the same time; pictures with the same number "
            "belong together"
        )
    return anchor, camera


def _common_views(
    placed: list[View], views: list[View], anchor: int, camera: int
) -> list[ViewPair]:
    """The views of the boards that both cameras see, the anchor's first."""
    first = {view.board: view for view in placed if view.camera == anchor}
    return [
        (first[view.board], view) for view in views if view.camera == camera and view.board in first
    ]
