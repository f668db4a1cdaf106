"""Why no relative pose explains what two cameras saw: the usual causes, tried one by one. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

from services.calibrator.board.board import Board
from services.calibrator.board.corner_order import mirrored_numbering, possible_numberings
from services.calibrator.bundle.residuals import View
from services.calibrator.rig.relative_pose import (
    Lenses,
    RelativePose,
    ViewPair,
    find_relative_pose,
)

# Two poses fix the relative pose, further ones test it; with fewer than this a wrong one goes
# unnoticed.
MIN_SHARED = 4
# Pairing errors looked for: a picture more or less on one side.
_SHIFTS = (1, -1, 2, -2)


@dataclass(frozen=True, eq=False)
class CameraPair:
    """Two cameras, and their views of the boards both saw."""

    names: tuple[str, str]
    second_size_px: tuple[int, int]
    lenses: Lenses
    views: list[ViewPair]


def diagnose(pair: CameraPair, board: Board, found: RelativePose, limit_px: float) -> str:
    """The sentence that says why the pose found does not fit to limit_px, and what to do."""
    first, second = (repr(name) for name in pair.names)
    both = f"cameras {first} and {second}"

    def fits(views: list[ViewPair]) -> bool:
        again = find_relative_pose(pair.lenses, views, possible_numberings(board))
        return again.median_px <= limit_px

    if board.kind == "chessboard" and fits(_second_mirrored(pair, board)):
        return (
            f"{both}: one of them delivers mirrored pictures; switch off its horizontal or "
            "vertical flip (one of hflip, vflip alone)"
        )
    for shift in _SHIFTS:
        shifted = _shifted(pair.views, shift)
        if len(shifted) >= MIN_SHARED and fits(shifted):
            way = f"{abs(shift)} {'later' if shift > 0 else 'earlier'}"
            return (
                f"{both}: the pictures are paired wrongly; those of {second} fit the others' {way} "
                "in number. Rename them"
            )
    fitting = sum(error <= limit_px for error in found.errors_px)
    return (
        f"{both}: no position of the second to the first explains the {len(pair.views)} common "
        f"pictures (the best fits {fitting}; the median is {found.median_px:.0f} px off). Either "
        "pictures with the same number do not show the same instant - hold the board still while "
        "all cameras take their picture - or a camera, its focus or its resolution was changed in "
        "between"
    )


def _second_mirrored(pair: CameraPair, board: Board) -> list[ViewPair]:
    """The views as they were if the second camera's pictures were mirrored."""
    order = mirrored_numbering(board.cols, board.rows)
    width = pair.second_size_px[0]

    def mirrored(view: View) -> View:
        pixels = view.pixels[order].copy()
        pixels[:, 0] = width - 1 - pixels[:, 0]
        return replace(view, pixels=pixels)

    return [(first, mirrored(second)) for first, second in pair.views]


def _shifted(pairs: list[ViewPair], shift: int) -> list[ViewPair]:
    """Each first view with the second view of a pair so many numbers earlier."""
    firsts = pairs[shift:] if shift > 0 else pairs[:shift]
    seconds = pairs[:-shift] if shift > 0 else pairs[-shift:]
    return [
        (first, replace(second, board=first.board))
        for (first, _), (_, second) in zip(firsts, seconds, strict=True)
    ]
