"""Real scenes for contacts: a solved hand with noise, and a cup."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from rhot.messages.objects import ObjectContacts, ObjectPose
from services.object_tracker.contacts.step import ContactStep
from testing.synthetic_grasps import GraspScene, Recording, Setting, record


@cache
def _recorded(setting: Setting) -> tuple[GraspScene, Recording]:
    scene = GraspScene(setting)
    return scene, record(scene)


@pytest.fixture
def recorded() -> Callable[..., tuple[GraspScene, Recording]]:
    """A scene and its recording, of a Setting's fields."""
    return lambda **fields: _recorded(Setting(**fields))


def contacts(scene: GraspScene, recording: Recording) -> list[ObjectContacts]:
    """All messages of a recording, through the step."""
    step, messages = ContactStep({"cup": scene.solid}), []
    for pose in recording.merged():
        if isinstance(pose, ObjectPose):
            step.note(pose)
        else:
            messages += step.step(pose)
    return messages


@pytest.fixture
def followed() -> Callable[[GraspScene, Recording], list[ObjectContacts]]:
    """All messages of a recording, through the step."""
    return contacts
