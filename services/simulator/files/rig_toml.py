"""Writes a RigConfig as rig.toml, for captures that must stand alone. Pure.

What load_rig reads back equals what was written, except for `folder`. Values that are None are left
out: TOML has no word for them.
"""

from __future__ import annotations

from typing import Any

import msgspec

from rhot.files.config import RigConfig
from rhot.files.toml_text import toml_key, toml_path, toml_value


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
        return [
            line for item in value for line in ["", f"[[{toml_path(path)}]]", *_body(path, item)]
        ]
    return ["", f"[{toml_path(path)}]", *_body(path, value)]


def _body(path: list[str], table: dict[str, Any]) -> list[str]:
    plain = {k: v for k, v in table.items() if v is not None and not isinstance(v, dict)}
    lines = [f"{toml_key(k)} = {toml_value(v)}" for k, v in plain.items()]
    for k, v in table.items():
        if isinstance(v, dict):
            lines += _table([*path, k], v)
    return lines
