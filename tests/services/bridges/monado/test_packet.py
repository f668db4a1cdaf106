"""Packets, read through Monado's own struct as a C compiler lays it out."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from rhot.files.bridge_tables import Monado
from rhot.hand import default_hand
from services.bridges.monado.packet import SIZE, curls, packet
from services.bridges.pacing import Frame
from services.bridges.placement import placement_of
from testing.sample_hands import hand_pose, random_pose


def struct_of(*fields):
    return type("Struct", (ctypes.Structure,), {"_fields_": list(fields)})


# src/xrt/drivers/remote/r_interface.h of Monado, "mndrmt3", with xrt_defines.h's types.
FLOAT, BOOL = ctypes.c_float, ctypes.c_bool
Vec3 = struct_of(("x", FLOAT), ("y", FLOAT), ("z", FLOAT))
Quat = struct_of(("x", FLOAT), ("y", FLOAT), ("z", FLOAT), ("w", FLOAT))
Pose = struct_of(("orientation", Quat), ("position", Vec3))
FLAGS = "hand_tracking_active active system_click system_touch a_click a_touch b_click b_touch "
FLAGS += "trigger_click trigger_touch thumbstick_click thumbstick_touch trackpad_touch p0 p1 p2"
Controller = struct_of(
    ("pose", Pose),
    ("linear_velocity", Vec3),
    ("angular_velocity", Vec3),
    ("hand_curl", FLOAT * 5),
    ("trigger_value", FLOAT),
    ("squeeze_value", FLOAT),
    ("squeeze_force", FLOAT),
    ("thumbstick", FLOAT * 2),
    ("trackpad_force", FLOAT),
    ("trackpad", FLOAT * 2),
    *((name, BOOL) for name in FLAGS.split()),
)
View = struct_of(("fov", FLOAT * 4), ("pose", Pose), ("pad", ctypes.c_uint32))
Head = struct_of(("views", View * 2), ("center", Pose), ("valid", BOOL), ("pad", BOOL * 3))
RemoteData = struct_of(
    ("header", ctypes.c_uint64), ("head", Head), ("left", Controller), ("right", Controller)
)


def read(frame, table=None):
    table = table or Monado()
    data = packet(frame, table, placement_of(table))
    assert len(data) == ctypes.sizeof(RemoteData) == SIZE == 376
    return RemoteData.from_buffer_copy(data), data


def test_a_packet_is_monados_struct():
    poses = {"left": random_pose("left", 1), "right": random_pose("right", 2)}
    table = Monado(head_m=(0.1, 1.5, 0.2))
    remote, data = read(Frame(0.0, poses, {}), table)
    assert data[:8] == b"mndrmt3\0"
    center = remote.head.center
    assert (center.position.x, center.position.y, center.position.z) == pytest.approx(
        (0.1, 1.5, 0.2)
    )
    assert (center.orientation.x, center.orientation.w) == (0.0, 1.0)
    assert not remote.head.valid
    placement = placement_of(table)
    for hand, pose in poses.items():
        sent = getattr(remote, hand)
        where, turn = sent.pose.position, sent.pose.orientation
        assert (where.x, where.y, where.z) == pytest.approx(
            placement.point(pose.wrist.position_m), abs=1e-6
        )
        assert (turn.w, turn.x, turn.y, turn.z) == pytest.approx(
            placement.orientation(pose.wrist.orientation_wxyz), abs=1e-6
        )
        assert list(sent.hand_curl) == pytest.approx(curls(pose)[::-1], abs=1e-6)
        assert sent.active
        assert sent.hand_tracking_active
    # What is unused is zero: the rest of the bytes.
    used = bytearray(data)
    for start, length in ((0, 8), (104, 28), (136, 28), (188, 20), (256, 28), (308, 20)):
        used[start : start + length] = bytes(length)
    for start in (240, 360):
        used[start : start + 2] = bytes(2)
    assert not any(used)


def test_a_hand_that_is_lost_is_inactive():
    remote, _ = read(Frame(0.0, {"right": random_pose("right", 1)}, {}))
    assert (remote.left.active, remote.left.hand_tracking_active) == (False, False)
    assert (remote.right.active, remote.right.hand_tracking_active) == (True, True)


def monados_bend(curl, digit):
    """The bends of a digit's joints as Monado makes them of a curl (u_hand_simulation.c)."""
    if digit == "thumb":
        return np.array([0.0, np.deg2rad(-10.0) + curl, np.deg2rad(-10.0) + curl])
    turn = 1.1 * curl
    if digit == "index":
        return np.array([0.9 * turn, turn, turn])
    turn *= 1.3
    return np.array([1.3 * turn, turn, 0.4 * turn])


@pytest.mark.parametrize("hand", ["left", "right"])
def test_curls_give_monado_the_same_whole_bend(hand):
    """What Monado bends its fingers by is what ours are bent by, all joints together."""
    for share in (0.0, 0.2, 0.7):
        angles = np.zeros((5, 4))
        for row, digit in enumerate(("thumb", "index", "middle", "ring", "little")):
            angles[row, 1:] = monados_bend(share, digit)[:3]
        pose = hand_pose(default_hand(hand), np.eye(3), np.zeros(3), angles)
        assert curls(pose) == pytest.approx([share] * 5, abs=1e-6)
    closed = hand_pose(default_hand(hand), np.eye(3), np.zeros(3), np.full((5, 4), 1.9))
    assert curls(closed) == (1.0,) * 5
