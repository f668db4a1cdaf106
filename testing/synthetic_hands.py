"""Hands of known bones in motion, as the HandPoints that fusion would publish of them, with white
noise and without any picture.

What the tests and benchmarks of the hand calibration measure with.
"""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector
from rhot.hand import (
    BASIC_LANDMARKS,
    HandModel,
    HandName,
    default_hand,
    forward,
    landmark_point,
)
from rhot.messages import HandPoint, HandPoints
from services.simulator.hands.gestures import Gesture

# Noise of each coordinate, one standard deviation.
NOISE_M = 1e-3
# The resting wrist in the rig frame.
_START = rotation_from_vector(np.array([1.2, 0.3, 0.1]))


def known_hand(hand: HandName = "right", scale: float = 1.0) -> HandModel:
    """The tables' hand as if its bones were known exactly: the solver trusts it."""
    return msgspec.structs.replace(default_hand(hand, scale), origin="simulated")


def with_bone_factors(model: HandModel, factors: Array) -> HandModel:
    """The hand with every bone longer by a factor of its own.

    factors (5, 4): three bones of each digit and, last, its metacarpal.
    """
    digits = []
    for digit, own in zip(model.digits, factors, strict=True):
        start = np.array(digit.metacarpal_m)
        base = start + own[3] * (np.array(digit.base_m) - start)
        lengths = own[:3] * np.array(digit.lengths_m)
        digits.append(
            msgspec.structs.replace(
                digit, base_m=tuple(base.tolist()), lengths_m=tuple(lengths.tolist())
            )
        )
    return msgspec.structs.replace(model, digits=tuple(digits))


def wrist_rotation(gesture: Gesture, sway: Array) -> Array:
    """The wrist in the rig frame (3, 3) during a gesture, turned further by sway (3,) rad."""
    return _START @ rotation_from_vector(gesture.turn_rad) @ rotation_from_vector(sway)


def noisy_points(
    model: HandModel,
    rotation: Array,
    position_m: Array,
    angles_rad: Array,
    random: np.random.Generator,
) -> list[HandPoint]:
    """Wrist and finger tips of a hand's pose, measured with NOISE_M."""
    joints = forward(model, rotation, position_m, angles_rad)
    points = []
    for name in BASIC_LANDMARKS:
        measured = landmark_point(model, name, *joints) + random.normal(0.0, NOISE_M, 3)
        points.append(
            HandPoint(
                name=name,
                position_m=tuple(measured.tolist()),
                sigma_m=(NOISE_M,) * 3,
                cameras=["left", "right"],
                source="measured",
            )
        )
    return points


def hand_message(
    model: HandModel, frame: int, time_s: float, points: list[HandPoint]
) -> HandPoints:
    """One message, time_s after the recording's beginning."""
    stamp_ns = 10**18 + round(1e9 * time_s)
    return HandPoints(hand=model.hand, seq=frame, stamp_ns=stamp_ns, points=points)
