"""When points are due: one instant for each frame of the reference camera, told as soon as enough
later frames have come.

The reference is the fastest camera that delivers; it keeps the role until it falls silent or a
faster one appears. Lost or late frames leave out an instant, a camera that is back after a pause
simply takes part again.
"""

from __future__ import annotations

from collections import deque

from rhot.geometry.transforms import Array

# A reference silent for this many of its own frames hands over to whichever camera delivers next:
# one lost frame is enough, jitter is not.
_SILENT_FRAMES = 1.25


class Pace:
    """The queue of instants (ns, master clock) whose points are wanted.

    At most `wait` + 1 of them.
    """

    def __init__(self, fps: Array, wait: int) -> None:
        """fps (C,) of the cameras.

        Wait: frames of the reference between an instant and the telling of its points.
        """
        self._fps = fps
        self._wait = wait
        self._reference: int | None = None
        self._newest_ns: int | None = None
        self._asked: deque[int] = deque()

    def frame(self, camera: int, instant_ns: int) -> int | None:
        """Note a frame; the instant whose points are due now, if any.

        Instants are told in ascending order, none twice.
        """
        if self._newest_ns is not None and instant_ns <= self._newest_ns:
            return None
        if not self._leads(camera, instant_ns):
            return None
        self._reference, self._newest_ns = camera, instant_ns
        self._asked.append(instant_ns)
        return self._asked.popleft() if len(self._asked) > self._wait else None

    def _leads(self, camera: int, instant_ns: int) -> bool:
        if self._reference is None or self._newest_ns is None or camera == self._reference:
            return True
        if self._fps[camera] > self._fps[self._reference]:
            return True
        return (instant_ns - self._newest_ns) * 1e-9 > _SILENT_FRAMES / float(
            self._fps[self._reference]
        )

    def rest(self) -> list[int]:
        """The instants still waiting, which no later frame will help."""
        rest = list(self._asked)
        self._asked.clear()
        return rest
