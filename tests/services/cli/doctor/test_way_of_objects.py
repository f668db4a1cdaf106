"""What the doctor says of objects: states in words, touches, faults of devices it does not know."""

from __future__ import annotations

import msgspec
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import HandTable, ObjectTable
from rhot.messages.objects import Contact, Grasp, ObjectContacts
from services.cli.doctor.listen import touch_text
from services.cli.doctor.observations import HandSeen, ObjectSeen, Observations
from services.cli.doctor.way_of_objects import OBJECT_CODES, object_links
from testing.sample_health import NOW_NS, fault

CUP = ObjectTable(name="cup", serial="LHR-1", shape="sphere", size_m=(0.08,))
CONFIG = RigConfig(hand={"right": HandTable(markers={"wrist": "blue"})}, object=[CUP])


def seen(cup=None, config=CONFIG, poses=120):
    return Observations(
        config_path="rig.toml",
        config=config,
        hands={"right": HandSeen(poses=poses)},
        objects={"cup": cup} if cup else {},
    )


def links(*args, told=(), **named):
    return {link.name: link for link in object_links(seen(*args, **named), list(told))}


def test_an_object_that_is_well_and_held():
    found = links(ObjectSeen(poses=400, ok=398, contacts=120, touching="right hand holds it"))
    assert found["object cup"].text == "400 poses, 398 of them ok"
    assert found["touch of cup"].text == "120 messages, right hand holds it"
    assert {link.state for link in found.values()} == {"ok"}


@pytest.mark.parametrize(
    ("state", "words", "action"),
    [
        ("out_of_range", "out of the lighthouses' view", "turn its tracker"),
        ("lost", "lost", "is its tracker on"),
        ("calibrating", "locating itself", "hold it still"),
        ("unregistered", "not registered", "rhot calibrate objects"),
    ],
)
def test_an_object_that_is_not_ok_has_its_state_and_what_to_do(state, words, action):
    link = links(ObjectSeen(poses=400, ok=10, state=state))["object cup"]
    assert link.state == "worse"
    assert link.text.startswith("10 of 400 poses are ok")
    assert words in link.text
    assert action in link.action


def test_no_pose_at_all_is_broken_and_its_fault_comes_first():
    assert links()["object cup"].code == "source_lost"
    told = fault("object_unregistered", "cup is not registered", "cup")
    assert links(told=[told])["object cup"].code == "object_unregistered"


def test_nobody_tells_of_touches():
    cup = ObjectSeen(poses=400, ok=400, state="ok")
    assert links(cup)["touch of cup"].state == "worse"
    assert links(cup, poses=0)["touch of cup"].text == "nothing to judge by"
    plain = msgspec.structs.replace(CONFIG, object=[ObjectTable(name="cup", serial="LHR-1")])
    assert list(links(cup, config=plain)) == ["object cup"]


def test_devices_of_no_table_are_told_beside_the_objects():
    told = fault("device_unknown", "LHR-9 is none of rig.toml's", "LHR-9")
    assert "device_unknown" in OBJECT_CODES
    found = links(ObjectSeen(poses=400, ok=400, contacts=1), told=[told])
    assert (found["object cup"].state, found["tracked devices"].code) == ("ok", "device_unknown")
    no_objects = Observations(config_path="rig.toml", config=RigConfig())
    assert object_links(no_objects, []) == []


def test_touches_in_words():
    parts = ("thumb", "index", "ring")
    contacts = [
        Contact(
            hand=hand,
            part=part,
            distance_m=0.0,
            sigma_m=0.001,
            point_m=(0.0, 0.0, 0.5),
            touching=part != "ring",
        )
        for hand in ("left", "right")
        for part in parts
    ]
    grasp = Grasp(hand="right", parts=["thumb", "index"], since_ns=NOW_NS)
    message = ObjectContacts(
        object="cup", seq=1, stamp_ns=NOW_NS, contacts=contacts, grasps=[grasp]
    )
    assert touch_text(message) == (
        "right hand holds cup (thumb, index), left hand touches cup (thumb, index)"
    )
    assert touch_text(msgspec.structs.replace(message, contacts=[], grasps=[])) == ""
