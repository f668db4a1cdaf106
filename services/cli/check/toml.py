"""Every mistake in a rig.toml, not only the first: what rhot.files.config would reject, key by key.

Wrong values are taken out, so that the rest of the file can still be checked. A file that is
missing or is not TOML has one problem and no configuration.
"""

from __future__ import annotations

import difflib
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any, get_args, get_origin

import msgspec

from rhot.errors import ConfigError
from rhot.files.config import (
    RigConfig,
    load_rig,
    with_joints,
)
from rhot.files.config_errors import explain
from rhot.files.table_rules import joints_problem, shape_problem, sharing_problem
from rhot.hand import LANDMARKS
from services.cli.check.problems import Problem, error


def read_rig(path: Path) -> tuple[RigConfig | None, list[Problem]]:
    """The configuration without its wrong values, and what is wrong with them.

    None if nothing can be read at all.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        try:
            load_rig(path)
        except ConfigError as broken:
            return None, [error(path, str(broken).removeprefix(f"{path}: "))]
        raise
    problems: list[Problem] = []
    clean = _clean(data, RigConfig, "", str(path), problems)
    config = msgspec.structs.replace(msgspec.convert(clean, RigConfig), folder=str(path.parent))
    problems += _rules(config, path, problems)
    config = with_joints(config)
    return config, problems or _leftover(path)


def _clean(value: Any, kind: Any, at: str, path: str, problems: list[Problem]) -> Any:
    """value without what does not fit its type kind; UNSET if nothing of it does.

    at is the key's name for people; problems are added to.
    """
    table, origin, of = _table_of(kind), get_origin(kind), get_args(kind)
    if table is not None and isinstance(value, dict):
        return _clean_table(value, table, at, path, problems)
    if origin is list and isinstance(value, list):
        items = [
            _clean(item, of[0], f"{at}[{number}]", path, problems)
            for number, item in enumerate(value)
        ]
        return [item for item in items if item is not msgspec.UNSET]
    if origin is dict and isinstance(value, dict):
        return _clean_dict(value, of[0], of[1], at, path, problems)
    wrong = _wrong(value, kind)
    if wrong is None:
        return value
    problems.append(error(path, f"`{at}`: {wrong}"))
    return msgspec.UNSET


def _clean_table(
    value: dict[str, Any], table: type[msgspec.Struct], at: str, path: str, problems: list[Problem]
) -> Any:
    fields = {field.encode_name: field for field in msgspec.structs.fields(table)}
    if table is RigConfig:
        # Filled in by the reader, never written by people.
        del fields["folder"]
    kept = {}
    for key, inner in value.items():
        if key not in fields:
            problems.append(
                error(path, _unknown(key, list(fields), f"[{at}]" if at else "top level", "key"))
            )
            continue
        inner = _clean(inner, fields[key].type, f"{at}.{key}" if at else key, path, problems)
        if inner is not msgspec.UNSET:
            kept[key] = inner
    absent = [name for name, field in fields.items() if field.required and name not in kept]
    problems += [
        error(path, f"[{at}]: `{name}` is missing") for name in absent if name not in value
    ]
    return msgspec.UNSET if absent else kept


def _clean_dict(
    value: dict[str, Any], keys: Any, values: Any, at: str, path: str, problems: list[Problem]
) -> dict[str, Any]:
    kept = {}
    for key, inner in value.items():
        if _wrong(key, keys) is not None:
            problems.append(
                error(path, _unknown(key, [str(name) for name in get_args(keys)], f"[{at}]", "key"))
            )
            continue
        inner = _clean(inner, values, f"{at}.{key}", path, problems)
        if inner is not msgspec.UNSET:
            kept[key] = inner
    return kept


def _rules(config: RigConfig, path: Path, known: list[Problem]) -> list[Problem]:
    """The rules that `load_rig` names one breach of at a time, for all breaches.

    known are the problems so far.
    """
    problems = []
    colors: Counter[str] = Counter()
    for hand, table in config.hand.items():
        where = f"[hand.{hand}.markers]"
        problems += [
            error(path, _unknown(name, list(LANDMARKS), where, "landmark"))
            for name in table.markers
            if name not in LANDMARKS
        ]
        # A table is not called empty for what was taken out of it.
        if wrong_joints := joints_problem(table):
            problems.append(error(path, f"[hand.{hand}]: {wrong_joints}"))
        if shared := sharing_problem(table):
            problems.append(error(path, f"{where}: {shared}"))
        if not (table.markers or table.joints) and not any(
            f"hand.{hand}.markers" in problem.what for problem in known
        ):
            problems.append(
                error(
                    path, f'{where}: is empty; name at least one landmark, e.g. index_tip = "blue"'
                )
            )
        # Landmarks of one hand may share a colour.
        colors.update({*table.markers.values(), *([table.joints] if table.joints else [])})
    colors.update(item.marker for item in config.object if item.marker)
    problems += [
        error(path, f"[[object]] {item.name!r}: {wrong}")
        for item in config.object
        if (wrong := shape_problem(item))
    ]
    for what, names in (
        ("[[camera]] name", Counter(c.name for c in config.camera)),
        ("[[object]] name", Counter(o.name for o in config.object)),
        ("[[object]] serial", Counter(o.serial for o in config.object)),
        ("colour", colors),
    ):
        problems += [
            error(path, f"{what} {name!r} is used {count} times; each must be its own")
            for name, count in names.items()
            if count > 1
        ]
    return problems


def _leftover(path: Path) -> list[Problem]:
    """What only rhot.files.config itself rejects: it decides in the end."""
    try:
        load_rig(path)
    except ConfigError as broken:
        return [error(path, str(broken).removeprefix(f"{path}: "))]
    return []


def _wrong(value: Any, kind: Any) -> str | None:
    """Why a value does not fit, as rhot.files.config says it, or None."""
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as wrong:
        return explain(str(wrong), kind).removeprefix("`file`: ")
    return None


def _unknown(name: str, valid: list[str], where: str, what: str) -> str:
    near = difflib.get_close_matches(name, valid, n=1)
    guess = f", did you mean `{near[0]}`?" if near else "."
    return f"{where}: unknown {what} `{name}`{guess} Valid: {', '.join(valid)}"


def _table_of(kind: Any) -> type[msgspec.Struct] | None:
    """The table itself, or the one inside `Table | None`."""
    if get_origin(kind) in (list, dict):
        return None
    return next((one for one in (kind, *get_args(kind)) if _is_struct(one)), None)


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)
