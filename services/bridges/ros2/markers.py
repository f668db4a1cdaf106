"""What RViz draws: hands as joints and bones, objects in their shapes; visualization_msgs. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import (
    Array,
    quaternion_from_rotation,
    quaternion_multiply,
    rotation_x,
)
from rhot.hand import JOINT_INDEX
from rhot.hand_mesh.skinned_hand import PARENTS
from rhot.messages import HandPose
from rhot.messages.objects import ObjectPose
from services.bridges.ros2.encode import Placed, header, make, store

# visualization_msgs/msg/Marker
_CUBE, _SPHERE, _CYLINDER, _LINE_LIST, _SPHERE_LIST = 1, 2, 3, 5, 7
# What is not told again for so long has gone: fifteen pictures of a 30 Hz camera.
_LIFETIME_NS = 500_000_000
# Each bone: two joints.
_BONES = np.array(
    [(JOINT_INDEX[parent], JOINT_INDEX[name]) for name, parent in PARENTS.items() if parent]
)
# Bones, and joints: a list's spheres are all of one size.
_BONE_M, _JOINT_M = 0.006, 0.012
_SKIN, _OBJECT = (0.94, 0.73, 0.58, 1.0), (0.0, 0.45, 0.70, 0.6)
# A cylinder of ROS's stands along z, ours along y: R_ours_from_ros turns z to y.
_UPRIGHT = quaternion_from_rotation(rotation_x(-0.5 * np.pi))
# An object without a shape, or with a mesh, is a ball of this diameter.
_BALL_M = 0.03


def marker_array(
    placed: Placed,
    hands: Iterable[HandPose],
    objects: Iterable[ObjectPose],
    tables: Mapping[str, ObjectTable],
) -> Any:
    """visualization_msgs/msg/MarkerArray; tables are those of rig.toml, by the objects' names."""
    markers = [marker for hand in hands for marker in _hand(placed, hand)]
    markers += [_object(placed, one, tables.get(one.object)) for one in objects]
    return make("visualization_msgs/msg/MarkerArray", markers=markers)


def _hand(placed: Placed, hand: HandPose) -> Iterable[Any]:
    positions_m = hand.positions_m
    (here,) = placed.poses(np.zeros((1, 3)), [[1.0, 0.0, 0.0, 0.0]])
    # Points of a list are in the marker's own frame: that of our messages.
    for number, kind, width_m, chosen in (
        (0, _SPHERE_LIST, _JOINT_M, positions_m),
        (1, _LINE_LIST, _BONE_M, positions_m[_BONES.ravel()]),
    ):
        yield _marker(
            hand.stamp_ns,
            f"{hand.hand}_hand",
            number,
            kind,
            here,
            (width_m, width_m, width_m),
            _SKIN,
            chosen,
        )


def _object(placed: Placed, one: ObjectPose, table: ObjectTable | None) -> Any:
    wxyz = one.orientation_wxyz
    shape = "" if table is None else table.shape
    kind, size = _SPHERE, (_BALL_M, _BALL_M, _BALL_M)
    if table is not None and shape == "box":
        x, y, z = table.size_m
        kind, size = _CUBE, (x, y, z)
    elif table is not None and shape == "cylinder":
        diameter, height = table.size_m
        kind, size = _CYLINDER, (diameter, diameter, height)
        wxyz = tuple(quaternion_multiply(wxyz, _UPRIGHT).tolist())
    elif table is not None and shape == "sphere":
        (diameter,) = table.size_m
        size = (diameter, diameter, diameter)
    (pose,) = placed.poses([one.position_m], [wxyz])
    return _marker(one.stamp_ns, f"object_{one.object}", 0, kind, pose, size, _OBJECT)


def _marker(
    stamp_ns: int,
    namespace: str,
    number: int,
    kind: int,
    pose: Any,
    size_m: tuple[float, float, float],
    color: tuple[float, float, float, float],
    points_m: Array | None = None,
) -> Any:
    r, g, b, a = color
    own = [] if points_m is None else points_m.tolist()
    point = store().types["geometry_msgs/msg/Point"]
    return make(
        "visualization_msgs/msg/Marker",
        header=header(stamp_ns),
        ns=namespace,
        id=number,
        type=kind,
        action=0,
        pose=pose,
        scale=make("geometry_msgs/msg/Vector3", x=size_m[0], y=size_m[1], z=size_m[2]),
        color=make("std_msgs/msg/ColorRGBA", r=r, g=g, b=b, a=a),
        lifetime=make("builtin_interfaces/msg/Duration", sec=0, nanosec=_LIFETIME_NS),
        frame_locked=False,
        points=[point(*p) for p in own],
        colors=[],
        texture_resource="",
        texture=make(
            "sensor_msgs/msg/CompressedImage",
            header=header(stamp_ns),
            format="",
            data=np.zeros(0, dtype=np.uint8),
        ),
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=make(
            "visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, dtype=np.uint8)
        ),
        mesh_use_embedded_materials=False,
    )
