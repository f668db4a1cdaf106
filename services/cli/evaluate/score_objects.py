"""One object's poses against its truth: place, turn, velocity, states, delay. Pure.

Compared at each pose's own stamp. Only poses that say that they are right (ok, and registered) are
scored; how many do is part of the score. Who touched and held it when is scored elsewhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec
import numpy as np

from rhot.geometry.transforms import Array
from rhot.messages.objects import ObjectPose
from services.cli.evaluate.interpolation import Stamps, cubic_slope
from services.cli.evaluate.score_statistics import (
    coverage,
    delay_ms,
    orientation_error,
    point_error,
    spread,
    turns_deg,
)
from services.cli.evaluate.score_types import ObjectScore
from services.cli.evaluate.truth_track import ObjectTrack, inside


def score_object(poses: Sequence[ObjectPose], truth: ObjectTrack, period_ns: float) -> ObjectScore:
    """One object's poses against its truth.

    period_ns is one frame: an instant of truth without a pose within half of it is missed. Errors
    are None if no registered pose that is ok lies inside the truth.
    """
    ordered = sorted(poses, key=lambda pose: pose.stamp_ns)
    registered = [pose for pose in ordered if pose.registered and pose.tracking == "ok"]
    stamps, position, wxyz, velocity = _arrays(registered)
    within = inside(truth, stamps)
    real = truth.at(stamps[within])
    counts = ObjectScore(
        poses=len(poses),
        scored=int(within.sum()),
        unregistered=sum(not pose.registered for pose in poses),
        states=dict(Counter(pose.tracking for pose in ordered)),
        ok_share=round(len(registered) / len(poses), 4) if poses else 0.0,
        position=None,
        orientation=None,
        coverage=coverage(stamps, truth.stamps_ns, period_ns),
        delay_ms=delay_ms(stamps, position, truth.stamps_ns, truth.position_m),
        latency_ms=_latency_ms(registered),
    )
    if not within.any():
        return counts
    off_m = position[within] - real.position_m  # (n, 3)
    turned = (wxyz[within], real.orientation_wxyz)
    true_velocity = cubic_slope(truth.stamps_ns, truth.position_m, stamps[within])  # (n, 3)
    faster_m_s = velocity[within] - true_velocity
    return msgspec.structs.replace(
        counts,
        position=point_error(off_m),
        orientation=orientation_error(*turned),
        position_mm=spread(1e3 * np.linalg.norm(off_m, axis=1)),
        orientation_deg=spread(turns_deg(*turned)),
        velocity_mm_s=spread(1e3 * np.linalg.norm(faster_m_s, axis=1)),
    )


def _arrays(poses: Sequence[ObjectPose]) -> tuple[Stamps, Array, Array, Array]:
    """Stamps (n,), positions (n, 3), orientations (n, 4), velocities (n, 3)."""
    return (
        np.array([pose.stamp_ns for pose in poses], dtype=np.int64),
        # The shapes are given for the sake of no poses at all.
        np.array([pose.position_m for pose in poses]).reshape(-1, 3),
        np.array([pose.orientation_wxyz for pose in poses]).reshape(-1, 4),
        np.array([pose.velocity_m_s for pose in poses]).reshape(-1, 3),
    )


def _latency_ms(poses: Sequence[ObjectPose]) -> float | None:
    """Median of how late poses were sent; None of what was tracked offline, which sends nothing."""
    late_ns = [pose.sent_ns - pose.stamp_ns for pose in poses if pose.sent_ns]
    return round(float(np.median(late_ns)) * 1e-6, 3) if late_ns else None
