"""A camera that was moved after its calibration is reported, where the epipolar errors show it.

A rig as it was calibrated never is.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from rhot.geometry.transforms import rotation_x, rotation_z, transform
from services.fusion.step import FusionStep
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands

# Pitch of .5 deg moves the whole view by 4.6 px; roll of 3 deg its left and right halves against
# each other.
BUMPS = {"pitch": rotation_x(np.deg2rad(0.5)), "roll": rotation_z(np.deg2rad(3.0))}


class Bumped(SyntheticRig):
    """The pictures are taken by a rig whose right camera was turned.

    Fusion works with the calibration of before.
    """

    def __init__(self, turn, **fields):
        super().__init__(**fields)
        object.__setattr__(self, "turn", turn)

    def rig(self):
        cameras = super().rig()
        right = cameras["right"]
        turned = right.T_rig_from_camera @ transform(self.turn, np.zeros(3))
        return cameras | {"right": dataclasses.replace(right, T_rig_from_camera=turned)}


def seconds_until_reported(setup: SyntheticRig, path: MovingHand, seconds: float) -> float | None:
    sound = SyntheticRig()
    step = FusionStep(sound.config(), sound.rig(), point_hands())
    first_ns = None
    for frame in frames(setup, path, seconds):
        first_ns = frame.stamp_ns if first_ns is None else first_ns
        step.step(frame)
        if step.clocks.moved_px:
            assert list(step.clocks.moved_px) == [("left", "right")]
            return (frame.stamp_ns - first_ns) * 1e-9
    return None


@pytest.mark.parametrize("bump", BUMPS)
@pytest.mark.parametrize("speed_m_s", [0.0, 0.5])
def test_a_bumped_camera_is_reported_within_seconds(bump, speed_m_s):
    found = seconds_until_reported(Bumped(BUMPS[bump]), MovingHand(speed_m_s=speed_m_s), 6.0)
    assert found is not None
    assert 0.5 < found < 5.0


@pytest.mark.parametrize("error_s", [0.0005, 0.005])
def test_a_sound_rig_is_not_even_with_clocks_off(error_s):
    setup = SyntheticRig(clock_error_s=error_s, clock_sigma_s=2 * error_s)
    assert seconds_until_reported(setup, MovingHand(speed_m_s=0.8), 8.0) is None
