"""msgspec's validation errors in the words of a TOML file, with the valid names where a key is
unknown.
"""

from __future__ import annotations

import difflib
import re
from typing import Any

from msgspec import inspect

_AT = re.compile(r" - at (?:`key` in )?`\$(.*)`$")
_UNKNOWN = re.compile(r"unknown field `(.*)`")


def explain(error: str, root: type) -> str:
    """One line for people: where in the file, what is wrong, what would be right.

    error is str(msgspec.ValidationError), root the Struct that was being read.
    """
    at = _AT.search(error)
    path = at[1].lstrip(".") if at else ""
    text = error[: at.start()] if at else error
    unknown = _UNKNOWN.search(text)
    if "enum value" in text:
        valid = _choices(_node_at(root, path), of_keys="`key`" in error)
        text += f"; valid: {', '.join(map(str, valid))}"
    if unknown is None:
        return f"`{path or 'file'}`: {text[:1].lower()}{text[1:]}"
    keys = _keys_of(_node_at(root, path), root)
    near = difflib.get_close_matches(unknown[1], keys, n=1)
    hint = f", did you mean `{near[0]}`?" if near else "."
    where = f"[{path}]" if path else "top level"
    return f"{where}: unknown key `{unknown[1]}`{hint} Valid keys: {', '.join(keys)}"


def _node_at(root: type, path: str) -> Any:
    """The type description at a msgspec path such as `hand[...].markers` or `camera[0]`."""
    node: Any = inspect.type_info(root)
    for part in re.findall(r"[^.\[\]]+|\[\.\.\.\]", path):
        node = _not_none(node)
        if isinstance(node, inspect.DictType):
            node = node.value_type
        elif isinstance(node, inspect.ListType | inspect.VarTupleType):
            node = node.item_type
        else:
            node = next(field.type for field in node.fields if field.encode_name == part)
    return _not_none(node)


def _not_none(node: Any) -> Any:
    if isinstance(node, inspect.UnionType):
        return next(kind for kind in node.types if not isinstance(kind, inspect.NoneType))
    return node


def _choices(node: Any, *, of_keys: bool) -> tuple[Any, ...]:
    node = node.key_type if of_keys else node
    return tuple(getattr(node, "values", ()))


def _keys_of(node: Any, root: type) -> list[str]:
    names = [field.encode_name for field in getattr(node, "fields", ())]
    # `folder` of the whole file is filled in by the reader, never written by people.
    return [name for name in names if name != "folder" or node.cls is not root]
