"""Fusion's figures for health, and its errors, each reported once."""

from __future__ import annotations

import msgspec
import pytest

from services.fusion.health import HealthFigures
from services.fusion.step import FusionStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands

RIG = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)


def run(given, seconds_apart: float = 1.0 / 60.0):
    """Values and errors after all frames."""
    step = FusionStep(RIG.config(), RIG.rig(), point_hands())
    values, errors, now_s = {}, [], 100.0
    health = HealthFigures(step, values, errors.append, now_s)
    for frame in given:
        step.step(frame)
        now_s += seconds_apart
        health.note_frame(2e-4, now_s)
    return values, errors


def lifted(frame, height_px: float):
    """The right camera's markers, so much lower in the image."""
    if frame.camera != "right":
        return frame
    markers = [msgspec.structs.replace(m, y_px=m.y_px + height_px) for m in frame.markers]
    return msgspec.structs.replace(frame, markers=markers)


def test_figures_are_renewed_once_a_second():
    given = frames(RIG, MovingHand(), 3.1)
    assert run(given[:50])[0] == {}
    values, errors = run(given)
    assert errors == []
    assert values["observations_hz"] == pytest.approx(360.0, rel=0.05)
    assert values["step_p50_us"] == pytest.approx(200.0)
    assert values["epipolar_px"] < 0.2
    assert {"late_left_ms", "late_right_ms", "height_left_right_px"} <= values.keys()
    assert [values[name] for name in ("dropped", "incoherent", "moved_pairs")] == [0.0, 0.0, 0.0]
    assert values["started"] == 6.0


def test_a_refusal_is_an_error_once_and_a_figure_each_time():
    stranger = msgspec.structs.replace(frames(RIG, MovingHand(), 0.1)[0], camera="door")
    values, errors = run([stranger] * 70)
    assert len(errors) == 1
    assert "rig.toml does not name" in errors[0]
    assert values["frames_unknown_camera"] > 50.0


def test_a_bumped_camera_is_reported_once():
    values, errors = run([lifted(frame, 8.0) for frame in frames(RIG, MovingHand(), 6.0)])
    assert values["moved_pairs"] == 1.0
    assert len(errors) == 1
    assert "left and right differ by 7." in errors[0]
    assert "`rhot calibrate stereo`" in errors[0]


def test_a_mirrored_view_is_reported_once():
    def mirrored(frame):
        if frame.camera != "right":
            return frame
        markers = [msgspec.structs.replace(m, x_px=639.0 - m.x_px) for m in frame.markers]
        return msgspec.structs.replace(frame, markers=markers)

    values, errors = run([mirrored(frame) for frame in frames(RIG, MovingHand(), 4.0)])
    assert values["mirrored_pairs"] == 1.0
    assert ["mirror images" in error and "horizontally" in error for error in errors].count(
        True
    ) == 1
