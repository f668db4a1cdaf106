"""Arguments and options of the `rhot` commands, from the signatures of their functions.

Not from --help, whose layout changes with typer's version.
"""

from __future__ import annotations

import enum
import inspect
import types
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import typer
from typer.models import ArgumentInfo, OptionInfo, ParameterInfo

from services.cli.application import application

_WORDS = {Path: "PATH", str: "TEXT", int: "N", float: "NUMBER"}


class Parameter(NamedTuple):
    """One argument or option of a command."""

    is_option: bool
    # As it is typed, e.g. "-o, --out PATH".
    usage: str
    says: str
    required: bool
    many: bool


def commands() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Every command with its full name, e.g. "rhot calibrate lens", in the order of --help."""
    yield from _commands(application(), "rhot")


def _commands(app: typer.Typer, path: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    for info in app.registered_commands:
        if info.callback is not None:
            yield f"{path} {info.name}", info.callback
    for group in app.registered_groups:
        if group.typer_instance is not None:
            name = group.typer_instance.info.name
            yield from _commands(group.typer_instance, f"{path} {name}")


def parameters(function: Callable[..., Any]) -> list[Parameter]:
    """Arguments and options of a command's function."""
    hints = typing.get_type_hints(function, include_extras=True)
    found = []
    for name, parameter in inspect.signature(function).parameters.items():
        kind, info = typing.get_args(hints[name])[:2]
        if not isinstance(info, ParameterInfo):
            raise TypeError(f"{function.__name__}: parameter {name} is no typer option")
        found.append(_parameter(name, kind, info, parameter.default))
    return found


def _parameter(name: str, kind: Any, info: ParameterInfo, default: Any) -> Parameter:
    kind, many = _without_wrappers(kind)
    required = default is inspect.Parameter.empty
    notes = [info.help or "", *_bounds(info)]
    if not required and default not in (None, False, (), []) and "default" not in notes[0]:
        notes.append(f"default: {_text(default)}")
    if isinstance(info, ArgumentInfo):
        usage = info.metavar or name.upper()
    else:
        usage = _option_names(name, kind, info) + _value(kind, info)
        if required:
            notes.append("must be given")
        if many and "again" not in notes[0] and "repeatable" not in notes[0]:
            notes.append("repeatable")
    says = "; ".join(filter(None, notes))
    return Parameter(isinstance(info, OptionInfo), usage, says, required, many)


def _without_wrappers(kind: Any) -> tuple[Any, bool]:
    """The type without None and list, and whether it was a list."""
    if isinstance(kind, types.UnionType):
        kind = next(part for part in typing.get_args(kind) if part is not types.NoneType)
    many = typing.get_origin(kind) is list
    return (typing.get_args(kind)[0] if many else kind), many


def _option_names(name: str, kind: Any, info: ParameterInfo) -> str:
    # In an Annotated type, typer.Option takes the first name as its default.
    names = [info.default, *(info.param_decls or ())]
    own = [part.strip() for n in names if isinstance(n, str) for part in n.split("/")]
    if not own:
        word = name.replace("_", "-")
        own = [f"--{word}", f"--no-{word}"] if kind is bool else [f"--{word}"]
    # The short form first, as --help has it.
    between = " / " if any(word.startswith("--no-") for word in own) else ", "
    return between.join(sorted(own, key=lambda word: word.startswith("--")))


def _value(kind: Any, info: ParameterInfo) -> str:
    if kind is bool:
        return ""
    return " " + (info.metavar or "|".join(_choices(kind)) or _WORDS[kind])


def _choices(kind: Any) -> list[str]:
    if typing.get_origin(kind) is typing.Literal:
        return list(typing.get_args(kind))
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return [str(member.value) for member in kind]
    return []


def _bounds(info: ParameterInfo) -> list[str]:
    low, high = info.min, info.max
    if low is not None and high is not None:
        return [f"{low:.9g} to {high:.9g}"]
    return [f"at least {low:.9g}"] if low is not None else []


def _text(default: Any) -> str:
    if isinstance(default, bool):
        return "on"
    if isinstance(default, float):
        return f"{default:g}"
    return str(default.value if isinstance(default, enum.Enum) else default)
