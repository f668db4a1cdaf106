"""The ground truth of a scene at one instant, as a message. Pure."""

from __future__ import annotations

from typing import Literal

from rhot.geometry.transforms import Array, inverse, quaternion_from_rotation
from rhot.hand import DIGIT_ANGLES, DIGITS, JOINTS, HandName
from rhot.hand_skin import PARTS, Skin
from rhot.messages import FingerAngles, WristPose
from rhot.messages.simulator import HandTruth, ObjectTruth, Truth
from services.simulator.hands.holds import part_distances, skin_at
from services.simulator.scene.actors import Hand, HandState, SceneObject

# Skin this near to a surface touches it: it is pressed in by 0.1 mm, and numbers are rounded.
_TOUCH_M = 3e-4


def truth_message(
    hands: dict[HandName, Hand],
    states: dict[HandName, HandState],
    objects: list[SceneObject],
    poses: dict[str, Array],
    stamp_ns: int,
) -> Truth:
    """The truth about hands in these states and objects at these poses T_rig_from_object (4, 4).

    points_m has all 26 joints.
    """
    joints = {name: hands[name].joints(state) for name, state in states.items()}
    skins = {name: skin_at(hands[name].model, *found) for name, found in joints.items()}
    return Truth(
        stamp_ns=stamp_ns,
        hands={str(name): _hand_truth(state, joints[name][0]) for name, state in states.items()},
        objects={item.name: _object_truth(item, poses[item.name], skins) for item in objects},
    )


def _hand_truth(state: HandState, positions: Array) -> HandTruth:
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


def _object_truth(
    item: SceneObject, T_rig_from_object: Array, skins: dict[HandName, Skin]
) -> ObjectTruth:
    contacts: dict[str, float] = {}
    held_by: Literal["", "left", "right"] = ""
    if item.solid is not None:
        for name, skin in skins.items():
            gaps = part_distances(item.solid, skin, inverse(T_rig_from_object))
            contacts |= {
                f"{name}.{part}": round(float(gap), 6)
                for part, gap in zip(PARTS, gaps, strict=True)
            }
            if _holds(gaps):
                held_by = name
    return ObjectTruth(
        position_m=rounded_vector(T_rig_from_object[:3, 3]),
        orientation_wxyz=_rounded_quaternion(T_rig_from_object[:3, :3]),
        contacts=contacts,
        held_by=held_by,
    )


def _holds(gaps: Array) -> bool:
    """Whether fingers press an object against the thumb or the palm; gaps (6,) as of PARTS."""
    touching = gaps < _TOUCH_M
    return bool(touching[1:5].any() and (touching[0] or touching[5]))


def rounded_vector(values: Array) -> tuple[float, float, float]:
    """A vector (3,) as messages have it, rounded to six digits: micrometres of a length in m."""
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z


def _rounded_quaternion(rotation: Array) -> tuple[float, float, float, float]:
    w, x, y, z = (round(float(v), 7) for v in quaternion_from_rotation(rotation))
    return w, x, y, z
