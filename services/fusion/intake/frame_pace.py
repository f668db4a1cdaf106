"""How far apart each camera's frames really come: as rig.toml says, or farther, of a camera that is
slow or loses frames.

What is said in frames (how old a look may be, for how long a landmark that nobody sees is carried
on) goes by this: at a third of the told rate, everything was lost with each frame that failed to
come.
"""

from __future__ import annotations

from rhot.geometry.transforms import Array

# Share of a new interval in the running one. Longer ones are pauses, and say nothing of a rate.
_NEW, _PAUSE_S = 0.125, 0.5


class FramePace:
    """The time from a frame to the next of C cameras, as their frames come."""

    def __init__(self, periods_s: Array) -> None:
        """periods_s (C,): as told; frames never count as nearer together."""
        # Kept up to date in place, for whoever was handed them: the usual time from a frame to the
        # next, (C,), and about the shortest lately, which losses leave as it is.
        self.periods_s = periods_s.copy()
        # Python's own numbers: numpy's cost five times as much, one at a time.
        self.shortest_s: list[float] = periods_s.tolist()
        self._told_s: list[float] = periods_s.tolist()
        self._running_s: list[float] = periods_s.tolist()
        self._newest_ns: list[int | None] = [None] * len(self._told_s)

    def note(self, camera: int, instant_ns: int) -> None:
        """A camera's frame has come; late ones say nothing."""
        before_ns = self._newest_ns[camera]
        if before_ns is not None and instant_ns <= before_ns:
            return
        self._newest_ns[camera] = instant_ns
        if before_ns is None:
            return
        interval_s = 1e-9 * (instant_ns - before_ns)
        if interval_s > _PAUSE_S:
            return
        told_s = self._told_s[camera]
        running_s = self._running_s[camera]
        running_s += _NEW * (interval_s - running_s)
        self._running_s[camera] = running_s
        self.periods_s[camera] = max(running_s, told_s)
        shortest_s = self.shortest_s[camera]
        longer_s = shortest_s + _NEW * (interval_s - shortest_s)
        self.shortest_s[camera] = max(min(interval_s, longer_s), told_s)

    def forget(self) -> None:
        """Time starts anew; what frames have shown of their rate is kept."""
        self._newest_ns = [None] * len(self._told_s)
