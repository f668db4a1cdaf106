"""The messages of a whole rig, straight from a simulated scene: without cameras, errors or delays.

For what shows or hands on messages, and should not pay for making them.
"""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.geometry.transforms import Array, quaternion_from_rotation
from rhot.hand import BASIC_LANDMARKS, JOINT_INDEX, HandName
from rhot.messages import HandPoint, HandPoints, HandPose
from rhot.messages.objects import Contact, Grasp, ObjectContacts, ObjectPose
from services.simulator.scene.actors import Hand, HandState
from services.simulator.scene.scene import Scene
from testing import sample_hands

# A landmark's error: across the cameras' rays, and along them.
_SIGMA_M = (0.0005, 0.0005, 0.0025)
# Skin this near to a surface touches it.
_TOUCH_M = 1e-3


def hand_pose(name: HandName, hand: Hand, state: HandState, stamp_ns: int, seq: int) -> HandPose:
    """A hand of the scene, as a solver tells it: wrist and tips measured, the rest solved."""
    pose = sample_hands.hand_pose(
        hand.model,
        state.wrist_rotation,
        state.wrist_m,
        state.angles_rad,
        stamp_ns=stamp_ns,
        seq=seq,
    )
    joints = [
        msgspec.structs.replace(joint, source="measured")
        if joint.name in BASIC_LANDMARKS
        else joint
        for joint in pose.joints
    ]
    return msgspec.structs.replace(pose, hand=name, joints=joints)


def hand_points(pose: HandPose) -> HandPoints:
    """Its painted landmarks, where their joints are."""
    points = [
        HandPoint(
            name=name,
            position_m=pose.joints[JOINT_INDEX[name]].position_m,
            sigma_m=_SIGMA_M,
            cameras=["left", "right"],
            source="measured",
        )
        for name in BASIC_LANDMARKS
    ]
    return HandPoints(hand=pose.hand, seq=pose.seq, stamp_ns=pose.stamp_ns, points=points)


def object_messages(
    scene: Scene, t_s: float, stamp_ns: int, seq: int
) -> list[tuple[ObjectPose, ObjectContacts]]:
    """Each object of the scene, and what touches it."""
    truth = scene.truth(t_s, stamp_ns)
    messages = []
    for item in scene.objects:
        one = truth.objects[item.name]
        pose = ObjectPose(
            object=item.name,
            serial=item.table.serial,
            seq=seq,
            stamp_ns=stamp_ns,
            position_m=one.position_m,
            orientation_wxyz=one.orientation_wxyz,
            velocity_m_s=(0.0, 0.0, 0.0),
            angular_velocity_rad_s=(0.0, 0.0, 0.0),
            tracking="ok",
            registered=True,
        )
        contacts = [
            Contact(
                hand=part.partition(".")[0],  # type: ignore[arg-type]
                part=part.partition(".")[2],  # type: ignore[arg-type]
                distance_m=gap,
                sigma_m=0.001,
                point_m=_tip(truth.hands[part.partition(".")[0]].points_m, part),
                touching=gap < _TOUCH_M,
                since_ns=stamp_ns if gap < _TOUCH_M else 0,
            )
            for part, gap in one.contacts.items()
        ]
        held = [c.part for c in contacts if c.touching and c.hand == one.held_by]
        grasps = [Grasp(hand=one.held_by, parts=held, since_ns=stamp_ns)] if one.held_by else []
        told = ObjectContacts(
            object=item.name, seq=seq, stamp_ns=stamp_ns, contacts=contacts, grasps=grasps
        )
        messages.append((pose, told))
    return messages


def _tip(points_m: dict[str, tuple[float, float, float]], part: str) -> tuple[float, float, float]:
    name = part.partition(".")[2]
    return points_m["palm" if name == "palm" else f"{name}_tip"]


def _vec3(values: Array) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).tolist()
    return x, y, z


def _wxyz(rotation: Array) -> tuple[float, float, float, float]:
    w, x, y, z = quaternion_from_rotation(rotation).tolist()
    return w, x, y, z
