"""Whether one part of a hand touches an object: begin and end from a series of distances. Pure.

A measured distance is biased by a millimetre or two, and differently tomorrow; so a touch begins
where a distance within its uncertainty stops falling, and ends where it rises from the level it had
while it touched. Either is found late, and dated back to the kink (kink.py); a finger that opens by
a few millimetres only and stays there is found when the whole hand leaves, and dated to its own.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from services.object_tracker.contacts.kink import arrival, departure

# The distance at which a part may touch. This and what follows was tried on 30 hands and cups of
# benchmarks/objects_grasps.py, seeds below 1000: 96 % of begins and ends within 50 ms and 3 mm,
# none twice; with 1.2 to 2 sigma the same within a percent. What is about fingers that slow down
# was tried on 47 hands of the simulator's grasp family, even seeds: 92.6 % before, 94.2 % now.
_ON_SIGMAS, _ON_MIN_M, _ON_MAX_M = 1.5, 0.002, 0.004
# How far it must rise above its level while touching, in RMS of what it did about that. With 2.5
# and 2.5 mm 44 of 150 touches broke in two, with 3 and 3 mm two.
_OFF_SPREADS, _OFF_MIN_M, _OFF_MAX_M = 4.0, 0.004, 0.006
# That RMS before there is any: rendered fingers' tips leave 0.8 mm from frame to frame.
_SPREAD_M = 0.001
# A finger that stands still: fingers close at 50 to 300 mm/s, slow ones end at 20. It may leave at
# the first, and come at the second, less the further it is from the surface: at 8 to 25 mm/s some
# had 5 mm to go when they "stood". With 25 mm/s for both, one of 47 grasps (even seeds) was wrong;
# with 15 and 18 none.
_STILL_M_S, _COMING_M_S = 0.025, 0.018
# Of the line that says where it is now, and how fast. With three samples: 1 % more missed; with
# five the slope of a finger at rest is 3 mm/s wrong, and a touch is told 15 ms later.
_SLOPE_S, _SLOPE_SAMPLES = 0.13, 5
# A fit that comes from less far than this is noise: the finger was there before it was seen.
_LEAST_M = 0.002
# What the kink is sought in, without the far part of the way. With 0.35 s 2 % more were missed, as
# a finger's speed changes on its way.
_WINDOW_S, _NEAR_M = 0.25, 0.02
# The level follows the hand's slow errors, not a finger that leaves slowly. With 1 s 13 broke.
_LEVEL_S, _DRIFT_M = 0.5, 0.0015
# After a gap the series begins anew: a finger needs a fifth of a second to touch and leave.
_GAP_S = 0.25
# A hand that carries the object does not let it go unnoticed: its grasp says so too. Then it must
# rise by this many sigmas: a finger hidden by what it carries was seen 12 mm off at 4 mm.
_HELD_FACTOR, _HELD_SIGMAS = 1.6, 4.0
# So must a palm, whose wrist's errors turn while fingers hide their paint: of one held-out hand it
# was 6 mm off at 3 mm, and touched twice. From 2 to 2.5 nothing changed on the even seeds above.
_PALM_SIGMAS = 2.5
# A finger that opens by 3 to 9 mm, waits, and leaves with its hand: how long ago it may have
# opened, and how far above its lowest moments of _REST_S it then was. Chosen on 8 rendered hands
# and 47 from landmarks, even seeds: the largest error of an end was 236 and 1002 ms without, 76 and
# 97 ms with; 2 mm is as good on landmarks, and one of 47 rendered ends worse.
_LOOK_BACK_S, _REST_S, _OPENED_M = 1.5, 0.17, 0.0015
# What a kink so long ago is sought in, before and after it.
_BEFORE_S, _AFTER_S = 0.35, 0.25
# 1.5 s at 240 Hz are 360.
_MAX_SAMPLES = 512


class TouchTracker:
    """One part of one hand, and one object."""

    def __init__(self, *, opens: bool = True) -> None:
        """opens: it may leave while its hand stays, as a finger does and a palm does not."""
        self._opens = opens
        self.touching = False
        self.since_ns = 0
        self.until_ns = 0
        self._samples: deque[tuple[int, float]] = deque(maxlen=_MAX_SAMPLES)
        self._level_m = 0.0
        self._spread_m = _SPREAD_M
        self._highest_m = 0.0
        self._held_ns = 0
        # Whether a touch is more than a distance that is some sigmas wrong.
        self._borne_out = opens
        # Whether the part was away since its last touch: until then only that touch's own level
        # counts, or a slow leave would begin anew.
        self._armed = True

    @property
    def sure(self) -> bool:
        """Whether it touches, and that may be told: of a palm once more than its distance says so.

        Its place follows from the wrist's turn, whose errors stay for a second: of 20 rendered
        hands that passed 10 mm beside a cup two were measured 3 mm from it for half a second.
        """
        return self.touching and self._borne_out

    def bear_out(self) -> None:
        """A finger touches as well, or the object moves with the hand."""
        self._borne_out = True

    def step(self, stamp_ns: int, distance_m: float, sigma_m: float, held: bool = False) -> None:
        """The next distance; held: the object is carried by this hand, and rather stays touched."""
        if self._samples and not 0 < stamp_ns - self._samples[-1][0] <= _GAP_S * 1e9:
            self._samples.clear()
        self._samples.append((stamp_ns, distance_m))
        now_m, speed_m_s = self._latest()
        if self.touching:
            if now_m <= 0.0:
                self.bear_out()
            off_m = min(max(_OFF_SPREADS * self._spread_m, _OFF_MIN_M), _OFF_MAX_M)
            if not self._opens:
                off_m = max(off_m, _PALM_SIGMAS * sigma_m)
            if held:
                self._held_ns = stamp_ns
                off_m = max(off_m * _HELD_FACTOR, _HELD_SIGMAS * sigma_m)
            self._maybe_end(now_m, off_m)
        else:
            on_m = min(max(_ON_SIGMAS * sigma_m, _ON_MIN_M), _ON_MAX_M)
            self._maybe_begin(now_m, speed_m_s, on_m)

    def end(self, stamp_ns: int) -> None:
        """Nothing is known any more: what touched no longer does, from stamp_ns on."""
        if self.touching:
            self._over(stamp_ns)
        self._samples.clear()
        self._armed = True

    def _maybe_begin(self, now_m: float, speed_m_s: float, on_m: float) -> None:
        if now_m > on_m:
            self._armed = True
            return
        if not self._armed and now_m > self._level_m + 0.5 * _OFF_MIN_M:
            return
        # Far from the surface only what rests touches there; at it, what is slow.
        still_m_s = _COMING_M_S * (1.0 - max(now_m, 0.0) / on_m)
        if speed_m_s > _STILL_M_S or not (now_m < -on_m or speed_m_s > -still_m_s):
            return
        times_s, values_m = self._window()
        near = values_m <= on_m
        if not near.any():
            # The line says so, but no sample yet: the distance has just jumped.
            return
        kink = arrival(times_s, values_m)
        self.touching = True
        if kink is None or kink.rise_m < _LEAST_M:
            self.since_ns = self._stamp(times_s[np.argmax(near)])
            self._level_m = float(values_m[near].mean())
        else:
            self.since_ns, self._level_m = self._stamp(kink.time_s), kink.level_m
        self.since_ns = max(self.since_ns, self.until_ns)
        self._borne_out = self._opens
        self._level_m, self._spread_m = min(self._level_m, on_m), _SPREAD_M
        self._highest_m = self._level_m + _DRIFT_M

    def _maybe_end(self, now_m: float, off_m: float) -> None:
        if now_m - self._level_m <= off_m:
            gap_s = (self._samples[-1][0] - self._samples[-2][0]) * 1e-9 if self._more else 0.0
            share = min(1.0, gap_s / _LEVEL_S)
            error_m = now_m - self._level_m
            self._level_m = min(self._level_m + error_m * share, self._highest_m)
            self._spread_m = math.sqrt((1.0 - share) * self._spread_m**2 + share * error_m**2)
            return
        times_s, values_m = self._opening()
        kink = departure(times_s, values_m)
        self._armed = False
        # Without a kink it jumped away: after the last sample that was near, or now.
        last_near_s = times_s[-1] if len(times_s) else 0.0
        self._over(self._stamp(last_near_s if kink is None else kink.time_s))

    def _over(self, stamp_ns: int) -> None:
        """It no longer touches; what was never told has no end either."""
        if self._borne_out:
            self.until_ns = max(stamp_ns, self.since_ns)
        self.touching, self.since_ns = False, 0

    @property
    def _more(self) -> bool:
        return len(self._samples) > 1

    def _latest(self) -> tuple[float, float]:
        """Distance and its rate now, by a line through the last few samples."""
        newest_ns = self._samples[-1][0]
        # Plain sums: six of these a pose, of three samples or so.
        count, t, tt, v, tv = 0, 0.0, 0.0, 0.0, 0.0
        for stamp_ns, value_m in reversed(self._samples):
            if count >= _SLOPE_SAMPLES and newest_ns - stamp_ns > _SLOPE_S * 1e9:
                break
            time_s = 1e-9 * (stamp_ns - newest_ns)
            count, t, tt = count + 1, t + time_s, tt + time_s * time_s
            v, tv = v + value_m, tv + time_s * value_m
        if count < _SLOPE_SAMPLES:
            return self._samples[-1][1], 0.0 if count == 1 else math.inf
        slope = (count * tv - t * v) / (count * tt - t * t)
        return (v - slope * t) / count, slope

    def _window(self) -> tuple[np.ndarray, np.ndarray]:
        """The samples of the last moments, without those far away: seconds before now, metres.

        The latest ones may be far away, too: what is gone within a frame was near until then.
        """
        newest_ns = self._samples[-1][0]
        times: list[float] = []
        values: list[float] = []
        for stamp, value in reversed(self._samples):
            if value > _NEAR_M and not times:
                continue
            if newest_ns - stamp > _WINDOW_S * 1e9 or value > _NEAR_M:
                break
            times.append(1e-9 * (stamp - newest_ns))
            values.append(value)
        return np.array(times[::-1]), np.array(values[::-1])

    def _opening(self) -> tuple[np.ndarray, np.ndarray]:
        """The samples about the moment at which it rose for good, as _window gives the last ones.

        That is the last moment as low as its lowest of late, since the object rests. A palm's level
        wanders by millimetres while its fingers open: looking back made its ends 1.1 s early.
        """
        newest_ns = self._samples[-1][0]
        first_ns = max(newest_ns - round(_LOOK_BACK_S * 1e9), self._held_ns, self.since_ns)
        late = [one for one in self._samples if one[0] >= first_ns]
        times_s = np.array([1e-9 * (stamp_ns - newest_ns) for stamp_ns, _ in late])
        values_m = np.array([value_m for _, value_m in late])
        count = 4 if len(late) < 2 else max(4, int(_REST_S / float(np.median(np.diff(times_s)))))
        if not self._opens or len(late) < 2 * count:
            return self._window()
        mean = np.ones(count) / count
        means_m = np.convolve(values_m, mean, "valid")
        low = np.flatnonzero(means_m <= means_m.min() + _OPENED_M)
        at_s = float(np.convolve(times_s, mean, "valid")[low[-1]])
        about = (times_s >= at_s - _BEFORE_S) & (times_s <= at_s + _AFTER_S) & (values_m <= _NEAR_M)
        if at_s > -_WINDOW_S or about.sum() < count:
            return self._window()
        return times_s[about], values_m[about]

    def _stamp(self, time_s: float) -> int:
        return self._samples[-1][0] + round(float(time_s) * 1e9)
