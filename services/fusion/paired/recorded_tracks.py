"""The measured paths of a recording's landmarks, and where in them the hand is still or fast."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages import HandPoints
from services.fusion.arrays import Bools

# Windows of this length are still or not; a hand at rest trembles by less than 1.5 cm/s, a moving
# one does 10 cm/s and more.
WINDOW_S, _STILL_M_S, _FAST_M_S = 0.5, 0.03, 0.1
# Fewer samples of a window tell no speed.
_MIN_SAMPLES = 6


class Track(msgspec.Struct, frozen=True):
    """One measured landmark's path, and which samples belong to still and to fast windows."""

    times_s: Array  # (n,)
    points_m: Array  # (n, 3)
    still: Bools  # (n,)
    fast: Bools  # (n,)


def tracks(messages: Iterable[HandPoints]) -> list[Track]:
    """The paths of all landmarks of a recording, measured points only.

    Those shorter than two windows are left out.
    """
    recorded: dict[tuple[str, str], list[tuple[int, tuple[float, float, float]]]]
    recorded = defaultdict(list)
    for message in messages:
        for point in message.points:
            if point.source == "measured":
                recorded[message.hand, point.name].append((message.stamp_ns, point.position_m))
    found = []
    for samples in recorded.values():
        # Samples that come twice, or go back in time, are left out.
        samples = [s for k, s in enumerate(samples) if k == 0 or s[0] > samples[k - 1][0]]
        times_s = 1e-9 * np.array([stamp_ns - samples[0][0] for stamp_ns, _ in samples])
        points_m = np.array([position_m for _, position_m in samples])
        if len(times_s) > 8 and times_s[-1] > 2.0 * WINDOW_S:
            found.append(Track(times_s, points_m, *_windows(times_s, points_m)))
    return found


def _windows(times_s: Array, points_m: Array) -> tuple[Bools, Bools]:
    """Which samples (n,) are of still windows, and which of fast ones.

    By the speed of a straight line through a window: noise hardly moves it.
    """
    still = np.zeros(len(times_s), dtype=bool)
    fast = np.zeros(len(times_s), dtype=bool)
    windows = (times_s / WINDOW_S).astype(int)
    for window in np.unique(windows):
        inside = windows == window
        t = times_s[inside] - times_s[inside].mean()
        if len(t) < _MIN_SAMPLES:
            continue
        slope = t @ points_m[inside] / (t @ t)  # (3,) m/s
        # A hand that swings has little mean speed: the way it goes beside the line counts as well.
        spread = np.linalg.norm(np.std(points_m[inside] - np.outer(t, slope), axis=0))
        speed = float(np.linalg.norm(slope)) + max(0.0, float(spread) - 0.008) / WINDOW_S * 4.0
        still[inside] = speed < _STILL_M_S
        fast[inside] = speed > _FAST_M_S
    return still, fast


def seconds_of(times_s: Array, chosen: Bools) -> float:
    """Seconds of a track's samples that are chosen (n,)."""
    return float(np.sum(np.diff(times_s)[chosen[1:] & chosen[:-1]])) if len(times_s) > 1 else 0.0
