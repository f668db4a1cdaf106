"""Detections as the adjustment's views, and subsets of them. Pure.

Pictures of another size than most are set aside, with the reason.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from services.calibrator.board.board import Board
from services.calibrator.board.detect import Detection
from services.calibrator.bundle.residuals import State, View

# Positions of the real pairs are at most 1.6 times as far off as the median one, and pull by less
# than 1 %.
_FAR, _PULL_PERCENT = 3.0, 5.0


@dataclass(frozen=True)
class LeftOut:
    """A picture that was not used, and why."""

    camera: str
    key: str
    reason: str


def same_size(
    camera: str, detections: dict[str, Detection]
) -> tuple[tuple[int, int], dict[str, Detection], list[LeftOut]]:
    """The size most pictures have, those pictures, and the others.

    A size of (0, 0) where there are none.
    """
    if not detections:
        return (0, 0), {}, []
    sizes = Counter(found.size_px for found in detections.values())
    size_px = sizes.most_common(1)[0][0]
    kept = {key: found for key, found in detections.items() if found.size_px == size_px}
    others = [
        LeftOut(
            camera,
            key,
            f"is {found.size_px[0]}x{found.size_px[1]}, the others {size_px[0]}x{size_px[1]}",
        )
        for key, found in detections.items()
        if found.size_px != size_px
    ]
    return size_px, kept, others


def view_of(board: Board, found: Detection, camera: int, number: int) -> View:
    """One detection as a view of board position `number`."""
    return View(camera, number, found.ids, board.points[found.ids], found.corners)


def alone(view: View) -> View:
    """The view as the only one of its camera and board."""
    return replace(view, camera=0, board=0)


def subset(views: Iterable[View], state: State, boards: Iterable[int]) -> tuple[list[View], State]:
    """The views of these board positions, and the state of them, numbered anew in that order."""
    numbers = {int(board): number for number, board in enumerate(boards)}
    kept = [replace(view, board=numbers[view.board]) for view in views if view.board in numbers]
    return kept, replace(
        state, T_rig_from_board=state.T_rig_from_board[np.array(list(numbers), dtype=np.int64)]
    )


def pull_percent(with_it: list[float], without_it: list[float]) -> float:
    """By how much one position raises the error of all others, on average: their RMS px with it and
    without it, in the same order.

    A mean of ratios: another bad position among them must not drown the rest.
    """
    ratios = np.array(with_it) / np.maximum(without_it, 1e-9)
    return 100.0 * float(np.mean(ratios) - 1.0) if len(ratios) else 0.0


def hurting(errors_px: list[float], pulls_percent: list[float]) -> list[bool]:
    """Which positions a person should look at: far from the calibration, or pulling it away from
    the others.
    """
    limit = _FAR * float(np.median(errors_px)) if errors_px else 0.0
    return [
        error > limit or pull > _PULL_PERCENT
        for error, pull in zip(errors_px, pulls_percent, strict=True)
    ]


def others(count: int, held_out: np.ndarray) -> list[int]:
    """Numbers 0..count-1 without the held-out ones."""
    out = set(held_out.tolist())
    return [number for number in range(count) if number not in out]
