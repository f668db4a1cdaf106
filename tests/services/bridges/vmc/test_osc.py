"""Bundles, decoded by python-osc."""

from __future__ import annotations

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from rhot.files.bridge_tables import Vmc
from rhot.geometry.transforms import rotation_from_quaternion
from services.bridges.pacing import Frame
from services.bridges.placement import placement_of
from services.bridges.vmc.osc import bundle
from testing.sample_hands import object_pose, random_pose


def decoded(frame, table):
    datagram = bundle(frame, table, placement_of(table))
    return [(one.address, *one.params) for one in OscBundle(datagram)]


def test_a_frame_has_what_is_asked_for():
    hands = {"left": random_pose("left", 1), "right": random_pose("right", 2)}
    frame = Frame(1.5, hands, {"cup": object_pose("cup")})
    everything = decoded(frame, Vmc(hand_bones=True))
    assert everything[:2] == [("/VMC/Ext/OK", 1), ("/VMC/Ext/T", 1.5)]
    names = [one[1] for one in everything[2:]]
    assert len(names) == len(set(names)) == 2 * (15 + 1 + 1) + 1
    assert {"LeftHand", "RightHand", "left_wrist", "right_wrist", "cup"} <= set(names)
    fewer = {one[1] for one in decoded(frame, Vmc(trackers=False))[2:]}
    assert fewer == {name for name in names if name.startswith(("Left", "Right"))} - {
        "LeftHand",
        "RightHand",
    }
    assert decoded(Frame(0.0, {}, {}), Vmc()) == [("/VMC/Ext/OK", 0), ("/VMC/Ext/T", 0.0)]


def test_the_bytes_are_those_of_python_oscs_own_builders():
    hands = {"left": random_pose("left", 1), "right": random_pose("right", 2)}
    datagram = bundle(Frame(1.5, hands, {"cup": object_pose("cup")}), Vmc(), placement_of(Vmc()))
    builder = OscBundleBuilder(IMMEDIATELY)
    for one in OscBundle(datagram):
        message = OscMessageBuilder(one.address)
        for value in one.params:
            message.add_arg(value)
        builder.add_content(message.build())
    assert builder.build().dgram == datagram


def test_a_tracker_is_where_rig_toml_places_the_rig():
    """Cameras at (0, 1, 2) of Unity that look at the avatar: their z is Unity's -z."""
    table = Vmc(position_m=(0.0, 1.0, -2.0), yaw_deg=180.0)
    item = object_pose("cup", position_m=(0.1, -0.2, 0.5), orientation_wxyz=(1.0, 0.0, 0.0, 0.0))
    (*_, tracker) = decoded(Frame(0.0, {}, {"cup": item}), table)
    assert tracker[:2] == ("/VMC/Ext/Tra/Pos", "cup")
    # x of a camera that looks at somebody is that person's left, y is down.
    assert tracker[2:5] == pytest.approx((-0.1, 1.0 + 0.2, 2.0 - 0.5), abs=1e-6)
    # Its own z axis, which looks away from the cameras, is what Unity calls its back.
    x, y, z, w = tracker[5:]
    turned = rotation_from_quaternion((w, x, y, z))
    assert turned @ [0.0, 0.0, -1.0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
    assert np.linalg.norm([w, x, y, z]) == pytest.approx(1.0)
