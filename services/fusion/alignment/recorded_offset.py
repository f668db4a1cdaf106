"""The offset and the drift between two cameras' clocks, from the heights of a whole recording.

Two views of one instant agree in height above the baseline, whatever the depth. The likeliest
offsets and drifts (likely_lines.py) are refined by regression window by window (clock_line.py),
which gives offset and drift with their covariance. Then the best line is held against the others
by what each leaves of the heights: a Student's t likelihood, of which a share of wrong markers is
no part. A hand that repeats itself has several lines nearly alike: undecided. Pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.clock_line import ClockLine, LineFit, fit_line, rows_along
from services.fusion.alignment.height_rows import INSTANTS_HZ, Rows, without_spikes
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.alignment.likely_lines import APART_S, likely_lines
from services.fusion.alignment.offset_search import usable_pairs

# Videos that were started by hand begin within a minute of each other.
RANGE_S = 60.0
# The likeliest are looked for again nearby, s, by so many rows: wrong markers spoil variances, by
# which lines are likely, and not what follows.
_ABOUT_S, _ABOUT_STEP_S, _ABOUT_ROWS, _ABOUT_LINES = 0.1, 0.02, 1500, 2
# Least noise of a height (.05 px at 500 px of focal length), and how many independent values a
# second of heights stands for: those of one hand move alike.
_NOISE, _RATE_HZ = 1e-4, 3.0
# What a line must be better by than any other, and than none, as a log-likelihood; and how much
# both must see, s.
_BETTER, _OVERLAP_S = 20.0, 2.5
# As a share of what it is better by than none, too: of much evidence 20 is little.
_BETTER_SHARE = 0.1
# Rows that differ from their mean by more than so many sigmas of what is left are of a hand that
# moves; of these such a share must fit, and so many there must be.
_MOVING, _FIT, _FIT_SHARE, _MOVING_ROWS = 5.0, 4.7, 0.6, 20
# Why it cannot be told, mostly.
_NOTHING = "nothing moves that both see for long enough to tell"
_REPEATS = "the motion repeats itself: two offsets fit"
# Degrees of freedom of what is left, and the share of rows that may be of something else.
_STUDENT, _WRONG = 4.0, 0.2


class RecordedOffset(NamedTuple):
    """The second camera's clock against the first's; why_not if it cannot be told.

    repeats: it cannot because others fit nearly as well: where the motion is the same each time,
    points are right by any of them.
    better is the best line's log-likelihood above the second best's; residual and second_residual,
    normalised units, what each leaves of the heights (robust RMS).
    """

    fit: LineFit
    why_not: str
    better: float
    residual: float
    second_s: float
    second_residual: float
    repeats: bool = False

    @property
    def decided(self) -> bool:
        """Whether the line may be relied on."""
        return not self.why_not


def undecided(why_not: str) -> RecordedOffset:
    """Nothing, and the reason."""
    nothing = LineFit(ClockLine(0.0, 0.0, 0.0), math.inf, math.inf, math.inf, 0)
    return RecordedOffset(nothing, why_not, 0.0, math.nan, math.nan, math.nan)


def find_recorded_offset(
    first: Sequence[HeightTrack], second: Sequence[HeightTrack], range_s: float = RANGE_S
) -> RecordedOffset:
    """The line within +-range_s; the tracks are of the same landmarks, in one order."""
    pairs = usable_pairs(*([without_spikes(track) for track in own] for own in (first, second)))
    if not pairs:
        return undecided("no marker is seen by both cameras")
    lines = likely_lines(pairs, range_s)
    if not lines:
        return undecided(_NOTHING)
    lines = [_best_about(pairs, line) for line in lines[:_ABOUT_LINES]] + lines[_ABOUT_LINES:]
    fits = [fit for line in lines if (fit := fit_line(pairs, line)) is not None]
    if not fits:
        return undecided(_NOTHING)
    return _judged(pairs, fits)


def _best_about(pairs: list[tuple[HeightTrack, HeightTrack]], line: ClockLine) -> ClockLine:
    """The best line of those a little earlier and later, by a part of all rows."""
    seconds = max(float(one.times_s[-1] - one.times_s[0]) for one, _ in pairs)
    rows_hz = _ABOUT_ROWS / (2.0 * len(pairs) * max(seconds, 1.0))
    count = round(_ABOUT_S / _ABOUT_STEP_S)
    near = [
        line._replace(offset_s=line.offset_s + _ABOUT_STEP_S * k) for k in range(-count, count + 1)
    ]
    found = [_compare(rows_along(pairs, one, rows_hz)) for one in near]
    scale = min(_scale(one.left) for one in found)
    return near[int(np.argmax([_mean_gain(one, scale) for one in found]))]


class _Comparison(NamedTuple):
    """What a line leaves of the heights, about each landmark's median: n rows."""

    left: Array  # (n,)
    own: Array  # (n,) what a constant leaves
    missed: Array  # (n,) variances of what interpolation misses at its worst
    seconds: float  # that both see
    landmarks: int


