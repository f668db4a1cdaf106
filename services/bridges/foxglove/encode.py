"""Hands and objects as Foxglove's messages. Pure.

Everything is in the frame `rig`, as the bus has it (docs/reference/frames.md): Foxglove's frames
are right-handed, in metres, as ours are, and its 3D panel asks which axis is up. Stamps are the
messages' own. Hands that are not told again for half a second disappear.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    Duration,
    FrameTransform,
    FrameTransforms,
    LinePrimitive,
    LinePrimitiveLineType,
    ModelPrimitive,
    Point3,
    Pose,
    PosesInFrame,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    Timestamp,
    Vector3,
)

from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import quaternion_from_rotation, rotation_x
from rhot.hand import JOINT_INDEX
from rhot.hand_mesh.skinned_hand import PARENTS
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose

RIG = "rig"
# Shapes do not change, and meshes are large.
SHAPES_S = 1.0
# Fifteen pictures of a 30 Hz camera.
_LIFETIME_S = 0.5
_BONES = np.array(
    [(JOINT_INDEX[parent], JOINT_INDEX[name]) for name, parent in PARENTS.items() if parent]
)
_BONE_M = 0.006
_SKIN, _OBJECT = Color(r=0.94, g=0.73, b=0.58, a=1.0), Color(r=0.0, g=0.45, b=0.70, a=0.6)
# A cylinder of Foxglove's stands along z, ours along y.
_UPRIGHT = quaternion_from_rotation(rotation_x(-0.5 * np.pi))
# An object without a shape is a ball of this diameter.
_BALL_M = 0.03


def object_frame(name: str) -> str:
    """Name of an object's frame."""
    return f"object_{name}"


def transforms(hands: Iterable[HandPose], objects: Iterable[ObjectPose]) -> FrameTransforms:
    """Each wrist and each object on `rig`."""
    found = [
        _transform(
            hand.stamp_ns,
            f"{hand.hand}_hand",
            hand.wrist.position_m,
            hand.wrist.orientation_wxyz,
        )
        for hand in hands
    ]
    found += [
        _transform(one.stamp_ns, object_frame(one.object), one.position_m, one.orientation_wxyz)
        for one in objects
    ]
    return FrameTransforms(transforms=found)


def joint_poses(hand: HandPose) -> PosesInFrame:
    """The 26 joints in the order of rhot.hand.JOINTS."""
    return PosesInFrame(
        timestamp=_stamp(hand.stamp_ns),
        frame_id=RIG,
        poses=[_pose(joint.position_m, joint.orientation_wxyz) for joint in hand.joints],
    )


def hand_scene(hands: Iterable[HandPose]) -> SceneUpdate:
    """Hands as joints and bones."""
    return SceneUpdate(entities=[_hand(hand) for hand in hands])


def shapes(
    objects: Iterable[ObjectPose], tables: Mapping[str, ObjectTable], meshes: Mapping[str, bytes]
) -> SceneUpdate:
    """Objects in their shapes, each in a frame of its own, which `transforms` moves.

    Sent again each SHAPES_S. tables are those of rig.toml, meshes GLB files in metres, both by the
    objects' names.
    """
    return SceneUpdate(
        entities=[
            _shape(one, tables.get(one.object), meshes.get(one.object, b"")) for one in objects
        ]
    )


def _hand(hand: HandPose) -> SceneEntity:
    ends = hand.positions_m[_BONES.ravel()].tolist()
    bones = LinePrimitive(
        type=LinePrimitiveLineType.LineList,
        pose=_pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)),
        thickness=_BONE_M,
        points=[Point3(x=x, y=y, z=z) for x, y, z in ends],
        color=_SKIN,
    )
    joints = [
        SpherePrimitive(
            pose=_pose(joint.position_m, joint.orientation_wxyz),
            size=_vector((2.0 * joint.radius_m,) * 3),
            color=_SKIN,
        )
        for joint in hand.joints
    ]
    return SceneEntity(
        timestamp=_stamp(hand.stamp_ns),
        frame_id=RIG,
        id=f"{hand.hand}_hand",
        lifetime=Duration.from_secs(_LIFETIME_S),
        spheres=joints,
        lines=[bones],
    )


def _shape(one: ObjectPose, table: ObjectTable | None, mesh: bytes) -> SceneEntity:
    shape = "" if table is None else table.shape
    size = () if table is None else table.size_m
    here = _pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    primitives: dict[str, Any]
    if shape == "mesh" and mesh:
        model = ModelPrimitive(
            pose=here,
            scale=_vector((1.0, 1.0, 1.0)),
            color=_OBJECT,
            override_color=True,
            media_type="model/gltf-binary",
            data=mesh,
        )
        primitives = {"models": [model]}
    elif shape == "box":
        box = CubePrimitive(pose=here, size=_vector(size), color=_OBJECT)
        primitives = {"cubes": [box]}
    elif shape == "cylinder":
        diameter, height = size
        tube = CylinderPrimitive(
            pose=_pose((0.0, 0.0, 0.0), _UPRIGHT.tolist()),
            size=_vector((diameter, diameter, height)),
            bottom_scale=1.0,
            top_scale=1.0,
            color=_OBJECT,
        )
        primitives = {"cylinders": [tube]}
    else:
        diameter = size[0] if shape == "sphere" else _BALL_M
        ball = SpherePrimitive(pose=here, size=_vector((diameter,) * 3), color=_OBJECT)
        primitives = {"spheres": [ball]}
    name = object_frame(one.object)
    return SceneEntity(
        timestamp=_stamp(one.stamp_ns),
        frame_id=name,
        id=name,
        frame_locked=True,
        lifetime=Duration.from_secs(2.5 * SHAPES_S),
        **primitives,
    )


def _transform(
    stamp_ns: int, child: str, position_m: Sequence[float], wxyz: Sequence[float]
) -> FrameTransform:
    return FrameTransform(
        timestamp=_stamp(stamp_ns),
        parent_frame_id=RIG,
        child_frame_id=child,
        translation=_vector(position_m),
        rotation=_quaternion(wxyz),
    )


def _pose(position_m: Sequence[float], wxyz: Sequence[float]) -> Pose:
    return Pose(position=_vector(position_m), orientation=_quaternion(wxyz))


def _quaternion(wxyz: Sequence[float]) -> Quaternion:
    w, x, y, z = wxyz
    return Quaternion(x=x, y=y, z=z, w=w)


def _vector(xyz: Sequence[float]) -> Vector3:
    x, y, z = xyz
    return Vector3(x=x, y=y, z=z)


def _stamp(stamp_ns: int) -> Timestamp:
    sec, nsec = divmod(stamp_ns, 10**9)
    return Timestamp(sec=sec, nsec=nsec)
