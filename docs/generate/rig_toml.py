"""docs/reference/rig-toml.md, from the types and comments of rhot/files/rig_tables.py."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import inspect

from docs.generate.markdown import generated_from, in_markdown, paragraphs, wrapped
from docs.generate.type_words import default_of, in_words
from rhot.files.config import RigConfig
from rhot.files.rig_comments import comments_of

_ABOUT = """The one file of a rig that people write. A table that is missing means its defaults; an
unknown table or key is an error that names the nearest valid one. `rhot check rig.toml` lists
everything that is wrong. Tools never change it: what they measure is in `calibration/`. Ready to
copy: [config/rig.example.toml](../../config/rig.example.toml)."""
# What may follow the name of a table that holds tables.
_KEYS = {"hand": ("left", "right")}


def _key(field: inspect.Field, comment: str) -> str:
    default = "must be given" if field.required else f"default `{_toml(default_of(field) or '')}`"
    head = f"* **`{field.encode_name}`**: {in_words(field.type)}; {default}."
    return wrapped(f"{head} {in_markdown(comment)}", indent="  ", first="")


def _toml(value: str) -> str:
    """A JSON value as TOML writes it, where they differ."""
    return value.replace(",", ", ")


def _tables(cls: type, name: str, header: str) -> Iterator[str]:
    """The section of one table and of the tables in it."""
    kind = inspect.type_info(cls)
    if not isinstance(kind, inspect.StructType):
        raise TypeError(f"{cls} is no table")
    comments = comments_of(cls)
    own, inner = [], []
    for field in kind.fields:
        below = _table_of(field.type)
        if below is None:
            own.append(_key(field, comments.get(field.name, "")))
        else:
            inner.append((field, *below))
    if name and own:
        parts = [f"## {header}", paragraphs(vars(cls).get("__doc__") or ""), "\n".join(own)]
        yield "\n\n".join(filter(None, parts))
    for field, below_cls, many in inner:
        path = f"{name}.{field.name}".lstrip(".")
        yield from _tables(below_cls, path, _header(path, field, many))


def _table_of(kind: inspect.Type) -> tuple[type, str] | None:
    """The struct that a field holds, and whether one, a list or a dictionary of them."""
    match kind:
        case inspect.StructType():
            return kind.cls, "one"
        case inspect.UnionType():
            return next(filter(None, map(_table_of, kind.types)), None)
        case inspect.ListType(item_type=inspect.StructType() as item):
            return item.cls, "list"
        case inspect.DictType(value_type=inspect.StructType() as value):
            return value.cls, "dict"
    return None


def _header(path: str, field: inspect.Field, many: str) -> str:
    match many:
        case "list":
            return f"`[[{path}]]`"
        case "dict":
            return ", ".join(f"`[{path}.{key}]`" for key in _KEYS[field.name])
    return f"`[{path}]`"


def page() -> str:
    """The whole page."""
    sections = list(_tables(RigConfig, "", ""))
    return (
        "\n\n".join(
            ["# rig.toml", generated_from("`rhot/files/rig_tables.py`"), wrapped(_ABOUT), *sections]
        )
        + "\n"
    )
