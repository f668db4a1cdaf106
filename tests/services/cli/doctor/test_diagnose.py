"""From what was observed to the links: the order, and which of several faults is the cause."""

from __future__ import annotations

import msgspec
import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, ObjectTable, RigTable
from rhot.watch.rig_monitor import RigMonitor
from services.cli.doctor.diagnose import diagnose
from services.cli.doctor.links import first_cause
from services.cli.doctor.observations import (
    CameraSeen,
    HandSeen,
    ObjectSeen,
    Observations,
    Reach,
)
from services.cli.doctor.text import links_text
from testing.sample_health import NOW_NS, SECOND_NS, beat, fault

CONFIG = RigConfig(
    rig=RigTable(name="desk"),
    camera=[CameraTable(name="left", host="pi-left"), CameraTable(name="right", host="pi-right")],
    hand={"right": HandTable(markers={"index_tip": "blue", "little_tip": "lime"})},
    object=[ObjectTable(name="cup", serial="LHR-1", shape="sphere", size_m=(0.08,))],
)
SERVICES = ("pi_tracker/left", "pi_tracker/right", "fusion", "solver", "object_tracker")


def state_of(**faults):
    """All services well, but for these faults by service; None: the service was never heard."""
    monitor = RigMonitor(CONFIG, NOW_NS)
    for name in SERVICES:
        service, _, instance = name.partition("/")
        found = faults.get(name, [])
        if found is not None:
            monitor.token(service, instance or "main", True, NOW_NS)
            monitor.beat(beat(service, instance or "main", faults=found), NOW_NS + SECOND_NS)
    return monitor.state(NOW_NS + 2 * SECOND_NS)


def observations(faults=None, **changes):
    """A rig that is well, seen for four seconds."""
    seen = {"blue": 120, "lime": 110}
    values = {
        "config_path": "rig.toml",
        "config": CONFIG,
        "reached": [Reach(endpoint="tcp/127.0.0.1:7447")],
        "listened_s": 4.0,
        "state": state_of(**(faults or {})),
        "session_running": True,
        "clock_masters": ["master"],
        "cameras": {
            name: CameraSeen(frames=120, clock_known=120, colors=dict(seen))
            for name in ("left", "right")
        },
        "hands": {"right": HandSeen(points=120, measured=120, poses=120)},
        "objects": {"cup": ObjectSeen(poses=300, ok=300, state="ok", contacts=120)},
    }
    return Observations(**values | changes)


def cause(faults=None, **changes):
    return first_cause(diagnose(observations(faults, **changes)))


def test_all_is_well():
    links = diagnose(observations())
    assert {link.state for link in links} == {"ok"}
    assert links_text(links).splitlines()[-1] == "every link holds"


def test_links_go_from_the_file_to_the_object():
    names = [link.name for link in diagnose(observations())]
    assert names[:2] == ["rig.toml", "router"]
    way = ["pi_tracker/left", "fusion", "session", "camera left", "markers of left"]
    way += [
        "cameras together",
        "points of right hand",
        "pose of right hand",
        "object cup",
        "touch of cup",
    ]
    assert [name for name in names if name in way] == way


def test_without_a_router_nothing_else_is_judged():
    reached = [Reach(endpoint="tcp/m:7447", problem="m does not answer")]
    links = diagnose(observations(state=None, reached=reached))
    assert [link.name for link in links] == ["rig.toml", "router"]
    assert links[-1].code == "router_unreachable"


def test_a_certificate_is_named_before_the_router_it_keeps_away():
    found = cause(secured=True, certificate_problem="it ended on 2024-01-01", state=None)
    assert (found.name, found.code) == ("certificates", "certificate_refused")


def test_an_absent_service_says_where_to_start_it():
    found = cause({"pi_tracker/right": None})
    assert found.code == "service_absent"
    assert "pi-right" in found.action


def test_fusion_that_cannot_start_names_the_calibration():
    found = cause({"fusion": None}, calibration_problem="rig.json: no such file")
    assert (found.name, found.code) == ("fusion", "not_calibrated")


