"""Where the cameras of a rig stand to each other, from boards they saw together; and why not, where
it cannot be. Pure.

Cameras are joined one after the other to those already placed, each through the partner with which
it shares most boards. A pair that no guess fits is looked at for the usual causes - a mirrored
picture, pictures paired one off, a board that moved between the exposures - and refused with a
CalibrationError that names the cause.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.errors import CalibrationError
from rhot.geometry.transforms import Array
from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import mirrored, turns
from services.calibrator.bundle.adjust import Free, adjust
from services.calibrator.bundle.initial_guess import Relation, board_pose, relate
from services.calibrator.bundle.residuals import State, View, rms

# Two poses fix the relation, further ones test it; with fewer than this a wrong one goes unnoticed.
MIN_SHARED = 4
# Median error of a pair of cameras, px at 640 px width: .2 on the real pairs; wrong pairings give
# 10 and more.
_FITS_PX = 3.0
# Pairing errors looked for: a picture more or less on one side.
_SHIFTS = (1, -1, 2, -2)


def place_cameras(
    names: list[str], sizes: list[tuple[int, int]], lenses: Array, views: list[View], board: Board
) -> tuple[Array, list[View]]:
    """T_camera_from_rig (c, 4, 4) with the first camera as the rig, and the views with one
    numbering of the board for all cameras.

    lenses is (c, 9).

    Raises CalibrationError if a camera shares too few boards with the others, or cannot be fitted
    to them.
    """
    places = {0: np.eye(4)}
    renumbered = [view for view in views if view.camera == 0]
    while len(places) < len(names):
        anchor, camera = _next(names, places, views)
        pairs = _pairs(renumbered, views, anchor, camera)
        relation = _related((lenses[anchor], lenses[camera]), pairs, _turns(board))
        limit = _FITS_PX * max(sizes[camera][0] / 640.0, 1.0)
        if not relation.median_px <= limit:
            raise CalibrationError(
                _why(names, sizes, (anchor, camera), lenses, pairs, board, relation, limit)
            )
        places[camera] = relation.T_second_from_first @ places[anchor]
        turned = {pair[1].board: turn for pair, turn in zip(pairs, relation.turns, strict=True)}
        # Boards the anchor did not see are numbered against any other camera that is placed.
        renumbered += _renumbered(views, camera, turned, renumbered, places, lenses, board)
    return np.stack([places[k] for k in range(len(names))]), renumbered


def _related(
    lenses: tuple[Array, Array], pairs: list[tuple[View, View]], turned: list[np.ndarray]
) -> Relation:
    """The best guess, adjusted to all pairs: single views of small or distant boards guess several
    pixels off.
    """
    guess = relate(lenses, pairs, turned)
    if not np.isfinite(guess.median_px):
        return guess
    views = []
    for number, ((first, second), turn) in enumerate(zip(pairs, guess.turns, strict=True)):
        pixels = second.pixels[turned[turn]] if len(turned) > 1 else second.pixels
        views += [
            replace(first, camera=0, board=number),
            replace(second, camera=1, board=number, pixels=pixels),
        ]
    poses = np.stack([board_pose(lenses[0], first)[0] for first, _ in pairs])
    start = State(np.stack(lenses), np.stack([np.eye(4), guess.T_second_from_first]), poses)
    found = adjust(views, start, Free(np.zeros((2, 9), dtype=bool), np.array([False, True])))
    errors = tuple(rms(np.concatenate(found.errors[2 * k : 2 * k + 2])) for k in range(len(pairs)))
    better = Relation(found.state.T_camera_from_rig[1], guess.turns, errors)
    return better if better.median_px <= guess.median_px else guess


def _next(names: list[str], places: dict[int, Array], views: list[View]) -> tuple[int, int]:
    """The placed camera and the other one that share most boards."""
    boards = {
        camera: {view.board for view in views if view.camera == camera}
        for camera in range(len(names))
    }
    shared = {
        (anchor, camera): len(boards[anchor] & boards[camera])
        for anchor in places
        for camera in range(len(names))
        if camera not in places
    }
    # On a draw the earliest camera, so that the result does not depend on the order of a
    # dictionary.
    (anchor, camera), count = max(
        shared.items(), key=lambda item: (item[1], -item[0][1], -item[0][0])
    )
    if count < MIN_SHARED:
        raise CalibrationError(
            f"cameras {names[anchor]!r} and {names[camera]!r} see the board together in {count} pictures only, at least {MIN_SHARED} are "
            f"needed (12 to 20 are good). Take pictures of the board where both see it whole, at the same time; pictures with the same "
            f"number belong together"
        )
    return anchor, camera


def _pairs(
    placed: list[View], views: list[View], anchor: int, camera: int
) -> list[tuple[View, View]]:
    first = {view.board: view for view in placed if view.camera == anchor}
    return [
        (first[view.board], view) for view in views if view.camera == camera and view.board in first
    ]


def _turns(board: Board) -> list[np.ndarray]:
    """Numberings a view may be meant by; a ChArUco board's markers leave no doubt."""
    return turns(board.cols, board.rows) if board.kind == "chessboard" else [np.arange(board.size)]


