"""Events from states, also when messages are lost."""

from __future__ import annotations

import pytest

from rhot.contact_events import KEPT_NS, GraspEvent, GraspEvents, TouchEvents
from rhot.messages.objects import Contact, Grasp, ObjectContacts

T = 10**9


def message(stamp_ns, *contacts, grasps=(), ended=(), name="cup"):
    return ObjectContacts(
        object=name,
        seq=0,
        stamp_ns=stamp_ns,
        contacts=list(contacts),
        grasps=list(grasps),
        ended=list(ended),
    )


def index(since_ns=0, until_ns=0, part="index"):
    return Contact(
        hand="right",
        part=part,
        distance_m=0.0,
        sigma_m=0.001,
        point_m=(0.0, 0.0, 0.0),
        touching=since_ns > 0,
        since_ns=since_ns,
        until_ns=until_ns,
    )


def grasp(since_ns, until_ns=0, *parts):
    return Grasp(
        hand="right", parts=list(parts or ("thumb", "index")), since_ns=since_ns, until_ns=until_ns
    )


def fed(events, *messages):
    return [(event.kind, event.stamp_ns) for message in messages for event in events.feed(message)]


def test_a_touch_begins_once_and_ends_once():
    found = fed(
        TouchEvents(),
        message(T, index()),
        message(2 * T, index(since_ns=T + 5)),
        message(3 * T, index(since_ns=T + 5)),
        message(4 * T, index(until_ns=3 * T + 7)),
        message(5 * T, index(until_ns=3 * T + 7)),
    )
    assert found == [("begin", T + 5), ("end", 3 * T + 7)]


def test_a_touch_whose_end_was_lost_ends_before_the_next_begins():
    found = fed(
        TouchEvents(),
        message(T, index(since_ns=T - 5)),
        message(4 * T, index(since_ns=3 * T, until_ns=2 * T)),
    )
    assert found == [("begin", T - 5), ("end", 2 * T), ("begin", 3 * T)]


def test_what_is_not_listed_is_kept_for_half_a_second():
    events = TouchEvents()
    assert fed(events, message(T, index(since_ns=T))) == [("begin", T)]
    assert fed(events, message(T + KEPT_NS // 2)) == []
    assert fed(events, message(T + KEPT_NS // 2 + 1, index(since_ns=T))) == []
    late_ns = T + 2 * KEPT_NS
    assert fed(events, message(late_ns)) == [("end", late_ns)]


def test_parts_and_objects_are_apart():
    events = TouchEvents()
    first = events.feed(message(T, index(since_ns=T), index(since_ns=T + 1, part="thumb")))
    other = events.feed(message(T, index(since_ns=T), name="box"))
    assert [(event.object, event.part) for event in [*first, *other]] == [
        ("cup", "index"),
        ("cup", "thumb"),
        ("box", "index"),
    ]


def test_a_grasp_with_its_parts():
    events = GraspEvents()
    (begun,) = events.feed(message(2 * T, grasps=[grasp(T, 0, "thumb", "ring")]))
    assert begun == GraspEvent("begin", "cup", "right", ("thumb", "ring"), T)
    assert events.feed(message(3 * T, grasps=[grasp(T)])) == []
    (ended,) = events.feed(message(4 * T, ended=[grasp(T, 3 * T, "thumb", "ring")]))
    assert ended == GraspEvent("end", "cup", "right", ("thumb", "ring"), 3 * T)
    assert events.feed(message(5 * T, ended=[grasp(T, 3 * T)])) == []


def test_a_grasp_that_was_missed_as_a_whole_is_two_events():
    found = fed(
        GraspEvents(),
        message(T),
        message(9 * T, ended=[grasp(2 * T, 3 * T)]),
        message(10 * T, ended=[grasp(2 * T, 3 * T)]),
    )
    assert found == [("begin", 2 * T), ("end", 3 * T)]


def test_what_had_ended_before_one_listened_is_no_event():
    assert fed(GraspEvents(), message(9 * T, ended=[grasp(2 * T, 3 * T)])) == []


@pytest.mark.parametrize("ended", [[], [(T, 3 * T)]])
def test_a_grasp_is_followed_by_the_next(ended):
    found = fed(
        GraspEvents(),
        message(2 * T, grasps=[grasp(T)]),
        message(5 * T, grasps=[grasp(4 * T)], ended=[grasp(*one) for one in ended]),
    )
    end_ns = 3 * T if ended else 5 * T
    assert sorted(found) == sorted([("begin", T), ("end", end_ns), ("begin", 4 * T)])


def test_a_tracker_that_starts_anew_ends_what_it_knows_nothing_of():
    found = fed(GraspEvents(), message(2 * T, grasps=[grasp(T)]), message(3 * T))
    assert found == [("begin", T), ("end", 3 * T)]


def test_names_from_the_network_do_not_fill_the_memory():
    touches, grasps = TouchEvents(), GraspEvents()
    for number in range(1000):
        one = message(T, index(since_ns=T), grasps=[grasp(T)], name=f"cup{number}")
        assert touches.feed(one)
        assert grasps.feed(one)
    assert len(touches._objects) <= 64
    assert len(grasps._objects) <= 64
