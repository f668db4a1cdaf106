"""The guided recording as a simulated person does it: to the guide's pace, but never quite as
asked. Pure.

"Straight" is off by a few degrees, differently in every exercise; held fingers drift, neighbours
follow the one that bends.
"""

from __future__ import annotations

import numpy as np

from rhot.hand import HandModel
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from services.simulator.scene.gestures import Fitted, Gesture, Motion, bump

# Standard deviation of "straight" per exercise (abduction, two flexions), and of the thumb's rest.
_OFF_DEG, _THUMB_OFF_DEG = (3.0, 3.5, 3.5), (4.0, 5.0, 5.0)
# How far neighbours follow, deg: finger independence is limited (Haeger-Ross & Schieber 2000),
# least for ring and little finger.
_FOLLOW_DEG = (2.0, 8.0)
_NO = np.zeros(3)


def guided(model: HandModel, seed: int) -> Motion:
    """The exercises of rhot/hand_exercises.py, over and over; each bends twice."""
    fit, rng = Fitted(model), np.random.default_rng([seed, 13])
    rest, bend = np.zeros((len(EXERCISES), 5, 4)), np.zeros((len(EXERCISES), 5, 4))
    for number, exercise in enumerate(EXERCISES):
        rest[number, 0, :3] = np.array([5.0, 0.0, 10.0]) + np.clip(
            rng.normal(0.0, _THUMB_OFF_DEG), -8.0, 8.0
        )
        # Never beyond the limits, together with the bends below.
        rest[number, 1:, :3] = np.clip(
            np.array([0.0, 4.0, 4.0]) + rng.normal(0.0, _OFF_DEG, (4, 3)),
            (-3.0, 0.0, 0.0),
            (3.0, 7.0, 12.0),
        )
        row, top = exercise.digit, rng.uniform(0.85, 0.97)
        if exercise.kind == "knuckle":
            bend[number, row, 1] = 84.0 * top
        elif exercise.kind == "hook":
            bend[number, row, 2] = 100.0 * top
        elif exercise.kind == "thumb":
            bend[number, 0, 2] = 38.0 * top
        elif exercise.kind == "spread":
            bend[number, :, 0] = (12.0, 10.0, 0.0, -9.0, -12.0)
        elif exercise.kind == "fist":
            bend[number] = np.array([[5, 6, 14, 0], *([0, 78, 96, 0],) * 4]) * top
        for near in (row - 1, row + 1):
            if row > 0 and 1 <= near <= 4:
                bend[number, near, 1:3] = rng.uniform(*_FOLLOW_DEG, 2)

    def at(t_s: float) -> Gesture:
        phase = t_s % CYCLE_S
        number, within = int(phase // EXERCISE_S) % len(EXERCISES), phase % EXERCISE_S
        # Change over within .4 s around the boundary, so that nothing jumps.
        change = min(1.0, within / 0.4)
        ease = change * change * change * (10.0 + change * (6.0 * change - 15.0))
        held = rest[number - 1] + ease * (rest[number] - rest[number - 1])
        stroke = bump(2.0 * within / EXERCISE_S % 1.0)
        drift = np.zeros((5, 4))
        drift[:, 1] = 0.7 + 0.7 * np.sin(2.0 * t_s + np.arange(5))
        return Gesture(fit(held + stroke * bend[number] + drift), _NO, _NO)

    return at
