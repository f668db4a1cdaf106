"""Stamps, and how far this machine's clock is from the master's.

All stamps are CLOCK_REALTIME nanoseconds. No NTP is needed: every node asks the master for its
clock over Zenoh and estimates its own offset:

1. The node reads its clock: t1.
2. It asks the master (topic control/clock).
3. The master answers with its clock: t_master.
4. The node reads its clock as the answer arrives: t2.
5. If both ways took equally long, t_master was read at (t1 + t2) / 2 of the node's clock, so
       offset = (t1 + t2) / 2 - t_master,  stamp on the master's clock = own stamp - offset.
6. Delays are never equal, but the error is at most (t2 - t1) / 2: only the quickest exchanges of a
   window count.
7. A line through them gives offset and drift; their scatter, and the delay itself, give the
   uncertainty.
8. Exchanges that contradict the line three times in a row mean that a clock was set: the window
   starts anew.

Late or missing answers make the uncertainty grow, never an error; before the first answer the
offset is unknown (sigma -1).
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

# Exchanges kept: a minute at one a second, long enough to see 1 ppm of drift, short enough to
# follow a warming crystal.
_WINDOW = 60
# Only exchanges this near the quickest one count; a queueing delay is one-sided and would bias the
# rest.
_NEAR_BEST = 1.5
# Crystals stay within 100 ppm; older exchanges lose that much certainty for each second of age.
_DRIFT_LIMIT = 1e-4
# An exchange this far off the line (in its own half delays, plus 1 ms) contradicts it; so many in a
# row mean a clock was set.
_JUMP_FACTOR, _JUMP_FLOOR_NS, _JUMP_COUNT = 2.0, 1_000_000, 3


def now_ns() -> int:
    """CLOCK_REALTIME in ns."""
    return time.time_ns()


@dataclass(frozen=True)
class Offset:
    """Own clock minus the master's at one instant.

    sigma_ns is one standard deviation, -1 while unknown.
    """

    offset_ns: int
    sigma_ns: int


@dataclass(frozen=True)
class _Exchange:
    at_ns: int  # own clock, middle of the exchange
    offset_ns: int
    delay_ns: int


class OffsetEstimator:
    """Minimum-delay filter with drift over a sliding window of clock exchanges."""

    def __init__(self) -> None:
        self._exchanges: deque[_Exchange] = deque(maxlen=_WINDOW)
        self._contradictions: list[_Exchange] = []

    def update(self, asked_ns: int, master_ns: int, answered_ns: int) -> None:
        """Take in one exchange; one whose clock ran backwards meanwhile is ignored."""
        if answered_ns < asked_ns:
            return
        middle_ns = (asked_ns + answered_ns) // 2
        exchange = _Exchange(middle_ns, middle_ns - master_ns, answered_ns - asked_ns)
        if self._exchanges and abs(exchange.offset_ns - self.at(middle_ns).offset_ns) > (
            _JUMP_FACTOR * exchange.delay_ns / 2 + _JUMP_FLOOR_NS
        ):
            self._contradictions.append(exchange)
            if len(self._contradictions) < _JUMP_COUNT:
                return
            self._exchanges.clear()
            self._exchanges.extend(self._contradictions)
        else:
            self._exchanges.append(exchange)
        self._contradictions.clear()

    @property
    def doubted(self) -> bool:
        """Whether the last exchange contradicted the others: a few more will tell."""
        return bool(self._contradictions)

    def follow_step(self, step_ns: int) -> None:
        """The own clock was set ahead by so much (negative: back), as another clock tells."""
        for kept in (self._exchanges, self._contradictions):
            moved = [
                _Exchange(one.at_ns + step_ns, one.offset_ns + step_ns, one.delay_ns)
                for one in kept
            ]
            kept.clear()
            kept.extend(moved)

    def at(self, own_ns: int) -> Offset:
        """Offset at an instant of the own clock."""
        if not self._exchanges:
            return Offset(0, -1)
        quickest = min(e.delay_ns for e in self._exchanges)
        good = [e for e in self._exchanges if e.delay_ns <= _NEAR_BEST * quickest + 1000]
        n = len(good)
        # Integers are brought near zero first: float64 holds nanoseconds since 1970 only to 256 ns.
        origin_ns, base_ns = good[-1].at_ns, good[-1].offset_ns
        ages = [(e.at_ns - origin_ns) * 1e-9 for e in good]
        offsets = [float(e.offset_ns - base_ns) for e in good]
        mean_age, mean_offset = sum(ages) / n, sum(offsets) / n
        spread = sum((a - mean_age) ** 2 for a in ages)
        # A slope from a short stretch is noise: five seconds of standard deviation are needed to
        # see 10 ppm in 50 us.
        slope = (
            sum((a - mean_age) * (o - mean_offset) for a, o in zip(ages, offsets, strict=True))
            / spread
            if spread > 25.0 * n
            else 0.0
        )
        slope = max(-_DRIFT_LIMIT * 1e9, min(_DRIFT_LIMIT * 1e9, slope))
        at_s = (own_ns - origin_ns) * 1e-9
        offset = mean_offset + slope * (at_s - mean_age)
        residual = (
            sum(
                (o - mean_offset - slope * (a - mean_age)) ** 2
                for a, o in zip(ages, offsets, strict=True)
            )
            / n
        )
        unknown_s = max(0.0, at_s) if slope else abs(at_s - mean_age)
        # Half the delay bounds the asymmetry; uniform within it means a standard deviation of
        # 1/sqrt(3) of the bound.
        sigma = (
            residual / n + (quickest / 2) ** 2 / 3.0 + (unknown_s * _DRIFT_LIMIT * 1e9 / 3.0) ** 2
        ) ** 0.5
        return Offset(base_ns + round(offset), round(min(sigma, 2.0**60)))
