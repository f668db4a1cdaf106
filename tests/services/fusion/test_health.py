"""Fusion's figures for health."""

from __future__ import annotations

import pytest

from services.fusion.health import HealthFigures
from services.fusion.step import FusionStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands

RIG = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)


def test_figures_of_a_second():
    step = FusionStep(RIG.config(), RIG.rig(), point_hands())
    values: dict[str, float] = {}
    health = HealthFigures(step, values, 100.0)
    for number, frame in enumerate(frames(RIG, MovingHand(), 2.0), start=1):
        step.step(frame)
        health.note_frame(2e-4)
        if number % 60 == 0:
            health.renew(100.0 + number / 60.0)
    assert values["observations_hz"] == pytest.approx(360.0, rel=0.05)
    assert values["step_p50_us"] == pytest.approx(200.0)
    assert values["epipolar_px"] < 0.2
    assert {"late_left_ms", "late_right_ms", "height_left_right_px"} <= values.keys()
    assert [values[name] for name in ("dropped", "incoherent", "moved_pairs")] == [0.0, 0.0, 0.0]
    assert values["late_poses"] == values["frames_unlearned"] == 0.0
    assert values["started"] == 6.0


def test_a_second_without_frames_says_so():
    values: dict[str, float] = {}
    HealthFigures(FusionStep(RIG.config(), RIG.rig(), point_hands()), values, 0.0).renew(1.0)
    assert values["observations_hz"] == 0.0
    assert "step_p50_us" not in values
