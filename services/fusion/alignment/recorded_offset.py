"""The offset and the drift between two cameras' clocks, from the heights of a whole recording.

Two views of one instant agree in height above the baseline, whatever the depth. The recording is
cut into pieces of some seconds, and each is compared with the other camera at all offsets within
the range (correlation by FFT, as in offset_search.py); a clock that drifts moves the best offset
from piece to piece, so that the pieces' log-likelihoods are added along lines (a Hough transform:
offset against drift). The likeliest lines are refined by regression piece by piece, and a line
through the pieces' offsets gives offset and drift with their covariance.

Then the best line is held against the others by what is left after each was refined, as a
Student's t likelihood: a hand that repeats itself has several lines nearly alike, and is refused.
Pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.clock_line import ClockLine, LineFit, fit_line, rows_along
from services.fusion.alignment.offset_search import (
    STEP_S,
    HeightTrack,
    lag_variances,
    resampled,
    usable_pairs,
)
from services.fusion.alignment.recorded_rows import INSTANTS_HZ, Rows

# Videos that were started by hand begin within a minute of each other.
RANGE_S = 60.0
# Clocks of cameras are within 100 ppm of the truth, cheap ones within 200.
DRIFT_MAX = 300e-6
# A piece is so long, s, that a drift of 200 ppm moves it by 2 ms within it; there are no more than
# so many, as each costs 30 ms.
_PIECE_S, _PIECES = 10.0, 90
# Lines that are refined and compared; closer than this, s, two are one.
_LINES, _APART_S = 6, 0.1
# Noise of a height, and how many independent values a second of one landmark's
# heights stands for, as in offset_search.py.
_NOISE, _RATE_HZ = 5e-4, 3.0
# What a line must be better by than any other, and than none, as a log-likelihood.
_BETTER = 20.0
# Rows that differ from their mean by more than so many sigmas of what is left are of a hand that
# moves; of these such a share must fit, and so many there must be.
_MOVING, _FIT, _FIT_SHARE, _MOVING_ROWS = 5.0, 4.7, 0.6, 20
# Degrees of freedom of what is left: markers are wrong now and then.
_STUDENT = 4.0


class RecordedOffset(NamedTuple):
    """The second camera's clock against the first's; why_not if it cannot be told.

    better is the best line's log-likelihood above the second best's; residual and second_residual,
    normalised units, what each leaves of the heights (robust RMS).
    """

    fit: LineFit
    why_not: str
    better: float
    residual: float
    second_s: float
    second_residual: float

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
    pairs = usable_pairs(first, second)
    if not pairs:
        return undecided("no marker is seen by both cameras")
    lines = _likely_lines(pairs, range_s)
    if not lines:
        return undecided("the recordings do not overlap for long enough")
    fits = [fit for line in lines if (fit := fit_line(pairs, line)) is not None]
    if not fits:
        return undecided("nothing moves that would tell")
    return _judged(pairs, fits)


class _Comparison(NamedTuple):
    """What a line leaves of the heights, about each landmark's median: n rows."""

    left: Array  # (n,)
    own: Array  # (n,) what a constant leaves
    missed: Array  # (n,) variances of what interpolation misses
    seconds: float  # of all landmarks together that the line is judged by


def _judged(pairs: list[tuple[HeightTrack, HeightTrack]], fits: list[LineFit]) -> RecordedOffset:
    """The best of some lines, and whether it is so good that it may be relied on."""
    found = [_compare(rows_along(pairs, fit.line)) for fit in fits]
    # By one scale, that of the line which leaves least of as much as another.
    most = max(one.seconds for one in found)
    scales = [_scale(one.left) for one in found]
    enough = [k for k, one in enumerate(found) if one.seconds >= 0.1 * most]
    scale = min(scales[k] for k in enough)
    gains = [_gain(found[k], scale) if k in enough else -math.inf for k in range(len(found))]
    best = int(np.argmax(gains))
    fit, one = fits[best], found[best]
    scale = scales[best]
    # For as much evidence, where it is of at least half as much.
    rivals = {}
    for k, other in enumerate(found):
        if k == best or abs(fits[k].line.late_s(fit.line.at_s) - fit.line.offset_s) < _APART_S:
            continue
        share = other.seconds / one.seconds
        factor = 1.0 / share if share >= 0.5 else 1.0
        rivals[k] = _gain(other, scale) * factor
    gain = _gain(one, scale)
    second = max(rivals, key=lambda k: rivals[k], default=None)
    better = min([gain, *(gain - value for value in rivals.values())])
    moving = np.abs(one.own) > _MOVING * scale
    fits_well = np.abs(one.left) < _FIT * np.sqrt(scale**2 + one.missed)
    fitting = float(np.mean(fits_well[moving])) if moving.any() else 0.0
    why_not = ""
    if gain < _BETTER or np.count_nonzero(moving) < _MOVING_ROWS:
        why_not = "nothing moves that would tell"
    elif fitting < _FIT_SHARE:
        why_not = "the views fit at no offset"
    elif better < _BETTER:
        why_not = "the motion repeats itself: two offsets fit"
    return RecordedOffset(
        fit,
        why_not,
        better,
        scale,
        math.nan if second is None else fits[second].line.late_s(fit.line.at_s),
        math.nan if second is None else scales[second],
    )


