"""What 1-Euro settings suit a recording: jitter of its still stretch against error and lag in its
fast one.

Truth is not known; in motion the path smoothed from both sides stands for it, which has no lag.
Casiez et al., CHI 2012: first mincutoff for a calm rest, then beta for little lag; here all pairs
of a grid are tried and for each degree of calm the one with the least error in motion is kept. Gaps
in a track are bridged by their time step, as the live filter does. A recording without two seconds
at rest, or without one in motion, is a CaptureError that says what to record.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import msgspec
import numpy as np
import numpy.typing as npt

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.messages import HandPoints
from services.fusion.paired.one_euro import smoothing_factor

# Grids: from what makes a hand swim to what does nothing, a step of about 1.5.
CUTOFFS_HZ = np.geomspace(0.2, 20.0, 13)
BETAS = np.geomspace(2.0, 1000.0, 13)
# Degrees of calm that the table shows, as a share of the unfiltered jitter.
SHARES = (0.9, 0.7, 0.5, 0.35, 0.25)
_DCUTOFF_HZ = 1.0
# Windows of this length are still or not; a hand at rest trembles by less than 1.5 cm/s, a moving
# one does 10 cm/s and more.
_WINDOW_S, _STILL_M_S, _FAST_M_S = 0.5, 0.03, 0.1
_NEEDED_STILL_S, _NEEDED_FAST_S = 2.0, 1.0
# Reference path: cubics over this long to either side, or three samples. Fingers tap at up to 2.5
# Hz: a fifth of their period.
_REFERENCE_S = 0.08
_MAX_LAG_S = 0.15


class Row(msgspec.Struct, frozen=True):
    """One setting and what it does; jitter per axis at rest, error in space in motion."""

    mincutoff_hz: float
    beta: float
    jitter_mm: float
    jitter_share: float
    error_mm: float
    lag_ms: float


class Proposal(msgspec.Struct, frozen=True):
    """The trade-off, calmest last, and the row that was asked for."""

    still_s: float
    moving_s: float
    noise_mm: float
    speed_m_s: float
    rows: list[Row]
    best: Row


class Track(msgspec.Struct, frozen=True):
    """One measured landmark's path: times_s (n,), points_m (n, 3), and which samples belong to
    still and to fast windows (n,).
    """

    times_s: Array
    points_m: Array
    still: npt.NDArray[np.bool_]
    fast: npt.NDArray[np.bool_]


def tracks(messages: Iterable[HandPoints]) -> list[Track]:
    """The paths of all landmarks of a recording, measured points only.

    Those shorter than two windows are left out.
    """
    rows: dict[tuple[str, str], list[tuple[int, tuple[float, float, float]]]] = defaultdict(list)
    for message in messages:
        for point in message.points:
            if point.source == "measured":
                rows[message.hand, point.name].append((message.stamp_ns, point.position_m))
    found = []
    for samples in rows.values():
        samples = [s for k, s in enumerate(samples) if k == 0 or s[0] > samples[k - 1][0]]
        times_s = 1e-9 * np.array([stamp_ns - samples[0][0] for stamp_ns, _ in samples])
        points_m = np.array([position_m for _, position_m in samples])
        if len(times_s) > 8 and times_s[-1] > 2.0 * _WINDOW_S:
            found.append(Track(times_s, points_m, *_windows(times_s, points_m)))
    return found


def _windows(
    times_s: Array, points_m: Array
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Which samples are of still windows, which of fast ones, by the speed of a straight line
    through a window: noise hardly moves it.
    """
    still, fast = np.zeros(len(times_s), dtype=bool), np.zeros(len(times_s), dtype=bool)
    windows = (times_s / _WINDOW_S).astype(int)
    for window in np.unique(windows):
        inside = windows == window
        t = times_s[inside] - times_s[inside].mean()
        if len(t) < 6:
            continue
        slope = t @ points_m[inside] / (t @ t)
        # A hand that swings has little mean speed: the way it goes beside the line counts as well.
        spread = np.linalg.norm(np.std(points_m[inside] - np.outer(t, slope), axis=0))
        speed = float(np.linalg.norm(slope)) + max(0.0, float(spread) - 0.008) / _WINDOW_S * 4.0
        still[inside], fast[inside] = speed < _STILL_M_S, speed > _FAST_M_S
    return still, fast


