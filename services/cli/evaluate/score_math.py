"""Poses against truth: the numbers behind `rhot score`. Pure maths; files are score_result.py's
matter.

Frames: everything in the rig frame. An estimate is compared with the truth at its own stamp, so
lateness of the estimate's content shows as `delay_ms` and in the errors, lateness of its delivery
does not. No estimate inside the truth: CaptureError.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINT_INDEX, TIPS, HandModel
from rhot.messages import HandPose, ObjectPose
from services.cli.evaluate.score_types import (
    AngleError,
    Coverage,
    HandScore,
    ObjectScore,
    PointError,
    TurnError,
    Vec3,
    Violations,
)
from services.cli.evaluate.truth_track import (
    HandTrack,
    ObjectTrack,
    Stamps,
    angle_rows,
    cubic,
    inside,
)

_TIP_ROWS = [JOINT_INDEX[tip] for tip in TIPS]
# Angles are rounded to 1e-6 rad in messages: a joint at its limit may lie half of that outside.
_LIMIT_SLACK_RAD = 1e-6
# The lag is searched in +-120 ms, four frames at 30 fps: more is not a delay but another motion.
_LAG_REACH_S = 0.120
_LAG_STEP_S = 0.002
# A lag is told only if shifting by one frame (33 ms) changes the error by more than 0.1 mm RMS; a
# still hand has none.
_LAG_CONTRAST_M = 1e-4


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
            _apart(estimate.stamps_ns, truth.stamps_ns, f"poses of the {model.hand} hand")
        )
    real = truth.at(estimate.stamps_ns[within])
    tips = estimate.tips_m[within] - real.tips_m  # (n, 5, 3)
    angles = estimate.angles_rad[within] - real.angles_rad  # (n, 5, 4)
    free = model.limits_rad[:, :, 1] > model.limits_rad[:, :, 0]  # (5, 4)
    return HandScore(
        poses=len(ordered),
        scored=int(within.sum()),
        predicted=sum(any(f.status == "predicted" for f in pose.fingers) for pose in ordered),
        distance_m=_round(float(np.linalg.norm(real.tips_m, axis=2).mean()), 4),
        tips={tip: point_error(tips[:, row]) for row, tip in enumerate(TIPS)},
        tips_rms_mm=_round(1e3 * float(np.sqrt(np.mean(np.sum(tips**2, axis=2))))),
        angles=_angle_errors(angles, free),
        angles_mean_deg=_round(float(np.rad2deg(np.abs(angles[:, free]).mean()))),
        wrist=point_error(estimate.wrist_m[within] - real.wrist_m),
        orientation=turn_error(estimate.wrist_wxyz[within], real.wrist_wxyz),
        coverage=coverage(estimate.stamps_ns, truth.stamps_ns, period_ns),
        violations=violations(estimate.angles_rad, model),
        delay_ms=delay_ms(
            estimate.stamps_ns,
            estimate.tips_m.reshape(-1, 15),
            truth.stamps_ns,
            truth.tips_m.reshape(-1, 15),
        ),
    )


def score_object(poses: Sequence[ObjectPose], truth: ObjectTrack, period_ns: float) -> ObjectScore:
    """One object's poses against its truth.

    Errors are None if no registered pose lies inside the truth.
    """
    registered = sorted(
        (pose for pose in poses if pose.registered and pose.tracking == "ok"),
        key=lambda pose: pose.stamp_ns,
    )
    stamps = np.array([pose.stamp_ns for pose in registered], dtype=np.int64)
    position = np.array([pose.position_m for pose in registered]).reshape(-1, 3)
    wxyz = np.array([pose.orientation_wxyz for pose in registered]).reshape(-1, 4)
    within = inside(truth, stamps)
    real = truth.at(stamps[within])
    found = bool(within.any())
    return ObjectScore(
        poses=len(poses),
        scored=int(within.sum()),
        unregistered=sum(not pose.registered for pose in poses),
        position=point_error(position[within] - real.position_m) if found else None,
        orientation=turn_error(wxyz[within], real.orientation_wxyz) if found else None,
        coverage=coverage(stamps, truth.stamps_ns, period_ns),
        delay_ms=delay_ms(stamps, position, truth.stamps_ns, truth.position_m),
    )


def estimate_track(poses: Sequence[HandPose]) -> HandTrack:
    """The arrays of poses that are in order of time."""
    return HandTrack(
        np.array([pose.stamp_ns for pose in poses], dtype=np.int64),
        np.array([pose.wrist.position_m for pose in poses]).reshape(-1, 3),
        np.array([pose.wrist.orientation_wxyz for pose in poses]).reshape(-1, 4),
        np.array([[pose.joints[row].position_m for row in _TIP_ROWS] for pose in poses]).reshape(
            -1, 5, 3
        ),
        np.array(
            [angle_rows([finger.angles_rad for finger in pose.fingers]) for pose in poses]
        ).reshape(-1, 5, 4),
    )


def point_error(error_m: Array) -> PointError:
    """Statistics of errors (n, 3) in metres, n > 0."""
    lengths = np.linalg.norm(error_m, axis=1)
    return PointError(
        bias_mm=_vector(1e3 * error_m.mean(axis=0)),
        rms_mm=_vector(1e3 * np.sqrt(np.mean(error_m**2, axis=0))),
        total_rms_mm=_round(1e3 * float(np.sqrt(np.mean(lengths**2)))),
        max_mm=_round(1e3 * float(lengths.max())),
    )


def turn_error(a_wxyz: Array, b_wxyz: Array) -> TurnError:
    """Angles between orientations (n, 4) and (n, 4), n > 0."""
    a = a_wxyz / np.linalg.norm(a_wxyz, axis=1, keepdims=True)
    b = b_wxyz / np.linalg.norm(b_wxyz, axis=1, keepdims=True)
    # From the chord |a -+ b| = 2 sin(angle / 4): exact for small angles, where arccos of the dot
    # product is not.
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    deg = np.rad2deg(4.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
    return TurnError(
        mean_deg=_round(float(deg.mean())),
        rms_deg=_round(float(np.sqrt(np.mean(deg**2)))),
        max_deg=_round(float(deg.max())),
    )


def coverage(stamps_ns: Stamps, truth_ns: Stamps, period_ns: float) -> Coverage:
    """How well sorted stamps (m,) cover the instants of truth (n,), n > 0."""
    within = stamps_ns[
        (stamps_ns >= truth_ns[0] - period_ns / 2) & (stamps_ns <= truth_ns[-1] + period_ns / 2)
    ]
    ends = np.concatenate([truth_ns[:1], within, truth_ns[-1:]])
    if len(within):
        after = np.clip(np.searchsorted(within, truth_ns), 0, len(within) - 1)
        before = np.maximum(after - 1, 0)
        nearest = np.minimum(np.abs(within[after] - truth_ns), np.abs(within[before] - truth_ns))
        missed = int((nearest > period_ns / 2).sum())
    else:
        missed = len(truth_ns)
    return Coverage(
        expected=len(truth_ns),
        missed=missed,
        missed_share=_round(missed / len(truth_ns), 6),
        longest_gap_ms=_round(float(np.diff(ends).max()) * 1e-6),
        outside=len(stamps_ns) - len(within),
    )


def violations(angles_rad: Array, model: HandModel) -> Violations:
    """Angles (n, 5, 4) beyond the model's limits."""
    limits = model.limits_rad
    excess = np.maximum(limits[:, :, 0] - angles_rad, angles_rad - limits[:, :, 1])  # (n, 5, 4)
    worst = np.unravel_index(int(np.argmax(excess)), excess.shape) if excess.size else (0, 0, 0)
    count = int((excess > _LIMIT_SLACK_RAD).sum())
    return Violations(
        count=count,
        worst_deg=_round(float(np.rad2deg(excess[worst]))) if count else 0.0,
        worst_joint=f"{DIGITS[worst[1]]} {DIGIT_ANGLES[worst[1]][worst[2]]}" if count else "",
    )


