"""A tour speaks of what messages show, and of nothing else."""

from __future__ import annotations

from typing import Literal

from rhot.messages import HandPoint, HandPoints
from rhot.messages.health import Fault
from rhot.messages.objects import Contact, Grasp, HandPart, ObjectContacts
from services.cli.demo.evidence import Evidence
from testing.sample_health import beat


def points(**sources: Literal["measured", "predicted"]) -> HandPoints:
    sigma = (0.001, 0.001, 0.001)
    made = [
        HandPoint(name=name, position_m=(0, 0, 0), sigma_m=sigma, cameras=[], source=source)
        for name, source in sources.items()
    ]
    return HandPoints(hand="right", seq=0, stamp_ns=1, points=made)


def test_a_landmark_that_is_predicted_or_left_out_is_not_measured() -> None:
    evidence = Evidence()
    assert evidence.measured("right", "index_tip") is None
    evidence.add_points(points(index_tip="measured", wrist="measured"))
    assert evidence.measured("right", "index_tip") is True
    evidence.add_points(points(index_tip="predicted", wrist="measured"))
    assert evidence.measured("right", "index_tip") is False
    evidence.add_points(points(index_tip="measured"))
    assert evidence.measured("right", "wrist") is False


def test_a_fault_is_there_until_its_service_tells_of_it_no_more() -> None:
    evidence = Evidence()
    moved = Fault(
        code="camera_moved",
        severity="error",
        subject="left and right",
        text="one has moved",
        action="fasten it",
        since_ns=1,
    )
    evidence.add_health(beat("fusion", faults=[moved]))
    evidence.add_health(beat("solver"))
    assert evidence.fault("camera_moved", "right") == moved
    assert evidence.fault("camera_moved", "top") is None
    evidence.add_health(beat("fusion"))
    assert evidence.fault("camera_moved", "right") is None


def test_who_touches_and_holds_is_the_newest_message_s() -> None:
    evidence = Evidence()
    parts: tuple[HandPart, ...] = ("palm", "index", "thumb")
    contacts = [
        Contact(
            hand="right",
            part=part,
            distance_m=0.0,
            sigma_m=0.001,
            point_m=(0, 0, 0),
            touching=part != "palm",
        )
        for part in parts
    ]
    grasp = Grasp(hand="right", parts=["thumb", "index"], since_ns=2)
    evidence.add_contacts(
        ObjectContacts(object="cup", seq=1, stamp_ns=2, contacts=contacts, grasps=[grasp])
    )
    assert evidence.touching("cup") == ["thumb", "index"]
    assert evidence.grasp("cup") == grasp
    evidence.add_contacts(ObjectContacts(object="cup", seq=2, stamp_ns=3, contacts=[], grasps=[]))
    assert (evidence.touching("cup"), evidence.grasp("cup")) == ([], None)
