"""docs/reference/messages.md, from the messages' own types and docstrings."""

from __future__ import annotations

import inspect as python
from types import ModuleType

import msgspec
from msgspec import inspect

import rhot.messages
import rhot.messages.calibration
import rhot.messages.camera
import rhot.messages.health
import rhot.messages.objects
import rhot.messages.recording
import rhot.messages.simulator
from docs.generate.markdown import generated_from, paragraphs, table, wrapped
from docs.generate.type_words import default_of, in_words
from rhot.topics import TOPICS

_ABOUT = """Every message is a JSON object. A field without a default must be there; unknown fields
are ignored; what does not decode is counted as rejected and dropped. The unit is the end of the
name; `3 x number` is a list of three numbers. `stamp_ns` is CLOCK_REALTIME at the instant the
content describes, `sent_ns` the instant of sending on the sender's own clock (0 in files). Frames
and angles: [frames](frames.md). Keys and rates: [topics](topics.md)."""

_MODULES = (
    rhot.messages,
    rhot.messages.objects,
    rhot.messages.health,
    rhot.messages.camera,
    rhot.messages.calibration,
    rhot.messages.recording,
    rhot.messages.simulator,
)

# End of a field's name -> unit; the longest that fits counts.
_UNITS = {
    "_m": "m",
    "_m_s": "m/s",
    "_rad": "rad",
    "_rad_s": "rad/s",
    "_px": "px",
    "_ns": "ns",
    "_us": "us",
    "_ms": "ms",
    "_s": "s",
    "_hz": "Hz",
    "_mb": "MB",
    "_percent": "%",
    "_wxyz": "unit quaternion",
}


def unit_of(name: str) -> str:
    """The unit that a field's name ends in."""
    ends = [end for end in _UNITS if name.endswith(end)]
    return _UNITS[max(ends, key=len)] if ends else ""


def _structs(module: ModuleType) -> list[type]:
    """Message classes of a module, in the order of its text; without its bases."""
    found = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, msgspec.Struct)
        and value.__module__ == module.__name__
        and value.__struct_fields__
    ]
    return sorted(found, key=lambda cls: python.getsourcelines(cls)[1])


def _section(cls: type) -> str:
    kind = inspect.type_info(cls)
    if not isinstance(kind, inspect.StructType):
        raise TypeError(f"{cls} is no message")
    keys = [f"`{topic.template}`" for topic in TOPICS if topic.message is cls]
    rows = [
        [
            f"`{field.encode_name}`",
            in_words(field.type, link=True),
            unit_of(field.name),
            "" if field.required else f"`{default_of(field)}`",
        ]
        for field in kind.fields
    ]
    parts = [f"## {cls.__name__}", paragraphs(python.getdoc(cls) or "")]
    if keys:
        parts.append(f"On {', '.join(keys)}.")
    return "\n\n".join([*parts, table(["field", "type", "unit", "default"], rows)])


def page() -> str:
    """The whole page."""
    messages = [cls for module in _MODULES for cls in _structs(module)]
    return (
        "\n\n".join(
            [
                "# Messages",
                generated_from("`rhot/*messages.py`"),
                wrapped(_ABOUT),
                *map(_section, messages),
            ]
        )
        + "\n"
    )
