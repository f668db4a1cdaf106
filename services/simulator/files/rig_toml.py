"""Writes a RigConfig as rig.toml, for captures that must stand alone. Pure.

What load_rig reads back equals what was written, except for `folder`. Values that are None are left
out: TOML has no word for them. tomli-w would write [[object]] as one inline array of tables and
every array over several lines: people read and edit this file, and its bytes would change.
"""

from __future__ import annotations

import json
import math
from typing import Any

import msgspec

from rhot.files.config import RigConfig


def rig_toml(config: RigConfig, comment: str) -> str:
    """The text of a rig.toml with every value spelled out, under one line of comment."""
    tables = msgspec.to_builtins(config)
    del tables["folder"]
    lines = [f"# {comment}"]
    for name, value in tables.items():
        lines += _table([name], value)
    return "\n".join(lines) + "\n"


def _table(path: list[str], value: Any) -> list[str]:
    if isinstance(value, list):
        return [line for item in value for line in ["", f"[[{_dotted(path)}]]", *_body(path, item)]]
    return ["", f"[{_dotted(path)}]", *_body(path, value)]


def _body(path: list[str], table: dict[str, Any]) -> list[str]:
    plain = {k: v for k, v in table.items() if v is not None and not isinstance(v, dict)}
    lines = [f"{_key(k)} = {_value(v)}" for k, v in plain.items()]
    for k, v in table.items():
        if isinstance(v, dict):
            lines += _table([*path, k], v)
    return lines


def _dotted(path: list[str]) -> str:
    return ".".join(_key(part) for part in path)


def _key(name: str) -> str:
    bare = name.replace("_", "").replace("-", "").isalnum() and name.isascii()
    return name if bare else _string(name)


def _value(value: Any) -> str:
    match value:
        case list() | tuple():
            return "[" + ", ".join(_value(item) for item in value) + "]"
        case str():
            return _string(value)
        case float() if not math.isfinite(value):
            # inf, -inf or nan.
            return str(value)
        case _:
            # JSON's other numbers and booleans are TOML's.
            return json.dumps(value)


def _string(text: str) -> str:
    """A basic string in ASCII.

    As JSON writes it, but for two kinds of characters: JSON leaves DEL as it is, and writes those
    beyond 16 bits as two surrogates; TOML allows neither.
    """
    return '"' + "".join(_character(c) for c in text) + '"'


def _character(c: str) -> str:
    if c == "\x7f":
        return "\\u007f"
    return f"\\U{ord(c):08x}" if ord(c) > 0xFFFF else json.dumps(c)[1:-1]
