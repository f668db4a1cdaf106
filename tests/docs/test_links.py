"""Links, files and commands that pages name exist."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.generate import signatures
from docs.generate.pages import ROOT, pages

PAGES = pages()
# What this project builds later: the issue that builds it -> commands that pages may name already.
TO_COME = {"objects": {"rhot calibrate objects"}}
_CODE_BLOCK = re.compile(r"^( *)```\w*\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`\n]+)`")
# Folders of the tree; what is elsewhere (calibration/, recordings/) is the user's.
_FOLDERS = ("rhot", "services", "tests", "benchmarks", "docs", "config", "testing", ".ci")
_PATH = re.compile(rf"(?:{'|'.join(map(re.escape, _FOLDERS))})/[\w./-]*")
_SCRIPT = re.compile(r"[\w./-]*\w\.py")


def slug(heading: str) -> str:
    """The anchor that GitHub makes of a heading."""
    return re.sub(r"[^\w -]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    """All anchors of a page."""
    text = _CODE_BLOCK.sub("", page.read_text(encoding="utf-8"))
    return {slug(line.lstrip("#")) for line in text.splitlines() if line.startswith("#")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    text = _CODE_BLOCK.sub("", page.read_text(encoding="utf-8"))
    for link in _LINK.findall(text):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        target, _, anchor = link.partition("#")
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f"{link}: no such file"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{link}: no such heading"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_are_named_exist(page):
    text = page.read_text(encoding="utf-8")
    blocks = [block[2] for block in _CODE_BLOCK.finditer(text)]
    names = [word for code in [*_CODE.findall(text), *blocks] for word in code.split()]
    for name in names:
        if _PATH.fullmatch(name):
            assert (ROOT / name).exists() or list(ROOT.glob(f"{name}*")), f"{name}: no such file"
        elif _SCRIPT.fullmatch(name):
            assert list(ROOT.glob(f"[a-z]*/**/{name}")), f"{name}: no file ends so"


def commands_in(text: str) -> Iterator[str]:
    """Every `rhot ...` in backticks, and every line of a code block that begins so."""
    plain = _CODE_BLOCK.sub("", text)
    yield from (code for code in _CODE.findall(plain) if code.startswith("rhot "))
    for block in _CODE_BLOCK.finditer(text):
        for line in block[2].splitlines():
            # Two commands may share a line, far apart.
            yield from (part for part in re.split(r"\s{3,}", line.strip()) if part[:5] == "rhot ")


COMMANDS = {path: signatures.parameters(function) for path, function in signatures.commands()}
GROUPS = {path.rpartition(" ")[0] for path in COMMANDS}


def problem_of(line: str) -> str | None:
    """What is wrong with a `rhot ...` that a page names; None if nothing."""
    words = shlex.split(line.partition(" #")[0].replace("...", ""))
    known = {option for path in COMMANDS for option in _options(path)}
    end = next((n for n, word in enumerate(words) if word.startswith("-")), len(words))
    path = next((p for n in (3, 2) if (p := " ".join(words[: min(n, end)])) in COMMANDS), None)
    given = {word.partition("=")[0] for word in words if word.startswith("--")}
    if path is None:
        alone = " ".join(words[:end])
        if alone in GROUPS or words[1:2] in (["--help"], ["--version"], ["COMMAND"], []):
            return None
        return None if alone in set().union(*TO_COME.values()) else "no such command"
    missing = given - (_options(path) if path else known) - {"--help"}
    return f"no option {sorted(missing)}" if missing else None


def _options(path: str) -> set[str]:
    return {word for one in COMMANDS[path] for word in re.findall(r"--[\w-]+", one.usage)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_that_are_named_exist(page):
    for line in commands_in(page.read_text(encoding="utf-8")):
        for one in _alternatives(line):
            assert problem_of(one) is None, f"{line}: {problem_of(one)}"


def _alternatives(line: str) -> list[str]:
    """`rhot calibrate lens|stereo` is two commands."""
    match = re.match(r"(rhot calibrate )(\w+(?:\|\w+)+)(.*)", line)
    return [match[1] + name + match[3] for name in match[2].split("|")] if match else [line]


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("rhot demo --seconds 10", False),
        ("rhot calibrate lens", False),
        ("rhot calibrate", False),
        ("rhot --help", False),
        ("rhot dance", True),
        ("rhot demo --second 10", True),
        ("rhot calibrate lenses", True),
    ],
)
def test_wrong_commands_are_noticed(line, wrong):
    assert bool(problem_of(line)) == wrong
