"""Measures a running rig for `rhot demo`: pose rate, glass-to-pose latency, finger-tip error.

The error is against the simulator's truth. A pose without truth before and after it counts in rate
and latency only. Pure.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from rhot.bus.stats import percentiles_ms
from rhot.geometry.transforms import Array
from rhot.hand import JOINT_INDEX, TIPS
from rhot.messages import HandPose
from rhot.messages.simulator import Truth
from services.cli.demo.object_metrics import ObjectMetrics
from services.cli.demo.summary import Summary
from services.cli.demo.truths import KEPT, Truths

_TIP_JOINTS = [JOINT_INDEX[name] for name in TIPS]


class DemoMetrics:
    """Collects poses and truth as they arrive; stamps in ns on one clock."""

    def __init__(self) -> None:
        self.poses = 0
        self.first_ns = 0
        self.last_ns = 0
        self._latencies_ns: list[int] = []
        # One value a pose: the mean over the five tips of the squared distance.
        self._squared_errors_mm2: list[float] = []
        self._truths = Truths()
        self.objects = ObjectMetrics(self._truths)
        # Poses that are newer than the newest truth.
        self._waiting: deque[HandPose] = deque(maxlen=KEPT)

    def add_truth(self, truth: Truth) -> None:
        """Take in the simulator's truth, and score the poses that waited for it."""
        self._truths.add(truth)
        self.objects.score()
        while self._waiting and self._waiting[0].stamp_ns <= truth.stamp_ns:
            self._score(self._waiting.popleft())

    def add_pose(self, pose: HandPose, arrived_ns: int) -> None:
        """Take in a pose that arrived at arrived_ns."""
        self.poses += 1
        self.first_ns = self.first_ns or arrived_ns
        self.last_ns = arrived_ns
        self._latencies_ns.append(arrived_ns - pose.stamp_ns)
        self._waiting.append(pose)

    def tip_error_mm(self, last: int | None = None) -> float | None:
        """RMS tip error in mm over the last poses, or over all."""
        squared = self._squared_errors_mm2 if last is None else self._squared_errors_mm2[-last:]
        return float(np.sqrt(np.mean(squared))) if squared else None

    def summary(self, restarts: dict[str, int]) -> Summary:
        """All measurements so far; restarts counts by process."""
        seconds = (self.last_ns - self.first_ns) * 1e-9
        measured = self.poses > 1 and seconds > 0.0
        p50_ms, p99_ms = percentiles_ms(self._latencies_ns)
        rms_mm = self.tip_error_mm()
        squared = self._squared_errors_mm2
        return Summary(
            seconds=round(seconds, 2),
            poses=self.poses,
            poses_per_s=round((self.poses - 1) / seconds, 1) if measured else 0.0,
            latency_p50_ms=p50_ms if self.poses else None,
            latency_p99_ms=p99_ms if self.poses else None,
            tip_error_rms_mm=None if rms_mm is None else round(rms_mm, 2),
            tip_error_median_mm=round(float(np.sqrt(np.median(squared))), 2) if squared else None,
            object_poses=self.objects.poses,
            objects=self.objects.summary(),
            restarts=restarts,
        )

    def _score(self, pose: HandPose) -> None:
        true_tips_m = self._true_tips(pose)
        if true_tips_m is None:
            return
        tips_m = np.array([pose.joints[joint].position_m for joint in _TIP_JOINTS])  # (5, 3)
        squared_m2 = np.sum((tips_m - true_tips_m) ** 2, axis=1)  # (5,)
        self._squared_errors_mm2.append(float(np.mean(squared_m2)) * 1e6)

    def _true_tips(self, pose: HandPose) -> Array | None:
        """True tips (5, 3) in m at the pose's stamp, linear between the truths around it."""
        found = self._truths.around(pose.stamp_ns)
        if found is None or pose.hand not in found.before.hands.keys() & found.after.hands.keys():
            return None
        a, b = (
            np.array([truth.hands[pose.hand].points_m[name] for name in TIPS])
            for truth in (found.before, found.after)
        )
        return a + found.share * (b - a)
