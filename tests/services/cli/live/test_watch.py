"""Messages as tables, and what can be watched."""

from __future__ import annotations

import math

import msgspec
import pytest

from rhot import topics
from rhot.errors import BusError
from rhot.messages import (
    FingerAngles,
    FingerPose,
    HandJoint,
    HandPoint,
    HandPoints,
    HandPose,
    Marker,
    MarkerFrame,
    Session,
    WristPose,
)
from rhot.messages.health import Fault, Health, StreamHealth
from rhot.messages.objects import Contact, Grasp, ObjectContacts, ObjectPose
from services.cli.live.watch import _topic, table

NOW_NS = 5_000_000_000


def cells(line):
    return line.split()


def test_markers_are_rows_with_numbers_to_the_right():
    markers = [
        Marker(color=name, x_px=x, y_px=7.0, area_px=80.4, sigma_px=0.1, quality=1.0)
        for name, x in (("green", 31.257), ("lime", 331.0))
    ]
    frame = MarkerFrame(
        camera="left",
        seq=1,
        stamp_ns=NOW_NS - 42_000_000,
        row_time_ns=0.0,
        clock_offset_ns=0,
        clock_sigma_ns=0,
        size_px=(640, 480),
        markers=markers,
    )
    title, head, green, lime = table(frame, NOW_NS)
    assert title == "camera left, 42 ms old"
    assert cells(head)[:3] == ["colour", "x", "y"]
    assert cells(green) == ["green", "31.26", "7.00", "0.10", "80", "1.00"]
    assert green.index("31.26") + 5 == lime.index("331.00") + 6
    assert len(table(frame, NOW_NS)) == 4


def test_points_say_where_and_who_sees_them():
    point = HandPoint(
        name="wrist",
        position_m=(0.1, -0.0255, 0.5),
        sigma_m=(0.001, 0.001, 0.002),
        cameras=["left", "right"],
        source="measured",
    )
    lost = HandPoint(
        name="index_tip",
        position_m=(0.0, 0.0, 0.5),
        sigma_m=(0.001, 0.001, 0.002),
        cameras=[],
        source="predicted",
    )
    points = HandPoints(hand="right", seq=1, stamp_ns=NOW_NS, points=[point, lost])
    lines = table(points, NOW_NS)
    assert cells(lines[2]) == [
        "wrist",
        "100.0",
        "-25.5",
        "500.0",
        "1.0",
        "1.0",
        "2.0",
        "left",
        "right",
    ]
    assert cells(lines[3])[-1] == "predicted"


def test_a_pose_is_a_row_for_each_finger(resting_pose):
    lines = table(resting_pose, resting_pose.stamp_ns)
    assert lines[0] == "right hand, 0 ms old"
    assert cells(lines[1])[0] == "wrist"
    assert [cells(line)[0] for line in lines[4:]] == ["thumb", "index", "middle", "ring", "little"]
    index = resting_pose.fingers[1]
    assert cells(lines[5])[3] == f"{math.degrees(index.angles_rad.mcp):.0f}"


@pytest.fixture
def resting_pose():
    """A pose as the solver publishes it."""
    upright = (1.0, 0.0, 0.0, 0.0)
    joint = HandJoint(
        name="wrist",
        position_m=(0.0, 0.0, 0.5),
        orientation_wxyz=upright,
        radius_m=0.01,
        source="solved",
    )
    fingers = [
        FingerPose(
            name=name,
            angles_rad=FingerAngles(abduction=0.1, mcp=0.5, pip=0.0, dip=0.3),
            residual_m=0.0004,
            iterations=3,
            status="solved",
        )
        for name in ("thumb", "index", "middle", "ring", "little")
    ]
    return HandPose(
        hand="right",
        seq=1,
        stamp_ns=NOW_NS,
        method="dls",
        wrist=WristPose(position_m=(0.0, 0.0, 0.5), orientation_wxyz=upright),
        joints=[joint] * 26,
        fingers=fingers,
    )


