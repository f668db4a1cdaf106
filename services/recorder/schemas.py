"""JSON Schemas of the messages, in the form that MCAP readers such as Foxglove need. Pure."""

from __future__ import annotations

import msgspec

from rhot.topics import Topic

SCHEMA_ENCODING = "jsonschema"


def schema_name(topic: Topic) -> str:
    """The schema's name, or "" for topics that carry no message."""
    return "" if topic.message is None else f"rhot.{topic.message.__name__}"


def json_schema(message: type) -> bytes:
    """The JSON Schema of a message, its root spelled out.

    msgspec makes the root a $ref into $defs, which viewers do not follow; inner references are
    kept.
    """
    schema = msgspec.json.schema(message)
    defs = schema.pop("$defs", {})
    reference = schema.pop("$ref", "").rpartition("/")[2]
    root = {**defs.pop(reference, {}), **schema}
    if defs:
        root["$defs"] = defs
    return msgspec.json.encode(root)
