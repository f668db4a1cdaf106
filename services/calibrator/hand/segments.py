"""The prior of an exercise: which angles vary in it, and what the others should be. Pure."""

from __future__ import annotations

import math

import numpy as np

from rhot.hand_exercises import Exercise
from services.calibrator.hand.problem import Segment

# How straight "straight" is: abduction, first, second and last flexion; and the thumb's rest, which
# nobody is told.
_STRAIGHT_DEG, _STRAIGHT_SD_DEG = (0.0, 4.0, 4.0, 0.0), (5.0, 6.0, 5.0, 4.0)
_THUMB_DEG, _THUMB_SD_DEG = (5.0, 0.0, 10.0, 2.0), (10.0, 12.0, 10.0, 8.0)
# The middle finger does not abduct (RHOT section 3.1): its angle's number, and how little.
_MIDDLE_ABDUCTION, _MIDDLE_ABDUCTION_SD_DEG = 8, 0.5
# A varying joint may be anywhere in its range; this only keeps one that nothing shows finite.
# Neighbours follow a little.
FREE_RAD, _FOLLOW_RAD = math.radians(60.0), math.radians(5.0)


def exercise_segment(exercise: Exercise, count: int) -> Segment:
    """The segment of an exercise with so many frames."""
    expected = np.deg2rad(np.concatenate([_THUMB_DEG, *(_STRAIGHT_DEG,) * 4]))
    sd = np.deg2rad(np.concatenate([_THUMB_SD_DEG, *(_STRAIGHT_SD_DEG,) * 4]))
    sd[_MIDDLE_ABDUCTION] = np.deg2rad(_MIDDLE_ABDUCTION_SD_DEG)
    return Segment(exercise.name, count, varying_angles(exercise), expected, sd)


def varying_angles(exercise: Exercise) -> dict[int, float]:
    """Angles (0..19) that change during an exercise and their standard deviation, rad.

    A last joint follows by its coupling.
    """
    if exercise.kind == "spread":
        return dict.fromkeys((4, 12, 16), FREE_RAD)
    column = {"knuckle": 1, "hook": 2, "thumb": 2}.get(exercise.kind)
    if column is None:
        return {}
    angles = {4 * exercise.digit + column: FREE_RAD}
    if exercise.digit > 0:
        neighbours = (exercise.digit - 1, exercise.digit + 1)
        angles |= {4 * row + 1: _FOLLOW_RAD for row in neighbours if 1 <= row <= 4}
    return angles