def test_health_shows_faults_and_rates_and_no_control_characters():
    stream = StreamHealth(
        key="rhot/desk/hand/right/pose",
        direction="out",
        count=30,
        rate_hz=29.96,
        expected_hz=30.0,
        ok=True,
        dropped=1,
        rejected=0,
        latency_p50_ms=1.0,
        latency_p99_ms=2.0,
    )
    fault = Fault(
        code="event",
        severity="warning",
        subject="",
        text="bad \x1b[31mtext",
        action="read it",
        since_ns=0,
    )
    health = Health(
        service="solver",
        instance="main",
        stamp_ns=NOW_NS,
        version="1",
        pid=7,
        uptime_s=12.0,
        state="running",
        streams=[stream],
        errors=0,
        last_error="",
        cpu_percent=1.0,
        rss_mb=50.0,
        values={"step_ms": 0.5},
        faults=[fault],
    )
    lines = table(health, NOW_NS)
    assert lines[0].startswith("solver/main, 0 ms old")
    assert any("read it [event]" in line for line in lines)
    assert any("30.0 of 30 Hz, 1 dropped, 0 rejected" in line for line in lines)
    assert not any("\x1b" in line for line in lines)


def test_objects_and_anything_else():
    pose = ObjectPose(
        object="cup",
        serial="LHR-1",
        seq=1,
        stamp_ns=NOW_NS,
        position_m=(0.0, 0.1, 0.2),
        orientation_wxyz=(1.0, 0.0, 0.0, 0.0),
        velocity_m_s=(0.0, 0.0, 0.0),
        angular_velocity_rad_s=(0.0, 0.0, 0.0),
        tracking="ok",
        registered=False,
    )
    lines = table(pose, NOW_NS)
    assert any("not registered to the rig; run `rhot calibrate objects`" in line for line in lines)
    assert not any(line.startswith("+-") for line in lines)
    sure = msgspec.structs.replace(pose, registered=True, sigma_m=0.0008, sigma_rad=0.002)
    lines = table(sure, NOW_NS)
    assert ["+-", "0.8", "mm", "0.11", "deg"] in [cells(line) for line in lines]
    assert ["tracking", "tracked"] in [cells(line) for line in lines]
    lines = table(Session(running=True, start_ns=7), NOW_NS)
    assert lines[0] == "Session"
    assert cells(lines[1]) == ["running", "true"]


def test_who_touches_and_holds_an_object():
    contacts = [
        Contact(
            hand="right",
            part=part,
            distance_m=off_m,
            sigma_m=0.0012,
            point_m=(0.0, 0.0, 0.5),
            touching=off_m < 0.001,
            since_ns=NOW_NS - 1_500_000_000 if off_m < 0.001 else 0,
        )
        for part, off_m in (("thumb", -0.0004), ("ring", 0.0213))
    ]
    grasp = Grasp(hand="right", parts=["thumb", "index"], since_ns=NOW_NS)
    message = ObjectContacts(
        object="cup", seq=1, stamp_ns=NOW_NS, contacts=contacts, grasps=[grasp]
    )
    lines = table(message, NOW_NS)
    assert lines[0] == "cup, who touches it, 0 ms old"
    assert cells(lines[2]) == ["right", "thumb", "-0.4", "1.2", "1.5", "touches"]
    assert cells(lines[3]) == ["right", "ring", "21.3", "1.2"]
    assert lines[4] == "right hand holds cup (thumb, index)"


@pytest.mark.parametrize(
    ("stream", "topic", "names"),
    [
        ("hand/right/pose", topics.POSE, {"hand": "right"}),
        ("object/cup/contacts", topics.CONTACTS, {"object": "cup"}),
        ("camera/left/markers", topics.MARKERS, {"camera": "left"}),
        ("control/session", topics.SESSION, {}),
    ],
)
def test_a_stream_is_named_by_the_end_of_its_key(stream, topic, names):
    assert _topic(stream) == (topic, names)


@pytest.mark.parametrize("stream", ["", "hand/right", "camera/left/frame", "rhot/desk/hand", "a b"])
def test_what_is_no_stream_is_refused_with_examples(stream):
    with pytest.raises(BusError, match="say one like hand/right/pose"):
        _topic(stream)
