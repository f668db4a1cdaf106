"""The exercises of `rhot calibrate hand` as a simulated person does them. Pure.

They follow the guide's timing, but are never quite as asked: "straight" is off by a few degrees,
differently in every exercise, held fingers drift, and neighbours follow the finger that bends.
"""

from __future__ import annotations

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import HandModel
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES, Exercise
from services.simulator.hands.gestures import Gesture, LimitScaling, Motion, bump, smootherstep

# Standard deviation of a straight finger per exercise (abduction, two flexions), and of the resting
# thumb.
_FINGER_SIGMA_DEG, _THUMB_SIGMA_DEG = (3.0, 3.5, 3.5), (4.0, 5.0, 5.0)
# How far neighbours follow (enslaving), deg: finger independence is limited (Haeger-Ross & Schieber
# 2000), most for ring and little finger.
_ENSLAVING_DEG = (2.0, 8.0)
# From one exercise to the next the hand changes over within this time, so that nothing jumps.
_CHANGE_S = 0.4
_ZERO = np.zeros(3)


def guided(model: HandModel, seed: int) -> Motion:
    """The exercises of rhot/hand_exercises.py, over and over; each bends twice."""
    scale, rng = LimitScaling(model), np.random.default_rng([seed, 13])
    rest = np.zeros((len(EXERCISES), 5, 4))  # deg
    bend = np.zeros((len(EXERCISES), 5, 4))  # deg
    for number, exercise in enumerate(EXERCISES):
        rest[number] = _rest_deg(rng)
        bend[number] = _bend_deg(exercise, rng)

    def at(t_s: float) -> Gesture:
        phase = t_s % CYCLE_S
        number, within = int(phase // EXERCISE_S) % len(EXERCISES), phase % EXERCISE_S
        ease = smootherstep(within / _CHANGE_S)
        held = rest[number - 1] + ease * (rest[number] - rest[number - 1])
        stroke = bump(2.0 * within / EXERCISE_S % 1.0)
        drift = np.zeros((5, 4))
        drift[:, 1] = 0.7 + 0.7 * np.sin(2.0 * t_s + np.arange(5))
        return Gesture(scale(held + stroke * bend[number] + drift), _ZERO, _ZERO)

    return at


def _rest_deg(rng: np.random.Generator) -> Array:
    """A hand held open, as far as the person manages; (5, 4)."""
    rest = np.zeros((5, 4))
    rest[0, :3] = np.array([5.0, 0.0, 10.0]) + np.clip(rng.normal(0.0, _THUMB_SIGMA_DEG), -8.0, 8.0)
    # Never beyond the limits, together with the bends below.
    rest[1:, :3] = np.clip(
        np.array([0.0, 4.0, 4.0]) + rng.normal(0.0, _FINGER_SIGMA_DEG, (4, 3)),
        (-3.0, 0.0, 0.0),
        (3.0, 7.0, 12.0),
    )
    return rest


def _bend_deg(exercise: Exercise, rng: np.random.Generator) -> Array:
    """How far each joint bends at most in an exercise, from rest; (5, 4)."""
    bend = np.zeros((5, 4))
    row, share = exercise.digit, rng.uniform(0.85, 0.97)
    if exercise.kind == "knuckle":
        bend[row, 1] = 84.0 * share
    elif exercise.kind == "hook":
        bend[row, 2] = 100.0 * share
    elif exercise.kind == "thumb":
        bend[0, 2] = 38.0 * share
    elif exercise.kind == "spread":
        bend[:, 0] = (12.0, 10.0, 0.0, -9.0, -12.0)
    elif exercise.kind == "fist":
        bend[:] = np.array([[5, 6, 14, 0], *([0, 78, 96, 0],) * 4]) * share
    for neighbour in (row - 1, row + 1):
        if row > 0 and 1 <= neighbour <= 4:
            bend[neighbour, 1:3] = rng.uniform(*_ENSLAVING_DEG, 2)
    return bend
