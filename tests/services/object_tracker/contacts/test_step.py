"""Scenes through the whole step: real solver, noise, cups."""

from __future__ import annotations

import msgspec
import pytest

from rhot.contact_events import KEPT_NS, GraspEvents, TouchEvents
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.solids import Cylinder
from rhot.messages.objects import ObjectContacts, ObjectPose
from services.cli.evaluate.contacts.contact_score import contact_score
from services.object_tracker.contacts.step import ContactStep, solids_of


def grasp_events(messages):
    events = GraspEvents()
    return [event for message in messages for event in events.feed(message)]


@pytest.mark.parametrize("seed", [1, 4])
def test_a_cup_is_taken_and_put_back(recorded, followed, seed):
    scene, recording = recorded(seed=seed, hand="right" if seed % 2 else "left")
    messages = followed(scene, recording)
    assert [event.kind for event in grasp_events(messages)] == ["begin", "end"]
    score = contact_score(recording.truth, messages, "cup")
    assert (score.touches.true, score.touches.missed, score.touches.false) == (5, 0, 0)
    # Of ten begins and ends; .93 on average over twelve seeds.
    assert score.touches.within_share >= 0.7
    assert (score.grasps.right, score.grasps.false) == (1, 0)


def test_a_hand_that_passes_at_10_mm_is_no_event(recorded, followed):
    scene, recording = recorded(seed=2, gap_m=0.01)
    messages = followed(scene, recording)
    assert min(c.distance_m for m in messages for c in m.contacts) < 0.02
    assert not grasp_events(messages)
    assert not any(contact.touching for message in messages for contact in message.contacts)


def test_the_same_poses_give_the_same_bytes_and_the_messages_decode(recorded, followed):
    scene, recording = recorded(seed=1)
    first, second = followed(scene, recording), followed(scene, recording)
    encoded = [msgspec.json.encode(message) for message in first]
    assert encoded == [msgspec.json.encode(message) for message in second]
    assert [msgspec.json.decode(one, type=ObjectContacts) for one in encoded] == first
    assert max(len(one) for one in encoded) < 4096
    assert [message.seq for message in first] == list(range(len(first)))


def until(recording, seconds):
    """The poses of the first seconds, in order."""
    return [pose for pose in recording.merged() if pose.stamp_ns < 10**18 + seconds * 1e9]


def feed(step, poses):
    messages = []
    for pose in poses:
        if isinstance(pose, ObjectPose):
            step.note(pose)
        else:
            messages += step.step(pose)
    return messages


def test_a_cup_that_is_lost_is_let_go_half_a_second_later(recorded):
    scene, recording = recorded(seed=1, noise=0.3)
    step = ContactStep({"cup": scene.solid})
    assert feed(step, until(recording, 2.7))[-1].grasps
    lost_ns = 10**18 + 2_700_000_000
    later = []
    for pose in recording.merged():
        if lost_ns <= pose.stamp_ns < lost_ns + 10**9:
            lost = isinstance(pose, ObjectPose)
            later += feed(step, [msgspec.structs.replace(pose, tracking="lost") if lost else pose])
    assert not later[-1].contacts
    for message in later:
        age_ns = message.stamp_ns - lost_ns
        # From the last instant at which it was known, a frame or so before it was lost.
        if age_ns < KEPT_NS - 50_000_000:
            assert message.grasps
        if age_ns > KEPT_NS:
            assert not message.grasps
    assert [(one.hand, one.since_ns > 0) for one in later[-1].ended] == [("right", True)]


def test_a_hand_that_is_gone_lets_go_half_a_second_later(recorded):
    scene, recording = recorded(seed=1, noise=0.3)
    step = ContactStep({"cup": scene.solid})
    messages = feed(step, until(recording, 2.7))
    last_ns = messages[-1].stamp_ns
    assert step.idle(last_ns + KEPT_NS // 2) == []
    (message,) = step.idle(last_ns + KEPT_NS + 1)
    assert not message.grasps
    assert message.ended[0].until_ns <= last_ns + KEPT_NS
    assert step.idle(last_ns + 2 * KEPT_NS) == []
    touches = TouchEvents()
    events = [event for one in [*messages, message] for event in touches.feed(one)]
    kinds = [event.kind for event in events]
    assert kinds.count("begin") == kinds.count("end") > 0


@pytest.mark.parametrize("fields", [{"registered": False}, {"tracking": "calibrating"}])
def test_a_cup_that_is_not_where_it_says_touches_nobody(recorded, fields):
    scene, recording = recorded(seed=1)
    poses = [
        msgspec.structs.replace(pose, **fields) if isinstance(pose, ObjectPose) else pose
        for pose in until(recording, 2.7)
    ]
    assert feed(ContactStep({"cup": scene.solid}), poses) == []


def test_predicted_fingers_begin_no_touch(recorded):
    scene, recording = recorded(seed=1)
    poses = [
        pose
        if isinstance(pose, ObjectPose)
        else msgspec.structs.replace(
            pose,
            fingers=[msgspec.structs.replace(f, status="predicted") for f in pose.fingers],
        )
        for pose in until(recording, 2.7)
    ]
    messages = feed(ContactStep({"cup": scene.solid}), poses)
    assert {c.part for m in messages for c in m.contacts if c.touching} <= {"palm"}


def test_time_that_is_set_back_starts_anew(recorded):
    scene, recording = recorded(seed=1)
    step = ContactStep({"cup": scene.solid})
    first = feed(step, until(recording, 2.7))
    again = feed(step, until(recording, 2.7))
    fields = [(m.contacts, m.grasps) for m in first]
    assert [(m.contacts, m.grasps) for m in again][5:] == fields[5:]


def test_shapes_of_a_rig(tmp_path):
    objects = [
        ObjectTable(name="cup", serial="LHR-1", shape="cylinder", size_m=(0.07, 0.1)),
        ObjectTable(name="plain", serial="LHR-2"),
    ]
    config = RigConfig(object=objects, folder=str(tmp_path))
    assert solids_of(config) == {"cup": Cylinder(0.07, 0.1)}
    broken = [msgspec.structs.replace(objects[0], size_m=(0.07,))]
    with pytest.raises(ConfigError, match="cup"):
        solids_of(RigConfig(object=broken, folder=str(tmp_path)))
