"""Writes a RigConfig as rig.toml, for captures that must stand alone. Pure.

Values that rig.toml does not know (None) are left out; what load_rig reads back equals what was
written, but for `folder`.
"""

from __future__ import annotations

import json
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
    return (
        name
        if name.replace("_", "").replace("-", "").isalnum() and name.isascii()
        else json.dumps(name)
    )


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    # JSON's numbers, booleans and basic strings are TOML's.
    return json.dumps(value, ensure_ascii=True)
