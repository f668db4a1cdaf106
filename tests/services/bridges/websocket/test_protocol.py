"""What is said over WebSocket, and what is understood."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from rhot.files.config import load_rig
from rhot.hand import JOINTS
from rhot.messages import HandPose
from services.bridges.websocket.protocol import frame, hello, request_from
from testing.sample_hands import random_pose

TOPICS = ("hand/left/pose", "hand/right/pose", "object/cup/pose", "object/cup/contacts")


def test_hello_says_what_it_is():
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    said = json.loads(frame("hello", hello(rig, "1.2.3", 60.0, meshes={"cup": "/cup.glb"})))
    assert said["topic"] == "hello"
    told = said["message"]
    assert (told["program"], told["version"], told["protocol"]) == ("rhot", "1.2.3", 1)
    assert told["joints"] == list(JOINTS)
    assert told["angles"]["thumb"] == ["abduction", "cmc", "mcp", "dip"]
    assert told["rig"] == rig.rig.name
    assert told["hands"] == ["right"]
    assert [one["name"] for one in told["objects"]] == [table.name for table in rig.object]


def test_a_message_is_that_of_the_bus():
    pose = random_pose("left", 2)
    said = json.loads(frame("hand/left/pose", pose))
    assert said["topic"] == "hand/left/pose"
    assert msgspec.convert(said["message"], HandPose) == pose


@pytest.mark.parametrize(
    ("patterns", "wanted"),
    [
        (["hand/*/pose"], {"hand/left/pose", "hand/right/pose"}),
        (["object/cup/*"], {"object/cup/pose", "object/cup/contacts"}),
        (["hand/*"], set()),
        ([], set()),
        (
            ["*/*/*"],
            {"hand/left/pose", "hand/right/pose", "object/cup/pose", "object/cup/contacts"},
        ),
    ],
)
def test_patterns_stand_for_parts(patterns, wanted):
    request = request_from(json.dumps({"subscribe": patterns}))
    assert {topic for topic in TOPICS if request.wants(topic)} == wanted


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[" * 3000,
        '{"subscribe":["a"],"rate_hz":0}',
        '{"subscribe":["a"],"rate_hz":NaN}',
        '{"subscribe":"hand/*/pose"}',
        '{"subscribe":["a/b/c/d/e"]}',
        '{"subscribe":["(a+)+$"]}',
        '{"subscribe":["a"],"more":1}',
        '{"subscribe":' + json.dumps(["a"] * 33) + "}",
        b"\xff\xfe",
    ],
)
def test_everything_else_is_refused_with_what_would_be_right(text):
    with pytest.raises(ValueError, match=r'^send ."subscribe"'):
        request_from(text)
