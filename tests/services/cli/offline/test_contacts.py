"""Contacts offline are those of the object tracker's step."""

from __future__ import annotations

import pytest

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from services.cli.offline.contacts import ContactTrack
from testing.synthetic_grasps import GraspScene, Setting, record


def rig(folder, **shape):
    return RigConfig(object=[ObjectTable(name="cup", serial="LHR-1", **shape)], folder=str(folder))


def test_hands_meet_the_objects_of_their_own_time(tmp_path):
    scene = GraspScene(Setting(seed=1, noise=0.3))
    recording = record(scene)
    size = (scene.setting.diameter_m, scene.setting.height_m)
    track = ContactTrack(rig(tmp_path, shape="cylinder", size_m=size), recording.objects)
    messages = [one for hand in recording.hands for one in track.step([hand])]
    assert any(message.grasps for message in messages)
    stamps = {message.stamp_ns for message in messages}
    assert stamps <= {hand.stamp_ns for hand in recording.hands}
    # Hands before the first pose of an object have no contacts with it.
    late = ContactTrack(rig(tmp_path, shape="cylinder", size_m=size), recording.objects[200:])
    first = next(one for hand in recording.hands for one in late.step([hand]))
    assert first.stamp_ns >= recording.objects[200].stamp_ns


def test_without_a_shape_nothing_is_read(tmp_path):
    def never():
        raise AssertionError("read")
        yield

    recording = record(GraspScene(Setting(seed=1, noise=0.3)))
    assert ContactTrack(rig(tmp_path), never()).step(recording.hands[:3]) == []


def test_a_wrong_shape_is_told(tmp_path):
    with pytest.raises(ConfigError, match="cup"):
        ContactTrack(rig(tmp_path, shape="sphere"), [])
