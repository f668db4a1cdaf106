"""The JSON Schemas that go into recordings."""

from __future__ import annotations

import json
import re

import pytest

from rhot import topics
from rhot.topics import Topic
from services.recorder.schemas import json_schema, schema_name

RECORDED = [topic for topic in topics.TOPICS if topic.message is not None]


@pytest.mark.parametrize("topic", RECORDED, ids=lambda topic: topic.name)
def test_roots_are_objects_and_references_resolve(topic: Topic) -> None:
    assert topic.message is not None
    text = json_schema(topic.message)
    schema = json.loads(text)
    assert schema["type"] == "object"
    assert set(topic.message.__struct_encode_fields__) == set(schema["properties"])
    assert "$ref" not in schema
    for name in re.findall(r'"\$ref":"#/\$defs/(\w+)"', text.decode()):
        assert name in schema["$defs"]


def test_names() -> None:
    assert schema_name(topics.MARKERS) == "rhot.MarkerFrame"
    assert schema_name(topics.PREVIEW) == ""