def test_the_cause_comes_before_what_follows_from_it():
    """A dark camera also gives no markers, no points and no pose."""
    dark = fault("camera_dark", "camera 'left' is black", "left")
    cameras = observations().cameras | {"left": CameraSeen(frames=120, clock_known=120)}
    hands = {"right": HandSeen(points=120)}
    seen = observations({"pi_tracker/left": [dark]}, cameras=cameras, hands=hands)
    links = diagnose(seen)
    assert first_cause(links).code == "camera_dark"
    text = links_text(links)
    assert "3 more below may only follow from it" in text
    assert text.count("->") == 1


def test_a_slow_camera_does_not_hide_why_there_is_no_pose():
    slow = fault("camera_slow", "7 pictures a second", "left", since_s=60)
    white = fault("camera_saturated", "white", "left")
    assert cause({"pi_tracker/left": [slow, white]}).code == "camera_saturated"
    mirrored = fault("cameras_mirrored", "mirrored", "left and right")
    assert cause({"pi_tracker/left": [slow], "fusion": [mirrored]}).code == "cameras_mirrored"
    nothing = {"right": HandSeen(points=120)}
    assert cause({"pi_tracker/left": [slow]}, hands=nothing).code == "camera_slow"


def test_views_that_do_not_fit_are_told_from_markers_out_of_view():
    nothing = {"right": HandSeen(points=120)}
    assert "do not fit together" in cause(hands=nothing).text


def test_paint_of_an_object_is_no_marker_of_a_hand():
    bead = {
        name: CameraSeen(frames=120, clock_known=120, colors={"orange": 120})
        for name in ("left", "right")
    }
    links = diagnose(observations(hands={"right": HandSeen(points=120)}, cameras=bead))
    told = next(link for link in links if link.name == "points of right hand")
    assert (told.code, told.text) == ("no_points", "no marker is seen by two cameras at once")


def test_a_hint_does_not_hide_what_is_broken():
    hint = fault("camera_automatic", "exposure is automatic", "left")
    found = cause({"pi_tracker/left": [hint]}, cameras={"right": observations().cameras["right"]})
    assert (found.name, found.code) == ("camera left", "camera_silent")


def test_services_of_one_process_that_runs_twice_are_named_together():
    places = ["process 1 on desk", "process 2 on desk"]
    doubles = {"solver": places, "fusion": places, "recorder": ["process 3", "process 4"]}
    text = first_cause(diagnose(observations(doubles=doubles))).text
    assert text == "fusion and solver run 2 times: process 1 on desk and process 2 on desk"


@pytest.mark.parametrize(
    ("teller", "code", "subject", "name"),
    [
        ("pi_tracker/left", "camera_frozen", "left", "camera left"),
        ("pi_tracker/left", "clock_unknown", "left", "clock of left"),
        ("pi_tracker/right", "colors_missing", "right", "colors of right"),
        ("fusion", "camera_clock_off", "right", "clock of right"),
        ("fusion", "camera_silent", "right", "camera right"),
        ("fusion", "camera_moved", "left and right", "cameras together"),
        ("fusion", "cameras_mirrored", "left and right", "cameras together"),
        ("fusion", "second_service", "1a2b", "one of each"),
        ("fusion", "second_clock", "", "master clock"),
        ("recorder", "disk_full", "session.mcap", "recorder"),
        ("object_tracker", "source_lost", "libsurvive", "object_tracker"),
        ("openvr_bridge", "source_lost", "steamvr", "SteamVR"),
        ("openvr_bridge/gaming-pc", "source_lost", "steamvr", "SteamVR"),
    ],
)
def test_what_services_tell_breaks_its_own_link(teller, code, subject, name):
    state = state_of()
    told = fault(code, "told", subject)
    monitor = RigMonitor(CONFIG, NOW_NS)
    for service in {*SERVICES, teller}:
        kind, _, instance = service.partition("/")
        monitor.token(kind, instance or "main", True, NOW_NS)
        own = beat(kind, instance or "main", faults=[told] if service == teller else [])
        monitor.beat(own, NOW_NS + SECOND_NS)
    state = monitor.state(NOW_NS + 2 * SECOND_NS)
    found = first_cause(diagnose(observations(state=state)))
    assert (found.name, found.code) == (name, code)


