"""What is said of objects: their state in words, who holds them, what can be done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

import pytest

from rhot.files.config import RigConfig
from rhot.messages.objects import ObjectTracking
from rhot.watch.object_words import ADVICE, WORDS
from services.viewer.live.model import ViewModel
from services.viewer.live.object_texts import label, object_lines

Make = Callable[..., Any]


def test_every_state_has_words_and_all_but_ok_advice() -> None:
    states = set(get_args(ObjectTracking))
    assert set(WORDS) == set(ADVICE) == states
    assert {state for state in states if not ADVICE[state]} == {"ok"}


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({}, "object cup: tracked"),
        (
            {"tracking": "out_of_range"},
            "object cup: out of the lighthouses' view; turn its tracker",
        ),
        ({"tracking": "lost"}, "object cup: lost; is its tracker on"),
        (
            {"registered": False, "tracking": "unregistered"},
            "object cup: not registered to the rig; run `rhot calibrate objects`",
        ),
    ],
)
def test_a_state_is_said_with_what_to_do(
    config: RigConfig, make_object: Make, fields: dict[str, Any], said: str
) -> None:
    model = ViewModel()
    model.object(make_object(**fields), 0.0)
    (line,) = object_lines(config, model.view(0.0))
    assert line.startswith(said)


def test_what_never_came_is_waited_for_and_what_has_gone_is_missed(
    config: RigConfig, make_object: Make
) -> None:
    model = ViewModel()
    assert object_lines(config, model.view(0.0)) == ["waiting for the object cup ..."]
    model.object(make_object(), 0.0)
    (line,) = object_lines(config, model.view(12.0))
    assert line.startswith("object cup: nothing has come for 12 s")


def test_a_hand_that_holds_is_not_also_said_to_touch(
    config: RigConfig, make_object: Make, make_contacts: Make
) -> None:
    model = ViewModel()
    model.object(make_object(), 0.0)
    model.contacts(make_contacts("thumb", "index"), 0.0)
    assert object_lines(config, model.view(0.0))[1:] == ["right hand touches cup (thumb, index)"]
    model.contacts(make_contacts("thumb", "index", "palm", held=("thumb", "index")), 0.0)
    assert object_lines(config, model.view(0.0))[1:] == ["right hand holds cup (thumb, index)"]


def test_the_name_in_the_scene_tells_what_is_not_certain(make_object: Make) -> None:
    model = ViewModel()
    model.object(make_object(), 0.0)
    assert label(model.view(0.0).objects["cup"]) == "cup"
    model.object(make_object(tracking="out_of_range"), 0.0)
    assert label(model.view(0.0).objects["cup"]) == "cup: out of the lighthouses' view"
