"""What is wrong stands above all, its reason first, with what to do, plain and harmless."""

from __future__ import annotations

from rhot.watch.causes import causes
from rhot.watch.rig_state import ServiceRow, StandingFault
from services.viewer.panel.fault_texts import (
    banner,
    following,
    headline,
    of_no_start,
    starting,
    wait,
)
from testing.sample_health import NOW_NS, beat, fault

EVIL = '<script>alert("x")</script><img src=x onerror=alert(1)>\x1b[2J'


def found(*faults, teller="fusion"):
    return causes([StandingFault(teller=teller, fault=one) for one in faults])


def test_nothing_is_said_while_all_is_well():
    assert banner([], NOW_NS) == following([]) == headline([]) == ""


def test_what_since_when_and_what_to_do():
    said = banner(found(fault("camera_moved", "left has moved", "left", since_s=125)), NOW_NS)
    assert "problem:" in said
    assert "left has moved (says fusion), for 2 min" in said
    assert "<code>rhot calibrate stereo</code>" in said
    assert "camera_moved" not in said
    # A sender's clock that is ahead says nothing of how long it lasts.
    assert ", for" not in banner(found(fault("disk_low", "low", since_s=-60)), NOW_NS)
    assert "for 3 hours" in banner(found(fault("event", since_s=10800)), NOW_NS)


def test_what_is_mended_alike_stands_together():
    both = banner(
        found(
            fault("camera_slow", "'left' delivers 4 pictures", "left"),
            fault("camera_slow", "'right' delivers 5 pictures", "right"),
            fault("disk_low", "the disk is full"),
        ),
        NOW_NS,
    )
    assert both.count("note:") == 2
    assert "&#x27;left&#x27; delivers 4 pictures (says fusion)<br>&#x27;right&#x27;" in both
    assert both.count("lower fps or size_px") == 1


def test_problems_push_notes_aside_and_nothing_is_lost():
    every = found(fault("camera_moved", "left has moved", "left"), fault("disk_low", "low"))
    assert "low" not in banner(every, NOW_NS)
    assert "low (says fusion)" in following(every)


def test_what_follows_is_told_apart():
    both = found(
        fault("stream_slow", "rhot/sim/hand/*/points: 0.0 a second received instead of 30.0"),
        fault("camera_moved", "left has moved", "left"),
    )
    assert "0.0 a second" not in banner(both, NOW_NS)
    assert "points of the hands: 0.0 a second received instead of 30.0" in following(both)
    assert "rhot/sim" not in following(both)
    assert headline(both) == "1 problem"
    assert headline(found(fault("disk_low"), fault("computer_hot"))) == "2 notes"


def test_strangers_cannot_write_html():
    evil = [StandingFault(teller=EVIL, fault=fault("event", EVIL, EVIL))]
    follower = StandingFault(teller=EVIL, fault=fault("no_pose", EVIL))
    for said in (banner(causes(evil), NOW_NS), following(causes([*evil, follower]))):
        assert "<script" not in said
        assert "<img" not in said
        assert "\x1b" not in said


def test_what_is_too_much_is_counted():
    many = found(*(fault("event", str(n)) for n in range(30)))
    assert banner(many, NOW_NS).count("(says fusion)") == 3
    assert following(many).count("(says fusion)") == 27
    slow = found(fault("camera_moved"), *(fault("stream_slow", str(n)) for n in range(60)))
    assert "30 more" in following(slow)


def test_while_programs_start_nobody_is_told_what_merely_follows():
    rows = [
        ServiceRow(service=name, instance="main", state=state, health=health)
        for name, state, health in (
            ("fusion", "starting", beat("fusion", state="starting")),
            ("solver", "starting", beat("solver", state="starting", uptime_s=900.0)),
            ("simulator", "running", beat("simulator")),
            ("object_tracker", "absent", None),
        )
    ]
    # Who prepares itself for a quarter of an hour is stuck, and what follows from it is told.
    assert starting(rows) == ["fusion"]
    assert "fusion" in wait(starting(rows))
    assert "2 more" in wait(["a", "b", "c", "d", "e"])
    standing = [
        StandingFault(teller="fusion", fault=fault(code))
        for code in ("stream_slow", "session_stopped", "clock_unknown", "camera_moved")
    ]
    assert [one.fault.code for one in of_no_start(standing)] == ["camera_moved"]
    assert "<script" not in wait([EVIL])
