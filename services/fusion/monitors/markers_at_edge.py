"""Cameras whose picture's edge cuts markers of a hand for long: the hand is too far to one side.

Such a marker's place is a guess by its size (services/pi_tracker/measure/cut_marker.py), a pixel or
more off where a whole one is a tenth, and the next thing that it does is to leave the picture. A
hand that passes the edge is nobody's concern.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.fusion.intake.observations import View

# As long as a marker that is not seen.
AT_EDGE_S = 6.0
# Of a camera's frames of a second: one that is cut in more of them is, in fewer it is not; in
# between nothing changes.
_CUT_SHARE, _WHOLE_SHARE = 0.5, 0.2
# A look after a longer pause than this tells nothing about the time between.
_LONGEST_S = 2.0


@dataclass(frozen=True)
class MarkersAtEdge:
    """Landmarks that the edge of a camera's picture cuts."""

    camera: str
    landmarks: tuple[int, ...]
    seconds: float  # of the longest


class EdgeMonitor:
    """How long each of L landmarks has been cut in each of C cameras."""

    def __init__(self, cameras: list[str], landmarks: int) -> None:
        self._cameras = cameras
        # Since the last look: frames by camera, and those in which each landmark was cut.
        self._frames = np.zeros(len(cameras))
        self._counts = np.zeros((len(cameras), landmarks))
        self._cut_s = np.zeros((len(cameras), landmarks))

    def observe(self, view: View) -> None:
        """Count a frame's markers."""
        self._frames[view.camera] += 1.0
        if view.cut.any():
            self._counts[view.camera, view.landmarks[view.cut]] += 1.0

    def look(self, elapsed_s: float) -> list[MarkersAtEdge]:
        """Who is cut, as of the frames since the last look, elapsed_s ago (about a second)."""
        share = self._counts / np.maximum(self._frames, 1.0)[:, None]
        self._cut_s[share >= _CUT_SHARE] += min(elapsed_s, _LONGEST_S)
        self._cut_s[share < _WHOLE_SHARE] = 0.0
        self._frames[:], self._counts[:] = 0.0, 0.0
        return [
            MarkersAtEdge(name, tuple(np.flatnonzero(cut_s >= AT_EDGE_S).tolist()), cut_s.max())
            for name, cut_s in zip(self._cameras, self._cut_s, strict=True)
            if cut_s.max(initial=0.0) >= AT_EDGE_S
        ]


def at_edge_text(camera: str, markers: list[str], seconds: float) -> str:
    """What people are told: `the edge of left's picture has cut lime (little tip) for 8 s`."""
    return f"the edge of {camera}'s picture has cut {', '.join(markers)} for {seconds:.0f} s"
