"""The rules of the house that a machine can check (docs/architecture.md)."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).parents[1]
CLI = ROOT / "services" / "cli"
CODE = sorted([*(ROOT / "rhot").rglob("*.py"), *(ROOT / "services").rglob("*.py")])

MAX_FILE_LINES, MAX_MEDIAN_LINES, MAX_FUNCTION_LINES, MAX_MAIN_LINES = 300, 120, 50, 40

# Only these may touch the outside world: sockets, threads, clocks, logs.
IMPURE_MODULES = {
    "asyncio",
    "zenoh",
    "logging",
    "time",
    "datetime",
    "uvloop",
    "socket",
    "threading",
    "subprocess",
}
IMPURE_RHOT = {
    "bus.py",
    "bus_config.py",
    "bus_streams.py",
    "lifecycle.py",
    "service.py",
    "clock.py",
    "client.py",
    "systemd.py",
}
IMPURE_SERVICE_FILES = {"service.py", "__main__.py"}
IMPURE_FOLDERS = {"sources", "sinks", "cli"}

# services/cli is the one place that knows all services: it composes their pure steps offline.
COMPOSERS = {"cli"}
# Rooms of the command that work on files alone: what they find must not depend on when they run.
PURE_CLI_ROOMS = {"check", "evaluate", "offline"}
# Which rooms of the command may use which others. No circles: keep it so.
CLI_ROOM_USES = {"calibrate": {"offline"}, "evaluate": {"offline"}}


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def imports_of(tree: ast.AST, *, top_level_only: bool = False) -> set[str]:
    """Full names of everything imported, `from a import b` as a.b.

    Without what only the type checker sees.
    """
    names: set[str] = set()
    guarded = {
        id(inner) for node in ast.walk(tree) if _is_type_checking(node) for inner in ast.walk(node)
    }
    nodes = ast.iter_child_nodes(tree) if top_level_only else ast.walk(tree)
    for node in nodes:
        if id(node) in guarded:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def may_be_impure(path: Path) -> bool:
    parts = path.relative_to(ROOT).parts
    if parts[0] == "rhot":
        return path.name in IMPURE_RHOT
    if parts[1] == "cli" and parts[2] in PURE_CLI_ROOMS:
        return False
    return (
        path.name in IMPURE_SERVICE_FILES
        or bool(set(parts[1:-1]) & IMPURE_FOLDERS)
        or path.stem in IMPURE_FOLDERS
    )


def own_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    lines = (node.end_lineno or node.lineno) - node.lineno + 1
    if ast.get_docstring(node):
        lines -= (node.body[0].end_lineno or 0) - node.body[0].lineno + 1
    return lines


@pytest.mark.parametrize("path", CODE, ids=relative)
def test_rhot_imports_no_service_and_services_not_each_other(path):
    parts = path.relative_to(ROOT).parts
    for name in imports_of(ast.parse(path.read_text())):
        if not name.startswith("services."):
            continue
        assert parts[0] == "services", (
            f"{relative(path)} imports {name}: the shared vocabulary must not know its users"
        )
        assert parts[1] in {name.split(".")[1], *COMPOSERS}, (
            f"{relative(path)} imports {name}: services meet on the bus only"
        )


@pytest.mark.parametrize(
    "path",
    [path for path in CODE if path.is_relative_to(CLI) and path.name != "__main__.py"],
    ids=relative,
)
def test_rooms_of_the_command_use_no_others_but_those_named(path):
    rooms = {folder.parent.name for folder in CLI.glob("*/__init__.py")}
    own = path.parent.name if path.parent != CLI else None
    used = {
        parts[2]
        for name in imports_of(ast.parse(path.read_text()))
        if len(parts := name.split(".")) > 2 and name.startswith("services.cli.")
    }
    foreign = (used & rooms) - {own} - CLI_ROOM_USES.get(own, set())
    assert not foreign, (
        f"{relative(path)} imports from {sorted(foreign)}: what rooms share belongs beside them in services/cli"
    )


@pytest.mark.parametrize("path", [path for path in CODE if not may_be_impure(path)], ids=relative)
def test_pure_modules_stay_pure(path):
    impure = {
        name
        for name in imports_of(ast.parse(path.read_text()))
        if name.split(".")[0] in IMPURE_MODULES
    }
    impure |= {
        n
        for n in imports_of(ast.parse(path.read_text()))
        if n.startswith(("rhot.bus.bus", "rhot.process.lifecycle", "rhot.clock.now_ns"))
    }
    assert not impure, (
        f"{relative(path)} imports {sorted(impure)}: algorithms take time as an argument"
    )


def test_keys_are_written_in_the_topics_table_only():
    for path in CODE:
        if path.name == "topics.py":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and not isinstance(node, ast.Expr)
            ):
                assert (
                    not node.value.startswith(
                        ("rhot/", "camera/", "hand/", "openvr/", "object/", "control/")
                    )
                    or " " in node.value
                ), f"{relative(path)}:{node.lineno} writes the key {node.value!r}"


@pytest.mark.parametrize("path", CODE, ids=relative)
def test_files_and_functions_stay_small(path):
    text = path.read_text()
    assert text.count("\n") <= MAX_FILE_LINES, f"{relative(path)} has outgrown its room"
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            limit = MAX_MAIN_LINES if node.name == "serve" else MAX_FUNCTION_LINES
            assert own_lines(node) <= limit, (
                f"{relative(path)}:{node.lineno} {node.name} has {own_lines(node)} lines"
            )


def test_the_median_file_is_short():
    assert median(path.read_text().count("\n") for path in CODE) <= MAX_MEDIAN_LINES


@pytest.mark.parametrize("path", CODE, ids=relative)
def test_modules_and_public_names_say_what_they_are(path):
    tree = ast.parse(path.read_text())
    if not tree.body:
        return
    assert ast.get_docstring(tree), f"{relative(path)} has no docstring"
    for node in tree.body:
        if isinstance(
            node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
        ) and not node.name.startswith("_"):
            is_table = isinstance(node, ast.ClassDef) and path.name == "config.py"
            assert is_table or ast.get_docstring(node), (
                f"{relative(path)}:{node.lineno} {node.name} has no docstring"
            )


@pytest.mark.parametrize("path", CODE, ids=relative)
def test_no_assert_on_input(path):
    for node in ast.walk(ast.parse(path.read_text())):
        assert not isinstance(node, ast.Assert), (
            f"{relative(path)}:{node.lineno}: raise an error that says what to do"
        )


@pytest.mark.parametrize(
    ("module", "forbidden"),
    [
        (
            "services.pi_tracker.__main__",
            {"scipy", "numba", "viser", "mcap", "typer", "matplotlib"},
        ),
        (
            "services.object_tracker.__main__",
            {"scipy", "numba", "viser", "cv2", "mcap", "matplotlib"},
        ),
        ("rhot.client", {"scipy", "numba", "viser", "cv2", "mcap", "typer", "matplotlib"}),
        ("services.cli.__main__", {"scipy", "numba", "viser", "cv2", "matplotlib"}),
    ],
)
def test_a_process_imports_only_what_it_needs(module, forbidden):
    script = f"import sys, {module}; print(*{{name.split('.')[0] for name in sys.modules}})"
    loaded = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        cwd=ROOT,
    ).stdout.split()
    assert not forbidden & set(loaded)
