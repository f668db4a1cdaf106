"""No text sends a user to a command or a file that does not exist."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import typer

from services.cli.application import application
from testing.source_tree import BESIDE, CODE, ROOT, relative, tree_of

# What docs/extend.md makes as an example, and tests/docs/test_extend.py runs.
EXAMPLES = ("services/pi_tracker/sources/pattern.py", "services/pinch/")

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "Makefile"])
# `rhot ...` in backticks, and the lines of code blocks that begin with it.
QUOTED = re.compile(r"`(rhot [^`\n]+)`")
IN_BLOCK = re.compile(r"^\s*(?:\$ )?(rhot (?!is |has )[a-z][^#\n]*)", re.MULTILINE)
FENCED = re.compile(r"^```[a-z]*\n(.*?)^```|((?:^    .*\n)+)", re.MULTILINE | re.DOTALL)
ENTRY_POINT = re.compile(r"\brhot-[a-z][a-z-]*\b")
FILE = re.compile(
    r"(?<![\w./<-])((?:rhot|services|tests|testing|benchmarks|docs|config|deploy)/"
    r"(?:[A-Za-z0-9_.<>*{}-]+/)*(?:[A-Za-z0-9_-]+\.(?:py|md|toml|json5?|sh)|(?=[\s`),.;]|$)))"
)


def texts() -> Iterator[tuple[str, str]]:
    """(where, text) of every page, and of every comment, docstring and string of the code."""
    for path in PAGES:
        yield relative(path), path.read_text(encoding="utf-8")
    for path in [*CODE, *BESIDE]:
        if path.parent.name not in ("tests",):
            yield relative(path), path.read_text(encoding="utf-8")


def strings(path: Path) -> Iterator[tuple[int, str]]:
    """Numbered strings of a file; what an f-string fills in reads `X`."""
    inside = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.JoinedStr):
            inside |= {id(one) for one in node.values}
            parts = (one.value if isinstance(one, ast.Constant) else "X" for one in node.values)
            yield node.lineno, "".join(map(str, parts))
    for node in ast.walk(tree_of(path)):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in inside
        ):
            yield node.lineno, node.value


def _commands() -> Iterator[tuple[str, str]]:
    """(where, command line) of every `rhot ...` that users may read."""
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        blocks = "".join((one[1] or one[2] or "") for one in FENCED.finditer(text))
        for line in [*QUOTED.findall(text), *IN_BLOCK.findall(blocks)]:
            yield relative(path), line
    for path in CODE:
        for number, text in strings(path):
            for line in QUOTED.findall(text):
                yield f"{relative(path)}:{number}", line
            # A string that is a command line as a whole; `rhot demo: ...` is a message.
            if re.match(r"rhot [a-z]+(?: [^:\n]+)?$", text) and "  " not in text:
                yield f"{relative(path)}:{number}", text


@cache
def commands() -> tuple[tuple[str, str], ...]:
    """The same, read once."""
    return tuple(_commands())


ROOT_COMMAND: Any = typer.main.get_command(application())


def unknown_part(line: str) -> str | None:
    """The first word of a command line that `rhot` does not know, or None."""
    # A choice such as lens|stereo is checked word by word; several commands may follow each other.
    for one in re.split(r"\s{2,}rhot |\s&&\s(?:rhot )?", line.removeprefix("rhot ")):
        try:
            words = shlex.split(one.replace("...", " "), comments=True)
        except ValueError:
            words = one.split()
        command: Any = ROOT_COMMAND
        known: set[str] = options_of(command)
        for word in words:
            if word in ("X", "COMMAND"):
                return None
            if word.startswith("--"):
                if word.split("=")[0] not in known:
                    return word
            elif hasattr(command, "commands"):
                choices = [command.commands.get(name) for name in word.split("|")]
                if None in choices:
                    return word
                known = set.union(*(options_of(choice) for choice in choices))
                command = choices[0] if len(choices) == 1 else None
    return None


def options_of(command: Any) -> set[str]:
    """Every `--option` of a command, with those that switch it off."""
    own = (option for one in command.params for option in (*one.opts, *one.secondary_opts))
    return {*own, "--help"}


def test_every_command_that_a_text_names_exists():
    wrong = {
        f"{where}: `{line}`": word for where, line in commands() if (word := unknown_part(line))
    }
    assert not wrong, "\n".join(f"{where} has no {word!r}" for where, word in wrong.items())


def test_the_check_finds_commands_and_knows_wrong_ones():
    assert len({line for _, line in commands()}) > 40
    assert unknown_part("rhot calibrate lens --out X") is None
    assert unknown_part("rhot calibrate lens|stereo") is None
    assert unknown_part("rhot calibrate glasses") == "glasses"
    assert unknown_part("rhot track capture --outt result") == "--outt"
    assert unknown_part("rhot fly") == "fly"


def test_every_entry_point_that_a_text_names_exists():
    pyproject = (ROOT / "pyproject.toml").read_text()
    there = set(re.findall(r"^(rhot-[a-z-]+) = ", pyproject, re.MULTILINE))
    # Not entry points: systemd's units, the root of simulated pictures' keys, and prefixes of
    # folders.
    there |= {unit.stem.split("@")[0] for unit in (ROOT / "deploy" / "systemd").glob("rhot-*")}
    there |= {"rhot-sim", "rhot-picture", "rhot-kernels", "rhot-demo", "rhot-deploy"}
    for where, text in texts():
        for name in ENTRY_POINT.findall(text):
            is_known = name.rstrip("-") in there or any(name.startswith(f"{t}-") for t in there)
            assert is_known or "tests/" in where, f"{where} names {name}, which is no entry point"


def missing(name: str, where: str) -> bool:
    """Whether a file named in a text is not there."""
    # tests/docs makes pages of its own.
    if (
        where.startswith("tests/docs/")
        or any(name.startswith(prefix) for prefix in EXAMPLES)
        or re.search(r"[<>*{}]", name)
    ):
        return False
    path = ROOT / name
    if path.exists():
        return False
    # docs/ in a page of docs/ may be meant from there; captures hold files of their own.
    return not (ROOT / where).parent.joinpath(name).exists()


def test_every_file_that_a_text_names_exists():
    wrong = sorted(
        f"{where} names {name}"
        for where, text in texts()
        for name in FILE.findall(text)
        if missing(name, where)
    )
    assert not wrong, "\n".join(wrong)
