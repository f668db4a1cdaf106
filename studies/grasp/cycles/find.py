"""Where a finger closes and opens: found in the sum of its three flexions over time. Pure.

The sum is smoothed, then followed from one turning point to the next; a turn counts where the
motion has gone back by a share of the whole range (so that noise and trembling do not). Between
two turning points a closing begins where the sum last left the open level, and ends where it first
reached the closed one: pauses at either end are not part of it, pauses on the way are.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from rhot.geometry.transforms import Array

Kind = Literal["closing", "opening"]

# rad; a finger that flexes less in all, three joints together, does not close.
_MIN_RANGE_RAD = np.deg2rad(30.0)
# Share of the whole range by which the motion must go back for a turning point. A closing that
# is given up half way is one of its own (marked incomplete); trembling and hesitating are not.
_TURN_SHARE = 0.35
# A motion of less than this share of the usual range is incomplete.
_COMPLETE_SHARE = 0.75
# A recording that starts further from the usual level, as a share of the range, starts in a motion.
_LEVEL_SHARE = 0.12
# The motion begins and ends at this share of its range from the levels before and after. 3 % of
# 200 deg is 6 deg: three times the noise of dots after smoothing.
_EDGE_SHARE = 0.03
# s; smoothing before the search. A quick fist takes 0.3 s.
_SMOOTH_S = 0.1
# A motion with a longer stretch without measurement is incomplete: share of its duration.
_GAP_SHARE = 0.12
# A stretch that moves slower than this share of the mean speed is a pause; reported from 0.2 of
# the duration on.
_PAUSE_SPEED, _PAUSE_SHARE = 0.05, 0.2
_MIN_FRAMES = 8


class Cycle(NamedTuple):
    """One closing or opening."""

    kind: Kind
    start_s: float
    end_s: float
    range_rad: float  # of the three flexions together
    frames: int  # measured in it
    incomplete: str  # why it is, or nothing
    pause_s: float  # the longest standstill on the way, 0 if short


def find_cycles(times_s: Array, flexion_rad: Array) -> tuple[list[Cycle], str]:
    """All closings and openings by time; and why there are none, where there are none.

    times_s (n,), flexion_rad (n,): the sum of the flexions, NaN where not measured.
    """
    known = np.isfinite(flexion_rad)
    if known.sum() < _MIN_FRAMES:
        return [], f"only {int(known.sum())} frames tell how far the finger is bent"
    seen_s, seen = times_s[known], flexion_rad[known]
    grid_s, smooth = _smoothed(seen_s, seen)
    whole = float(np.ptp(smooth))
    if whole < _MIN_RANGE_RAD:
        return [], (
            f"its flexions change by {np.rad2deg(whole):.0f} deg in all three joints together;"
            f" a closing changes them by {np.rad2deg(_MIN_RANGE_RAD):.0f} deg at least"
        )
    turns = _turning_points(smooth, max(_TURN_SHARE * whole, 0.6 * _MIN_RANGE_RAD))
    moves = [_move(grid_s, smooth, a, b) for a, b in pairwise(turns)]
    usual = np.median([m.range_rad for m in moves if m.range_rad > 0.6 * whole])
    levels = _usual_levels(smooth, turns)
    found = []
    for move, first, last in zip(moves, turns[:-1], turns[1:], strict=True):
        inside = (seen_s >= move.start_s - 1e-9) & (seen_s <= move.end_s + 1e-9)
        why = _why_incomplete(move, seen_s[inside], float(usual))
        before, after = levels if move.kind == "closing" else levels[::-1]
        if move is moves[0] and abs(smooth[first] - before) > _LEVEL_SHARE * usual:
            why = "the recording starts in the middle of it"
        if move is moves[-1] and abs(smooth[last] - after) > _LEVEL_SHARE * usual:
            why = "the recording ends in the middle of it"
        found.append(move._replace(frames=int(inside.sum()), incomplete=why))
    return found, ""


def _smoothed(times_s: Array, values: Array) -> tuple[Array, Array]:
    """On an even grid of the usual step: a running median of five, then a mean over _SMOOTH_S."""
    step_s = max(float(np.median(np.diff(times_s))), (times_s[-1] - times_s[0]) / 1e5)
    grid_s = np.arange(times_s[0], times_s[-1] + 0.5 * step_s, step_s)
    even = np.interp(grid_s, times_s, values)
    padded = np.pad(even, 2, mode="edge")
    even = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    half = round(0.5 * _SMOOTH_S / step_s)
    padded = np.pad(even, half, mode="reflect", reflect_type="odd") if len(even) > half else even
    width = len(padded) - len(even) + 1
    return grid_s, np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def _turning_points(values: Array, turn: float) -> list[int]:
    """Numbers of the lowest and highest values by turns, those at both ends included."""
    points: list[int] = []
    low = high = 0
    rising = 0  # not yet known
    for k, value in enumerate(values.tolist()):
        if value > values[high]:
            high = k
        if value < values[low]:
            low = k
        if rising >= 0 and value < values[high] - turn:
            points += [low, high] if rising == 0 and low < high else [high]
            rising, low = -1, k
        elif rising <= 0 and value > values[low] + turn:
            points += [high, low] if rising == 0 and high < low else [low]
            rising, high = 1, k
    last = high if rising > 0 else low
    if points and last > points[-1]:
        points.append(last)
    return points


def _move(grid_s: Array, smooth: Array, first: int, last: int) -> Cycle:
    """From one turning point to the next, without the rests at both."""
    before, after = smooth[first], smooth[last]
    share = (smooth[first : last + 1] - before) / (after - before)
    middle = int(np.argmax(share > 0.5))
    start = int(np.flatnonzero(share[: middle + 1] <= _EDGE_SHARE)[-1])
    end = middle + int(np.argmax(share[middle:] >= 1.0 - _EDGE_SHARE))
    duration_s = float(grid_s[first + end] - grid_s[first + start])
    slow = np.abs(np.diff(share[start : end + 1])) < _PAUSE_SPEED / max(end - start, 1)
    pause_s = _longest_run(slow) * float(grid_s[1] - grid_s[0])
    return Cycle(
        kind="closing" if after > before else "opening",
        start_s=float(grid_s[first + start]),
        end_s=float(grid_s[first + end]),
        range_rad=abs(float(after - before)),
        frames=0,
        incomplete="",
        pause_s=pause_s if pause_s > _PAUSE_SHARE * duration_s else 0.0,
    )


def _longest_run(flags: Array) -> int:
    longest = run = 0
    for flag in flags.tolist():
        run = run + 1 if flag else 0
        longest = max(longest, run)
    return longest


def _usual_levels(smooth: Array, turns: list[int]) -> tuple[float, float]:
    """The open and the closed level: medians of turning points, the first and last if no other."""
    first_is_closed = smooth[turns[0]] > smooth[turns[1]]
    levels = []
    for is_closed in (False, True):
        own = turns[0 if first_is_closed == is_closed else 1 :: 2]
        inner = [k for k in own if k not in (turns[0], turns[-1])] or own
        levels.append(float(np.median(smooth[inner])))
    return levels[0], levels[1]


def _why_incomplete(move: Cycle, seen_s: Array, usual: float) -> str:
    if move.range_rad < _COMPLETE_SHARE * usual:
        share = 100.0 * move.range_rad / usual
        return f"it covers {share:.0f} % of the usual range"
    if len(seen_s) < _MIN_FRAMES:
        return f"only {len(seen_s)} frames were measured in it"
    edges = np.concatenate([[move.start_s], seen_s, [move.end_s]])
    gap_s = float(np.diff(edges).max())
    if gap_s > max(_GAP_SHARE * (move.end_s - move.start_s), 2.5 * np.median(np.diff(seen_s))):
        return f"nothing was measured for {gap_s:.2f} s of it"
    return ""
