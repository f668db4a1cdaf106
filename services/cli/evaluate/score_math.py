"""Poses against truth: the numbers behind `rhot score`. Pure; files are read by score_result.py.

Everything is in the rig frame. An estimate is compared with the truth at its own stamp. Content
that is late shows as `delay_ms` and in the errors; how late it was delivered does not count.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot.errors import CaptureError
from rhot.hand import JOINT_INDEX, TIPS, HandModel
from rhot.messages import HandPose
from services.cli.evaluate.interpolation import Stamps
from services.cli.evaluate.score_statistics import (
    angle_errors,
    coverage,
    delay_ms,
    limit_violations,
    orientation_error,
    point_error,
)
from services.cli.evaluate.score_types import HandScore
from services.cli.evaluate.truth_track import HandTrack, angle_rows, inside

_TIP_JOINTS = [JOINT_INDEX[tip] for tip in TIPS]


def score_hand(
    poses: Sequence[HandPose], truth: HandTrack, model: HandModel, period_ns: float
) -> HandScore:
    """One hand's poses against its truth.

    period_ns is one frame: an instant of truth without a pose within half of it is missed.
    Raises CaptureError if no pose lies inside the truth.
    """
    ordered = sorted(poses, key=lambda pose: pose.stamp_ns)
    estimate = estimate_track(ordered)
    within = inside(truth, estimate.stamps_ns)
    if not within.any():
        raise CaptureError(
            _no_overlap(estimate.stamps_ns, truth.stamps_ns, f"poses of the {model.hand} hand")
        )
    real = truth.at(estimate.stamps_ns[within])
    tip_errors_m = estimate.tips_m[within] - real.tips_m  # (n, 5, 3)
    angle_errors_rad = estimate.angles_rad[within] - real.angles_rad  # (n, 5, 4)
    free = model.limits_rad[:, :, 1] > model.limits_rad[:, :, 0]  # (5, 4)
    distance_m = float(np.linalg.norm(real.tips_m, axis=2).mean())
    tips_rms_m = float(np.sqrt(np.mean(np.sum(tip_errors_m**2, axis=2))))
    angles_mean_deg = float(np.rad2deg(np.abs(angle_errors_rad[:, free]).mean()))
    return HandScore(
        poses=len(ordered),
        scored=int(within.sum()),
        predicted=sum(any(f.status == "predicted" for f in pose.fingers) for pose in ordered),
        distance_m=round(distance_m, 4),
        tips={tip: point_error(tip_errors_m[:, row]) for row, tip in enumerate(TIPS)},
        tips_rms_mm=round(1e3 * tips_rms_m, 3),
        angles=angle_errors(angle_errors_rad, free),
        angles_mean_deg=round(angles_mean_deg, 3),
        wrist=point_error(estimate.wrist_m[within] - real.wrist_m),
        orientation=orientation_error(estimate.wrist_wxyz[within], real.wrist_wxyz),
        coverage=coverage(estimate.stamps_ns, truth.stamps_ns, period_ns),
        violations=limit_violations(estimate.angles_rad, model),
        delay_ms=delay_ms(
            estimate.stamps_ns,
            estimate.tips_m.reshape(-1, 15),
            truth.stamps_ns,
            truth.tips_m.reshape(-1, 15),
        ),
    )


def estimate_track(poses: Sequence[HandPose]) -> HandTrack:
    """Poses, in order of time, as arrays."""
    tips_m = [[pose.joints[joint].position_m for joint in _TIP_JOINTS] for pose in poses]
    angles_rad = [angle_rows([finger.angles_rad for finger in pose.fingers]) for pose in poses]
    # The shapes are given for the sake of no poses at all.
    return HandTrack(
        np.array([pose.stamp_ns for pose in poses], dtype=np.int64),
        np.array([pose.wrist.position_m for pose in poses]).reshape(-1, 3),
        np.array([pose.wrist.orientation_wxyz for pose in poses]).reshape(-1, 4),
        np.array(tips_m).reshape(-1, 5, 3),
        np.array(angles_rad).reshape(-1, 5, 4),
    )


def _no_overlap(stamps_ns: Stamps, truth_ns: Stamps, what: str) -> str:
    if not len(stamps_ns):
        return f"there are no {what} to score; look at summary.json of the result for the reason"
    return (
        f"{what} are not of this capture: they span {stamps_ns[0]} .. {stamps_ns[-1]} ns, "
        f"its truth {truth_ns[0]} .. {truth_ns[-1]} ns; "
        "track this capture with `rhot track CAPTURE --out DIR` and score that"
    )
