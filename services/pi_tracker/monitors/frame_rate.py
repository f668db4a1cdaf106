"""The rate at which a camera really delivers. Pure; time is an argument.

Counted over some seconds: frames come late and in pairs now and then, and that is no fault. Until
so many seconds of frames have passed there is no rate: a camera that has just begun is not slow.
"""

from __future__ import annotations

from collections import deque

# Long enough that one lost second of a camera's restart shows, and one lost frame does not.
WINDOW_S = 4.0
# One frame lost in five is where a user should look (as rhot/bus/stats.py); over once it is clearly
# better, or it would come and go.
_SLOW, _WELL = 0.8, 0.85


class FrameRate:
    """Counts one camera's frames against the rate in rig.toml."""

    def __init__(self, expected_hz: float) -> None:
        self.slow = False
        self.rate_hz: float | None = None
        self._expected_hz = expected_hz
        self._count = 0
        self._beats: deque[tuple[int, int]] = deque()

    def count(self) -> None:
        """A frame has come."""
        self._count += 1

    def beat(self, now_ns: int) -> None:
        """About once a second: the rate over the last seconds."""
        # The second in which the first frame came is not a whole one.
        if self._beats and self._beats[-1][1] == 0:
            self._beats.clear()
        self._beats.append((now_ns, self._count))
        while len(self._beats) > 2 and now_ns - self._beats[1][0] >= WINDOW_S * 1e9:
            self._beats.popleft()
        began_ns, before = self._beats[0]
        elapsed_s = (now_ns - began_ns) * 1e-9
        # Beats come a little early, too.
        if elapsed_s < 0.95 * WINDOW_S:
            return
        self.rate_hz = (self._count - before) / elapsed_s
        self.slow = self.rate_hz < (_WELL if self.slow else _SLOW) * self._expected_hz
