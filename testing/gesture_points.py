"""The simulator's gestures as points: hands that move as joints let them. Pure."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, HandModel, forward, landmark_point
from services.simulator.hands.gestures import MOTIONS
from testing.synthetic_points import Motion

# Before a gesture's name: its hand turns and sways by 12 cm as well.
SWAYING = "swaying "
# Seeds from here on are for tuning on.
FIRST_TUNING_SEED = 11
_HELD_UP = rotation_from_vector(np.array([1.2, 0.3, 0.1]))
# Where the wrist is; of one that sways, such that no tip leaves a picture.
_PLACE_M, _SWAYING_PLACE_M = np.array([0.03, 0.03, 0.55]), np.array([0.03, -0.09, 0.65])
# How the swaying hand turns and shifts: rad and m, rad/s.
_TURN_RAD, _TURN_RAD_S = 0.5, np.array([3.1, 2.3, 2.7])
_SHIFT_M, _SHIFT_RAD_S = 0.12, np.array([2.9, 3.7, 2.1])

Joints = tuple[Array, Array]  # positions (26, 3), rotations (26, 3, 3)


def hand_at(name: str, model: HandModel, seed: int) -> Callable[[float], Joints]:
    """Joints of a gesture at a time (s)."""
    sways = name.startswith(SWAYING)
    gesture = MOTIONS[name.removeprefix(SWAYING)](model, seed)
    place_m = _SWAYING_PLACE_M if sways else _PLACE_M
    # Gestures that know no seed are elsewhere in their course.
    later_s = 0.37 * seed if seed >= FIRST_TUNING_SEED else 0.0
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (2, 3))

    @cache
    def at(t_s: float) -> Joints:
        angles, turn, shift, *_ = gesture(t_s + later_s)
        if sways:
            turn = _TURN_RAD * np.sin(_TURN_RAD_S * t_s + phase[0])
            shift = _SHIFT_M * np.sin(_SHIFT_RAD_S * t_s + phase[1])
        rotation = _HELD_UP @ rotation_from_vector(np.asarray(turn))
        return forward(model, rotation, place_m + shift, angles)

    return at


def motion_of(model: HandModel, at: Callable[[float], Joints]) -> Motion:
    """The painted landmarks of a hand whose joints are known at any time, as SyntheticRig's frames
    ask for them.
    """

    def motion(times_s: Array) -> Array:
        times = np.broadcast_to(times_s.reshape(len(times_s), -1), (len(times_s), 6)).tolist()
        return np.array(
            [
                [
                    landmark_point(model, mark, *at(t))
                    for mark, t in zip(BASIC_LANDMARKS, row, strict=True)
                ]
                for row in times
            ]
        )

    return motion
