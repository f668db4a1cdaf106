"""The offset between two cameras' clocks from the heights of markers, however far apart they are.

Two views of one instant agree in height above the baseline, whatever the depth. So of all offsets
within a range the right one is that at which each landmark's height differs least between the two,
up to a constant. First all offsets of a grid at once (correlation by FFT of heights resampled by
cubics; its cost grows with range and length as n log n), then a robust regression about the best.

It says when it cannot tell: of a hand that keeps still all offsets are alike, of one that repeats
itself two are, and views that fit at no offset are not of one hand. Pure; a range of +-2.5 s is for
rigs, more for videos that were started by hand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.clock_line import CONSTANT, ClockLine, rows_along
from services.fusion.alignment.height_track import HeightTrack, resampled
from services.fusion.monitors.shift_regression import NOTHING, fit_shift

# The grid of the search, s: a hand's motion changes little within it, and the regression finds the
# rest.
STEP_S = 0.01
# Noise of a height (normalised units at 500 px of focal length: .25 px), as a floor for what cubics
# miss and for markers of a resting hand.
_NOISE = 5e-4
# How many independent values a second of one landmark's heights stands for: those of one hand move
# alike, and change within a third of a second.
_RATE_HZ = 3.0
# The least overlap that an offset is judged by, s.
_OVERLAP_S = 1.5
# What an offset must be better by than any other, and than none, as a log-likelihood; and the share
# of the heights' variance that it must explain. Four seconds of moving hands (tuning half, also
# under lasting errors of 2 px) have 54 and .95 at least; of hands at rest 7 and .62 at most, or so
# little motion that the regression refuses it.
_BETTER, _EXPLAINED = 20.0, 0.8
# Offsets at which so much overlaps, as a share of the best one's, are compared by like evidence.
_ALIKE = 0.5
# Rounds of the regression at most, and the share of its sigma by which a settled one moves. It
# looks at all samples of both cameras, and at what cubics miss. (With ten a second of one camera's,
# of 50 captures of the tuning motions under lasting errors of 0 to 3 px whose clocks were 10, 20
# and 500 ms off, 18, 28 and 36 were put right to 3 ms; so, 38, 40 and 40; of 50 with right clocks
# none was touched, either way. Of 20 ms, 42 tuning clips of the other renderer had .67 ms RMS left,
# 2.5 at most; so, .54 and 1.5.)
_ROUNDS, _SETTLED = 4, 0.1


class Offset(NamedTuple):
    """How much later the second camera's clock reads than the first's; why_not if undecided."""

    offset_s: float
    sigma_s: float
    why_not: str
    better: float  # than the second best, as a log-likelihood

    @property
    def decided(self) -> bool:
        """Whether the offset may be relied on."""
        return not self.why_not


def undecided(why_not: str) -> Offset:
    """No offset, and the reason."""
    return Offset(0.0, math.inf, why_not, 0.0)


def find_offset(
    first: Sequence[HeightTrack],
    second: Sequence[HeightTrack],
    range_s: float = 2.5,
    near_s: float = 0.0,
    *,
    together: bool = False,
) -> Offset:
    """The offset within near_s +- range_s; the tracks are of the same landmarks, in one order.

    together: both tracks are of the same seconds, as frames that arrived together are. That so much
    overlaps then speaks for an offset, even of motion that repeats itself.
    """
    pairs = usable_pairs(first, second)
    if not pairs:
        return undecided("no marker is seen by both cameras")
    offsets_s, score, explained, weight = _scores(pairs, range_s, near_s)
    if not len(score):
        return undecided("the views do not overlap for long enough")
    best = int(np.argmax(score))
    better = _better(score, np.ones_like(weight) if together else weight, best)
    coarse_s = float(offsets_s[best])
    if score[best] < _BETTER:
        return Offset(coarse_s, math.inf, "nothing moves that would tell", better)
    if explained[best] < _EXPLAINED:
        return Offset(coarse_s, math.inf, "the views fit at no offset", better)
    if better < _BETTER:
        return Offset(coarse_s, math.inf, "the motion repeats itself: two offsets fit", better)
    if best in (0, len(score) - 1):
        return Offset(coarse_s, math.inf, "the offset lies at the end of the search", better)
    return _refined(pairs, coarse_s, better)


def usable_pairs(
    first: Sequence[HeightTrack], second: Sequence[HeightTrack]
) -> list[tuple[HeightTrack, HeightTrack]]:
    """The tracks of each landmark that both cameras see for some samples."""
    return [
        (one, other)
        for one, other in zip(first, second, strict=True)
        if len(one.times_s) >= 4 and len(other.times_s) >= 4
    ]


def _scores(
    pairs: list[tuple[HeightTrack, HeightTrack]], range_s: float, near_s: float
) -> tuple[Array, Array, Array, Array]:
    """Offsets (K,) of the grid, their log-likelihoods, the shares of variance explained, weights.

    A weight is the number of independent values that an offset is judged by.
    """
    ends = [
        (min(track.times_s[0] for track in own), max(track.times_s[-1] for track in own))
        for own in zip(*pairs, strict=True)
    ]
    # One instant at least, of stamps that stand still or run back, too.
    grids = [np.arange(begin, max(end, begin + STEP_S), STEP_S) for begin, end in ends]
    a, ma = resampled([pair[0] for pair in pairs], grids[0])  # (L, N)
    b, mb = resampled([pair[1] for pair in pairs], grids[1])
    length = fast_length(a.shape[1] + b.shape[1])
    lags = np.arange(length)
    lags[lags >= b.shape[1]] -= length
    offsets_s = lags * STEP_S + (ends[1][0] - ends[0][0])
    own, left, weight = lag_variances(a, ma, b, mb, length)
    score = 0.5 * np.sum(weight * np.log(own / left), axis=0)
    explained = 1.0 - np.sum(weight * left, axis=0) / np.maximum(
        np.sum(weight * own, axis=0), 1e-12
    )
    taken = np.flatnonzero((np.abs(offsets_s - near_s) <= range_s) & (weight.sum(axis=0) > 0.0))
    taken = taken[np.argsort(offsets_s[taken])]
    return offsets_s[taken], score[taken], explained[taken], weight.sum(axis=0)[taken]


def fast_length(least: int) -> int:
    """The next number from `least` on with no prime factor above 5: by others an FFT takes longer.

    Of 1201 numbers, a prime, six times as long as of 1215.
    """
    length = least
    while True:
        left = length
        for prime in (2, 3, 5):
            while left % prime == 0:
                left //= prime
        if left == 1:
            return length
        length += 1


def lag_variances(
    a: Array, ma: Array, b: Array, mb: Array, length: int
) -> tuple[Array, Array, Array]:
    """Variances of heights and of what is left at each lag (L, length), and numbers of values.

    a, b heights of L landmarks, ma, mb where they are known; lags beyond half of length are those
    below 0.
    """
    fa, fma, faa = (np.fft.rfft(x, length).conj() for x in (a, ma, a * a))
    fb, fmb, fbb = (np.fft.rfft(x, length) for x in (b, mb, b * b))
    # Sums over the overlap at each lag: of samples, heights, squares and products.
    n, sa, sb, saa, sbb, sab = np.fft.irfft(
        np.stack([fma * fmb, fa * fmb, fma * fb, faa * fmb, fma * fbb, fa * fb]), length
    )  # (L, length) each
    n = np.round(n)
    enough = np.maximum(n, 1.0)
    mean_a, mean_b = sa / enough, sb / enough
    own = saa / enough - mean_a**2 + sbb / enough - mean_b**2
    left = (saa + sbb - 2.0 * sab) / enough - (mean_a - mean_b) ** 2
    own, left = np.maximum(own, 0.0) + _NOISE**2, np.maximum(left, 0.0) + _NOISE**2
    return own, left, np.where(n * STEP_S >= _OVERLAP_S, n * STEP_S * _RATE_HZ, 0.0)


def _better(score: Array, weight: Array, best: int) -> float:
    """What the best offset's log-likelihood is above those beyond the valleys on both sides, ...

    ... and above none at all; of offsets at which nearly as much overlaps, for as much evidence.
    """
    falling = np.diff(score)
    left = np.flatnonzero(falling[:best] < 0.0)
    right = np.flatnonzero(falling[best:] > 0.0)
    elsewhere = np.zeros(len(score), dtype=bool)
    if len(left):
        elsewhere[: left[-1] + 1] = True
    if len(right):
        elsewhere[best + right[0] :] = True
    alike = np.where(weight >= _ALIKE * weight[best], weight / weight[best], 1.0)
    above = np.minimum(score[best], score[best] * alike) - score
    return float(min([score[best], *above[elsewhere].tolist()]))


def _refined(
    pairs: list[tuple[HeightTrack, HeightTrack]], coarse_s: float, better: float
) -> Offset:
    """The offset by regression about that of the grid."""
    offset_s, variance = coarse_s, math.inf
    for _ in range(_ROUNDS):
        rows = rows_along(pairs, ClockLine(offset_s, 0.0, 0.0))
        found = NOTHING if rows is None else fit_shift(rows.heights, 0.0, CONSTANT)
        offset_s, variance = offset_s + found.shift_s, found.variance
        if not math.isfinite(variance) or abs(offset_s - coarse_s) > 2.0 * STEP_S:
            return Offset(coarse_s, math.inf, "the motion is too little to be timed", better)
        if abs(found.shift_s) < _SETTLED * math.sqrt(variance):
            break
    return Offset(offset_s, math.sqrt(variance), "", better)
