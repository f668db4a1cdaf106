"""The output schedule: one instant for each frame of the reference camera, due when lag allows.

The reference is the fastest camera that delivers; it keeps the role until it falls silent or a
faster one appears. Lost or late frames leave out an instant; a camera that is back after a pause
simply takes part again.
"""

from __future__ import annotations

from collections import deque

from rhot.geometry.transforms import Array

# A reference silent for this many of its own frames hands over to whichever camera delivers next:
# one lost frame is enough, jitter is not.
_SILENT_FRAMES = 1.25


class OutputSchedule:
    """The queue of instants (ns, master clock) whose points are wanted; lag_frames + 1 at most."""

    def __init__(self, fps: Array, lag_frames: int) -> None:
        """fps (C,) of the cameras.

        lag_frames: frames of the reference between an instant and the output of its points.
        """
        self._fps = fps
        self._lag_frames = lag_frames
        self._reference: int | None = None
        self._newest_ns: int | None = None
        self._waiting: deque[int] = deque()

    def add_frame(self, camera: int, instant_ns: int) -> int | None:
        """Note a frame; the instant whose points are due now, if any.

        Instants come in ascending order, none twice.
        """
        if self._newest_ns is not None and instant_ns <= self._newest_ns:
            return None
        if not self._is_reference(camera, instant_ns):
            return None
        self._reference = camera
        self._newest_ns = instant_ns
        self._waiting.append(instant_ns)
        return self._waiting.popleft() if len(self._waiting) > self._lag_frames else None

    def _is_reference(self, camera: int, instant_ns: int) -> bool:
        """Whether a camera is the reference, or becomes it with a frame."""
        if self._reference is None or self._newest_ns is None or camera == self._reference:
            return True
        if self._fps[camera] > self._fps[self._reference]:
            return True
        silent_s = (instant_ns - self._newest_ns) * 1e-9
        return silent_s > _SILENT_FRAMES / float(self._fps[self._reference])

    def take_waiting(self) -> list[int]:
        """The instants still waiting, which no later frame will help; none wait any more."""
        waiting = list(self._waiting)
        self._waiting.clear()
        return waiting
