"""Which offsets and drifts between two cameras' clocks are likely at all, over minutes.

The recording is cut into pieces of some seconds, and each is compared with the other camera at all
offsets within the range (correlation by FFT, as in offset_search.py); a clock that drifts moves the
best offset from piece to piece, so that the pieces' log-likelihoods are added along lines (a Hough
transform: offset against drift). Pure.
"""

from __future__ import annotations

import math

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.clock_line import ClockLine
from services.fusion.alignment.height_track import HeightTrack, resampled
from services.fusion.alignment.offset_search import STEP_S, lag_variances

# Clocks of cameras are within 100 ppm of the truth, cheap ones within 200.
_DRIFT_MAX = 300e-6
# Pieces are so long, s, that wrong markers of some seconds spoil few of them, and that a drift of
# 200 ppm moves nothing by more than 2 ms; there are so many, up to a limit, as each costs 30 ms.
_PIECE_S, _PIECES, _MOST_PIECES = (3.0, 10.0), 12, 90
# What a piece may say against an offset at most, as a share of its values: wrong markers would
# outweigh all the others.
_AGAINST = 0.2
# So many lines are told; closer than this, s, two are one.
_LINES, APART_S = 6, 0.15


def likely_lines(pairs: list[tuple[HeightTrack, HeightTrack]], range_s: float) -> list[ClockLine]:
    """The lines of the highest peaks, the best first."""
    begin_s = min(float(one.times_s[0]) for one, _ in pairs)
    end_s = max(float(one.times_s[-1]) for one, _ in pairs)
    piece_s = float(np.clip((end_s - begin_s) / _PIECES, *_PIECE_S))
    count = int(np.clip(round((end_s - begin_s) / piece_s), 1, _MOST_PIECES))
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
    best[weights.sum(axis=0) == 0.0] = -np.inf
    lines: list[ClockLine] = []
    order = np.argsort(-best, kind="stable")
    for lag in order.tolist():
        offset_s = -range_s + lag * STEP_S
        if len(lines) == _LINES or (lines and best[lag] <= 0.0):
            break
        around = best[max(lag - 1, 0) : lag + 2]
        if best[lag] >= around.max() and all(
            abs(offset_s - one.offset_s) >= APART_S for one in lines
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
    gained = np.maximum(0.5 * np.log(own / left), -_AGAINST)
    return np.sum(weight * gained, axis=0), weight.sum(axis=0)


def _along_lines(scores: Array, since_s: Array) -> tuple[Array, Array]:
    """The best sum (K,) of pieces' scores (P, K) at each offset, and the drift that gives it."""
    reach_s = float(np.abs(since_s).max())
    # So fine that the ends move by one step.
    most = math.ceil(_DRIFT_MAX * reach_s / STEP_S) if len(since_s) > 1 else 0
    best, drifts = np.full(scores.shape[1], -np.inf), np.zeros(scores.shape[1])
    # No drift first: of equals it is the likelier.
    for step in sorted(range(-most, most + 1), key=abs):
        drift = step * _DRIFT_MAX / max(most, 1)
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
