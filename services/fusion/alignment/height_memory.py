"""The last seconds of all cameras' markers, by each camera's own clock, accepted or not."""

from __future__ import annotations

from collections import deque
from typing import TypeVar

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.arrays import Ints
from services.fusion.geometry.rectified_pair import RectifiedPair, rectify_ray
from services.fusion.intake.observations import View

T = TypeVar("T", Array, Ints)

# So much of each camera is remembered, s: enough for a few turns of a hand.
MEMORY_S = 6.0
# Stamps that jump by more than this, or go back, are of a clock that was set: what was before does
# not fit any more. A camera that was silent for so long by another one's clock is forgotten, too.
_JUMP_S = 0.5
# Markers that there is room for at first.
_ROOM = 1024


class HeightMemory:
    """Frames of C cameras: their markers' instants, landmarks and rays.

    All that is remembered is of the same seconds, as the order of arrival tells: of a camera whose
    cable is out, what it saw before would be compared with what the others see now, and of a motion
    that repeats itself both fit, as much apart as its period.
    """

    def __init__(self, cameras: int) -> None:
        self._seen = [_SeenMarkers() for _ in range(cameras)]
        # Of each camera, by its own clock: when each other one last sent.
        self._heard_s = [[0.0] * cameras for _ in range(cameras)]
        self._epoch_ns: int | None = None

    def add(self, view: View) -> None:
        """Take in a frame, at the instant its camera claims."""
        if self._epoch_ns is None:
            self._epoch_ns = view.instant_ns
        time_s = (view.instant_ns - self._epoch_ns) * 1e-9
        seen = self._seen[view.camera]
        newest_s = seen.newest_s
        if newest_s is not None and not 0.0 < time_s - newest_s < _JUMP_S:
            seen.clear()
        if seen.newest_s is None:
            self._heard_s[view.camera] = [time_s] * len(self._seen)
        seen.add(time_s, view)
        self._forget_the_silent(view.camera, time_s)

    def _forget_the_silent(self, camera: int, time_s: float) -> None:
        """A camera sent a frame, of an instant by its clock: for how long have others not?"""
        for other, seen in enumerate(self._seen):
            if other != camera and seen.newest_s is not None:
                self._heard_s[other][camera] = seen.newest_s
                if time_s - self._heard_s[camera][other] > _JUMP_S:
                    seen.clear()

    def clear(self, camera: int) -> None:
        """Forget a camera's frames."""
        self._seen[camera].clear()

    def newest_s(self, camera: int) -> float | None:
        """A camera's newest instant, None without any."""
        return self._seen[camera].newest_s

    def length_s(self, camera: int) -> float:
        """How much of a camera is remembered."""
        return self._seen[camera].length_s

    def tracks(
        self, first: int, second: int, pair: RectifiedPair
    ) -> tuple[list[HeightTrack], list[HeightTrack]]:
        """Each landmark's heights in two cameras, in the frame of their pair."""
        one = self._seen[first].tracks(pair.R_rectified_from_first)
        other = self._seen[second].tracks(pair.R_rectified_from_second)
        both = sorted(one.keys() & other.keys())
        return [one[row] for row in both], [other[row] for row in both]


class _SeenMarkers:
    """The markers of one camera's frames of the last seconds, the oldest first."""

    def __init__(self) -> None:
        self._landmarks = np.empty(_ROOM, dtype=np.int64)
        self._times_s, self._rays = np.empty(_ROOM), np.empty((_ROOM, 2))
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._begin = self._end = 0
        # Of each frame: its instant, and how many markers it had.
        self._frames: deque[tuple[float, int]] = deque()
        self.newest_s: float | None = None

    @property
    def length_s(self) -> float:
        """How much is remembered."""
        return 0.0 if self.newest_s is None else self.newest_s - self._frames[0][0]

    def add(self, time_s: float, view: View) -> None:
        """Take in a frame, and forget those that are over."""
        begin, count = self._end, len(view.landmarks)
        if begin + count > len(self._times_s):
            self._make_room(count)
            begin = self._end
        self._end = end = begin + count
        self._landmarks[begin:end] = view.landmarks
        self._times_s[begin:end] = view.delay_s
        self._times_s[begin:end] += time_s
        self._rays[begin:end] = view.rays
        frames = self._frames
        frames.append((time_s, count))
        self.newest_s = time_s
        while time_s - frames[0][0] > MEMORY_S:
            self._begin += frames.popleft()[1]

    def _make_room(self, count: int) -> None:
        """Move what is remembered to the front; to a larger place where it fills half of this."""
        kept = slice(self._begin, self._end)
        self._begin, self._end = 0, self._end - self._begin
        room = max(2 * (self._end + count), len(self._times_s))
        self._landmarks = _moved(self._landmarks[kept], room)
        self._times_s = _moved(self._times_s[kept], room)
        self._rays = _moved(self._rays[kept], room)

    def tracks(self, R_rectified_from_camera: Array) -> dict[int, HeightTrack]:
        """Heights over time by landmark, in the frame of a pair of cameras."""
        rows = slice(self._begin, self._end)
        order, times_s, heights = heights_by_landmark(
            self._landmarks[rows], self._times_s[rows], self._rays[rows], R_rectified_from_camera
        )
        found, counts = np.unique(order, return_counts=True)
        ends = np.cumsum(counts).tolist()
        return {
            landmark: HeightTrack(times_s[end - count : end], heights[end - count : end])
            for landmark, count, end in zip(found.tolist(), counts.tolist(), ends, strict=True)
        }


def _moved(kept: T, room: int) -> T:
    """Rows at the front of an array with room for more."""
    larger = np.empty((room, *kept.shape[1:]), dtype=kept.dtype)
    larger[: len(kept)] = kept
    return larger


@njit(cache=True, error_model="numpy")
def heights_by_landmark(
    landmarks: Ints, times_s: Array, rays: Array, R_rectified_from_camera: Array
) -> tuple[Ints, Array, Array]:
    """Landmarks (m,), times and heights of markers that have one, by landmark, then as seen."""
    heights = np.empty(landmarks.size)
    for i in range(landmarks.size):
        heights[i] = rectify_ray(R_rectified_from_camera, rays[i])[1]
    order = np.argsort(landmarks, kind="mergesort")
    order = order[np.isfinite(heights[order])]
    return landmarks[order], times_s[order], heights[order]
