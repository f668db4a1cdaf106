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

from collections.abc import Iterable, Sequence

from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from rhot.files.bridge_tables import Vmc
from rhot.geometry.quaternions import Quat, Vec3
from rhot.geometry.transforms import rotation_from_quaternion
from services.bridges.pacing import Frame
from services.bridges.placement import Placement
from services.bridges.vmc.skeleton import BonePose, finger_bones, hand_bone


def bundle(frame: Frame, table: Vmc, placement: Placement) -> bytes:
    """The frame's datagram."""
    builder = OscBundleBuilder(IMMEDIATELY)
    for message in _messages(frame, table, placement):
        builder.add_content(message)
    return bytes(builder.build().dgram)


def _messages(frame: Frame, table: Vmc, placement: Placement) -> Iterable[OscMessage]:
    yield _message("/VMC/Ext/OK", "i", [int(bool(frame.hands))])
    yield _message("/VMC/Ext/T", "f", [frame.time_s])
    for hand, pose in frame.hands.items():
        wrist = placement.orientation(pose.wrist.orientation_wxyz)
        if table.hand_bones:
            yield _pose("/VMC/Ext/Bone/Pos", hand_bone(hand, rotation_from_quaternion(wrist)))
        for one in finger_bones(pose):
            yield _pose("/VMC/Ext/Bone/Pos", one)
        if table.trackers:
            yield _tracker(f"{hand}_wrist", placement.point(pose.wrist.position_m), wrist)
    if table.trackers:
        for name, item in frame.objects.items():
            orientation = placement.orientation(item.orientation_wxyz)
            yield _tracker(name, placement.point(item.position_m), orientation)


def _tracker(name: str, position_m: Vec3, orientation_wxyz: Quat) -> OscMessage:
    (x, y, z), (w, i, j, k) = position_m, orientation_wxyz
    return _pose("/VMC/Ext/Tra/Pos", BonePose(name, (x, y, -z), (-i, -j, k, w)))


def _pose(address: str, one: BonePose) -> OscMessage:
    return _message(address, "sfffffff", [one.name, *one.position_m, *one.rotation_xyzw])


def _message(address: str, types: str, values: Sequence[str | int | float]) -> OscMessage:
    builder = OscMessageBuilder(address)
    for kind, value in zip(types, values, strict=True):
        builder.add_arg(value, kind)
    return builder.build()
