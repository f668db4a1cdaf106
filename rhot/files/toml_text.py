"""Keys and values as TOML writes them. Pure.

tomli-w would write [[object]] as one inline array of tables and every array over several lines:
people read and edit these files.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any


def toml_path(path: Sequence[str]) -> str:
    """The name of a table: its keys with dots between."""
    return ".".join(toml_key(part) for part in path)


def toml_key(name: str) -> str:
    """A key, in quotes where it needs them."""
    bare = name.replace("_", "").replace("-", "").isalnum() and name.isascii()
    return name if bare else _string(name)


def toml_value(value: Any) -> str:
    """A value; lists on one line."""
    match value:
        case list() | tuple():
            return "[" + ", ".join(toml_value(item) for item in value) + "]"
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
