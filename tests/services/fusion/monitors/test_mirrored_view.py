"""Mirrored views are named, sound ones never are."""

from __future__ import annotations

import msgspec
import pytest

from rhot.messages import MarkerFrame
from services.fusion.step import FusionStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands


def flipped(frame: MarkerFrame, axis: str) -> MarkerFrame:
    change = {"x": lambda m: {"x_px": 639.0 - m.x_px}, "y": lambda m: {"y_px": 479.0 - m.y_px}}[
        axis
    ]
    return msgspec.structs.replace(
        frame, markers=[msgspec.structs.replace(m, **change(m)) for m in frame.markers]
    )


def run(given, setup: SyntheticRig) -> FusionStep:
    step = FusionStep(setup.config(), setup.rig(), point_hands())
    for frame in given:
        step.step(frame)
    return step


@pytest.mark.parametrize(("axis", "named"), [("x", "horizontally"), ("y", "vertically")])
@pytest.mark.parametrize("speed_m_s", [0.0, 0.5])
def test_a_mirrored_view_is_named_within_two_seconds(axis, named, speed_m_s):
    setup = SyntheticRig()
    given = [
        flipped(frame, axis) if frame.camera == "right" else frame
        for frame in frames(setup, MovingHand(speed_m_s=speed_m_s), 2.0)
    ]
    assert run(given, setup).mirrors.mirrored == {("left", "right"): named}


def test_it_is_taken_back_when_the_setting_is_right_again():
    setup = SyntheticRig()
    given = frames(setup, MovingHand(), 6.0)
    half = [
        flipped(frame, "x") if frame.camera == "left" and k < len(given) / 2 else frame
        for k, frame in enumerate(given)
    ]
    assert run(half[: len(given) // 2], setup).mirrors.mirrored
    assert not run(half, setup).mirrors.mirrored


@pytest.mark.parametrize(
    "setup",
    [SyntheticRig(), SyntheticRig(cameras=3), SyntheticRig(baseline_m=0.3, toe_in_rad=0.2)],
    ids=["pair", "three", "wide"],
)
def test_sound_views_are_not(setup):
    step = FusionStep(setup.config(), setup.rig(), point_hands())
    for frame in frames(setup, MovingHand(speed_m_s=0.8), 6.0):
        step.step(frame)
        assert not step.mirrors.mirrored
