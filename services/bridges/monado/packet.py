"""A frame as Monado's remote driver reads it: struct r_remote_data, 376 bytes. Pure.

From src/xrt/drivers/remote/r_interface.h of Monado, copyright Collabora 2020-2023, BSL-1.0: the
packets that call themselves "mndrmt3". Older Monado (2022 and before) reads others, mndrmt1 and
mndrmt2, of another length, and does not look at the name: it would make nonsense of these.
Little-endian, as every computer that Monado runs on.

    header                8 bytes
    head                128 bytes: two views of field of view, pose and padding, unused; the pose
                          of the centre; per_view_data_valid (false); padding
    left, right         120 bytes each: pose; linear and angular velocity; curls of little, ring,
                          middle, index finger and thumb; triggers, stick and pad, unused; flags,
                          of which the first is hand_tracking_active and the second active

Poses are orientation xyzw and position, OpenXR's axes. Monado makes 26 joints of pose and curls
(u_hand_simulation.c): it takes the pose for the wrist's, and hands of its own size. So a finger's
curl is the share of its whole bend in what Monado's finger can bend.
"""

from __future__ import annotations

import struct

import numpy as np

from rhot.files.bridge_tables import Monado
from rhot.hand import HANDS
from rhot.messages import HandPose
from services.bridges.pacing import Frame
from services.bridges.placement import Placement

HEADER = b"mndrmt3\0"
_PACKET = struct.Struct("<8s 96x 7f ?3x 120s 120s")
_HAND = struct.Struct("<7f 3f 3f 5f 32x ??14x")
SIZE = _PACKET.size
# What Monado's simulated fingers bend at a curl of 1, all three joints together, in radians, from
# u_hand_sim_simulate_for_valve_index_knuckles: index 1.1 (0.9 + 1 + 1), the others
# 1.1 1.3 (1.3 + 1 + 0.4).
_INDEX_BEND, _FINGER_BEND = 1.1 * 2.9, 1.1 * 1.3 * 2.7
# Its thumb bends by 1 rad at each of two joints, from 10 degrees backwards on.
_THUMB_BEND, _THUMB_START = 2.0, 2.0 * np.deg2rad(10.0)
_AWAY = bytes(_HAND.size)


def packet(frame: Frame, table: Monado, placement: Placement) -> bytes:
    """The frame's packet; a hand that is lost is inactive."""
    hands = [
        _hand(frame.hands[hand], placement) if hand in frame.hands else _AWAY for hand in HANDS
    ]
    return _PACKET.pack(HEADER, 0.0, 0.0, 0.0, 1.0, *table.head_m, False, *hands)


def curls(pose: HandPose) -> tuple[float, ...]:
    """How far each digit is bent, thumb to little, 0 to 1 as Monado counts it."""
    thumb, *fingers = pose.angles_rad[:, 1:].tolist()
    # Of the thumb without its first joint, which Monado does not bend.
    shares = [(thumb[1] + thumb[2] + _THUMB_START) / _THUMB_BEND]
    for bends, most in zip(fingers, (_INDEX_BEND, *(_FINGER_BEND,) * 3), strict=True):
        shares.append(sum(bends) / most)
    return tuple(min(1.0, max(0.0, share)) for share in shares)


def _hand(pose: HandPose, placement: Placement) -> bytes:
    w, x, y, z = placement.orientation(pose.wrist.orientation_wxyz)
    position_m = placement.point(pose.wrist.position_m)
    # No velocities: poses come oftener than what they would predict is worth.
    still = (0.0,) * 6
    return _HAND.pack(x, y, z, w, *position_m, *still, *reversed(curls(pose)), True, True)
