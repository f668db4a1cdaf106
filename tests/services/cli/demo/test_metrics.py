"""Poses made from the truth have the error, latency and rate that was put into them."""

from __future__ import annotations

import numpy as np
import pytest

from rhot import hand as h
from rhot.messages import FingerAngles, FingerPose, HandJoint, HandPose, WristPose
from rhot.messages.simulator import HandTruth, Truth
from services.cli.demo.metrics import DemoMetrics
from services.cli.demo.summary import summary_text

START_NS = 1_700_000_000_000_000_000
FRAME_NS = 33_333_333
WRIST = WristPose(position_m=(0.0, 0.0, 0.5), orientation_wxyz=(1.0, 0.0, 0.0, 0.0))
ANGLES = FingerAngles(abduction=0.0, mcp=0.0, pip=0.0, dip=0.0)


def joints_at(x_m):
    positions, _ = h.forward(
        h.default_hand("right"), np.eye(3), np.array([x_m, 0.0, 0.5]), np.zeros((5, 4))
    )
    return positions


def truth(index, x_m):
    points = {
        name: tuple(joints_at(x_m)[h.JOINT_INDEX[name]].tolist()) for name in h.BASIC_LANDMARKS
    }
    hand = HandTruth(points_m=points, wrist=WRIST, angles_rad=dict.fromkeys(h.DIGITS, ANGLES))
    return Truth(stamp_ns=START_NS + index * FRAME_NS, hands={"right": hand}, objects={})


def pose(stamp_ns, x_m):
    joints = [
        HandJoint(
            name=name,
            position_m=tuple(p.tolist()),
            orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
            radius_m=0.01,
            source="solved",
        )
        for name, p in zip(h.JOINTS, joints_at(x_m), strict=True)
    ]
    fingers = [
        FingerPose(name=digit, angles_rad=ANGLES, residual_m=0.0, iterations=1, status="solved")
        for digit in h.DIGITS
    ]
    return HandPose(
        hand="right",
        seq=0,
        stamp_ns=stamp_ns,
        method="dls",
        wrist=WRIST,
        joints=joints,
        fingers=fingers,
    )


def test_error_is_measured_against_truth_at_the_poses_own_instant():
    metrics = DemoMetrics()
    for index in range(10):
        metrics.add_truth(truth(index, 0.001 * index))
        between_ns = START_NS + index * FRAME_NS + FRAME_NS // 2
        metrics.add_pose(pose(between_ns, 0.001 * (index + 0.5) + 0.003), between_ns + 20_000_000)
    summary = metrics.summary({"fusion": 1})
    assert summary.tip_error_rms_mm == pytest.approx(3.0, abs=0.01)
    assert summary.latency_p50_ms == pytest.approx(20.0)
    assert summary.poses_per_s == pytest.approx(30.0, abs=0.1)
    assert summary.restarts == {"fusion": 1}


def test_without_truth_or_poses_nothing_is_claimed():
    metrics = DemoMetrics()
    assert metrics.summary({}).latency_p50_ms is None
    metrics.add_pose(pose(START_NS, 0.0), START_NS + 1)
    assert metrics.summary({}).tip_error_rms_mm is None


def test_the_text_has_every_measurement_and_names_what_is_missing():
    metrics = DemoMetrics()
    metrics.add_pose(pose(START_NS, 0.0), START_NS + 20_000_000)
    text = summary_text(metrics.summary({"fusion": 2}))
    for part in ("1 in 0.0 s", "p50 20.0 ms", "RMS not measured", "fusion: 2"):
        assert part in text
