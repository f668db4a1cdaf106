"""The ground truth of a scene at one instant, as a message. Pure."""

from __future__ import annotations

from rhot.geometry.transforms import Array, quaternion_from_rotation
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, HandName
from rhot.messages import FingerAngles, WristPose
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.simulator.scene.actors import Hand, HandState


def truth_message(
    hands: dict[HandName, Hand],
    states: dict[HandName, HandState],
    objects: dict[str, Array],
    stamp_ns: int,
) -> Truth:
    """The truth about hands in these states and objects at these poses T_rig_from_object (4, 4).

    points_m has all 26 joints.
    """
    return Truth(
        stamp_ns=stamp_ns,
        hands={str(name): _hand_truth(hands[name], state) for name, state in states.items()},
        objects={name: _object_truth(T) for name, T in objects.items()},
    )


def _hand_truth(hand: Hand, state: HandState) -> HandTruth:
    positions, _ = hand.joints(state)
    angles = {}
    for digit, names, row in zip(DIGITS, DIGIT_ANGLES, state.angles_rad, strict=True):
        rounded = {name: round(float(angle), 6) for name, angle in zip(names, row, strict=True)}
        # The thumb has no middle joint.
        angles[digit] = FingerAngles(**{"pip": 0.0, **rounded})
    return HandTruth(
        points_m={name: rounded_vector(positions[i]) for i, name in enumerate(JOINTS)},
        wrist=WristPose(
            position_m=rounded_vector(state.wrist_m),
            orientation_wxyz=_rounded_quaternion(state.wrist_rotation),
        ),
        angles_rad=angles,
    )


def _object_truth(T_rig_from_object: Array) -> ObjectTruth:
    return ObjectTruth(
        position_m=rounded_vector(T_rig_from_object[:3, 3]),
        orientation_wxyz=_rounded_quaternion(T_rig_from_object[:3, :3]),
    )


def rounded_vector(values: Array) -> tuple[float, float, float]:
    """A vector (3,) as messages have it, rounded to six digits: micrometres of a length in m."""
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z


def _rounded_quaternion(rotation: Array) -> tuple[float, float, float, float]:
    w, x, y, z = (round(float(v), 7) for v in quaternion_from_rotation(rotation))
    return w, x, y, z
