"""The source tree as its tests see it: files, imports, rooms."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOTS = ("rhot", "services", "studies")
CODE = sorted(path for root in ROOTS for path in (ROOT / root).rglob("*.py"))
BESIDE = sorted(
    path
    for folder in ("testing", "tests", "benchmarks", "docs", "examples")
    for path in (ROOT / folder).rglob("*.py")
)
_FILES = set(CODE)


def relative(path: Path) -> str:
    """A path from the root of the tree, with slashes."""
    return path.relative_to(ROOT).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    """A file, parsed."""
    return ast.parse(path.read_text(encoding="utf-8"))


def keep_to(rule: Callable[[Path], Iterator[str]], paths: Iterable[Path] = tuple(CODE)) -> None:
    """Fail with every breach of a rule, which yields a sentence for each in a file.

    One test a rule: as one a file, six thousand, their mere number cost a minute.
    """
    breaches = [f"{relative(path)}{breach}" for path in paths for breach in rule(path)]
    assert not breaches, "\n".join(breaches)


@cache
def imports_of(path: Path) -> frozenset[str]:
    """Full names of everything imported anywhere in a file, `from a import b` as a.b."""
    names: set[str] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


def only_for_types(path: Path) -> set[str]:
    """What only the type checker imports."""
    return {
        f"{inner.module}.{alias.name}"
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
        if isinstance(inner, ast.ImportFrom)
        for alias in inner.names
    }


def file_of(name: str) -> Path | None:
    """The file of ours that an imported name comes from."""
    parts = name.split(".")
    for count in (len(parts), len(parts) - 1):
        stem = ROOT.joinpath(*parts[:count])
        for path in (stem.with_suffix(".py"), stem / "__init__.py"):
            if count and path in _FILES:
                return path
    return None


@cache
def uses(path: Path) -> frozenset[Path]:
    """Files of ours that a file imports, also inside functions and for types."""
    found = {file_of(name) for name in imports_of(path) if name.startswith(ROOTS)}
    return frozenset(one for one in found if one is not None and one != path)


def room_of(path: Path) -> str:
    """The room of a file: its folder below rhot/, services/<name>/, studies/<name>/.

    Beside the rooms, the file itself.
    """
    parts = path.relative_to(ROOT).with_suffix("").parts
    doors = 1 if parts[0] == "rhot" else 2
    return "/".join(parts[: doors + 1]) if len(parts) > doors else "/".join(parts)
