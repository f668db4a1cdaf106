"""A hand with a recording's bones is where the recording is, and knows when none fits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rhot.hand import CHAIN_JOINTS, DIGITS, default_hand, forward
from services.simulator.recorded_motion.bones import DrivenHand, driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints, RecordedPoints

RECORDINGS = ("grab", "pinch", "wave", "HandSplay-110fps")


@pytest.mark.parametrize("name", RECORDINGS)
def test_the_model_is_where_the_sensor_saw_the_hand(rhot_data: Path, name: str) -> None:
    """Tips within 0.02 mm, all joints within 0.05, in every frame of every recording."""
    recorded = load_recording(rhot_data / f"hand_motion/leap/{name}.csv")
    assert isinstance(recorded, RecordedJoints)
    driven = driven_hand(recorded)
    assert isinstance(driven, DrivenHand)
    assert driven.gap_m.max() < 2e-5
    for k in range(0, len(driven.times_s), 9):
        joints, _ = forward(
            driven.model, driven.rotations[k], driven.wrist_m[k], driven.angles_rad[k]
        )
        np.testing.assert_allclose(joints[CHAIN_JOINTS], recorded.joints_m[k], atol=5e-5)
        np.testing.assert_allclose(driven.points().points_m[k, 1:], joints[CHAIN_JOINTS[:, 3]])
    limits = driven.model.limits_rad
    assert np.all(driven.angles_rad >= limits[..., 0])
    assert np.all(driven.angles_rad <= limits[..., 1])
    # The sensor's own model, whose DIP is its PIP.
    assert [digit.coupling for digit in driven.model.digits] == pytest.approx([1.0] * 5, abs=0.01)


def _random_hand(hand: str, with_angles: bool) -> tuple[RecordedJoints, np.ndarray]:
    """A hand of the tables that moves through its limits, and its angles (n, 5, 4)."""
    model, rng = default_hand(hand, 0.9), np.random.default_rng(7)
    low, high = model.limits_rad[..., 0], model.limits_rad[..., 1]
    angles = low + (high - low) * rng.uniform(0.05, 0.95, (60, 5, 4))
    joints = np.array(
        [forward(model, np.eye(3), np.zeros(3), row)[0][CHAIN_JOINTS] for row in angles]
    )
    frames = len(angles)
    axes = np.broadcast_to(np.eye(3), (frames, 3, 3))
    recorded = RecordedJoints(
        hand,  # type: ignore[arg-type]
        np.arange(frames) / 60.0,
        joints,
        np.zeros((frames, 3)),
        axes,
        True,
        angles if with_angles else None,
    )
    return recorded, angles


@pytest.mark.parametrize("hand", ["left", "right"])
@pytest.mark.parametrize("with_angles", [True, False])
def test_angles_are_those_that_moved_the_joints(hand: str, with_angles: bool) -> None:
    recorded, angles = _random_hand(hand, with_angles)
    driven = driven_hand(recorded)
    assert isinstance(driven, DrivenHand)
    np.testing.assert_allclose(driven.angles_rad, angles, atol=1e-5)
    assert driven.gap_m.max() < 1e-6
    table = default_hand(hand, 0.9)
    for digit, own in zip(driven.model.digits, table.digits, strict=True):
        np.testing.assert_allclose(digit.base_m, own.base_m, atol=1e-9)
        np.testing.assert_allclose(digit.lengths_m, own.lengths_m, atol=1e-9)


def test_bones_that_stretch_are_none() -> None:
    recorded, _ = _random_hand("right", False)
    stretched = recorded.joints_m.copy()
    stretched[::2, DIGITS.index("ring"), 3] *= 1.05
    found = driven_hand(replace(recorded, joints_m=stretched))
    assert isinstance(found, RecordedPoints)
    np.testing.assert_array_equal(found.points_m[:, 1:], stretched[:, :, 3])
