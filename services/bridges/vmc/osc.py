"""A frame as the Virtual Motion Capture protocol says it (protocol.vmc.info), in one OSC bundle.
Pure.

    /VMC/Ext/OK i        1: hands are seen; 0: none is
    /VMC/Ext/T f         seconds since the bridge's start
    /VMC/Ext/Bone/Pos    name, position x y z, rotation x y z w: each bone in its parent's frame
    /VMC/Ext/Tra/Pos     name, position x y z, rotation x y z w: a tracker in the program's space

A hand or object that is lost is not sent: the program keeps its last pose, or goes on with its own
animation, as it is set. Beyond 1.4 kB a bundle travels in several packets of the network; a frame
of two hands has 3 kB.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from functools import cache

from pythonosc.parsing.osc_types import (
    IMMEDIATELY,
    write_date,
    write_float,
    write_int,
    write_string,
)

from rhot.files.bridge_tables import Vmc
from rhot.geometry.quaternions import Quat, Vec3
from services.bridges.pacing import Frame
from services.bridges.placement import Placement
from services.bridges.vmc.skeleton import BonePose, finger_bones, hand_bone

_BUNDLE = write_string("#bundle") + write_date(IMMEDIATELY)
_SEVEN = struct.Struct(">7f")


def bundle(frame: Frame, table: Vmc, placement: Placement) -> bytes:
    """The frame's datagram.

    From python-osc's parts and not by its builders, which read again all that they have written:
    the bytes are the same, and two hands cost a tenth of that.
    """
    parts = [_BUNDLE]
    for message in _messages(frame, table, placement):
        parts += (write_int(len(message)), message)
    return b"".join(parts)


def _messages(frame: Frame, table: Vmc, placement: Placement) -> Iterable[bytes]:
    yield _head("/VMC/Ext/OK", "i") + write_int(int(bool(frame.hands)))
    yield _head("/VMC/Ext/T", "f") + write_float(frame.time_s)
    for hand, pose in frame.hands.items():
        wrist = placement.orientation(pose.wrist.orientation_wxyz)
        if table.hand_bones:
            yield _pose("/VMC/Ext/Bone/Pos", hand_bone(hand, wrist))
        for one in finger_bones(pose):
            yield _pose("/VMC/Ext/Bone/Pos", one)
        if table.trackers:
            yield _tracker(f"{hand}_wrist", placement.point(pose.wrist.position_m), wrist)
    if table.trackers:
        for name, item in frame.objects.items():
            orientation = placement.orientation(item.orientation_wxyz)
            yield _tracker(name, placement.point(item.position_m), orientation)


def _tracker(name: str, position_m: Vec3, orientation_wxyz: Quat) -> bytes:
    (x, y, z), (w, i, j, k) = position_m, orientation_wxyz
    return _pose("/VMC/Ext/Tra/Pos", BonePose(name, (x, y, -z), (-i, -j, k, w)))


def _pose(address: str, one: BonePose) -> bytes:
    numbers = _SEVEN.pack(*one.position_m, *one.rotation_xyzw)
    return _head(address, "sfffffff") + write_string(one.name) + numbers


@cache
def _head(address: str, types: str) -> bytes:
    return bytes(write_string(address) + write_string(f",{types}"))
