"""Golden messages: what the bridge makes of every result, class and event of the real binding."""

from __future__ import annotations

import json

import msgspec
import pytest

from rhot.messages.objects import OpenVrEvent, OpenVrPose
from testing.openvr_golden import PLACE, golden, text

MESSAGES = json.loads(PLACE.read_text())


def test_the_file_is_what_the_bridge_sends():
    assert PLACE.read_text() == text(), "python -m testing.openvr_golden --write"


def test_every_result_class_and_event_of_the_binding_is_there():
    kinds = {kind: [n for n in golden() if n.startswith(kind)] for kind in ("result", "class")}
    assert len(kinds["result"]) == 6
    assert len(kinds["class"]) == 6
    assert {m["event_type"] for n, m in MESSAGES.items() if n.startswith("event")} == {
        100,
        101,
        700,
        801,
        804,
        808,
    }


@pytest.mark.parametrize("name", MESSAGES)
def test_the_decoders_of_the_bus_read_it(name):
    if MESSAGES[name] is None:
        assert name in ("class Invalid", "class TrackingReference", "class DisplayRedirect")
        return
    kind = OpenVrEvent if name.startswith("event") else OpenVrPose
    payload = json.dumps(MESSAGES[name]).encode()
    decoded = msgspec.json.decode(payload, type=kind)
    assert json.loads(msgspec.json.encode(decoded)) == MESSAGES[name]


def test_what_makes_a_difference_is_there():
    assert MESSAGES["result Running_OK"]["eTrackingResult"] == 200
    assert MESSAGES["result Uninitialized"]["eTrackingResult"] == 1
    assert not MESSAGES["pose not a number"]["bPoseIsValid"]
    assert MESSAGES["pose not a number"]["mDeviceToAbsoluteTracking"][0] == [0.0] * 4
    assert MESSAGES["pose of an unknown universe"]["universe"] == "raw"
    assert MESSAGES["event TrackedDeviceActivated"]["serial"] == "LHR-1234ABCD"
    assert MESSAGES["event ChaperoneUniverseHasChanged"]["universe"] == "raw:7"
