"""Names that fit into keys, and the names of universes."""

from __future__ import annotations

import pytest

from rhot import topics
from services.openvr_bridge.names import key_name, message_device, universe_of
from services.openvr_bridge.sweep import Device
from testing.steamvr import HMD, TRACKER


@pytest.mark.parametrize(
    ("serial", "name"),
    [
        ("LHR-1234ABCD", "LHR-1234ABCD"),
        ("LHR/1 x", "LHR_1_x"),
        ("", "device5"),
        ("-odd", "device5"),
        ("../../x", "device5"),
        ("**", "device5"),
        ("x" * 99, "x" * 64),
        ("LHR-ü\n", "LHR-__"),
    ],
)
def test_serials_fit_into_keys(serial, name):
    assert key_name(serial, 5) == name
    topics.OPENVR.key("desk", serial=name)


@pytest.mark.parametrize(
    ("told", "sent"), [(0.5, 0.5), (1.0, 1.0), (-1.0, -1.0), (55.0, -1.0), (float("nan"), -1.0)]
)
def test_batteries(told, sent):
    assert message_device(1, Device(TRACKER, "A", battery=told)).battery == sent


def test_models_are_printed_safely():
    assert message_device(
        1, Device(TRACKER, "A", model="VIVE\x1b[2J" + "x" * 99)
    ).model.isprintable()


def test_a_universe_is_the_devices_own_or_that_of_its_tracking_system():
    devices = {
        0: Device(HMD, "null", universe_id=2, system="null"),
        1: Device(TRACKER, "A", universe_id=0, system="lighthouse"),
        2: Device(TRACKER, "B", universe_id=2**63, system="lighthouse"),
        3: Device(TRACKER, "C", system="other"),
    }
    assert [universe_of(slot, devices) for slot in devices] == [
        "raw:2",
        f"raw:{2**63}",
        f"raw:{2**63}",
        "raw",
    ]