def _renumbered(
    views: list[View],
    camera: int,
    turned: dict[int, int],
    placed: list[View],
    places: dict[int, Array],
    lenses: Array,
    board: Board,
) -> list[View]:
    known = {view.board: view for view in reversed(placed)}
    numbered = []
    options = _turns(board)
    for view in (view for view in views if view.camera == camera):
        turn = turned.get(view.board, 0)
        partner = known.get(view.board)
        if view.board not in turned and partner is not None and len(options) > 1:
            turn = _turn_by(partner, view, places, lenses, options)
        numbered.append(
            replace(view, pixels=view.pixels[options[turn]]) if len(options) > 1 else view
        )
    return numbered


def _turn_by(
    partner: View, view: View, places: dict[int, Array], lenses: Array, options: list[np.ndarray]
) -> int:
    T_rig_from_board = (
        np.linalg.inv(places[partner.camera]) @ board_pose(lenses[partner.camera], partner)[0]
    )
    expected = places[view.camera] @ T_rig_from_board
    poses = [
        board_pose(lenses[view.camera], replace(view, pixels=view.pixels[turn]))[0]
        for turn in options
    ]
    return int(np.argmin([np.linalg.norm(pose[:3, :2] - expected[:3, :2]) for pose in poses]))


def _why(
    names: list[str],
    sizes: list[tuple[int, int]],
    cameras: tuple[int, int],
    lenses: Array,
    pairs: list[tuple[View, View]],
    board: Board,
    relation: Relation,
    limit: float,
) -> str:
    """The sentence for a pair of cameras that nothing fits."""
    anchor, camera = cameras
    who = f"cameras {names[anchor]!r} and {names[camera]!r}"
    both = (lenses[anchor], lenses[camera])
    if board.kind == "chessboard":
        seen = [(a, _mirrored(b, sizes[camera], board)) for a, b in pairs]
        if _related(both, seen, _turns(board)).median_px <= limit:
            return f"{who}: one of them delivers mirrored pictures; switch off its horizontal or vertical flip (one of hflip, vflip alone)"
    for shift in _SHIFTS:
        moved = _shifted(pairs, shift)
        if len(moved) >= MIN_SHARED and _related(both, moved, _turns(board)).median_px <= limit:
            way = f"{abs(shift)} {'later' if shift > 0 else 'earlier'}"
            return f"{who}: the pictures are paired wrongly; those of {names[camera]!r} fit the others' {way} in number. Rename them"
    fitting = sum(error <= limit for error in relation.errors_px)
    return (
        f"{who}: no position of the second to the first explains the {len(pairs)} common pictures (the best fits {fitting}; the median is "
        f"{relation.median_px:.0f} px off). Either pictures with the same number do not show the same instant - hold the board still "
        "while all cameras take their picture - or a camera, its focus or its resolution was changed in between"
    )


def _mirrored(view: View, size_px: tuple[int, int], board: Board) -> View:
    pixels = view.pixels[mirrored(board.cols, board.rows)].copy()
    pixels[:, 0] = size_px[0] - 1 - pixels[:, 0]
    return replace(view, pixels=pixels)


def _shifted(pairs: list[tuple[View, View]], shift: int) -> list[tuple[View, View]]:
    firsts = pairs[shift:] if shift > 0 else pairs[:shift]
    seconds = pairs[:-shift] if shift > 0 else pairs[-shift:]
    return [(a, replace(b, board=a.board)) for (a, _), (_, b) in zip(firsts, seconds, strict=True)]
