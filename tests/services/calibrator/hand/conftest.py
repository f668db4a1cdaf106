"""A guided recording, and random motion, of a hand that is not the tables', as noisy points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import HandModel, HandName, default_hand
from rhot.hand_exercises import CYCLE_S
from rhot.messages import HandPoints
from services.simulator.hands.calibration_exercises import guided
from services.simulator.hands.gestures import MOTIONS
from services.simulator.hands.involuntary_motion import InvoluntaryMotion
from testing.synthetic_hands import hand_message, noisy_points, with_bone_factors, wrist_rotation

_GUIDED_FPS, _RANDOM_FPS = 15.0, 30.0
_WRIST_M = np.array([0.0, 0.0, 0.5])


def _other(hand: HandName, factors: tuple[float, ...]) -> HandModel:
    return with_bone_factors(default_hand(hand), np.repeat(np.array(factors)[:, None], 4, axis=1))


def _guided(model: HandModel, begin_s: float = 0.0, still: bool = False) -> list[HandPoints]:
    random, unrest, motion = np.random.default_rng(5), InvoluntaryMotion(5), guided(model, 5)
    messages = []
    for frame in range(int(CYCLE_S * _GUIDED_FPS)):
        time_s = frame / _GUIDED_FPS
        turn, shift = unrest(time_s)
        R = rotation_from_vector(np.array([1.2, 0.3, 0.1])) @ rotation_from_vector(turn)
        angles_rad = motion(1.0 if still else time_s - begin_s).angles_rad
        points = noisy_points(model, R, _WRIST_M + shift, angles_rad, random)
        messages.append(hand_message(model, frame, time_s, points))
    return messages


def _random(model: HandModel, frames: int, seed: int) -> list[tuple[HandPoints, Array]]:
    random, unrest, motion = (
        np.random.default_rng(seed),
        InvoluntaryMotion(seed),
        MOTIONS["random"](model, seed),
    )
    recorded = []
    for frame in range(frames):
        time_s = frame / _RANDOM_FPS
        gesture, (sway, shift) = motion(time_s), unrest(time_s)
        R, position_m = wrist_rotation(gesture, sway), _WRIST_M + gesture.shift_m + shift
        points = noisy_points(model, R, position_m, gesture.angles_rad, random)
        # A second and more between two recordings: a solver begins anew.
        message = hand_message(model, frame, 1000.0 * seed + time_s, points)
        recorded.append((message, gesture.angles_rad))
    return recorded


@pytest.fixture(scope="session")
def other_hand() -> Callable[[HandName, tuple[float, ...]], HandModel]:
    """The tables' hand with every digit, and its metacarpal, longer by a factor."""
    return _other


@pytest.fixture(scope="session")
def guided_messages() -> Callable[..., list[HandPoints]]:
    """One pass of the guide with 1 mm noise.

    begin_s: cut so that the exercises begin later; still: nothing moves.
    """
    return _guided


@pytest.fixture(scope="session")
def random_motion() -> Callable[[HandModel, int, int], list[tuple[HandPoints, Array]]]:
    """So many frames of random motion with 1 mm noise, and the true angles (5, 4) of each."""
    return _random