def _judged(pairs: list[tuple[HeightTrack, HeightTrack]], fits: list[LineFit]) -> RecordedOffset:
    """The best of some lines, and whether it is so good that it may be relied on."""
    found = [_compare(rows_along(pairs, fit.line)) for fit in fits]
    # By one scale, that of the line which leaves least of as much as another.
    most = max(one.seconds for one in found)
    scales = [_scale(one.left) for one in found]
    enough = [k for k, one in enumerate(found) if one.seconds >= max(0.1 * most, _OVERLAP_S)]
    if not enough:
        return undecided(_NOTHING)
    scale = min(scales[k] for k in enough)
    gains = [_gain(found[k], scale) if k in enough else -math.inf for k in range(len(found))]
    best = int(np.argmax(gains))
    fit, one = fits[best], found[best]
    scale = scales[best]
    # For as much evidence, where it is of at least half as much.
    rivals = {}
    for k, other in enumerate(found):
        if k == best or abs(fits[k].line.late_s(fit.line.at_s) - fit.line.offset_s) < APART_S:
            continue
        share = other.seconds / one.seconds
        rivals[k] = _gain(other, scale) / (share if 0.5 <= share < 1.0 else 1.0)
    gain = _gain(one, scale)
    second = max(rivals, key=lambda k: rivals[k], default=None)
    better = min([gain, *(gain - value for value in rivals.values())])
    moving = np.abs(one.own) > _MOVING * scale
    fits_well = np.abs(one.left) < _FIT * np.sqrt(scale**2 + one.missed)
    fitting = float(np.mean(fits_well[moving])) if moving.any() else 0.0
    why_not = ""
    if gain < _BETTER or np.count_nonzero(moving) < _MOVING_ROWS:
        why_not = _NOTHING
    elif fitting < _FIT_SHARE:
        why_not = "the views fit at no offset"
    elif better < max(_BETTER, _BETTER_SHARE * gain):
        why_not = _REPEATS
    return RecordedOffset(
        fit,
        why_not,
        better,
        scale,
        math.nan if second is None else fits[second].line.late_s(fit.line.at_s),
        math.nan if second is None else scales[second],
        why_not == _REPEATS,
    )


def _compare(rows: Rows | None) -> _Comparison:
    """What a line leaves, from its rows."""
    if rows is None:
        return _Comparison(np.zeros(0), np.zeros(0), np.zeros(0), 0.0, 0)
    heights, landmarks = rows.heights.heights, rows.heights.landmarks
    left = np.empty(len(heights))
    known = np.unique(landmarks).tolist()
    for landmark in known:
        its = landmarks == landmark
        left[its] = heights[its] - np.median(heights[its])
    seconds = len(np.unique(rows.heights.instants)) / INSTANTS_HZ
    return _Comparison(left, rows.own, rows.missed**2, seconds, len(known))


def _scale(left: Array) -> float:
    """The robust RMS of what is left, with a floor of the least noise there is."""
    if not len(left):
        return math.inf
    return math.hypot(1.48 * float(np.median(np.abs(left))), _NOISE)


def _gain(one: _Comparison, scale: float) -> float:
    """A line's log-likelihood above that of no relation."""
    return _RATE_HZ * one.seconds * math.sqrt(one.landmarks) * _mean_gain(one, scale)


def _mean_gain(one: _Comparison, scale: float) -> float:
    """The same for one value."""
    if not len(one.left):
        return -math.inf
    variances = _STUDENT * (scale**2 + one.missed)
    gained = np.log1p(one.own**2 / variances) - np.log1p(one.left**2 / variances)
    gained = np.logaddexp(
        math.log(1.0 - _WRONG) + 0.5 * (_STUDENT + 1.0) * gained, math.log(_WRONG)
    )
    return float(np.mean(gained))
