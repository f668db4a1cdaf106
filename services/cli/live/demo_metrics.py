"""Figures of a running rig for `rhot demo`: rate, glass-to-pose latency, tip error against the
simulator's truth. Pure.

Poses without truth about them count in rate and latency only. Poses from before `begin` are left
out: the summary speaks of the time in which everything ran.
"""

from __future__ import annotations

from collections import deque

import msgspec
import numpy as np

from rhot.bus.stats import percentiles_ms
from rhot.hand import JOINT_INDEX, TIPS
from rhot.messages import HandPose
from rhot.simulator_messages import Truth

# Truth kept: two seconds at 90 Hz, far longer than any pose takes.
_TRUTH = 180
_TIP_JOINTS = [JOINT_INDEX[name] for name in TIPS]


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """What `rhot demo --seconds N` reports; None where nothing was measured."""

    seconds: float
    poses: int
    poses_per_s: float
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    tip_error_rms_mm: float | None
    tip_error_median_mm: float | None
    object_poses: int
    restarts: dict[str, int]


class LiveFigures:
    """Collects poses and truth as they arrive; stamps in ns on one clock."""

    def __init__(self) -> None:
        self.poses = 0
        self.objects = 0
        self.first_ns = 0
        self.last_ns = 0
        self._latencies_ns: list[int] = []
        self._squared_mm2: list[float] = []
        self._truth: deque[Truth] = deque(maxlen=_TRUTH)
        self._waiting: deque[HandPose] = deque(maxlen=_TRUTH)

    def truth(self, truth: Truth) -> None:
        """Take in what the simulator knows, and score the poses that waited for it."""
        self._truth.append(truth)
        while self._waiting and self._waiting[0].stamp_ns <= truth.stamp_ns:
            self._score(self._waiting.popleft())

    def pose(self, pose: HandPose, arrived_ns: int) -> None:
        """Take in a pose that arrived at arrived_ns."""
        self.poses += 1
        self.first_ns = self.first_ns or arrived_ns
        self.last_ns = arrived_ns
        self._latencies_ns.append(arrived_ns - pose.stamp_ns)
        self._waiting.append(pose)

    def tip_error_mm(self, last: int | None = None) -> float | None:
        """RMS tip error in mm over the last poses, or over all."""
        squared = self._squared_mm2 if last is None else self._squared_mm2[-last:]
        return float(np.sqrt(np.mean(squared))) if squared else None

    def summary(self, restarts: dict[str, int]) -> Summary:
        """All figures so far."""
        seconds = (self.last_ns - self.first_ns) * 1e-9
        p50_ms, p99_ms = percentiles_ms(self._latencies_ns)
        rms_mm = self.tip_error_mm()
        return Summary(
            seconds=round(seconds, 2),
            poses=self.poses,
            poses_per_s=round((self.poses - 1) / seconds, 1)
            if self.poses > 1 and seconds > 0.0
            else 0.0,
            latency_p50_ms=p50_ms if self.poses else None,
            latency_p99_ms=p99_ms if self.poses else None,
            tip_error_rms_mm=None if rms_mm is None else round(rms_mm, 2),
            tip_error_median_mm=round(float(np.sqrt(np.median(self._squared_mm2))), 2)
            if self._squared_mm2
            else None,
            object_poses=self.objects,
            restarts=restarts,
        )

    def _score(self, pose: HandPose) -> None:
        tips = self._tips_at(pose)
        if tips is None:
            return
        solved = np.array([pose.joints[joint].position_m for joint in _TIP_JOINTS])
        self._squared_mm2.append(float(np.mean(np.sum((solved - tips) ** 2, axis=1))) * 1e6)

    def _tips_at(self, pose: HandPose) -> np.ndarray | None:
        """True tips (5, 3) at the pose's instant, on the line between the truths about it."""
        for before, after in zip(self._truth, list(self._truth)[1:], strict=False):
            if (
                before.stamp_ns <= pose.stamp_ns <= after.stamp_ns
                and pose.hand in before.hands
                and pose.hand in after.hands
            ):
                a, b = (
                    np.array([t.hands[pose.hand].points_m[name] for name in TIPS])
                    for t in (before, after)
                )
                share = (pose.stamp_ns - before.stamp_ns) / max(1, after.stamp_ns - before.stamp_ns)
                return a + share * (b - a)
        return None
