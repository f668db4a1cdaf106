"""Cross-validation: board positions held out of an adjustment, and their influence on it. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from services.calibrator.bundle.adjust import Adjustment, FreeUnknowns, adjust
from services.calibrator.bundle.residuals import State, View, rms_by_board
from services.calibrator.bundle.views import subset

# Folds into which pictures are dealt to choose a lens model: with ten, nine tenths of the pictures
# calibrate.
_FOLDS = 10
# Positions of the real pairs are at most 1.6 times as far off as the median one, and raise the
# error of the others by less than 1 %.
_SUSPECT_TIMES, _SUSPECT_PERCENT = 3.0, 5.0


@dataclass(frozen=True, eq=False)
class LeftOneOut:
    """The adjustment without one board position, and that position's influence on the others.

    influence_percent: by how much the position raises the RMS error of all others, on average.
    """

    state: State
    influence_percent: float


def folds(count: int, parts: int = _FOLDS) -> list[np.ndarray]:
    """Numbers 0..count-1 dealt into parts, neighbours into different ones.

    One number each if there are fewer than parts.
    """
    parts = min(count, parts)
    return [np.arange(first, count, parts) for first in range(parts)]


def adjust_without(
    views: list[View], start: State, held_out: Iterable[int], free: FreeUnknowns
) -> State:
    """The state adjusted to all board positions but the held-out ones."""
    rest, rest_start = subset(views, start, _all_but(len(start.T_rig_from_board), held_out))
    return adjust(rest, rest_start, free).state


def leave_one_out(views: list[View], found: Adjustment, free: FreeUnknowns) -> list[LeftOneOut]:
    """Adjust again without each board position in turn, beginning with the state there is."""
    count = len(found.state.T_rig_from_board)
    rms_px = rms_by_board(views, found.residuals, count)
    result = []
    for board in range(count):
        rest, start = subset(views, found.state, _all_but(count, [board]))
        again = adjust(rest, start, free)
        influence = influence_percent(
            rms_px[:board] + rms_px[board + 1 :], rms_by_board(rest, again.residuals, count - 1)
        )
        result.append(LeftOneOut(again.state, influence))
    return result


def influence_percent(with_it: list[float], without_it: list[float]) -> float:
    """The influence of one position: the others' RMS px with it and without it, in one order.

    A mean of ratios: another bad position among them must not drown the rest.
    """
    ratios = np.array(with_it) / np.maximum(without_it, 1e-9)
    return 100.0 * float(np.mean(ratios) - 1.0) if len(ratios) else 0.0


def suspects(rms_px: list[float], influences_percent: list[float]) -> list[bool]:
    """Which positions a person should look at: residuals far above the median, or influence."""
    limit = _SUSPECT_TIMES * float(np.median(rms_px)) if rms_px else 0.0
    return [
        error > limit or influence > _SUSPECT_PERCENT
        for error, influence in zip(rms_px, influences_percent, strict=True)
    ]


def held_out_rms(errors: list[float]) -> float:
    """RMS of held-out errors; infinite of none, as nothing was tested."""
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("inf")


def _all_but(count: int, held_out: Iterable[int]) -> list[int]:
    """Numbers 0..count-1 without the held-out ones."""
    out = {int(number) for number in held_out}
    return [number for number in range(count) if number not in out]
