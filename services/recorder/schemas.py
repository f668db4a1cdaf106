"""Names of the schemas that stand in recordings. Pure."""

from __future__ import annotations

from rhot.topics import Topic

SCHEMA_ENCODING = "jsonschema"


def schema_name(topic: Topic) -> str:
    """The schema's name, or "" for topics that carry no message."""
    return "" if topic.message is None else f"rhot.{topic.message.__name__}"
