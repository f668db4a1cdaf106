"""The score of poses with known errors is those errors."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from rhot.hand import DIGIT_ANGLES, DIGITS
from services.cli.evaluate.score_math import score_hand
from services.cli.evaluate.truth_track import hand_track

PERIOD_NS = 1e9 / 30.0


def scored(made_up, poses):
    return score_hand(poses, hand_track(made_up.truths(), "right"), made_up.model, PERIOD_NS)


def test_the_truth_itself_has_no_error(made_up):
    score = scored(made_up, made_up.poses())
    assert score.poses == score.scored == 90
    assert score.tips_rms_mm == pytest.approx(0.0, abs=1e-3)
    assert score.angles_mean_deg == pytest.approx(0.0, abs=1e-3)
    assert score.orientation.max_deg == pytest.approx(0.0, abs=1e-3)
    assert score.coverage.missed == score.violations.count == 0
    assert score.delay_ms == pytest.approx(0.0, abs=0.1)
    assert 0.4 < score.distance_m < 0.6


def test_a_shift_is_bias_and_rms_of_its_axis_only(made_up):
    score = scored(made_up, made_up.poses(shift_m=(0.0, -0.003, 0.004)))
    for error in (*score.tips.values(), score.wrist):
        assert error.bias_mm == pytest.approx((0.0, -3.0, 4.0), abs=1e-2)
        assert error.rms_mm == pytest.approx((0.0, 3.0, 4.0), abs=1e-2)
        assert error.total_rms_mm == pytest.approx(5.0, abs=1e-2)
        assert error.max_mm == pytest.approx(5.0, abs=2e-2)
    assert score.tips_rms_mm == pytest.approx(5.0, abs=1e-2)
    # A constant offset is not a lag.
    assert score.delay_ms == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("late_ms", [-12.0, 7.0, 33.3, 50.0])
def test_late_content_is_measured_as_delay(made_up, late_ms):
    score = scored(made_up, made_up.poses(late_s=late_ms * 1e-3))
    assert score.delay_ms == pytest.approx(late_ms, abs=0.3)
    assert score.tips_rms_mm > 0.1 * abs(late_ms)


def test_noise_does_not_hide_the_delay(made_up):
    rng = np.random.default_rng(3)
    poses = [
        made_up.pose(i / 30.0, late_s=0.020, shift_m=rng.normal(0.0, 0.003, 3)) for i in range(90)
    ]
    assert scored(made_up, poses).delay_ms == pytest.approx(20.0, abs=3.0)


def test_a_still_hand_has_no_delay(made_up):
    truth = made_up.truths(1.0)
    still = [type(line)(stamp_ns=line.stamp_ns, hands=truth[0].hands, objects={}) for line in truth]
    first = made_up.pose(0.0)
    poses = [
        type(first)(
            **{f: getattr(first, f) for f in first.__struct_fields__} | {"stamp_ns": line.stamp_ns}
        )
        for line in still
    ]
    assert score_hand(poses, hand_track(still, "right"), made_up.model, PERIOD_NS).delay_ms is None


def test_angle_errors_are_per_joint_and_fixed_joints_do_not_dilute_the_mean(made_up):
    off = np.zeros((5, 4))
    off[1] = np.deg2rad([0.0, 10.0, -20.0, 0.0])
    score = scored(made_up, made_up.poses(off_rad=off))
    assert score.angles["index"]["mcp"].bias_deg == pytest.approx(10.0, abs=0.05)
    assert score.angles["index"]["pip"].bias_deg == pytest.approx(-20.0, abs=0.05)
    assert score.angles["index"]["pip"].mean_deg == pytest.approx(20.0, abs=0.05)
    assert score.angles["middle"]["abduction"].fixed
    assert score.angles_mean_deg == pytest.approx(30.0 / 19.0, abs=0.01)
    assert [tuple(joints) for joints in score.angles.values()] == [*DIGIT_ANGLES]
    assert tuple(score.angles) == DIGITS


def test_a_turned_hand_is_an_orientation_error(made_up):
    score = scored(made_up, made_up.poses(turn_rad=np.deg2rad(4.0)))
    assert score.orientation.mean_deg == pytest.approx(4.0, abs=1e-2)
    assert score.orientation.rms_deg == pytest.approx(4.0, abs=1e-2)


def test_joints_beyond_their_limits_are_counted(made_up):
    off = np.zeros((5, 4))
    off[3, 1] = np.deg2rad(40.0)
    score = scored(made_up, made_up.poses(off_rad=off))
    assert score.violations.count > 10
    assert score.violations.worst_joint == "ring mcp"
    # 0.5 + 0.3 of 90 deg, and 40 more.
    assert score.violations.worst_deg == pytest.approx(72.0 + 40.0 - 90.0, abs=0.2)


def test_what_rounding_to_a_microradian_does_is_no_violation(made_up):
    off = np.zeros((5, 4))
    off[2, 0] = 9e-7
    assert scored(made_up, made_up.poses(off_rad=off)).violations.count == 0


def test_a_gap_is_a_dropout(made_up):
    poses = [pose for i, pose in enumerate(made_up.poses()) if not 30 <= i < 39]
    score = scored(made_up, poses)
    assert score.coverage.expected == 90
    assert score.coverage.missed == 9
    assert score.coverage.missed_share == pytest.approx(0.1)
    assert score.coverage.longest_gap_ms == pytest.approx(10 * 33.333, abs=0.1)


def test_a_late_start_counts_as_a_gap_and_poses_after_the_end_do_not_score(made_up):
    poses = [made_up.pose(i / 30.0) for i in range(30, 100)]
    score = scored(made_up, poses)
    assert score.coverage.missed == 30
    assert score.coverage.outside == 10
    assert score.scored == 60
    assert score.coverage.longest_gap_ms == pytest.approx(1000.0, abs=0.1)


def test_poses_of_another_time_are_an_error(made_up):
    with pytest.raises(CaptureError, match="not of this capture"):
        scored(made_up, [made_up.pose(100.0)])