def test_a_steamvr_that_is_off_is_the_reason_for_objects_without_poses():
    monitor = RigMonitor(CONFIG, NOW_NS)
    told = fault("source_lost", "SteamVR does not run; start it", "steamvr")
    for name in (*SERVICES, "openvr_bridge"):
        service, _, instance = name.partition("/")
        faults = [told] if name == "openvr_bridge" else []
        monitor.token(service, instance or "main", True, NOW_NS)
        monitor.beat(beat(service, instance or "main", faults=faults), NOW_NS + SECOND_NS)
    state = monitor.state(NOW_NS + 2 * SECOND_NS)
    links = diagnose(observations(state=state, objects={}))
    assert first_cause(links).text == "SteamVR does not run; start it"
    assert [link.text for link in links].count("SteamVR does not run; start it") == 1


def test_a_warning_is_worse_and_not_broken():
    links = diagnose(observations({"fusion": [fault("disk_low", "200 MB are left", "desk")]}))
    assert first_cause(links) is None
    (low,) = [link for link in links if link.code == "disk_low"]
    assert low.state == "worse"
    assert "every link holds, 1 should be mended" in links_text(links)


def test_a_marker_nobody_complains_of_is_found_all_the_same():
    cameras = observations().cameras
    cameras["left"].colors = {"blue": 120, "lime": 2}
    found = cause(cameras=cameras)
    assert (found.name, found.code) == ("markers of left", "marker_not_seen")
    assert "not lime" in found.text
    assert "rhot calibrate colors left" in found.action
    cameras["left"].colors = {}
    # The cup's paint, which need not be in view, is not asked for.
    cup = ObjectTable(name="cup", serial="LHR-1", marker="orange")
    painted = msgspec.structs.replace(CONFIG, object=[cup])
    assert cause(cameras=observations().cameras, config=painted) is None
    assert "no marker at all" in cause(cameras=cameras).text


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"doubles": {"fusion": ["process 1", "process 2"]}}, "second_service"),
        ({"clock_masters": ["desk", "attic"]}, "second_clock"),
        ({"clock_masters": []}, "clock_unknown"),
        ({"session_running": False}, "session_stopped"),
        ({"session_running": None}, "session_stopped"),
        ({"hands": {"right": HandSeen(points=120, measured=0)}}, "no_points"),
        ({"hands": {"right": HandSeen(points=120, measured=120)}}, "no_pose"),
        (
            {"hands": {"right": HandSeen(points=9, measured=9, poses=9, implausible=2)}},
            "pose_implausible",
        ),
        ({"objects": {}}, "source_lost"),
    ],
)
def test_what_is_observed_from_outside(changes, code):
    assert cause(**changes).code == code


def test_a_slow_camera_and_an_unknown_clock_are_seen_from_outside():
    cameras = observations().cameras | {
        "left": CameraSeen(frames=20, clock_known=20, colors={"blue": 20, "lime": 20})
    }
    assert cause(cameras=cameras).code == "camera_slow"
    cameras = observations().cameras | {
        "left": CameraSeen(frames=120, colors={"blue": 120, "lime": 120})
    }
    assert cause(cameras=cameras).code == "clock_unknown"


def test_strangers_cannot_write_on_the_terminal():
    evil = "\x1b[2J\x1b]0;owned\x07\nok      router  all is well\u202e"
    told = {"fusion": [fault("camera_moved", evil, evil), fault("event", evil, evil)]}
    for line in links_text(diagnose(observations(told))).splitlines():
        assert line.isprintable()


def test_links_can_be_written_as_json():
    links = diagnose(observations())
    assert len(msgspec.json.decode(msgspec.json.encode(links))) == len(links)