def propose(paths: list[Track], jitter_share: float = 0.5) -> Proposal:
    """The trade-off of one recording, and the setting that brings its jitter at rest to
    jitter_share of the unfiltered one.

    Raises CaptureError if it has too little rest or too little motion.
    """
    still_s, moving_s = (
        max((_length(p.times_s, getattr(p, kind)) for p in paths), default=0.0)
        for kind in ("still", "fast")
    )
    if still_s < _NEEDED_STILL_S or moving_s < _NEEDED_FAST_S:
        raise CaptureError(
            f"the recording has {still_s:.1f} s of a still and {moving_s:.1f} s of a moving hand; hold the hand still for "
            f"{_NEEDED_STILL_S:.0f} s at least, then move it fast for {_NEEDED_FAST_S:.0f} s or more, all markers in both views"
        )
    noise_m = _rest(paths, [path.points_m for path in paths])
    references = [_smooth(path) for path in paths]
    tried = []
    for mincutoff_hz in CUTOFFS_HZ.tolist():
        for beta in BETAS.tolist():
            filtered = [_one_euro(path, mincutoff_hz, beta) for path in paths]
            tried.append(
                (
                    _rest(paths, filtered) / noise_m,
                    _error(paths, filtered, references),
                    mincutoff_hz,
                    beta,
                )
            )

    def row(share: float) -> Row | None:
        allowed = [entry for entry in tried if entry[0] <= share * 1.05]
        if not allowed:
            return None
        jitter, error_m, mincutoff_hz, beta = min(allowed, key=lambda entry: entry[1])
        lag_s = _lag(paths, [_one_euro(path, mincutoff_hz, beta) for path in paths], references)
        figures = (1e3 * jitter * noise_m, jitter, 1e3 * error_m, 1e3 * lag_s)
        return Row(
            round(mincutoff_hz, 2), round(beta, 1), *(round(float(value), 4) for value in figures)
        )

    best = row(jitter_share)
    if best is None:
        least = min(entry[0] for entry in tried)
        raise CaptureError(
            f"no setting brings the jitter of {1e3 * noise_m:.2f} mm down to {jitter_share:.2f} of it; the least is {least:.2f}: "
            f"use --jitter {least + 0.01:.2f} or more"
        )
    others = [found for share in SHARES if (found := row(share)) is not None]
    rows = sorted(
        {r.jitter_share: r for r in [*others, best]}.values(), key=lambda r: -r.jitter_share
    )
    speed = _speed(paths, references)
    return Proposal(
        round(still_s, 2), round(moving_s, 2), round(1e3 * noise_m, 4), round(speed, 3), rows, best
    )


def _length(times_s: Array, chosen: npt.NDArray[np.bool_]) -> float:
    """Seconds of a track that are chosen."""
    return float(np.sum(np.diff(times_s)[chosen[1:] & chosen[:-1]])) if len(times_s) > 1 else 0.0


def _rest(paths: list[Track], filtered: list[Array]) -> float:
    """RMS of one axis at rest about a parabola through each window: the hand's own slow drift is
    not jitter; m.
    """
    squares = []
    for path, points in zip(paths, filtered, strict=True):
        windows = (path.times_s / _WINDOW_S).astype(int)
        for window in np.unique(windows[path.still]):
            inside = (windows == window) & path.still
            basis = np.linalg.qr(np.vander(path.times_s[inside] - path.times_s[inside].mean(), 3))[
                0
            ]
            squares.append(
                (points[inside] - basis @ (basis.T @ points[inside])).ravel() ** 2
                * inside.sum()
                / max(inside.sum() - 3, 1)
            )
    # The smallest value keeps ratios finite for a recording without any noise.
    return max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1e-7)


def _error(paths: list[Track], filtered: list[Array], references: list[Array]) -> float:
    left = [
        points[path.fast] - reference[path.fast]
        for path, points, reference in zip(paths, filtered, references, strict=True)
    ]
    return float(np.sqrt(np.mean(np.sum(np.concatenate(left) ** 2, axis=1))))


def _speed(paths: list[Track], references: list[Array]) -> float:
    found = []
    for path, reference in zip(paths, references, strict=True):
        pace = np.linalg.norm(np.gradient(reference, path.times_s, axis=0), axis=1)
        found.append(pace[path.fast])
    return float(np.sqrt(np.mean(np.concatenate(found) ** 2)))


def _lag(paths: list[Track], filtered: list[Array], references: list[Array]) -> float:
    """The delay at which the filtered paths fit the references best, s."""
    delays = np.arange(0.0, _MAX_LAG_S, 0.002)
    errors = np.zeros(len(delays))
    for path, points, reference in zip(paths, filtered, references, strict=True):
        for n, delay_s in enumerate(delays):
            at_s = path.times_s - delay_s
            shifted = np.stack(
                [np.interp(at_s, path.times_s, reference[:, axis]) for axis in range(3)], axis=1
            )
            errors[n] += float(np.sum((points - shifted)[path.fast] ** 2))
    return float(delays[int(np.argmin(errors))])


def _one_euro(path: Track, mincutoff_hz: float, beta: float) -> Array:
    """services.fusion.paired.one_euro.OneEuroFilter with one cutoff for all axes, in plain floats:
    six times as fast, and equal.
    """
    out = path.points_m.copy()
    value, speed = path.points_m[0].tolist(), [0.0, 0.0, 0.0]
    for k, (point, dt) in enumerate(
        zip(path.points_m[1:].tolist(), np.diff(path.times_s).tolist(), strict=True), start=1
    ):
        ease = float(smoothing_factor(_DCUTOFF_HZ, dt))
        speed = [s + ease * ((p - v) / dt - s) for s, p, v in zip(speed, point, value, strict=True)]
        magnitude = (speed[0] ** 2 + speed[1] ** 2 + speed[2] ** 2) ** 0.5
        alpha = float(smoothing_factor(mincutoff_hz + beta * magnitude, dt))
        value = [v + alpha * (p - v) for p, v in zip(point, value, strict=True)]
        out[k] = value
    return out


def _smooth(path: Track) -> Array:
    """The path by local cubics, as Savitzky and Golay but for uneven times: calm, and without lag."""
    out = path.points_m.copy()
    for k, at_s in enumerate(path.times_s.tolist()):
        first = min(int(np.searchsorted(path.times_s, at_s - _REFERENCE_S)), max(k - 3, 0))
        last = max(int(np.searchsorted(path.times_s, at_s + _REFERENCE_S)), k + 4)
        t = (path.times_s[first:last] - at_s) / _REFERENCE_S
        # Across a gap a cubic would swing: such a point stays as it was measured.
        if len(t) >= 5 and np.diff(t).max() < 1.5:
            out[k] = np.linalg.lstsq(
                np.vander(t, 4, increasing=True), path.points_m[first:last], rcond=None
            )[0][0]
    return out
