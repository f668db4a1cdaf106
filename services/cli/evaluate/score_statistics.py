"""Error statistics for `rhot score`: points, orientations, joint angles, coverage, limits, delay.

Results are rounded to the digits that are shown and kept in JSON.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from rhot.hand import DIGIT_ANGLES, DIGITS, HandModel
from services.cli.evaluate.interpolation import Stamps, cubic
from services.cli.evaluate.score_types import (
    AngleError,
    Coverage,
    OrientationError,
    PointError,
    Spread,
    Vec3,
    Violations,
)

# Angles are rounded to 1e-6 rad in messages: a joint at its limit may lie half of that outside.
_LIMIT_SLACK_RAD = 1e-6
# The lag is searched in +-120 ms, four frames at 30 fps: more is not a delay but another motion.
_LAG_REACH_S = 0.120
_LAG_STEP_S = 0.002
# A lag is reported only if shifting by one frame (33 ms) changes the error by more than 0.1 mm RMS;
# the lag of a hand at rest cannot be measured.
_LAG_CONTRAST_S, _LAG_CONTRAST_M = 0.033, 1e-4


def point_error(error_m: Array) -> PointError:
    """Statistics of errors (n, 3) in metres, n > 0."""
    lengths = np.linalg.norm(error_m, axis=1)
    return PointError(
        bias_mm=_vector(1e3 * error_m.mean(axis=0)),
        rms_mm=_vector(1e3 * np.sqrt(np.mean(error_m**2, axis=0))),
        total_rms_mm=_round(1e3 * float(np.sqrt(np.mean(lengths**2)))),
        max_mm=_round(1e3 * float(lengths.max())),
    )


def spread(sizes: Array) -> Spread:
    """Statistics of sizes of errors (n,), n > 0, in the unit that they have."""
    return Spread(
        median=_round(float(np.median(sizes))),
        rms=_round(float(np.sqrt(np.mean(sizes**2)))),
        p95=_round(float(np.percentile(sizes, 95.0))),
        max=_round(float(sizes.max())),
    )


def turns_deg(a_wxyz: Array, b_wxyz: Array) -> Array:
    """Angles (n,) between orientations (n, 4) and (n, 4)."""
    a = a_wxyz / np.linalg.norm(a_wxyz, axis=1, keepdims=True)
    b = b_wxyz / np.linalg.norm(b_wxyz, axis=1, keepdims=True)
    # From the chord |a -+ b| = 2 sin(angle / 4): exact for small angles, where arccos of the dot
    # product is not.
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return np.rad2deg(4.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))


def orientation_error(a_wxyz: Array, b_wxyz: Array) -> OrientationError:
    """Angles between orientations (n, 4) and (n, 4), n > 0."""
    deg = turns_deg(a_wxyz, b_wxyz)
    return OrientationError(
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


def limit_violations(angles_rad: Array, model: HandModel) -> Violations:
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


def angle_errors(error_rad: Array, free: npt.NDArray[np.bool_]) -> dict[str, dict[str, AngleError]]:
    """Per digit and joint from errors (n, 5, 4) in rad; free (5, 4): joints that can move."""
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


def delay_ms(stamps_ns: Stamps, values: Array, truth_ns: Stamps, truth: Array) -> float | None:
    """How late the content is: the lag in ms for which values(t) fits truth(t - lag) best.

    values (m, k) at stamps_ns (m,), truth (n, k) at truth_ns (n,). The mean difference is removed
    first, so that a bias is not read as a lag. None where the motion is too slow to measure a lag.
    """
    reach_ns = int(1e9 * _LAG_REACH_S)
    inner = (stamps_ns - reach_ns >= truth_ns[0]) & (stamps_ns + reach_ns <= truth_ns[-1])
    # Ten instants of five tips: a lag fitted to fewer follows the noise.
    if inner.sum() < 10:
        return None
    stamps, values = stamps_ns[inner], values[inner]
    lags = np.arange(-_LAG_REACH_S, _LAG_REACH_S + _LAG_STEP_S / 2, _LAG_STEP_S)

    def residual(lag_s: float) -> float:
        error = values - cubic(truth_ns, truth, stamps - np.int64(round(lag_s * 1e9)))
        return float(np.sqrt(np.mean((error - error.mean(axis=0)) ** 2)))

    return _best_lag_ms(lags, residual)


def _best_lag_ms(lags: Array, residual: Callable[[float], float]) -> float | None:
    """The lag in ms of the lowest residual, refined by the parabola through its neighbours."""
    costs = np.array([residual(float(lag)) for lag in lags]) ** 2
    best, last = int(np.argmin(costs)), len(costs) - 1
    frame = round(_LAG_CONTRAST_S / _LAG_STEP_S)
    one_frame_off = np.sqrt(costs[[max(best - frame, 0), min(best + frame, last)]]).max()
    if best in (0, last) or one_frame_off - np.sqrt(costs[best]) < _LAG_CONTRAST_M:
        return None
    left, middle, right = costs[best - 1 : best + 2]
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature > 0.0 else 0.0
    return _round(1e3 * float(lags[best] + shift * _LAG_STEP_S))


def _vector(values: Array) -> Vec3:
    x, y, z = (_round(float(v)) for v in values)
    return x, y, z


def _round(value: float, digits: int = 3) -> float:
    return round(value, digits)
