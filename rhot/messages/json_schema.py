"""The JSON Schema of a message, as Foxglove and MCAP's readers need it. Pure."""

from __future__ import annotations

import msgspec


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
