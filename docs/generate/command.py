"""docs/reference/command.md: every `rhot` command with what its --help says, and the services."""

from __future__ import annotations

import ast
import inspect
import textwrap
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from docs.generate.markdown import COLUMNS, generated_from, table, wrapped
from docs.generate.signatures import Parameter, commands, parameters

ROOT = Path(__file__).parents[2]
_ABOUT = """`rhot COMMAND --help` says the same. What a user can mend is one line on standard error
and exit code 2; a bug is a traceback and exit code 1. Relative paths in a rig.toml start at its
folder."""
_SERVICES = """`rhot up` and `rhot demo` start the services; on a Raspberry Pi, or under systemd,
start them by these names. Each takes the options below and logs on standard output: with times on a
terminal, with priorities in systemd's journal, as JSON lines with `RHOT_LOG_FORMAT=json`. The
environment variable `RHOT_LOG` sets the level (`debug`, `info`, `warning`)."""
# Alike in rhot/process/lifecycle.py, `command`; tests/docs compares them.
SERVICE_OPTIONS = {
    "--config FILE": "rig.toml; must be given",
    "--camera NAME": "of rhot-pi-tracker: the camera's name in rig.toml; must be given",
    "--instance NAME": "of the others: which one of several this is; default: main",
    "--connect ENDPOINT": "router endpoint, instead of [bus] connect of rig.toml; repeatable",
    "--version": "print the version and end",
}
# How far the descriptions of options are indented at most.
_INDENT = 34


def _usage(path: str, given: list[Parameter]) -> str:
    words = [path]
    words += ["[OPTIONS]"] if any(p.is_option for p in given) else []
    for one in given:
        if not one.is_option:
            word = one.usage if one.required else f"[{one.usage}]"
            words.append(f"{word} ..." if one.many and "..." not in word else word)
    return " ".join(words)


def _block(rows: list[tuple[str, str]]) -> str:
    """Names and what they mean, side by side."""
    indent = min(2 + max(len(name) for name, _ in rows), _INDENT)
    lines = []
    for name, says in rows:
        text = textwrap.wrap(says, COLUMNS - indent, break_on_hyphens=False)
        if len(name) + 2 > indent:
            lines.append(name)
        else:
            text[0] = f"{name:{indent}}{text[0]}"
            lines.append(text.pop(0))
        lines += [" " * indent + line for line in text]
    return "\n".join(lines)


def _section(path: str, function: Callable[..., Any]) -> str:
    given = parameters(function)
    says = inspect.getdoc(function) or ""
    rows = [(one.usage, one.says) for one in given]
    usage = textwrap.fill(_usage(path, given), COLUMNS, subsequent_indent="    ")
    block = usage + ("\n\n" + _block(rows) if rows else "")
    text = "\n\n".join(wrapped(part) for part in says.split("\n\n"))
    return f"### {path}\n\n{text}\n\n```\n{block}\n```"


def services() -> dict[str, str]:
    """The services' commands of pyproject.toml, and what each does."""
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    found = {}
    for name, target in scripts.items():
        path = ROOT / Path(*target.split(".")[:2]) / "service.py"
        if path.is_file():
            found[name] = _serves(path)
    return found


def _serves(path: Path) -> str:
    """First sentence of the docstring of `serve`, without importing what it needs."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.AsyncFunctionDef) and node.name == "serve":
            return " ".join((ast.get_docstring(node) or "").split())
    raise LookupError(f"{path}: no function `serve`")


def page() -> str:
    """The whole page."""
    rows = [[f"`{name}`", says] for name, says in services().items()]
    parts = [
        "# The rhot command and the services",
        generated_from("`services/cli/` and `pyproject.toml`"),
        "## Services",
        wrapped(_SERVICES),
        table(["command", "what it does"], rows),
        "```\n" + _block(list(SERVICE_OPTIONS.items())) + "\n```",
        "## Commands",
        wrapped(_ABOUT),
    ]
    return "\n\n".join([*parts, *(_section(*each) for each in commands())]) + "\n"
