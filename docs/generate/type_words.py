"""Types of messages and settings in words, with their bounds."""

from __future__ import annotations

from typing import Any

import msgspec
from msgspec import inspect

# Names that stand for a pattern; the pattern itself says little to a reader.
_PATTERNS = {
    r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$": "name",
    r"^[0-9a-f]{16}$": "16 hexadecimal digits",
}
# Bounds of a signed 64-bit integer are no news.
_WIDE = 2**62


def in_words(kind: inspect.Type, link: bool = False) -> str:
    """A type in words; with `link`, structs are links within the page."""
    match kind:
        case inspect.Metadata():
            return in_words(kind.type, link)
        case inspect.IntType() | inspect.FloatType():
            name = "integer" if isinstance(kind, inspect.IntType) else "number"
            return " ".join(filter(None, [name, _bounds(kind)]))
        case inspect.BoolType():
            return "true or false"
        case inspect.StrType():
            return _PATTERNS.get(kind.pattern or "", "text")
        case inspect.NoneType():
            return "null"
        case inspect.AnyType():
            return "anything"
        case inspect.LiteralType():
            return " or ".join(f"`{msgspec.json.encode(v).decode()}`" for v in kind.values)
        case inspect.UnionType():
            return " or ".join(in_words(part, link) for part in kind.types)
        case inspect.StructType():
            return _struct(kind.cls, link)
        case inspect.DictType():
            return f"map from text to {in_words(kind.value_type, link)}"
        case inspect.ListType() | inspect.VarTupleType():
            return f"list of {in_words(kind.item_type, link)}{_length(kind)}"
        case inspect.TupleType():
            return _tuple([in_words(item, link) for item in kind.item_types])
    raise TypeError(f"{kind}: docs.generate.type_words.py has no words for it")


def default_of(field: inspect.Field) -> str | None:
    """The default as JSON; None of a field that must be given."""
    if field.default is not msgspec.NODEFAULT:
        return msgspec.json.encode(field.default).decode()
    if field.default_factory is not msgspec.NODEFAULT:
        return msgspec.json.encode(field.default_factory()).decode()
    return None


def _bounds(kind: Any) -> str:
    low, high = kind.ge, kind.le
    if kind.gt is not None:
        return f"> {kind.gt:.9g}" + (f", <= {high:.9g}" if high is not None else "")
    if low is not None and high is not None and high < _WIDE:
        return f"{low:.9g}..{high:.9g}"
    return f">= {low:.9g}" if low is not None and low > -_WIDE else ""


def _length(kind: Any) -> str:
    low, high = kind.min_length or 0, kind.max_length
    if high is None:
        return ""
    return f", {low} of them" if low == high else f", at most {high}"


def _struct(cls: type, link: bool) -> str:
    return f"[{cls.__name__}](#{cls.__name__.lower()})" if link else cls.__name__


def _tuple(items: list[str]) -> str:
    return f"{len(items)} x {items[0]}" if len(set(items)) == 1 else f"({', '.join(items)})"
