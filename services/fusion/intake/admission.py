"""Which frames belong to the present: a clock that jumps, a stamp from another year, a frame that
comes twice or too late.

Cameras' clocks are only as good as their estimates, and a wrong stamp must cost that camera's
frames, not the tracking. A frame near the newest accepted instant is accepted. Frames far from it
wait outside: while others carry on they are refused; when nobody else does for a few frames, or two
cameras agree on the new time, time itself has moved (a pause, a clock set everywhere) and starts
anew there.
"""

from __future__ import annotations

from collections import deque
from enum import Enum

# Frames this far from the newest instant are not of the same time. Longer than any hold, shorter
# than a second's jump of a clock.
WINDOW_NS = 500_000_000
# Frames of one camera in a row, with no others accepted meanwhile, that move time: 3 are a tenth of
# a second at 30 fps.
_INSIST = 3
# Instants remembered for each camera to know a frame that comes twice: more than any queue holds.
_REMEMBERED = 64


class Verdict(Enum):
    """What to do with a frame."""

    ACCEPT = "accepted"
    RESTART = "restart"  # accept it, and forget everything before
    TWICE = "twice"
    ASTRAY = "astray"  # its clock is off, or it is far too late


class Timeline:
    """Judges the instants (ns, master clock) of all cameras' frames; holds no frames."""

    def __init__(self, cameras: int) -> None:
        self.newest_ns: int | None = None
        self._known: list[deque[int]] = [deque(maxlen=_REMEMBERED) for _ in range(cameras)]
        # Last stray instant of each camera since somebody was accepted, and how many in a row.
        self._stray: dict[int, tuple[int, int]] = {}

    def judge(self, camera: int, instant_ns: int) -> Verdict:
        """The verdict on one frame; only accepted ones move time."""
        if instant_ns in self._known[camera]:
            return Verdict.TWICE
        if self.newest_ns is None:
            return self._restart(camera, instant_ns)
        if abs(instant_ns - self.newest_ns) <= WINDOW_NS:
            self.newest_ns = max(self.newest_ns, instant_ns)
            self._known[camera].append(instant_ns)
            self._stray.clear()
            return Verdict.ACCEPT
        last_ns, run = self._stray.get(camera, (instant_ns, 0))
        run = run + 1 if 0 < instant_ns - last_ns <= WINDOW_NS else 1
        self._stray[camera] = (instant_ns, run)
        agreed = any(
            abs(other_ns - instant_ns) <= WINDOW_NS
            for c, (other_ns, _) in self._stray.items()
            if c != camera
        )
        return self._restart(camera, instant_ns) if agreed or run >= _INSIST else Verdict.ASTRAY

    def _restart(self, camera: int, instant_ns: int) -> Verdict:
        self.newest_ns = instant_ns
        self._known[camera].append(instant_ns)
        self._stray.clear()
        return Verdict.RESTART
