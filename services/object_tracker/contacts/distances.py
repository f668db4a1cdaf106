"""How far each part of a hand is from an object's surface, and how sure that is. Pure.

The skin is that of rhot/hand_skin.py, made anew of the joints of a HandPose. A distance's sigma is
along the surface's normal: where the wrist is and how it is turned, a finger's angles, what its
marker was off, and the same of the object.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rhot.geometry.solids import Solid, capsule_distance
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import CHAIN_JOINTS, JOINT_INDEX
from rhot.hand_skin import PARTS, Skin, SkinPart, skin_of
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose

# Where senders know no sigma, which rhot's own solver and object tracker do: round numbers, not
# measured, of the size that simulated hands and a Vive tracker about a registration of 1 mm have.
_WRIST_M, _WRIST_RAD = 0.002, math.radians(1.5)
_FINGER_RAD = math.radians(3.0)
_OBJECT_M, _OBJECT_RAD = 0.0015, math.radians(0.3)
# Of a vector's length, that along one direction.
_ONE_AXIS = 1.0 / math.sqrt(3.0)
_WRIST = JOINT_INDEX["wrist"]


# Nothing further away is about to be touched; distances to all objects of a room would cost more
# than tracking them does.
NEAR_M = 0.3
# A finger tip that was seen is where it was seen: along one direction, as rendered hands have it.
_TIP_M = 0.0012


@dataclass(frozen=True, eq=False)
class PartDistance:
    """One part of a hand and an object, at one instant; in the rig frame.

    normal points out of the object, at point_m. predicted: nothing of that part was seen.
    """

    part: SkinPart
    distance_m: float
    sigma_m: float
    point_m: Array  # (3,)
    normal: Array  # (3,)
    predicted: bool


@dataclass(frozen=True, eq=False)
class SeenHand:
    """A hand's pose, and its skin in the rig frame."""

    pose: HandPose
    positions: Array  # (26, 3)
    skin: Skin


def seen_hand(pose: HandPose) -> SeenHand:
    """The skin of a pose, to be measured to many objects."""
    positions = np.array([joint.position_m for joint in pose.joints])
    rotations = _rotations(np.array([joint.orientation_wxyz for joint in pose.joints]))
    radii = np.array([joint.radius_m for joint in pose.joints])
    side = 1.0 if pose.hand == "right" else -1.0
    return SeenHand(pose, positions, skin_of(positions, rotations, radii, side))


def is_near(hand: SeenHand, pose: ObjectPose, solid: Solid) -> bool:
    """Whether the hand may be within NEAR_M of the object."""
    away = np.linalg.norm(hand.skin.ends_m - np.array(pose.position_m), axis=2) - hand.skin.radii_m
    return bool(away.min() <= solid.reach_m + NEAR_M)


def part_distances(seen: SeenHand, pose: ObjectPose, solid: Solid) -> list[PartDistance]:
    """All parts, in the order of PARTS; the object's pose is at the hand's stamp."""
    hand, skin = seen.pose, seen.skin
    R, origin = rotation_from_quaternion(pose.orientation_wxyz), np.array(pose.position_m)
    found = capsule_distance(solid, (skin.ends_m - origin) @ R, skin.radii_m)
    result = []
    for row, part in enumerate(PARTS):
        own = np.flatnonzero(skin.part == row)
        nearest = own[np.argmin(found.distance_m[own])]
        point = origin + R @ found.point_m[nearest]
        result.append(
            PartDistance(
                part,
                float(found.distance_m[nearest]),
                _sigma(seen, pose, row, point),
                point,
                R @ found.normal[nearest],
                _predicted(hand, row),
            )
        )
    return result


def _predicted(hand: HandPose, row: int) -> bool:
    """Whether a part was not seen: its finger's marker, or for the palm the wrist's."""
    if row < len(hand.fingers):
        return hand.fingers[row].status == "predicted"
    return hand.joints[_WRIST].source == "predicted"


def _rotations(wxyz: Array) -> Array:
    """Of unit quaternions (n, 4), rounded as messages are; (n, 3, 3)."""
    w, x, y, z = wxyz.T / np.maximum(np.linalg.norm(wxyz, axis=1), 1e-12)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _sigma(seen: SeenHand, pose: ObjectPose, row: int, point: Array) -> float:
    errors = [
        _known(pose.sigma_m, _OBJECT_M) * _ONE_AXIS,
        _known(pose.sigma_rad, _OBJECT_RAD) * _ONE_AXIS * math.dist(point, pose.position_m),
    ]
    hand, positions = seen.pose, seen.positions
    lever_m = math.dist(point, positions[_WRIST])
    wrist = [
        _known(hand.wrist_sigma_m, _WRIST_M) * _ONE_AXIS,
        _known(hand.wrist_sigma_rad, _WRIST_RAD) * _ONE_AXIS * lever_m,
    ]
    if row >= len(hand.fingers):
        errors += wrist
    else:
        finger, (root, _, _, tip) = hand.fingers[row], CHAIN_JOINTS[row].tolist()
        bend_rad = _known(finger.sigma_rad, _FINGER_RAD)
        if hand.joints[tip].source == "measured":
            # It was seen where the tip is; how its bone is turned about the tip, less well.
            errors += [_TIP_M, finger.residual_m, bend_rad * math.dist(point, positions[tip])]
        else:
            errors += [*wrist, bend_rad * math.dist(positions[root], positions[tip])]
    return math.hypot(*errors)


def _known(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value