def _compare(rows: Rows | None) -> _Comparison:
    """What a line leaves, from its rows."""
    if rows is None:
        return _Comparison(np.zeros(0), np.zeros(0), np.zeros(0), 0.0)
    heights, landmarks = rows.heights.heights, rows.heights.landmarks
    left = np.empty(len(heights))
    for landmark in np.unique(landmarks).tolist():
        its = landmarks == landmark
        left[its] = heights[its] - np.median(heights[its])
    variances = rows.heights.variances
    known = np.unique(rows.heights.instants * (1 + landmarks.max()) + landmarks)
    return _Comparison(left, rows.own, variances - variances.min(), len(known) / INSTANTS_HZ)


def _scale(left: Array) -> float:
    """The robust RMS of what is left, with a floor of the least noise there is."""
    if not len(left):
        return math.inf
    return math.hypot(1.48 * float(np.median(np.abs(left))), 0.2 * _NOISE)


def _gain(one: _Comparison, scale: float) -> float:
    """A line's log-likelihood above that of no relation, Student's t of a scale."""
    if not len(one.left):
        return -math.inf
    variances = _STUDENT * (scale**2 + one.missed)
    gained = np.log1p(one.own**2 / variances) - np.log1p(one.left**2 / variances)
    return 0.5 * (_STUDENT + 1.0) * _RATE_HZ * one.seconds * float(np.mean(gained))


def _likely_lines(pairs: list[tuple[HeightTrack, HeightTrack]], range_s: float) -> list[ClockLine]:
    """The lines of the highest peaks, the best first."""
    begin_s = min(float(one.times_s[0]) for one, _ in pairs)
    end_s = max(float(one.times_s[-1]) for one, _ in pairs)
    count = int(np.clip(round((end_s - begin_s) / _PIECE_S), 1, _PIECES))
    samples = int((end_s - begin_s) / (count * STEP_S)) + 1
    lags = 2 * int(range_s / STEP_S) + 1
    a, ma = resampled([one for one, _ in pairs], _grid(begin_s, count * samples))
    other_s = _grid(begin_s - range_s, count * samples + lags - 1)
    b, mb = resampled([other for _, other in pairs], other_s)
    scores, weights = np.zeros((count, lags)), np.zeros((count, lags))
    for k in range(count):
        own, there = slice(k * samples, (k + 1) * samples), slice(k * samples, None)
        if ma[:, own].any():
            reach = samples + lags - 1
            scores[k], weights[k] = _scores(
                a[:, own], ma[:, own], b[:, there][:, :reach], mb[:, there][:, :reach]
            )
    middles_s = _grid(begin_s + 0.5 * STEP_S * samples, count * samples)[::samples]
    # Drifts are about where pieces tell most.
    told = weights.max(axis=1)
    if not told.any():
        return []
    at_s = float(middles_s @ told / told.sum())
    best, drifts = _along_lines(scores, np.asarray(middles_s - at_s))
    lines: list[ClockLine] = []
    order = np.argsort(-best, kind="stable")
    for lag in order.tolist():
        offset_s = -range_s + lag * STEP_S
        if len(lines) == _LINES or best[lag] <= 0.0:
            break
        around = best[max(lag - 1, 0) : lag + 2]
        if best[lag] >= around.max() and all(
            abs(offset_s - one.offset_s) >= _APART_S for one in lines
        ):
            lines.append(ClockLine(offset_s, float(drifts[lag]), at_s))
    return lines


def _grid(begin_s: float, count: int) -> Array:
    return np.asarray(begin_s + STEP_S * np.arange(count), dtype=np.float64)


def _scores(a: Array, ma: Array, b: Array, mb: Array) -> tuple[Array, Array]:
    """Log-likelihoods (K,) of a piece at all lags, and the numbers of values they rest on.

    a, ma (L, N) heights and where they are known; b, mb (L, N + K - 1) of the other camera.
    """
    lags = b.shape[1] - a.shape[1] + 1
    length = 1 << (b.shape[1] - 1).bit_length()
    known = ma.any(axis=1) & mb.any(axis=1)
    if not known.any():
        return np.zeros(lags), np.zeros(lags)
    a, ma, b, mb = a[known], ma[known], b[known], mb[known]
    own, left, weight = (x[:, :lags] for x in lag_variances(a, ma, b, mb, length))
    return 0.5 * np.sum(weight * np.log(own / left), axis=0), weight.sum(axis=0)


def _along_lines(scores: Array, since_s: Array) -> tuple[Array, Array]:
    """The best sum (K,) of pieces' scores (P, K) at each offset, and the drift that gives it."""
    reach_s = float(np.abs(since_s).max())
    # So fine that the ends move by one step.
    most = math.ceil(DRIFT_MAX * reach_s / STEP_S) if len(since_s) > 1 else 0
    best, drifts = np.full(scores.shape[1], -np.inf), np.zeros(scores.shape[1])
    # No drift first: of equals it is the likelier.
    for step in sorted(range(-most, most + 1), key=abs):
        drift = step * DRIFT_MAX / max(most, 1)
        total = np.zeros(scores.shape[1])
        for score, since in zip(scores, since_s.tolist(), strict=True):
            shift = round(drift * since / STEP_S)
            if shift >= 0:
                total[: len(total) - shift] += score[shift:]
            else:
                total[-shift:] += score[:shift]
        better = total > best
        best[better], drifts[better] = total[better], drift
    return best, drifts
