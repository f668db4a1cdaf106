"""What a filter does to recorded tracks: jitter at rest, error and lag in motion.

Truth is not known. In motion the path smoothed from both sides stands for it, which has no lag; at
rest a parabola through each window does.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.paired.one_euro import smoothing_factor
from services.fusion.paired.recorded_tracks import WINDOW_S, Track

_DCUTOFF_HZ = 1.0
# Reference path: cubics over this long to either side, or three samples. Fingers tap at up to 2.5
# Hz: a fifth of their period.
_REFERENCE_S = 0.08
_MAX_LAG_S = 0.15


def one_euro_path(track: Track, mincutoff_hz: float, beta: float) -> Array:
    """The filtered path (n, 3) by services.fusion.paired.one_euro.OneEuroFilter, joint.

    In plain floats: six times as fast, and equal.
    """
    filtered = track.points_m.copy()
    value = track.points_m[0].tolist()
    speed = [0.0, 0.0, 0.0]
    steps = zip(track.points_m[1:].tolist(), np.diff(track.times_s).tolist(), strict=True)
    for k, (point, dt) in enumerate(steps, start=1):
        ease = float(smoothing_factor(_DCUTOFF_HZ, dt))
        speed = [s + ease * ((p - v) / dt - s) for s, p, v in zip(speed, point, value, strict=True)]
        magnitude = (speed[0] ** 2 + speed[1] ** 2 + speed[2] ** 2) ** 0.5
        alpha = float(smoothing_factor(mincutoff_hz + beta * magnitude, dt))
        value = [v + alpha * (p - v) for p, v in zip(point, value, strict=True)]
        filtered[k] = value
    return filtered


def reference_path(track: Track) -> Array:
    """The path (n, 3) by local cubics: calm, and without lag.

    As Savitzky and Golay, "Smoothing and Differentiation of Data", 1964, but for uneven times.
    """
    smoothed = track.points_m.copy()
    for k, at_s in enumerate(track.times_s.tolist()):
        first = min(int(np.searchsorted(track.times_s, at_s - _REFERENCE_S)), max(k - 3, 0))
        last = max(int(np.searchsorted(track.times_s, at_s + _REFERENCE_S)), k + 4)
        t = (track.times_s[first:last] - at_s) / _REFERENCE_S
        # Across a gap a cubic would swing: such a point stays as it was measured.
        if len(t) >= 5 and np.diff(t).max() < 1.5:
            powers = np.vander(t, 4, increasing=True)
            smoothed[k] = np.linalg.lstsq(powers, track.points_m[first:last], rcond=None)[0][0]
    return smoothed


def jitter_m(tracks: list[Track], filtered: list[Array]) -> float:
    """RMS of one axis at rest about a parabola through each window, m.

    The hand's own slow drift is not jitter.
    """
    squares = []
    for track, points in zip(tracks, filtered, strict=True):
        windows = (track.times_s / WINDOW_S).astype(int)
        for window in np.unique(windows[track.still]):
            inside = (windows == window) & track.still
            t = track.times_s[inside] - track.times_s[inside].mean()
            basis = np.linalg.qr(np.vander(t, 3))[0]  # (n, 3) orthonormal
            residuals = points[inside] - basis @ (basis.T @ points[inside])  # (n, 3)
            n = inside.sum()
            squares.append(residuals.ravel() ** 2 * n / max(n - 3, 1))
    # The smallest value keeps ratios finite for a recording without any noise.
    return max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1e-7)


def motion_error_m(tracks: list[Track], filtered: list[Array], references: list[Array]) -> float:
    """RMS error in space of the fast windows, m."""
    errors = [
        points[track.fast] - reference[track.fast]
        for track, points, reference in zip(tracks, filtered, references, strict=True)
    ]
    return float(np.sqrt(np.mean(np.sum(np.concatenate(errors) ** 2, axis=1))))


def motion_speed_m_s(tracks: list[Track], references: list[Array]) -> float:
    """RMS speed of the fast windows, m/s."""
    speeds = []
    for track, reference in zip(tracks, references, strict=True):
        velocity = np.gradient(reference, track.times_s, axis=0)  # (n, 3)
        speeds.append(np.linalg.norm(velocity, axis=1)[track.fast])
    return float(np.sqrt(np.mean(np.concatenate(speeds) ** 2)))


def lag_s(tracks: list[Track], filtered: list[Array], references: list[Array]) -> float:
    """The delay at which the filtered paths fit the references best, s."""
    delays = np.arange(0.0, _MAX_LAG_S, 0.002)
    errors = np.zeros(len(delays))
    for track, points, reference in zip(tracks, filtered, references, strict=True):
        for n, delay_s in enumerate(delays):
            at_s = track.times_s - delay_s
            delayed = np.stack(
                [np.interp(at_s, track.times_s, reference[:, axis]) for axis in range(3)], axis=1
            )
            errors[n] += float(np.sum((points - delayed)[track.fast] ** 2))
    return float(delays[int(np.argmin(errors))])
