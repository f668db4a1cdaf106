"""How a recording is played: a smooth curve through its frames, to and fro where it is too short.

Pure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.simulator.recorded_motion.recording import LONGEST_GAP_S

# Half of a turn's duration: 0.5 m/s turn round with 5 m/s^2, as hands do that are in no hurry.
_TURN_S = 0.1


@dataclass(frozen=True)
class Playback:
    """Which instant of a recording is shown when.

    to_and_fro: it turns round at its ends, eased, for ever; otherwise it stands there.
    """

    span_s: float
    to_and_fro: bool

    def __call__(self, times_s: Array) -> Array:
        """Instants of the recording at any times, of the same shape; s."""
        if not self.to_and_fro:
            return np.asarray(np.clip(times_s, 0.0, self.span_s))
        # Not more than a third of a short recording is for a turn.
        turn_s = min(_TURN_S, self.span_s / 3.0)
        phase = np.mod(times_s, 2.0 * self.span_s)
        there = np.where(phase > self.span_s, 2.0 * self.span_s - phase, phase)
        # The first frame is shown as it is: nothing was before it.
        begins = (times_s >= 0.0) & (times_s < self.span_s)
        back = self.span_s - _eased(self.span_s - there, turn_s)
        return np.asarray(np.where(begins, back, _eased(back, turn_s)))


def _eased(distance: Array, turn_s: float) -> Array:
    """A distance from an end (s of the recording) that turns round there without a jerk of speed:
    it goes down to half of turn_s only.
    """
    near = 0.5 * (distance**2 / turn_s + turn_s)
    return np.where(distance < turn_s, near, distance)


class Curve:
    """A cubic through samples (n, ...) at times (n,), where the samples are finite (all or none).

    NaN in gaps that are too long for one, and beyond the first and last sample.
    """

    def __init__(self, times_s: Array, samples: Array) -> None:
        # Not above: a rig whose hand moves by itself would start half a second later.
        from scipy.interpolate import CubicSpline

        seen = np.isfinite(samples.reshape(len(samples), -1)).all(axis=1)
        known_s = times_s[seen]
        self._spline = CubicSpline(known_s, samples[seen], axis=0)
        gaps = np.flatnonzero(np.diff(known_s) > LONGEST_GAP_S)
        ends = [(-np.inf, known_s[0]), (known_s[-1], np.inf)]
        self._unknown = [*ends, *((known_s[k], known_s[k + 1]) for k in gaps)]

    def __call__(self, times_s: Array) -> Array:
        """Values (k, ...) at times (k,)."""
        values = self._spline(times_s)
        for after, before in self._unknown:
            values[(times_s > after) & (times_s < before)] = np.nan
        return np.asarray(values)
