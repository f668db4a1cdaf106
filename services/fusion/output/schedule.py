"""The output schedule: one instant for each frame of the reference camera, due when lag allows.

The reference is a camera of the fastest that deliver, whatever rig.toml says; of these the one
whose frames come soonest after the others': cameras that run freely may expose 4 ms one after the
other, and points told at the earlier's frame would rest on what the later saw 29 ms before. It
keeps the role until it falls silent, or another is clearly better. Where cameras expose together,
it is chance whose frame comes first: an instant waits for the other's, for one frame of any camera
at most. Lost or late frames leave out an instant; a camera that is back after a pause simply takes
part again.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

# A camera is faster than another whose frames are so many times as far apart: both waver.
_FASTER = 1.2
# After a silence of so many frames of the reference another's frame stands in: one lost frame is
# enough, jitter is not. A reference that is silent for longer has lost its role.
_SILENT_FRAMES, _ABSENT_FRAMES = 1.25, 2.0
# What is older than so many of its camera's frames tells of a lost frame, not of when it exposes.
_OLDEST_FRAMES = 1.1
# Weight of the newest frame in how old the others' usually are; and the share of a frame's time by
# which these must be younger for another to take over. Newer frames with more weight, or a share of
# .3, are no better for cameras at any times apart, of networks that delay frames by a tenth to six
# tenths of their time (exponentially); with a weight of .25 and a share of .15 the lead changes at
# random, which costs instants.
_NEWEST, _YOUNGER = 0.05, 0.1
# Frames so near whole frames' times apart are of cameras that expose together: the newer one's
# partner is still to come. After more than two a camera is not waited for.
_TOGETHER_FRAMES, _AWAITED = 0.15, (1, 2)


class OutputSchedule:
    """The queue of instants (ns, master clock) whose points are wanted; lag_frames + 2 at most."""

    def __init__(self, periods_s: Sequence[float], lag_frames: int) -> None:
        """periods_s (C,): from a frame of each camera to its next (FramePace), kept up to date.

        lag_frames: frames of the reference between an instant and the output of its points.
        """
        self._periods_s = periods_s
        self._lag_frames = lag_frames
        self._reference: int | None = None
        self._told_ns: int | None = None
        self._waiting: deque[int] = deque()
        # Of each camera: its newest instant, ns, and how old the others' frames usually are when
        # one of its own comes, in frames of theirs; NaN where nothing is known.
        self._newest_ns: dict[int, int] = {}
        self._ages = [math.nan] * len(periods_s)

    def add_frame(self, camera: int, instant_ns: int) -> list[int]:
        """Note a frame; the instants whose points are due now: mostly one or none.

        Instants come in ascending order, none twice.
        """
        ages = self._ages_frames(camera, instant_ns)
        self._note_ages(camera, ages)
        held = False
        if (self._told_ns is None or instant_ns > self._told_ns) and self._leads(camera):
            self._told_ns = instant_ns
            self._waiting.append(instant_ns)
            held = any(abs(age - frames) < _TOGETHER_FRAMES for age in ages for frames in _AWAITED)
        ready = len(self._waiting) - held - self._lag_frames
        return [self._waiting.popleft() for _ in range(ready)]

    def take_waiting(self) -> list[int]:
        """The instants still waiting, which no later frame will help; none wait any more."""
        waiting = list(self._waiting)
        self._waiting.clear()
        return waiting

    def _ages_frames(self, camera: int, instant_ns: int) -> list[float]:
        """How old each other camera's newest frame is at one of a camera, in frames of its own."""
        newest_ns = self._newest_ns
        newest_ns[camera] = max(instant_ns, newest_ns.get(camera, instant_ns))
        return [
            (instant_ns - of_ns) * 1e-9 / self._periods_s[other]
            for other, of_ns in newest_ns.items()
            if other != camera
        ]

    def _note_ages(self, camera: int, ages: list[float]) -> None:
        """How old the other cameras' frames usually are as one of a camera comes."""
        known = [age for age in ages if age < _OLDEST_FRAMES]
        if known:
            now, usual = sum(known) / len(known), self._ages[camera]
            self._ages[camera] = now if math.isnan(usual) else usual + _NEWEST * (now - usual)

    def _leads(self, camera: int) -> bool:
        """Whether points are told at a camera's newest frame; notes who is the reference."""
        reference = self._reference
        if reference is None or self._told_ns is None:
            self._reference = camera
            return True
        period_s = self._periods_s[reference]
        newest_ns = self._newest_ns[camera]
        silent = (newest_ns - self._told_ns) * 1e-9 > _SILENT_FRAMES * period_s
        absent = (newest_ns - self._newest_ns[reference]) * 1e-9 > _ABSENT_FRAMES * period_s
        if camera == reference or self._is_faster(camera, reference) or silent or absent:
            self._reference = self._freshest(camera)
        # Where another is better, its frame comes next, less than half a frame's time from now.
        return self._reference == camera or silent

    def _is_faster(self, camera: int, other: int) -> bool:
        return self._periods_s[camera] * _FASTER < self._periods_s[other]

    def _freshest(self, camera: int) -> int:
        """The camera as fast as one whose frames find the others' clearly younger, or itself."""
        best = camera
        for other, newest_ns in self._newest_ns.items():
            since_frames = (self._newest_ns[camera] - newest_ns) * 1e-9 / self._periods_s[camera]
            if (
                not self._is_faster(camera, other)
                and not self._is_faster(other, camera)
                and since_frames < _ABSENT_FRAMES
                and self._ages[camera] - self._ages[other] > _YOUNGER
                and self._ages[other] < self._ages[best]
            ):
                best = other
        return best
