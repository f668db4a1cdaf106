"""When each message of a recording is due. Pure: time is an argument (ns of one monotonic clock).

Due times follow from the recording's own, from where the playing last began: nothing adds up. What
is late is sent at once, until the player is so late that it was asleep: then it goes on from there.
"""

from __future__ import annotations

import math

from rhot.errors import CaptureError
from services.recorder.reader import Summary

# A longer gap is a pause of the recording, or a damaged time: it is shortened to this.
LONGEST_GAP_NS = 10_000_000_000
# A computer that slept, or a line that was full: nobody wants the rest in one burst.
_ASLEEP_NS = 1_000_000_000


class Pace:
    """Maps a recording's times onto the player's clock, at a rate that may change meanwhile."""

    def __init__(self, rate: float) -> None:
        self.rate = check_rate(rate)
        # The message at _log_ns was due at _now_ns; None: the next one is due at once.
        self._log_ns: int | None = None
        self._now_ns = 0
        self._last_ns = 0

    def begin(self) -> None:
        """The next message is due at once: after a pause, a jump, a change of the rate."""
        self._log_ns = None

    def due_ns(self, log_ns: int, now_ns: int) -> int:
        """When the next message is due; in the order of the messages, each as often as one likes.

        At rate 0 now.
        """
        if self.rate == 0.0 or self._log_ns is None:
            self._log_ns, self._now_ns = log_ns, now_ns
        elif log_ns - self._last_ns > LONGEST_GAP_NS:
            self._log_ns += log_ns - self._last_ns - LONGEST_GAP_NS
        self._last_ns = log_ns
        due_ns = self._now_ns + round((log_ns - self._log_ns) / (self.rate or 1.0))
        if now_ns - due_ns > _ASLEEP_NS:
            self._log_ns, self._now_ns = log_ns, now_ns
            return now_ns
        return due_ns


def check_rate(rate: float) -> float:
    """The rate; raises CaptureError for one that cannot be."""
    if not (math.isfinite(rate) and rate >= 0.0):
        raise CaptureError(
            f"cannot replay at rate {rate}; 1 is real time, 2 twice as fast, 0 as fast as possible"
        )
    return rate


def window(summary: Summary, from_s: float | None, to_s: float | None) -> tuple[int, int]:
    """First and last time (ns) of what is to be played, both included.

    from_s and to_s are seconds from the recording's beginning, negative ones from its end. Raises
    CaptureError where nothing lies between them.
    """
    length_s = summary.duration_s
    start_s, end_s = (
        default if at is None else at if at >= 0.0 else length_s + at
        for at, default in ((from_s, 0.0), (to_s, length_s))
    )
    if not (math.isfinite(start_s) and math.isfinite(end_s)):
        raise CaptureError("--from and --to are seconds of the recording, e.g. --from 2.5 --to -1")
    if start_s > length_s or end_s < 0.0 or start_s > end_s:
        raise CaptureError(
            f"nothing to replay from {start_s:g} to {end_s:g} s: the recording has "
            f"{length_s:.1f} s; --from must come before --to, and negative ones count from its end"
        )
    return (
        summary.start_ns + round(max(0.0, start_s) * 1e9),
        min(summary.end_ns, summary.start_ns + math.ceil(end_s * 1e9)),
    )
