"""The last seconds of all cameras' markers, by each camera's own clock, accepted or not."""

from __future__ import annotations

from collections import deque

import numpy as np

from rhot.geometry.transforms import Array
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.arrays import Ints
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_rays
from services.fusion.intake.observations import View

# So much of each camera is remembered, s: enough for a few turns of a hand.
MEMORY_S = 6.0
# Stamps that jump by more than this, or go back, are of a clock that was set: what was before does
# not fit any more. A camera that was silent for so long by another one's clock is forgotten, too.
_JUMP_S = 0.5


class HeightMemory:
    """Frames of C cameras: their markers' instants, landmarks and rays.

    All that is remembered is of the same seconds, as the order of arrival tells: of a camera whose
    cable is out, what it saw before would be compared with what the others see now, and of a motion
    that repeats itself both fit, as much apart as its period.
    """

    def __init__(self, cameras: int) -> None:
        self._frames: list[deque[tuple[float, Ints, Array, Array]]] = [
            deque() for _ in range(cameras)
        ]
        # Of each camera, by its own clock: when each other one last sent.
        self._heard_s = np.zeros((cameras, cameras))
        self._epoch_ns: int | None = None

    def add(self, view: View) -> None:
        """Take in a frame, at the instant its camera claims."""
        if self._epoch_ns is None:
            self._epoch_ns = view.instant_ns
        time_s = (view.instant_ns - self._epoch_ns) * 1e-9
        frames = self._frames[view.camera]
        if frames and not 0.0 < time_s - frames[-1][0] < _JUMP_S:
            frames.clear()
        if not frames:
            self._heard_s[view.camera] = time_s
        frames.append((time_s, view.landmarks, time_s + view.delay_s, view.rays))
        while time_s - frames[0][0] > MEMORY_S:
            frames.popleft()
        self._forget_the_silent(view.camera, time_s)

    def _forget_the_silent(self, camera: int, time_s: float) -> None:
        """A camera sent a frame, of an instant by its clock: for how long have others not?"""
        for other, frames in enumerate(self._frames):
            if other != camera and frames:
                self._heard_s[other, camera] = frames[-1][0]
                if time_s - self._heard_s[camera, other] > _JUMP_S:
                    frames.clear()

    def clear(self, camera: int) -> None:
        """Forget a camera's frames."""
        self._frames[camera].clear()

    def newest_s(self, camera: int) -> float | None:
        """A camera's newest instant, None without any."""
        frames = self._frames[camera]
        return frames[-1][0] if frames else None

    def length_s(self, camera: int) -> float:
        """How much of a camera is remembered."""
        frames = self._frames[camera]
        return frames[-1][0] - frames[0][0] if frames else 0.0

    def tracks(
        self, first: int, second: int, pair: RectifiedPair
    ) -> tuple[list[HeightTrack], list[HeightTrack]]:
        """Each landmark's heights in two cameras, in the frame of their pair."""
        one = self._by_landmark(first, pair.R_rectified_from_first)
        other = self._by_landmark(second, pair.R_rectified_from_second)
        both = sorted(one.keys() & other.keys())
        return [one[row] for row in both], [other[row] for row in both]

    def _by_landmark(self, camera: int, R_rectified_from_camera: Array) -> dict[int, HeightTrack]:
        frames = [frame for frame in self._frames[camera] if len(frame[1])]
        if not frames:
            return {}
        landmarks = np.concatenate([frame[1] for frame in frames])
        times = np.concatenate([frame[2] for frame in frames])
        rays = np.concatenate([frame[3] for frame in frames])
        heights = rectify_rays(R_rectified_from_camera, rays)[:, 1]
        found = {}
        for row in np.unique(landmarks).tolist():
            own = (landmarks == row) & np.isfinite(heights)
            found[row] = HeightTrack(times[own], heights[own])
        return found
