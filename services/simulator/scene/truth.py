"""What is true at one instant, as a message. Pure."""

from __future__ import annotations

from rhot.geometry.transforms import Array, quaternion_from_rotation
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, HandName
from rhot.messages import FingerAngles, WristPose
from rhot.simulator_messages import HandTruth, ObjectTruth, Truth
from services.simulator.scene.actors import Hand, HandState


def truth_of(
    hands: dict[HandName, Hand],
    states: dict[HandName, HandState],
    things: dict[str, Array],
    stamp_ns: int,
) -> Truth:
    """The truth about hands in these states and objects at these poses T_rig_from_object.

    points_m has all 26 joints.
    """
    return Truth(
        stamp_ns=stamp_ns,
        hands={str(name): _hand(hands[name], state) for name, state in states.items()},
        objects={name: _object(T) for name, T in things.items()},
    )


def _hand(hand: Hand, state: HandState) -> HandTruth:
    positions, _ = hand.joints(state)
    angles = {
        digit: FingerAngles(
            **{"pip": 0.0, **{n: round(float(a), 6) for n, a in zip(names, row, strict=True)}}
        )
        for digit, names, row in zip(DIGITS, DIGIT_ANGLES, state.angles_rad, strict=True)
    }
    return HandTruth(
        points_m={name: vector(positions[i]) for i, name in enumerate(JOINTS)},
        wrist=WristPose(
            position_m=vector(state.wrist_m), orientation_wxyz=_quaternion(state.wrist_rotation)
        ),
        angles_rad=angles,
    )


def _object(T_rig_from_object: Array) -> ObjectTruth:
    return ObjectTruth(
        position_m=vector(T_rig_from_object[:3, 3]),
        orientation_wxyz=_quaternion(T_rig_from_object[:3, :3]),
    )


def vector(values: Array) -> tuple[float, float, float]:
    """A vector (3,) as messages have it, rounded to micrometres (or the like)."""
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z


def _quaternion(rotation: Array) -> tuple[float, float, float, float]:
    w, x, y, z = (round(float(v), 7) for v in quaternion_from_rotation(rotation))
    return w, x, y, z
