"""The JSON Schemas of all messages."""

from __future__ import annotations

import json
import re

import pytest

from rhot import topics
from rhot.messages.json_schema import json_schema
from rhot.topics import Topic

MESSAGES = [topic for topic in topics.TOPICS if topic.message is not None]


@pytest.mark.parametrize("topic", MESSAGES, ids=lambda topic: topic.name)
def test_roots_are_objects_and_references_resolve(topic: Topic) -> None:
    assert topic.message is not None
    text = json_schema(topic.message)
    schema = json.loads(text)
    assert schema["type"] == "object"
    assert set(topic.message.__struct_encode_fields__) == set(schema["properties"])
    assert "$ref" not in schema
    for name in re.findall(r'"\$ref":"#/\$defs/(\w+)"', text.decode()):
        assert name in schema["$defs"]
