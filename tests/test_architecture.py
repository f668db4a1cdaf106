"""The rules of the house that a machine can check (docs/architecture.md)."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from testing.source_tree import (
    CODE,
    ROOT,
    file_of,
    imports_of,
    keep_to,
    relative,
    room_of,
    tree_of,
    uses,
)

# The floors of rhot/, from the lowest: each uses only what is named, and what lies below it.
FLOORS_OF_RHOT = (
    {"rhot/errors", "rhot/clock", "rhot/geometry", "rhot/kernels", "rhot/plain_text"},
    {"rhot/hand_tables", "rhot/hand", "rhot/hand_exercises", "rhot/hand_skin"},
    {"rhot/messages", "rhot/hand_mesh"},
    {"rhot/topic_kinds"},
    {"rhot/topics", "rhot/faults", "rhot/object_motion", "rhot/contact_events"},
    {"rhot/files", "rhot/bus"},
    {"rhot/process", "rhot/watch"},
    {"rhot/client"},
    {"rhot/blocking"},
    {"rhot/__init__"},
)
# services/cli is the one place that knows all services: it composes their pure steps offline.
COMPOSERS = {"cli"}


def circle_in(graph: dict[str, set[str]]) -> list[str]:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_file_imports_itself_through_others():
    """Imports inside functions and for the type checker count: they are circles all the same."""
    graph = {relative(path): {relative(one) for one in uses(path)} for path in CODE}
    assert not circle_in(graph), " -> ".join(circle_in(graph))


def test_no_room_imports_itself_through_others():
    graph: dict[str, set[str]] = {}
    for path in CODE:
        # A package's docstring and its numba cache are no room.
        if path.name != "__init__.py" or relative(path) == "rhot/__init__.py":
            here = graph.setdefault(room_of(path), set())
            here |= {room_of(one) for one in uses(path) if one.name != "__init__.py"} - {
                room_of(path)
            }
    assert not circle_in(graph), " -> ".join(circle_in(graph))


def test_every_file_of_rhot_is_on_a_floor_and_imports_only_from_below():
    floor_of = {room: floor for floor, rooms in enumerate(FLOORS_OF_RHOT) for room in rooms}
    for path in CODE:
        if path.relative_to(ROOT).parts[0] != "rhot" or path.read_text() == "":
            continue
        assert room_of(path) in floor_of, f"{relative(path)} is on no floor of FLOORS_OF_RHOT"
        for other in uses(path):
            same = room_of(other) == room_of(path)
            assert same or floor_of[room_of(other)] <= floor_of[room_of(path)], (
                f"{relative(path)} imports {relative(other)} from a higher floor"
            )


def test_rhot_imports_no_service_and_services_not_each_other():
    def wrong_imports(path: Path) -> Iterator[str]:
        parts = path.relative_to(ROOT).parts
        for name in imports_of(path):
            # A study stands on the services' pure steps, as the command does.
            if not name.startswith("services.") or parts[0] == "studies":
                continue
            if parts[0] != "services":
                yield f" imports {name}: rhot knows no service"
            elif parts[1] not in {name.split(".")[1], *COMPOSERS} and file_of(name) is not None:
                yield f" imports {name}: services meet on the bus only"

    keep_to(wrong_imports)


def test_only_the_command_knows_studies_and_no_study_the_command():
    def wrong_imports(path: Path) -> Iterator[str]:
        parts = path.relative_to(ROOT).parts
        names = {name for name in imports_of(path) if name.startswith("studies.")}
        if names and parts[0] != "studies" and parts[:2] != ("services", "cli"):
            yield f" imports {sorted(names)}: studies stand above the services"
        command = {name for name in imports_of(path) if name.startswith("services.cli")}
        if command and parts[0] == "studies":
            yield f" imports {sorted(command)}: the command uses studies"

    keep_to(wrong_imports)


def test_the_wheel_stands_by_itself():
    """What is beside the packages (testing/, tests/, benchmarks/) is not installed."""

    def wrong_imports(path: Path) -> Iterator[str]:
        roots = {name.split(".")[0] for name in imports_of(path)}
        if foreign := roots & {"testing", "tests", "benchmarks"}:
            yield f" imports {sorted(foreign)}"

    keep_to(wrong_imports)


def test_keys_are_written_in_the_topics_table_only():
    roots = ("rhot/", "camera/", "hand/", "openvr/", "object/", "control/")
    for path in CODE:
        if path.name in ("topics.py", "topic_kinds.py"):
            continue
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                is_key = node.value.startswith(roots) and " " not in node.value
                assert not is_key, f"{relative(path)}:{node.lineno} writes the key {node.value!r}"


def test_modules_and_public_names_say_what_they_are():
    kinds = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

    def silent(path: Path) -> Iterator[str]:
        tree = tree_of(path)
        if tree.body and not ast.get_docstring(tree):
            yield " has no docstring"
        for node in tree.body:
            if isinstance(node, kinds) and not node.name.startswith("_"):
                # The tables of rig.toml are explained key by key.
                is_table = isinstance(node, ast.ClassDef) and path.name == "rig_tables.py"
                if not is_table and not ast.get_docstring(node):
                    yield f":{node.lineno} {node.name} has no docstring"

    keep_to(silent)


def test_no_assert_on_input():
    def asserts(path: Path) -> Iterator[str]:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Assert):
                yield f":{node.lineno}: raise an error that says what to do"

    keep_to(asserts)


def test_tests_mirror_the_tree():
    """A test file of a service lies in the room of what it tests, or at the service's door."""
    tests = ROOT / "tests"
    for path in [*(tests / "services").rglob("test_*.py"), *(tests / "studies").rglob("test_*.py")]:
        room = path.parent.relative_to(tests)
        assert (ROOT / room).is_dir(), f"{relative(path)}: there is no {room.as_posix()}/"
        tested = ROOT / room / f"{path.stem.removeprefix('test_')}.py"
        assert (
            tested.exists()
            or len(room.parts) <= 2
            or room.parts[1] == "cli"
            or (
                path.stem.removeprefix("test_")
                in ROOMS_TESTED_AS_A_WHOLE.get(room.as_posix(), set())
            )
        ), f"{relative(path)} tests no file of {room.as_posix()}/"


# Tests of a whole room, by name.
ROOMS_TESTED_AS_A_WHOLE = {
    "services/pi_tracker/sources": {"files", "sources"},
    "services/calibrator/rig": {"calibrate_real"},
    "services/object_tracker/sources": {"sources"},
    "services/openvr_bridge": {"golden", "portable", "secured"},
}


ARCHITECTURE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def test_the_plan_of_the_house_names_every_room_and_no_other():
    plan = re.search(r"<!-- rooms -->(.*?)<!-- end -->", ARCHITECTURE, re.DOTALL)
    assert plan, "docs/architecture.md has no list of rooms"
    named = set(re.findall(r"^(\S+/) ", plan[1], re.MULTILINE))
    there = {f"{relative(folder)}/" for folder in {path.parent for path in CODE}} | {"testing/"}
    there -= {"services/", "studies/"}
    assert named == there, f"not named: {there - named}; not there: {named - there}"


def test_where_is_what():
    rows = re.search(r"## Where is \.\.\.\?\n(.*?)\n## ", ARCHITECTURE, re.DOTALL)
    assert rows, "docs/architecture.md has no 'Where is ...?'"
    files = re.findall(r"\| `([^`]+)` \|$", rows[1], re.MULTILINE)
    assert len(files) >= 20
    for name in files:
        assert (ROOT / name).exists(), f"docs/architecture.md sends to {name}, which is not there"
