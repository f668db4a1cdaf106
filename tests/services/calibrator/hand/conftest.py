"""A guided recording of a hand that is not the tables', as points with noise."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from rhot.geometry.transforms import rotation_from_vector
from rhot.hand import BASIC_LANDMARKS, HandModel, HandName, default_hand, forward, landmark_point
from rhot.hand_exercises import CYCLE_S
from rhot.messages import HandPoint, HandPoints
from services.simulator.scene.calibration_exercises import guided
from services.simulator.scene.involuntary_motion import InvoluntaryMotion

_FPS = 15.0


def _other(hand: HandName, factors: tuple[float, ...]) -> HandModel:
    digits = []
    for digit, factor in zip(default_hand(hand).digits, factors, strict=True):
        start = np.array(digit.metacarpal_m)
        base = start + factor * (np.array(digit.base_m) - start)
        digits.append(
            msgspec.structs.replace(
                digit,
                base_m=tuple(base.tolist()),
                lengths_m=tuple((factor * np.array(digit.lengths_m)).tolist()),
            )
        )
    return msgspec.structs.replace(default_hand(hand), digits=tuple(digits))


def _messages(model: HandModel, begin_s: float = 0.0, still: bool = False) -> list[HandPoints]:
    rng, unrest, motion, told = np.random.default_rng(5), InvoluntaryMotion(5), guided(model, 5), []
    for frame in range(int(CYCLE_S * _FPS)):
        t_s = frame / _FPS
        turn, shift = unrest(t_s)
        R = rotation_from_vector(np.array([1.2, 0.3, 0.1])) @ rotation_from_vector(turn)
        joints = forward(
            model,
            R,
            np.array([0.0, 0.0, 0.5]) + shift,
            motion(1.0 if still else t_s - begin_s).angles_rad,
        )
        points = [
            HandPoint(
                name=name,
                position_m=tuple(
                    (landmark_point(model, name, *joints) + rng.normal(0.0, 1e-3, 3)).tolist()
                ),
                sigma_m=(1e-3,) * 3,
                cameras=["left", "right"],
                source="measured",
            )
            for name in BASIC_LANDMARKS
        ]
        told.append(
            HandPoints(
                hand=model.hand, seq=frame, stamp_ns=10**18 + round(1e9 * t_s), points=points
            )
        )
    return told


@pytest.fixture(scope="session")
def other_hand() -> Callable[[HandName, tuple[float, ...]], HandModel]:
    """The tables' hand with every digit, and its metacarpal, longer by a factor."""
    return _other


@pytest.fixture(scope="session")
def guided_messages() -> Callable[..., list[HandPoints]]:
    """One pass of the guide with 1 mm noise; begin_s: cut so that the exercises begin later.

    Still: nothing moves.
    """
    return _messages