def delay_ms(stamps_ns: Stamps, values: Array, truth_ns: Stamps, truth: Array) -> float | None:
    """How late the content is: the lag in ms for which values(t) fits truth(t - lag) best; (m, k)
    against (n, k).

    Constant offsets are taken out first, so that a bias is not read as a lag. None where the motion
    does not tell.
    """
    reach_ns = int(1e9 * _LAG_REACH_S)
    inner = (stamps_ns - reach_ns >= truth_ns[0]) & (stamps_ns + reach_ns <= truth_ns[-1])
    # Ten instants of five tips: fewer follow the noise.
    if inner.sum() < 10:
        return None
    stamps, values = stamps_ns[inner], values[inner]
    lags = np.arange(-_LAG_REACH_S, _LAG_REACH_S + _LAG_STEP_S / 2, _LAG_STEP_S)

    def residual(lag_s: float) -> float:
        error = values - cubic(truth_ns, truth, stamps - np.int64(round(lag_s * 1e9)))
        return float(np.sqrt(np.mean((error - error.mean(axis=0)) ** 2)))

    return _lowest(lags, residual)


def _lowest(lags: Array, residual: Callable[[float], float]) -> float | None:
    """The lag in ms of the lowest residual, refined by the parabola through its neighbours."""
    costs = np.array([residual(float(lag)) for lag in lags]) ** 2
    best = int(np.argmin(costs))
    aside = round(0.033 / _LAG_STEP_S)
    around = np.sqrt(costs[[max(best - aside, 0), min(best + aside, len(costs) - 1)]]).max()
    if best in (0, len(costs) - 1) or around - np.sqrt(costs[best]) < _LAG_CONTRAST_M:
        return None
    left, middle, right = costs[best - 1 : best + 2]
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature > 0.0 else 0.0
    return _round(1e3 * float(lags[best] + shift * _LAG_STEP_S))


def _angle_errors(
    error_rad: Array, free: npt.NDArray[np.bool_]
) -> dict[str, dict[str, AngleError]]:
    """Per digit and joint from errors (n, 5, 4)."""
    deg = np.rad2deg(error_rad)
    return {
        digit: {
            joint: AngleError(
                bias_deg=_round(float(deg[:, row, column].mean())),
                mean_deg=_round(float(np.abs(deg[:, row, column]).mean())),
                max_deg=_round(float(np.abs(deg[:, row, column]).max())),
                fixed=not bool(free[row, column]),
            )
            for column, joint in enumerate(DIGIT_ANGLES[row])
        }
        for row, digit in enumerate(DIGITS)
    }


def _apart(stamps_ns: Stamps, truth_ns: Stamps, what: str) -> str:
    if not len(stamps_ns):
        return f"there are no {what} to score; look at summary.json of the result for the reason"
    return (
        f"{what} are not of this capture: they span {stamps_ns[0]} .. {stamps_ns[-1]} ns, its truth {truth_ns[0]} .. {truth_ns[-1]} ns; "
        "track this capture with `rhot track CAPTURE --out DIR` and score that"
    )


def _vector(values: Array) -> Vec3:
    x, y, z = (_round(float(v)) for v in values)
    return x, y, z


def _round(value: float, digits: int = 3) -> float:
    return round(value, digits)
