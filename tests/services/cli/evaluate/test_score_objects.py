"""An object against its truth: errors, states, velocity, delay."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from rhot.geometry.transforms import quaternion_multiply
from rhot.messages.objects import ObjectPose
from services.cli.evaluate.score_objects import score_object
from services.cli.evaluate.truth_track import object_track

PERIOD_NS = 1e9 / 30


def object_pose(truth, i, *, registered=True, tracking="ok", shift_m=0.0, **fields):
    cup = truth.objects["cup"]
    usual = {"orientation_wxyz": cup.orientation_wxyz, "velocity_m_s": (0.0, 0.0, 0.0)}
    x, y, z = cup.position_m
    return ObjectPose(
        object="cup",
        serial="LHR-1",
        seq=i,
        stamp_ns=truth.stamp_ns,
        position_m=(x + shift_m, y, z),
        angular_velocity_rad_s=(0.0, 0.0, 0.0),
        tracking=tracking,
        registered=registered,
        **(usual | fields),
    )


def test_an_object_is_scored_like_a_point(made_up):
    lines = made_up.truths()
    poses = [
        object_pose(line, i, shift_m=0.002, tracking="lost" if i < 9 else "ok")
        for i, line in enumerate(lines)
    ]
    score = score_object(poses, object_track(lines, "cup"), PERIOD_NS)
    assert score.poses == 90
    assert score.scored == 81
    assert score.coverage.missed == 9
    assert score.position.bias_mm == pytest.approx((2.0, 0.0, 0.0), abs=1e-3)
    assert score.orientation.max_deg == pytest.approx(0.0, abs=1e-3)
    assert score.delay_ms == pytest.approx(0.0, abs=0.1)


def test_an_unregistered_object_is_counted_and_not_scored(made_up):
    lines = made_up.truths()
    score = score_object(
        [object_pose(line, 0, registered=False) for line in lines],
        object_track(lines, "cup"),
        PERIOD_NS,
    )
    assert score.unregistered == 90
    assert score.scored == 0
    assert score.position is None
    assert score.orientation is None
    assert score.coverage.missed_share == 1.0


def test_errors_are_told_by_their_median_rms_95_percent_and_maximum(made_up):
    lines = made_up.truths()
    # One in ten is 20 mm off, the others 1 mm.
    poses = [
        object_pose(line, i, shift_m=0.02 if i % 10 == 0 else 0.001) for i, line in enumerate(lines)
    ]
    found = score_object(poses, object_track(lines, "cup"), PERIOD_NS).position_mm
    assert (found.median, found.p95, found.max) == pytest.approx((1.0, 20.0, 20.0), abs=1e-3)
    assert found.rms == pytest.approx(np.sqrt(0.9 + 0.1 * 400.0), abs=1e-3)


def test_a_turned_object(made_up):
    lines = made_up.truths()
    turn = (np.cos(0.01), np.sin(0.01), 0.0, 0.0)
    poses = [
        object_pose(
            line,
            i,
            orientation_wxyz=tuple(
                quaternion_multiply(line.objects["cup"].orientation_wxyz, turn).tolist()
            ),
        )
        for i, line in enumerate(lines)
    ]
    found = score_object(poses, object_track(lines, "cup"), PERIOD_NS).orientation_deg
    assert found.median == found.max == pytest.approx(np.rad2deg(0.02), abs=1e-3)


def test_velocity_is_compared_with_the_slope_of_the_truth(made_up):
    lines = made_up.truths()
    track = object_track(lines, "cup")
    slope = np.gradient(track.position_m, track.stamps_ns * 1e-9, axis=0)
    poses = [
        object_pose(line, i, velocity_m_s=tuple(v))
        for i, (line, v) in enumerate(zip(lines, slope.tolist(), strict=True))
    ]
    still = [object_pose(line, i) for i, line in enumerate(lines)]
    right, wrong = (score_object(own, track, PERIOD_NS).velocity_mm_s for own in (poses, still))
    speed_mm_s = 1e3 * float(np.median(np.linalg.norm(slope, axis=1)))
    assert speed_mm_s > 1.0
    assert wrong.median == pytest.approx(speed_mm_s, rel=0.05)
    assert right.median < 0.1 * wrong.median


def test_states_are_counted_and_only_what_is_ok_is_scored(made_up):
    lines = made_up.truths()
    states = ["ok", "ok", "out_of_range", "calibrating", "ok"]
    poses = [
        object_pose(line, i, tracking=states[i % 5], shift_m=0.0 if states[i % 5] == "ok" else 9.0)
        for i, line in enumerate(lines)
    ]
    score = score_object(poses, object_track(lines, "cup"), PERIOD_NS)
    assert score.states == {"ok": 54, "out_of_range": 18, "calibrating": 18}
    assert score.ok_share == pytest.approx(0.6)
    assert score.position_mm.max < 0.01
    assert score.latency_ms is None


def test_late_stamps_show_as_delay_and_sending_as_latency(made_up):
    lines = made_up.truths()
    late = [
        msgspec.structs.replace(
            object_pose(line, i), stamp_ns=line.stamp_ns + 30_000_000, sent_ns=line.stamp_ns + 10**8
        )
        for i, line in enumerate(lines)
    ]
    score = score_object(late, object_track(lines, "cup"), PERIOD_NS)
    assert score.delay_ms == pytest.approx(30.0, abs=1.0)
    assert score.latency_ms == pytest.approx(70.0, abs=0.001)


def test_no_pose_at_all(made_up):
    score = score_object([], object_track(made_up.truths(), "cup"), PERIOD_NS)
    assert (score.poses, score.ok_share, score.position_mm) == (0, 0.0, None)
