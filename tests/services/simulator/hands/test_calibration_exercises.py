"""The guided scene follows the guide, smoothly and inside the limits."""

from __future__ import annotations

import numpy as np

from rhot.hand import default_hand
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from services.simulator.hands.calibration_exercises import guided


def test_it_stays_in_the_limits_and_does_not_jump() -> None:
    model = default_hand("right")
    for seed in range(4):
        motion = guided(model, seed)
        angles = np.array([motion(t).angles_rad for t in np.arange(-1.0, CYCLE_S + 1.0, 0.02)])
        assert np.all(angles >= model.limits_rad[..., 0] - 1e-12)
        assert np.all(angles <= model.limits_rad[..., 1] + 1e-12)
        # 100 deg there and back in 2 s, quintic: at most 5.6 deg in 20 ms.
        assert np.rad2deg(np.abs(np.diff(angles, axis=0))).max() < 8.0


def test_the_asked_joint_moves_most() -> None:
    motion = guided(default_hand("right"), 1)
    for number, exercise in enumerate(EXERCISES):
        if exercise.kind not in ("knuckle", "hook"):
            continue
        times = EXERCISE_S * number + np.linspace(0.5, EXERCISE_S - 0.2, 40)
        moved = np.ptp(np.array([motion(t).angles_rad for t in times]), axis=0)[:, 1:3]
        assert np.unravel_index(moved.argmax(), (5, 2)) == (
            exercise.digit,
            0 if exercise.kind == "knuckle" else 1,
        )
